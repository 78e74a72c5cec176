"""Wrong types, and what got past the checks, are answered with rule, name, value and remedy, never with a trace."""

import pytest
from typer.testing import CliRunner

import coupling
import structure
from coupling import cli
from coupling.refused import Refused
from coupling.runs.plan import rough_plan
from coupling.scenes.scene import as_scene
from mpm.scene import Scene as MpmScene
from verification.small_event import small_scene


@pytest.mark.parametrize(
    ("scene", "parts"),
    [
        (3, ["got 3", "coupling.load_scene('quick')"]),
        ("quik", ["'quik'", "did you mean 'quick'"]),
        ([coupling.load_scene("quick")], ["got [", "coupling.Scene"]),
    ],
    ids=["number", "misspelt", "list"],
)
def test_run_says_what_a_scene_is(scene, parts, tmp_path):
    for use in (lambda: coupling.run(scene, tmp_path / "run"), lambda: rough_plan(scene)):
        with pytest.raises(coupling.SceneError) as caught:
            use()
        assert not [part for part in parts if part not in str(caught.value)], caught.value
    assert not (tmp_path / "run").exists()


def test_run_takes_the_name_of_a_scene():
    # planned alike but for the memory of the moment, and refused only for what comes after the scene
    by_name, by_scene = (
        {
            key: value for key, value in rough_plan(scene).items() if key != "free_memory_bytes"
        }  # it changes by the moment
        for scene in ("quick", coupling.load_scene("quick"))
    )
    assert by_name == by_scene
    with pytest.raises(Refused, match="is a file"):
        coupling.run("quick", __file__)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"threads": -3}, "threads: must be a whole number from 1, got -3"),
        ({"threads": 1.5}, "threads: .* got 1.5"),
        ({"threads": True}, "threads: .* got True"),
        ({"out": 3}, "out: must be the path of a folder, got 3"),
        ({"progress": "bar"}, "progress: must be a function, got 'bar'"),
        ({"warn": "no"}, "warn: must be a function, got 'no'"),
        ({"checkpoint_interval": -1}, "checkpoint_interval: must not be negative, got -1"),
        ({"checkpoint_interval": "60 s"}, "checkpoint_interval: must be a number of seconds, got '60 s'"),
    ],
)
def test_run_refuses_arguments_of_a_wrong_type_before_it_starts(arguments, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(Refused, match=message):
        coupling.run("quick", **arguments)
    assert not list(tmp_path.iterdir())


def test_solver_refuses_what_is_no_number_of_threads():
    import mpm

    with pytest.raises(ValueError, match="threads: must be a whole number from 1, got 0"):
        mpm.Solver(None, None, threads=0)


def test_ground_alone_says_which_scene_it_takes():
    import mpm

    for use in (mpm.build_mesh, lambda scene: mpm.Solver(scene, None), lambda scene: next(mpm.simulate(scene))):
        with pytest.raises(ValueError, match=r"must be an mpm.Scene, got a str; coupling.load_scene\('quick'\) is one"):
            use("quick")


def test_ground_alone_is_a_scene_without_a_ring():
    whole = coupling.load_scene("quick")
    ground = MpmScene.model_validate(whole.model_dump(exclude={"ring", "limits"}))
    assert as_scene(ground) == coupling.load_scene("quick", ring="none") and as_scene(whole) == whole


@pytest.mark.parametrize("model", [structure.BeamSpringLining, structure.ContinuumLining])
def test_lining_models_say_what_they_take(model):
    scene = coupling.load_scene("quick")
    for given, hint in ((scene, "got a Scene; give its .ring"), (None, "got a NoneType; make one")):
        with pytest.raises(structure.InputError, match=rf"ring: must be a structure\.Ring, {hint}"):
            model(given)
    with pytest.raises(ValueError, match=r"pressures: must be an xarray\.Dataset of soil_pressure.*, got a list"):
        model(scene.ring).respond([1e5, 1e5])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: structure.Ring(), "Ring has 5 mistakes:\n  outer_diameter: missing; it decides the answer"),
        (lambda: structure.Ring(6.6, 5.9), "takes 1 positional argument"),
        (lambda: structure.Ground(youngs_modulus=-1.0), "youngs_modulus: must be greater than 0, got -1.0; give"),
        (lambda: structure.Limits(convergence_per_mile=3.0), "did you mean 'convergence_per_mille'"),
        (lambda: coupling.Scene(), "Scene has 6 mistakes:\n  name: missing"),
    ],
    ids=["empty ring", "positional", "ground", "limits", "scene"],
)
def test_input_in_python_gets_own_messages(make, message):
    with pytest.raises((structure.InputError, TypeError)) as caught:
        make()
    assert message in str(caught.value) and "pydantic" not in str(caught.value)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("gasket_opning = 0.004\n", "gasket_opning: unknown key, got 0.004; did you mean 'gasket_opening'?"),
        ("[segment]\nconcret = 'C50/60'\n", "did you mean 'concrete'?"),
        ("gasket_opening = \n", "must be valid TOML"),
        ("gasket_opening = 'wide'\ngasket_offset = 0.1\n", "gasket_opening: must be a valid number"),
    ],
)
def test_mistake_in_a_file_of_limits_is_told_alike_in_python_and_on_the_command_line(text, message, tmp_path):
    file = tmp_path / "limits.toml"
    file.write_text(text)
    with pytest.raises(structure.InputError) as caught:
        structure.Limits.from_toml(file)
    assert message in str(caught.value) and "pydantic" not in str(caught.value) and "limits.toml" in str(caught.value)
    from verification.synthetic_run import write_run

    write_run(tmp_path / "run")
    result = CliRunner().invoke(cli.app, ["respond", str(tmp_path / "run"), "--limits", str(file)])
    assert result.exit_code == 2 and str(caught.value) in result.stderr


def test_dictionary_takes_a_base_as_a_file_does():
    scene = coupling.make_scene({"base": "quick", "gate": {"angle": 10.0}})
    assert scene == coupling.load_scene("quick", gate={"angle": 10.0})
    with pytest.raises(coupling.SceneError, match="did you mean 'quick'"):
        coupling.make_scene({"base": "quik"})
    with pytest.raises(coupling.SceneError, match="base must be the name or file"):
        coupling.make_scene({"base": 3})


def test_run_validates_a_scene_that_was_copied_past_the_checks(tmp_path):
    scene = small_scene()
    stop = scene.stop.model_copy(update={"inflow_mass": -5.0})
    copied = scene.model_copy(update={"stop": stop})
    with pytest.raises(coupling.SceneError, match=r"stop\.inflow_mass: must be greater than 0, got -5"):
        coupling.run(copied, tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_changed_scene_is_validated_and_its_ring_follows_the_ground():
    scene = coupling.load_scene("quick")
    with pytest.raises(coupling.SceneError, match=r"stop\.inflow_mass: .* got -5"):
        scene.changed(stop={"inflow_mass": -5.0})
    soft = {"soils": [{**scene.soils[0].model_dump(), "youngs_modulus": 1e7}]}
    assert scene.changed(**soft) == coupling.load_scene("quick", **soft)
    assert scene.changed(**soft).ring.ground.youngs_modulus == 1e7
    assert scene.changed() == scene


def test_copied_ring_is_validated():
    ring = coupling.load_scene("quick").ring
    assert ring.model_copy(update={"n_elements": 120}).n_elements == 120
    with pytest.raises(structure.InputError, match="n_elements: must be greater than or equal to 24, got 3"):
        ring.model_copy(update={"n_elements": 3})
