"""Whatever stands in a scene or a file: the right answer, or a refusal that says where, why and what to do."""

import random

import h5py
import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

import coupling
from coupling import SceneError, datasets
from coupling.files import checkpoint
from coupling.runs.plan import plan, rough_plan
from coupling.scenes.mistake_lines import line_of
from coupling.scenes.plausibility import warnings_of
from verification.robustness import wild_scenes
from verification.robustness.damaged_files import READERS, damaged, judged
from verification.sensitivity.variants import value_at
from verification.small_event import small_scene
from verification.synthetic_run import write_run

FEW = settings(max_examples=150, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)
GOOD = small_scene().source


@pytest.mark.slow
@FEW
@given(seed=st.integers(0, 2**32))
def test_any_scene_file_is_planned_or_refused_with_its_line(tmp_path_factory, seed):
    file = tmp_path_factory.getbasetemp() / "mine.toml"
    text = wild_scenes.wild_text(random.Random(seed), GOOD)
    file.write_bytes(text.encode("utf-8", "surrogatepass"))
    wild_scenes.judged(lambda: coupling.load_scene(file), "mine.toml", True)


@pytest.mark.slow
@FEW
@given(seed=st.integers(0, 2**32))
def test_any_dotted_change_is_planned_with_its_value_or_refused(seed):
    changes, (name, expected) = wild_scenes.wild_changes(random.Random(seed))
    verdict, _ = wild_scenes.judged(lambda: coupling.load_scene("quick", **changes), "quick", False)
    if verdict != "refused":
        found = value_at(coupling.load_scene("quick", **changes), name)
        assert found == pytest.approx(expected, rel=1e-12)


ANYTHING = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20) | st.binary(max_size=3),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8) | st.integers(), inner, max_size=3),
    max_leaves=6,
)
TABLES = ("name", "gravity", "box", "water", "soils", "tunnels", "gate", "numerics", "stop", "output", "ring")


@pytest.mark.slow
@FEW
@given(table=st.sampled_from(TABLES), value=ANYTHING)
@example("soils", [None])
@example("tunnels", [{"x": 10**400}])
@example("ring", {"ground": 3})
@example("gravity", True)
def test_any_python_dictionary_is_planned_or_refused(table, value):
    wild_scenes.judged(lambda: coupling.load_scene("quick", **{table: value}), "quick", False)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('base = "quick"\n\n[gate]\nangle = 90.0\nwidth = 5.0\n', "line 5: gate: width"),
        ('base = "quick"\n\n[[soils]]\nname = "a"\nporosty = 1\n', "line 5: soils[0].porosty: unknown key"),
        ('base = "quick"\n[discretisation]\nelement_size = "1 kg"\n', "line 3: discretisation.element_size"),
        ('base = "quick"\n[stop]\ntime = [\n 1.0,\n]\n', "line 3: stop.time"),
        ('base = "quick"\ngate = { angle = 10.0, widht = 0.2 }\n', "line 2: gate.widht"),
        ('base = "quick"\n# note\n[gate]\nangle = \n', "at line 4"),
        ('base = "quick"\n[water]\ndensity = true\n', "line 3: water.density: must not be a truth value"),
    ],
)
def test_refusal_tells_the_line(tmp_path, text, expected):
    (tmp_path / "mine.toml").write_text(text)
    with pytest.raises(SceneError) as caught:
        coupling.load_scene(tmp_path / "mine.toml")
    assert expected in str(caught.value)


def test_mistake_in_a_base_names_the_base(tmp_path):
    (tmp_path / "below.toml").write_text('base = "quick"\n[gate]\nangle = 400.0\n')
    (tmp_path / "mine.toml").write_text('base = "below.toml"\n[stop]\ntime = 1.0\n')
    with pytest.raises(SceneError, match=r"below\.toml line 3: gate\.angle"):
        coupling.load_scene(tmp_path / "mine.toml")
    with pytest.raises(SceneError) as caught:
        coupling.load_scene(tmp_path / "mine.toml", gate={"angle": 500.0})
    assert "line" not in str(caught.value), "the mistake is none of the files'"


def test_line_is_that_on_which_the_statement_begins():
    text = "a = 1\n\nlong = [\n  1,\n  2,\n]\n[t]\nb = 2\n[[s]]\nc = 3\n[[s]]\nc = 4"
    places = {("a",): 1, ("long", 1): 3, ("t",): 7, ("t", "b"): 8, ("s", 0, "c"): 10, ("s", 1): 11, ("s", 1, "c"): 12}
    assert {path: line_of(text, path) for path in places} == places
    assert line_of(text, ("absent",)) is None


def soil(**values):
    return {"soils": [{**coupling.load_scene("quick").soils[0].model_dump(), **values}]}


