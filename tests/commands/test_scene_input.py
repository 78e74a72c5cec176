"""Bad input gets one clear message (rule, name, value, remedy); good input is kept exactly."""

import math
import re

import pytest
from pydantic import ValidationError

import coupling
import structure
from coupling import SceneError
from coupling.scenes.layers import parse_changes
from coupling.scenes.rings import UNITS
from mpm.scene import Scene as MpmScene
from structure.limits import CapacityRule, Limits
from structure.ring import Ground, Ring
from structure.segment import SegmentSection

# Every published case with what sets it apart: gate angle, soil strength and stiffness, cover.
CASES = {
    "case-1": (0, 0, 25, 40e6, 20), "case-2": (45, 0, 25, 40e6, 20), "case-3": (90, 0, 25, 40e6, 20),
    "case-4": (135, 0, 25, 40e6, 20), "case-5": (180, 0, 25, 40e6, 20), "case-6": (90, 5e3, 25, 40e6, 20),
    "case-7": (90, 0, 35, 40e6, 20), "case-8": (90, 0, 35, 30e6, 20), "case-9": (90, 0, 25, 40e6, 5),
    "case-10": (90, 0, 25, 40e6, 10),
}  # fmt: skip


def edited(name, table, **values):
    """`table` of a built-in scene with other values, first entry where it is a list."""
    data = getattr(coupling.load_scene(name), table)
    if isinstance(data, tuple):
        return {table: [{**data[0].model_dump(), **values}, *(entry.model_dump() for entry in data[1:])]}
    return {table: values}


def test_built_in_scenes_are_quick_the_ten_cases_and_the_twin_tunnels():
    assert coupling.scene_names() == ["quick", *CASES, "twin-tunnels"]


@pytest.mark.parametrize("name", CASES)
def test_cases_are_the_published_ones(name):
    scene = coupling.load_scene(name)
    angle, cohesion, friction, modulus, cover = CASES[name]
    soil, tunnel = scene.soils[0], scene.tunnels[0]
    assert scene.name == name
    assert (scene.gate.angle, scene.gate.width) == (angle, 0.2)
    assert (soil.cohesion, soil.friction_angle, soil.youngs_modulus) == (cohesion, friction, modulus)
    assert (soil.porosity, soil.grain_density, soil.poissons_ratio) == (0.45, 2650, 0.3)
    assert (tunnel.cover, tunnel.outer_diameter, tunnel.inner_diameter, tunnel.x) == (cover, 6.6, 5.9, 0)
    assert (scene.box.width, scene.box.depth) == (100, 50)
    assert (scene.water.density, scene.water.bulk_modulus) == (1000, 80e6)
    assert scene.stop.inflow_mass == 2000


def test_twin_tunnels_are_the_published_case_study():
    scene = coupling.load_scene("twin-tunnels")
    left, right = scene.tunnels
    assert (right.x - left.x, left.cover, right.cover, scene.box.width) == (pytest.approx(12.8), 23.1, 23.1, 80)


@pytest.mark.parametrize("name", ["quick", *CASES, "twin-tunnels"])
def test_built_in_scenes_have_the_published_ring_and_say_what_they_assume(name):
    ring = coupling.load_scene(name).ring
    assert (ring.joint_rotational_stiffness, ring.joint_normal_stiffness, ring.joint_shear_stiffness) == (5e8, 6e8, 8e7)
    assert ring.joint_angles == (8, 73, 138, 222, 287, 352) and ring.n_elements == 360


def test_ground_of_the_ring_is_the_soil_at_the_axis():
    scene = coupling.load_scene("case-3")
    buoyant = 0.55 * (2650 - 1000) * 9.81
    assert scene.ring.ground.vertical_stress == pytest.approx(buoyant * 23.3)
    # gravity loads an elastic body of nu = 0.3
    assert scene.ring.ground.horizontal_stress == pytest.approx(0.3 / 0.7 * buoyant * 23.3)


def test_ground_given_in_part_keeps_the_rest_of_the_soil_at_the_axis():
    ground = coupling.load_scene("quick").ring.ground
    softer = coupling.load_scene("quick", ring={"ground": {"youngs_modulus": 1e7}}).ring.ground
    assert softer == ground.model_copy(update={"youngs_modulus": 1e7})


