"""Two tunnels side by side: both rings answer, each to its own pressures, and both are drawn."""

import numpy as np
import pytest
from small_event import COARSE

import coupling
from coupling.datasets import read_pressures, read_response
from coupling.run import respond_by_name

GATE = 1


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A short event of the twin tunnels on a very coarse mesh, with the gate in the right one."""
    scene = coupling.load_scene(
        "twin-tunnels",
        discretisation=COARSE,
        numerics={"relaxation_tolerance": 1e-3},
        stop={"inflow_mass": 20.0, "time": 0.3},
        output={"interval": 0.01, "snapshot_interval": 0.05},
        gate={"tunnel": GATE, "angle": 270.0},
    )
    folder = tmp_path_factory.mktemp("twin") / "run"
    coupling.run(scene, out=folder, figures=True, threads=1)
    return folder


def test_each_ring_answers_its_own_pressures(run):
    scene = coupling.load_scene("twin-tunnels", gate={"tunnel": GATE, "angle": 270.0})
    pressures = read_pressures(run)
    for tunnel, stored in ((GATE, read_response(run)), (0, read_response(run, tunnel=0))):
        alone = respond_by_name(scene.ring, pressures.isel(tunnel=tunnel, drop=True), "beam-spring")
        np.testing.assert_array_equal(stored["bending_moment"], alone["bending_moment"])
    assert not np.array_equal(read_response(run)["bending_moment"], read_response(run, tunnel=0)["bending_moment"])


def test_the_ring_without_the_gate_feels_the_event_less(run):
    def added(response):
        moment = response["bending_moment"]
        return float(np.abs(moment.isel(time=-1) - moment.isel(time=0)).max())

    assert 0 < added(read_response(run, tunnel=0)) < 0.5 * added(read_response(run))


def test_initial_state_is_its_mirror_image(run):
    # before the gate opens both tunnels differ only by the mesh, whose left half is not the image of its right half
    # near the gate: within 10 % of the largest moment on this coarse mesh
    right, left = (read_response(run, tunnel=t)["bending_moment"].isel(time=0).values for t in (None, 0))
    mirrored = np.interp(360.0 - read_response(run)["theta"].values, read_response(run)["theta"].values, left,
                         period=360.0)  # fmt: skip
    assert np.abs(right - mirrored).max() < 0.1 * np.abs(right).max()


def test_both_tunnels_are_drawn_and_read_with_the_run(run):
    names = {path.stem for path in (run / "figures").glob("*.png")}
    assert {"internal_forces", "internal_forces_tunnel_0", "pressures", "pressures_tunnel_0"} <= names
    assert {"structure", "structure_tunnel_0"} <= set(coupling.read_run(run).children)