@pytest.mark.parametrize(
    ("changes", "parts"),
    [
        (soil(youngs_modulus=4e4), ["soils[0].youngs_modulus", "40000 kPa", "write 4e+07"]),
        (soil(cohesion=5.0), ["soils[0].cohesion", "5 kPa", "write 5000"]),
        (soil(friction_angle=0.436, k0=1.0), ["soils[0].friction_angle", "0.436 rad", "write 24.98"]),
        (soil(hydraulic_conductivity=8.64), ["hydraulic_conductivity", "8.64 m/day", "write 0.0001"]),
        ({"water": {"bulk_modulus": 2.2e6}}, ["water.bulk_modulus", "kPa", "write 2.2e+09"]),
        ({"gate": {"angle": 1.5708}}, ["gate.angle", "radians", "write 90"]),
        ({"ring": {"concrete_modulus": 34.5e6}}, ["ring.concrete_modulus", "kPa", "write 3.45e+10"]),
        ({"ring": {"concrete_unit_weight": 25.0}}, ["concrete_unit_weight", "25 kN/m3", "write 25000"]),
        ({"output": {"interval": 9.0}}, ["output.interval", "9", "stop.time"]),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else None,
)
def test_wrong_order_of_magnitude_is_warned_of_once_with_what_to_write(changes, parts):
    (warning,) = warnings_of(coupling.load_scene("quick", **changes))
    assert not [part for part in parts if part not in warning], warning


@pytest.mark.parametrize(
    ("changes", "parts"),
    [
        (soil(porosity=45), ["fraction, not percent", "write 0.45"]),
        (soil(grain_density=2.65), ["2.65 t/m3", "write 2650"]),
        (
            soil(friction_angle=0.436, k0=0.577),
            ["k0 must lie in", "soils[0].friction_angle", "0.436 rad", "write 24.98"],
        ),
        ({"gate": {"width": 200.0}}, ["200 mm", "write 0.2"]),
    ],
)
def test_impossible_number_in_another_unit_is_refused_with_what_to_write(changes, parts):
    with pytest.raises(SceneError) as caught:
        coupling.load_scene("quick", **changes)
    assert not [part for part in parts if part not in str(caught.value)], str(caught.value)


@pytest.mark.parametrize("name", coupling.scene_names())
def test_built_in_scenes_draw_no_warning(name):
    assert warnings_of(coupling.load_scene(name)) == []


@pytest.mark.parametrize("name", ["../../x", "..", ".", "/tmp/x", "a/b", "-x", "a\n", "a\0"])
def test_name_can_not_lead_out_of_the_output_folder(name):
    with pytest.raises(SceneError, match="name"):
        coupling.load_scene("quick", name=name)


@pytest.mark.parametrize("base", ["/dev/zero", "http://127.0.0.1:9/scene.toml", "/dev/stdin", "."])
def test_base_is_a_file_or_a_name_and_nothing_else(tmp_path, base):
    (tmp_path / "mine.toml").write_text(f'base = "{base}"\n')
    with pytest.raises(SceneError, match="must be a"):
        coupling.load_scene(tmp_path / "mine.toml")


@pytest.mark.parametrize(
    "text", ["9**9**9**9 m", "m**99999999", "1 m; import os", "__import__('os')", "1e400 m", "1 m" * 50]
)
def test_quantity_is_never_evaluated(text):
    with pytest.raises(SceneError, match=r"gate\.width"):
        coupling.load_scene("quick", gate={"width": text})


def test_misspelt_choice_gets_a_suggestion():
    with pytest.raises(SceneError, match="did you mean 'mohr-coulomb'"):
        coupling.load_scene("quick", **soil(model="mohr_coulomb"))


@pytest.mark.slow
def test_rough_plan_is_within_a_factor_of_three_of_the_mesh():
    scene = coupling.load_scene("quick")
    rough, exact = rough_plan(scene), plan(scene)
    for name in ("elements", "points", "dt"):
        assert 1 / 3 < rough[name] / exact[name] < 3, name


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Whole files, and what they hold, by kind."""
    place = tmp_path_factory.mktemp("whole")
    run = write_run(place / "run.nc", times=(0.0, 0.5), models=())
    state = {"step_count": 7, "points": np.random.default_rng(1).normal(size=(20, 200))}
    (place / "scene.toml").write_text(GOOD)
    files = {"run.nc": run, "scene.toml": place / "scene.toml"}
    files["checkpoint.h5"] = checkpoint.write_checkpoint(place, state, {"records": 2})
    return {kind: (file.read_bytes(), READERS[kind][0](file)) for kind, file in files.items()}


@pytest.mark.parametrize(("kind", "count"), [("run.nc", 8), ("checkpoint.h5", 12), ("scene.toml", 12)])
def test_damaged_file_is_refused_or_gives_what_the_whole_one_gives(whole, tmp_path, kind, count):
    content, expected = whole[kind]
    verdicts = set()
    for number in range(count):
        (tmp_path / kind).write_bytes(damaged(random.Random(number), content))
        verdicts.add(judged(tmp_path / kind, kind, expected))
    assert "refused" in verdicts


def test_file_that_shows_the_content_of_others_is_refused(whole, tmp_path):
    for name, link in (("external", h5py.ExternalLink("/etc/passwd", "/x")), ("soft", h5py.SoftLink("/lining"))):
        path = tmp_path / f"{name}.nc"
        path.write_bytes(whole["run.nc"][0])
        with h5py.File(path, "a") as file:
            file["history"][name] = link
        with pytest.raises(datasets.RunFileError, match="its own content"):
            datasets.read_history(path)
    with h5py.File(path, "a") as file:
        del file["history/soft"]
        file.create_dataset("x", (3,), "f8", external=[("/etc/hostname", 0, 24)])
    with pytest.raises(datasets.RunFileError, match="other files"):
        datasets.read_history(path)
