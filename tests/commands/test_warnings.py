"""What is possible but unusual is warned of alike in Python and on the command line, by warnings of one class."""

import warnings

import pytest
from typer.testing import CliRunner

import coupling
import structure
from coupling import GushingWarning, cli
from coupling.runs.plan import plan, rough_plan
from verification.small_event import small_scene

UNUSUAL = {"ring": {"ground": {"youngs_modulus": 35.0, "friction_angle": 0.5}}}
EXPECTED = (
    "ring.ground.youngs_modulus is unusual, got 35: between 200000 and 1e+11 Pa is usual; if 35 MPa was meant, write",
    "ring.ground.friction_angle is unusual, got 0.5",
)


def told(act):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        act()
    assert {warning.category for warning in caught} <= {GushingWarning}
    return [str(warning.message) for warning in caught]


@pytest.mark.slow
def test_python_warns_of_what_the_command_line_warns_of(tmp_path):
    scene = small_scene(**UNUSUAL, stop={"inflow_mass": 1.0})
    (tmp_path / "scene.toml").write_text(scene.source)
    command = CliRunner().invoke(cli.app, ["plan", str(tmp_path / "scene.toml"), "--rough"])
    by_command = [line.removeprefix("warning: ") for line in command.stderr.splitlines()]
    assert len(by_command) == 2 and all(a.startswith(b) for a, b in zip(by_command, EXPECTED, strict=True))
    for act in (lambda: rough_plan(scene), lambda: plan(scene), lambda: coupling.run(scene, tmp_path / "run")):
        assert told(act) == by_command


def test_usual_scene_warns_of_nothing():
    for name in coupling.scene_names():
        assert told(lambda name=name: rough_plan(name)) == [], name


def test_ring_made_in_python_warns_itself():
    ring = coupling.load_scene("quick").ring
    values = ring.model_dump() | {"concrete_modulus": 34.5}
    assert told(lambda: structure.Ring(**values)) == [
        "Ring.concrete_modulus is unusual, got 34.5: between 1e+09 and 5e+11 Pa is usual; if 34.5 GPa was meant, "
        "write 3.45e+10"
    ]
    (radians,) = told(lambda: ring.model_copy(update={"n_elements": 2000, "joint_angles": (0.5, 2.409, 4.4)}))
    assert "if radians were meant, write [28.65, 138, 252.1]" in radians
    assert told(lambda: structure.Ring(**ring.model_dump())) == []


@pytest.mark.parametrize(
    ("box", "message"),
    [
        ({"width": 12.0}, "box.width leaves 2.7 m beside tunnel 0 of 6.6 m"),
        ({"depth": 30.0}, "box.depth leaves 3.4 m below tunnel 0 of 6.6 m"),
    ],
)
def test_box_that_is_narrow_around_the_tunnel_is_warned_of(box, message):
    scene = small_scene(box=box, discretisation={"element_size": 1.0})
    (warning,) = told(lambda: rough_plan(scene))
    assert warning.startswith(message)
    (key,) = box
    enough = float(warning.split("write ")[1].split(" m")[0])
    assert told(lambda: rough_plan(small_scene(box={key: enough}, discretisation={"element_size": 1.0}))) == []