def test_source_is_complete_and_loads_as_the_same_scene(tmp_path):
    for name in ("quick", "twin-tunnels"):
        scene = coupling.load_scene(name)
        path = tmp_path / f"{name}.toml"
        path.write_text(scene.source, encoding="utf-8")
        assert coupling.load_scene(path) == scene


def test_base_may_be_a_file_beside_the_scene(tmp_path, monkeypatch):
    (tmp_path / "mine.toml").write_text('base = "quick"\n[gate]\nangle = 10.0\n')
    (tmp_path / "other.toml").write_text('base = "mine.toml"\n[gate]\nwidth = 0.3\n')
    monkeypatch.chdir("/")
    gate = coupling.load_scene(tmp_path / "other.toml").gate
    assert (gate.angle, gate.width) == (10, 0.3)


def test_scene_can_not_be_changed():
    scene = coupling.load_scene("quick")
    with pytest.raises(ValidationError):
        scene.gate.angle = 10
    with pytest.raises(ValidationError):
        scene.ring = None


def test_strings_with_units_are_converted():
    changes = edited(
        "quick", "soils", youngs_modulus="40 MPa", hydraulic_conductivity="0.1 mm/s", friction_angle="0.5 rad"
    )
    soil = coupling.load_scene("quick", **changes).soils[0]
    assert soil.youngs_modulus == pytest.approx(40e6) and soil.hydraulic_conductivity == pytest.approx(1e-4)
    assert soil.friction_angle == pytest.approx(math.degrees(0.5))


@pytest.mark.parametrize(
    ("table", "values", "parts"),
    [
        ("soils", {"porosity": 45}, ["sand", "porosity", "(0", "got 45", "fraction, not percent"]),
        ("soils", {"hydraulic_conductivity": -1e-4}, ["hydraulic_conductivity", "-0.0001", "m/s"]),
        ("soils", {"hydraulic_conductivity": 0}, ["hydraulic_conductivity", "got 0"]),
        ("soils", {"friction_angle": "20 kg"}, ["soils[0].friction_angle", "20 kg", "degree"]),
        ("soils", {"youngs_modulus": float("nan")}, ["soils[0].youngs_modulus", "nan", "finite"]),
        ("soils", {"dilatancy_angle": 30}, ["dilatancy_angle", "30", "friction_angle", "25"]),
        ("soils", {"loose_porosity": 0.4}, ["loose_porosity", "0.4", "porosity"]),
        ("soils", {"top_depth": 1.0}, ["top_depth", "start at 0", "1"]),
        ("soils", {"model": "cam-clay"}, ["soils[0].model", "cam-clay", "mohr-coulomb"]),
        ("soils", {"porosty": 0.4}, ["unknown key", "porosty", "did you mean 'porosity'"]),
        ("gate", {"width": 3.0}, ["gate", "width", "3", "segment"]),
        ("gate", {"width": 0.9}, ["gate", "width", "0.9", "segment", "0.82"]),
        ("gate", {"tunnel": 1}, ["gate", "tunnel", "1", "counted from 0"]),
        ("gate", {"angle": -10}, ["gate.angle", "-10", "0"]),
        ("tunnels", {"x": 48.0}, ["tunnel 0", "box", "51.3", "50", "enlarge"]),
        ("tunnels", {"cover": 45.0}, ["tunnel 0", "box", "51.6", "50", "enlarge"]),
        ("tunnels", {"inner_diameter": 7.0}, ["inner_diameter", "7", "6.6"]),
        ("tunnels", {"lining": "loose"}, ["tunnels[0].lining", "loose", "fixed", "elastic"]),
        ("tunnels", {"lining_poissons_ratio": 0.5}, ["lining_poissons_ratio", "got 0.5"]),
        ("water", {"table_depth": 60.0}, ["table_depth", "60", "50"]),
        ("discretisation", {"elements_across_gate": 1}, ["elements_across_gate", "got 1", "2"]),
        ("discretisation", {"element_size": 0.002}, ["discretisation", "memory", "element_size"]),
        ("discretisation", {"points_per_element": 5}, ["points_per_element", "got 5"]),
        ("numerics", {"courant": 2}, ["numerics.courant", "got 2", "1"]),
        ("output", {"interval": 0}, ["output.interval", "got 0"]),
    ],
    ids=lambda value: "-".join(value) if isinstance(value, dict) else None,
)
def test_bad_value_gets_one_message_with_name_value_and_remedy(table, values, parts):
    with pytest.raises(SceneError) as caught:
        coupling.load_scene("quick", **edited("quick", table, **values))
    message = str(caught.value)
    assert "has 1 mistake:" in message and len(message.splitlines()) == 2
    assert not [part for part in parts if part not in message], message


