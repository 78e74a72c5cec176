"""Ground and lining without a gate: nothing opens, nothing flows, and every command takes the run as any other."""

import pytest
from typer.testing import CliRunner

import coupling
from coupling import cli
from verification.small_event import COARSE

pytestmark = pytest.mark.slow

GATELESS = {
    "gate": "none", "discretisation": COARSE, "stop": {"time": 0.02, "inflow_mass": 1e9}, "output": {"interval": 0.01},
    "tunnels.0.friction_coefficient": 0.6,  # bears the K0 state: of that there is a theory
}  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("gateless") / "run"
    coupling.run(coupling.load_scene("quick", **GATELESS), out, figures=True)
    return out


def test_pressures_on_a_whole_lining_stay_those_at_rest(folder):
    pressures = coupling.read_run(folder)["lining"].to_dataset()
    crown = pressures.sel(theta=0)
    # weight of 20 m of buoyant sand, and 20 m of water; elements of 0.9 m at the lining
    at_rest = {"soil_pressure": 0.55 * 1650 * 9.81 * 20, "water_pressure": 1000 * 9.81 * 20}
    for name, expected in at_rest.items():
        assert crown[name].values == pytest.approx(expected, rel=0.02), name
    assert not pressures["inflow_mass"].any()


def test_every_command_takes_a_run_without_a_gate(folder):
    for command in (
        ["report", folder], ["info", folder], ["export", folder], ["export", folder, "--format", "gif",
        "--out", folder.parent / "gif"], ["rerun", folder, "--out", folder.parent / "again"],
        ["respond", folder, "--backend", "continuum"], ["compare", folder],
    ):  # fmt: skip
        result = CliRunner().invoke(cli.app, [str(word) for word in command])
        assert result.exit_code == 0, f"{command[0]}: {result.output} {result.exception!r}"


def test_response_that_fails_leaves_the_pictures_of_the_ground(tmp_path):
    """Six hinges in ground that bears nothing are a mechanism: the ring has no answer, the ground has."""
    weak = {"limit_pressure_normal": 1.0, "limit_pressure_tangential": 1.0}
    scene = coupling.load_scene("quick", **GATELESS, ring={"joint_rotational_stiffness": 0.0, "ground": weak})
    (tmp_path / "weak.toml").write_text(scene.source)
    result = CliRunner().invoke(cli.app, ["run", str(tmp_path / "weak.toml"), "--out", str(tmp_path / "run")])
    assert result.exit_code == 3
    assert "equilibrium" in result.stderr and "the ground is computed and drawn in" in result.stderr
    drawn = {path.stem for path in (tmp_path / "run" / "figures").glob("*.png")}
    assert drawn == {"mesh", "fields", "pressures", "inflow", "settlement"}
    run = coupling.read_run(tmp_path / "run")
    assert run.attrs["status"] == "finished" and run["lining"].sizes["time"] == 3