def test_moving_lining_needs_its_material():
    changes = edited("quick", "tunnels", lining="elastic")
    del changes["tunnels"][0]["lining_modulus"]
    with pytest.raises(SceneError, match=r"tunnel 0: lining_modulus must be given .* 'elastic'"):
        coupling.load_scene("quick", **changes)
    changes["tunnels"][0] |= {"lining": "fixed"}
    coupling.load_scene("quick", **changes)


def test_more_harmonics_than_the_lining_has_pairs_of_elements_are_refused():
    changes = edited("quick", "tunnels", lining="elastic", lining_harmonics=30)
    coupling.load_scene("quick", **changes, **{"discretisation.element_size_lining": 0.34})
    with pytest.raises(SceneError, match=r"tunnel 0: lining_harmonics must not exceed 28, .* got 30"):
        coupling.load_scene("quick", **changes, **{"discretisation.element_size_lining": 0.36})


def test_overlapping_tunnels_are_refused():
    tunnel = coupling.load_scene("quick").tunnels[0].model_dump()
    with pytest.raises(SceneError, match="tunnels: 0 and 1 must lie apart"):
        coupling.load_scene("quick", tunnels=[tunnel, {**tunnel, "x": 6.0}])


@pytest.mark.parametrize(
    ("changes", "hint"),
    [
        ({"disretisation": {}}, "discretisation"),
        ({"rng": {}}, "ring"),
        ({"ring": {"join_angles": [8.0]}}, "joint_angles"),
        ({"ring": {"ground": {"cohesoin": 0.0}}}, "cohesion"),
        ({"stop": {"inflow_mas": 3.0}}, "inflow_mass"),
    ],
)
def test_unknown_key_gets_a_suggestion(changes, hint):
    with pytest.raises(SceneError, match=f"unknown key.*did you mean '{hint}'"):
        coupling.load_scene("quick", **changes)


def test_all_mistakes_are_named_at_once():
    changes = edited("quick", "soils", youngs_modulus=-1) | {
        "gate": {"angle": 400.0},
        "ring": {"concrete_modulus": -3.0},
    }
    with pytest.raises(SceneError, match="has 3 mistakes") as caught:
        coupling.load_scene("quick", **changes)
    assert all(name in str(caught.value) for name in ("soils[0].youngs_modulus", "gate.angle", "ring.concrete_modulus"))


def test_missing_physical_number_is_not_filled_in():
    soil = coupling.load_scene("quick").soils[0].model_dump()
    for key, message in (
        ("hydraulic_conductivity", "soil 'sand': hydraulic_conductivity must be given where there is water"),
        ("porosity", r"soils\[0\]: porosity missing"),
    ):
        with pytest.raises(SceneError, match=message):
            coupling.load_scene("quick", soils=[{k: v for k, v in soil.items() if k != key}])


def test_scene_made_in_python_meets_the_same_checks():
    data = coupling.load_scene("quick").model_dump(exclude={"ring", "limits"})
    data["soils"][0]["porosity"] = 45
    with pytest.raises(ValidationError, match=r"porosity .*got 45; give a fraction, not percent"):
        MpmScene(**data)


def test_misspelt_scene_name_gets_a_suggestion():
    with pytest.raises(SceneError, match=r"did you mean 'case-3'.*quick"):
        coupling.load_scene("cas-3")


@pytest.mark.parametrize(
    ("content", "rule"),
    [
        (b'base = "quick"\n[gate]\nangle = ', "valid TOML"),
        (b'base = "quick"\n[gate', "valid TOML"),
        (b"\xff\xfe\x00\x01", "UTF-8"),
        (b"", "empty"),
        (b"[box]\nwidth = 100.0\n", "missing"),
        (b"a" * 1_000_001, "1 MB"),
        (b'base = "mine.toml"', "lead back to itself"),
        (b'base = "case-33"', "did you mean 'case-3'"),
        (b"base = 3", "base"),
        (b'base = "quick"\ngate = 3', "must be a table"),
        (b'base = "quick"\nring = 3', "must be a table"),
    ],
)
def test_bad_scene_file_is_refused_with_its_name(tmp_path, content, rule):
    path = tmp_path / "mine.toml"
    path.write_bytes(content)
    with pytest.raises(SceneError, match=rule) as caught:
        coupling.load_scene(path)
    assert "mine.toml" in str(caught.value) or "case-33" in str(caught.value)


def test_folder_is_no_scene_file(tmp_path):
    with pytest.raises(SceneError, match="readable file"):
        coupling.load_scene(tmp_path)


def test_one_value_of_a_list_is_changed_by_its_dotted_name(tmp_path):
    base = coupling.load_scene("quick")
    scene = coupling.load_scene("quick", **{"soils.0.friction_angle": 33, "gate.angle": "0.5 rad"})
    assert scene.soils[0] == base.soils[0].model_copy(update={"friction_angle": 33.0})
    assert scene.gate.angle == pytest.approx(math.degrees(0.5))
    # the same in a file, whose lines are named
    path = tmp_path / "mine.toml"
    path.write_text('base = "quick"\n[soils.0]\nfriction_angle = 33\n')
    assert coupling.load_scene(path).soils == scene.soils
    path.write_text('base = "quick"\n[soils.0]\nporosity = 45\n')
    with pytest.raises(SceneError, match=r"line 3: soils\[0\]\.porosity"):
        coupling.load_scene(path)
    for name in ("soils.1.k0", "soils.first.k0"):
        with pytest.raises(SceneError, match="must be a number below 1, the length of that list"):
            coupling.load_scene("quick", **{name: 0.5})


def test_ring_takes_strings_with_units():
    plain = coupling.load_scene("quick").ring
    units = {
        "concrete_modulus": f"{plain.concrete_modulus / 1e9} GPa",
        "concrete_unit_weight": f"{plain.concrete_unit_weight / 1e3} kN/m3",
        "joint_rotational_stiffness": f"{plain.joint_rotational_stiffness / 1e6} MN*m/rad/m",
        "joint_normal_stiffness": f"{plain.joint_normal_stiffness / 1e6} MN/m",
        "joint_angles": [f"{angle} deg" for angle in plain.joint_angles],
        "ground": {"cohesion": "0 kPa", "friction_angle": f"{math.radians(25)} rad"},
    }
    ring = coupling.load_scene("quick", ring=units).ring
    for name in ("concrete_modulus", "concrete_unit_weight", "joint_rotational_stiffness", "joint_normal_stiffness"):
        assert getattr(ring, name) == pytest.approx(getattr(plain, name))
    assert ring.joint_angles == pytest.approx(plain.joint_angles)
    assert ring.ground.friction_angle == pytest.approx(25)
    with pytest.raises(SceneError, match=r"ring\.concrete_modulus: must be a quantity in Pa, got '34 m'"):
        coupling.load_scene("quick", ring={"concrete_modulus": "34 m"})


def test_every_number_of_a_ring_and_its_limits_has_a_unit_or_is_one():
    dimensionless = {
        "concrete_poissons_ratio", "joint_friction_coefficient", "n_elements", "poissons_ratio",
        "convergence_per_mille", "own", "axial_force_factor", "moment_factor",
        "concrete_long_term_factor", "concrete_partial_factor", "steel_partial_factor",
    }  # fmt: skip
    tables = {"ring": Ring, "ring.ground": Ground, "limits": Limits, "limits.segment": SegmentSection}
    for table, model in (tables | {"limits.capacity": CapacityRule}).items():
        units = {name.rpartition(".")[2] for name in UNITS if name.rpartition(".")[0] == table}
        numbers = {
            name
            for name, field in model.model_fields.items()
            if any(kind in str(field.annotation) for kind in ("float", "int")) and "bool" not in str(field.annotation)
        } - {"ground"}
        assert numbers - dimensionless == units


def test_byte_order_mark_of_an_editor_is_no_mistake(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('base = "quick"\n[gate]\nangle = 10.0\n', encoding="utf-8-sig")
    assert coupling.load_scene(path).gate.angle == 10
    path.write_text("joint_dislocation = 6e-3\n", encoding="utf-8-sig")
    assert structure.Limits.from_toml(path).joint_dislocation == 6e-3


def test_refusal_names_the_true_reason(tmp_path):
    with pytest.raises(
        SceneError, match=r"must have a decimal point, got '0,2 m' with a comma; write it like '0\.2 m'"
    ):
        coupling.load_scene("quick", gate={"width": "0,2 m"})
    path = tmp_path / "mine.toml"
    path.write_text('base = "quick"\n[gate]\nwidth = 0,2\nangle = 10.0\n')
    with pytest.raises(SceneError, match=r"valid TOML.*line 3") as caught:
        coupling.load_scene(path)
    assert "truncated" not in str(caught.value)
    path.write_text('base = "quick"\n[gate')
    with pytest.raises(SceneError, match="truncated"):
        coupling.load_scene(path)


def test_changes_of_the_command_line_are_read_as_a_scene_says_them():
    given = ["gate.angle=45", "gate.width = 20 cm", "water=none", "ring.joint_angles=[8, 73]"]
    assert parse_changes(given) == {
        "gate.angle": 45, "gate.width": "20 cm", "water": "none", "ring.joint_angles": [8, 73],
    }  # fmt: skip
    for text in ("gate.angle", "=45", "gate.angle="):
        with pytest.raises(SceneError, match="must be NAME=VALUE"):
            parse_changes([text])


def with_soil(**values):
    return coupling.load_scene("quick", **edited("quick", "soils", **values))


@pytest.mark.parametrize(("k0", "borne"), [(0.405, False), (0.406, True), (1.0, True), (2.463, True), (2.465, False)])
def test_k0_is_one_that_friction_bears(k0, borne):
    # phi = 25: (1 - sin)/(1 + sin) = 0.4059, (1 + sin)/(1 - sin) = 2.4639
    if borne:
        assert with_soil(k0=k0).soils[0].k0 == k0
        return
    with pytest.raises(coupling.SceneError, match=r"soil 'sand': k0 must lie in 0\.406 \.\. 2\.464.* got .*; give"):
        with_soil(k0=k0)


def test_k0_that_cohesion_bears_near_the_surface_only_is_refused_with_the_depth():
    # undrained clay: s_v - s_h = 2 c; (1 - 0.5) s_v reaches 2 * 20 kPa at s_v = 80 kPa
    clay = dict(friction_angle=0.0, dilatancy_angle=0.0, cohesion=20e3, k0=0.5)
    buoyant = 9.81 * 0.55 * 1650
    with pytest.raises(coupling.SceneError, match="yields from a depth of") as refusal:
        with_soil(**clay)
    depth = float(re.search(r"from a depth of (\S+) m", str(refusal.value))[1])
    # 1 %: printed with three digits
    assert depth == pytest.approx(80e3 / buoyant, rel=0.01)
    least = 1 - 2 * 20e3 / (buoyant * 50.0)
    assert f"k0 must lie in {least:.3f} .. {2 - least:.3f}" in str(refusal.value)
    assert with_soil(**clay | dict(cohesion=0.25 * buoyant * 50.0 + 1.0)).soils[0].k0 == 0.5
    # elastic ground bears any
    assert with_soil(k0=0.05, model="elastic").soils[0].k0 == 0.05


@pytest.mark.parametrize("name", coupling.scene_names())
def test_built_in_scene_begins_with_a_stress_that_its_soils_bear(name):
    scene = coupling.load_scene(name)
    for soil in scene.soils:
        vertical = scene.vertical_stress(scene.box.depth)
        lowest, highest = soil.admissible_k0(vertical)
        # as published: loaded by gravity as an elastic body of nu = 0.3, within the strength of every soil
        assert soil.k0 is None
        assert soil.lateral_pressure_coefficient(vertical) == pytest.approx(3 / 7, rel=1e-12)
        assert lowest < 3 / 7 < highest


def test_ring_without_ground_is_stored_as_such():
    scene = coupling.load_scene("quick", **{"ring.ground": "none"})
    assert scene.ring.ground is None and 'ground = "none"' in scene.source
    assert coupling.scenes.scene.parse_scene(scene.source, "again") == scene == scene.changed(gravity=9.81)
    assert coupling.load_scene("quick", **{"ring.ground": None}) == scene


def test_entry_of_a_number_without_end_is_refused():
    with pytest.raises(coupling.SceneError, match="must be a number below 1"):
        coupling.load_scene("quick", **{"soils." + 5000 * "9" + ".k0": 0.5})
