"""What a scene does not need is not computed; where the feature is there but neutral, the answer is the same."""

import numba
import numpy as np
import pytest

import coupling
import coupling.datasets
import mpm
import mpm.scene
from coupling.scenes.features import features
from mpm.fields import (
    CONTACT_RECORD,
    LEDGER_RECORD,
    NODE_RECORD,
    REACTION_RECORD,
    SIDE_RECORD,
    SUM_RECORD,
    TIED_RECORD,
    block,
    numbers,
    values,
)
from mpm.laws.law import soil_law
from mpm.step.nodes import solve_kernel
from mpm.step.system import Medium, Needs, Net, System, Tally, Walls
from mpm.time_step.clock import Clock
from verification.small_event import small_scene

pytestmark = pytest.mark.slow

MOTION = ("x", "y", "velocity_solid_x", "velocity_solid_y", "deviatoric_strain")
STRESS = ("stress_xx", "stress_yy", "stress_zz", "stress_xy")


def scene(**changes):
    return coupling.load_scene("quick").model_copy(update=changes)


def stepped(case, steps=60, weightless=False):
    """Points after some steps with the gate open, one thread."""
    solver = mpm.Solver(case, mpm.build_mesh(case), threads=1)
    if weightless:
        solver.points["pore_pressure"] = 0.0
    solver.relax()
    solver.open_gate()
    for _ in range(steps):
        solver.step(2e-5)
    return solver


def test_dry_scene_is_the_limit_of_water_without_weight_and_stiffness():
    dry = stepped(scene(water=None))
    # no validated scene can have such water: its bulk modulus and density are bounded from below
    nothing = mpm.scene.Water.model_construct(table_depth=0.0, density=1e-9, bulk_modulus=0.0)
    wet = stepped(scene(water=nothing), weightless=True)
    moved = np.hypot(dry.points["velocity_solid_x"], dry.points["velocity_solid_y"]).max()
    assert moved > 1e-3
    assert np.abs(values(dry.points, MOTION) - values(wet.points, MOTION)).max() < 1e-9
    scale = np.abs(values(dry.points, STRESS)).max()
    assert np.abs(values(dry.points, STRESS) - values(wet.points, STRESS)).max() < 1e-8 * scale


def test_elastic_scene_is_the_limit_of_a_strength_that_is_never_reached():
    soil = scene().soils[0]
    elastic = stepped(scene(soils=(soil.model_copy(update={"model": "elastic"}),)))
    strong = stepped(scene(soils=(soil.model_copy(update={"cohesion": 1e12, "tensile_strength": 1e12}),)))
    # two compilations fuse products and sums differently: round-off of 60 steps, over each variable's largest value
    elastic, strong = numbers(elastic.points), numbers(strong.points)
    assert (np.abs(elastic - strong) <= 1e-12 * np.abs(elastic).max(axis=0)).all()


def test_dry_scene_has_no_water_pressure_and_less_weight():
    rough = scene().tunnels[0].model_copy(update={"friction_coefficient": 0.6})  # bears the K0 state
    case = scene(water=None, stop=mpm.scene.Stop(time=0.004), tunnels=(rough,))
    first, *_, last = mpm.simulate(case)
    assert not first.lining[0]["water_pressure"].any() and not last.lining[0]["water_pressure"].any()
    crown = int(np.argmin(np.abs(first.lining[0]["theta"])))
    weight = 9.81 * 2650.0 * 0.55 * 20.0  # dry grains above the crown
    assert first.lining[0]["soil_pressure"][crown] == pytest.approx(weight, rel=0.02)


def test_scene_file_can_leave_out_the_water_of_its_base(tmp_path):
    file = tmp_path / "dry.toml"
    file.write_text('base = "quick"\nname = "dry"\nwater = "none"\n')
    dry = coupling.load_scene(str(file))
    assert dry.water is None
    # soil springs see the dry stress at the axis
    assert dry.ring.ground.vertical_stress == pytest.approx(9.81 * 2650.0 * 0.55 * 23.3)


def test_water_needs_a_permeability():
    data = coupling.load_scene("quick").model_dump(exclude={"ring", "limits"})
    data["soils"][0]["hydraulic_conductivity"] = None
    with pytest.raises(ValueError, match="hydraulic_conductivity must be given where there is water"):
        mpm.scene.Scene.model_validate(data)
    mpm.scene.Scene.model_validate(data | {"water": None})


def test_frictionless_scene_is_the_limit_of_vanishing_friction():
    tunnel = scene().tunnels[0]
    states = [
        stepped(scene(tunnels=(tunnel.model_copy(update={"friction_coefficient": mu}),), initial_contact="frictional"))
        for mu in (0.0, 1e-12)
    ]
    smooth, rough = states
    assert not smooth.impulse["shear"].any() and smooth.impulse["soil"].any() and rough.impulse["shear"].any()
    # the shear is 1e-12 of the pressure, and 60 steps and the relaxation add it up
    scale = np.abs(values(smooth.points, STRESS)).max()
    assert np.abs(values(smooth.points, STRESS) - values(rough.points, STRESS)).max() < 1e-8 * scale
    assert np.abs(values(smooth.points, MOTION) - values(rough.points, MOTION)).max() < 1e-8


def test_undrained_ground_needs_no_smaller_step_and_is_the_limit_of_falling_permeability():
    soil = scene().soils[0]
    states = [
        stepped(scene(soils=(soil.model_copy(update={"hydraulic_conductivity": k}),)), steps=30) for k in (1e-9, 1e-12)
    ]
    for state in states:
        apart = np.hypot(
            state.points["velocity_solid_x"] - state.points["velocity_liquid_x"],
            state.points["velocity_solid_y"] - state.points["velocity_liquid_y"],
        )
        moved = np.hypot(state.points["velocity_solid_x"], state.points["velocity_solid_y"]).max()
        assert moved > 1e-3 and apart.max() < 1e-3 * moved  # one velocity, though two are carried
    low, lower = (state.points for state in states)
    assert np.abs(low["pore_pressure"] - lower["pore_pressure"]).max() < 1e-3 * lower["pore_pressure"].max()
    steps = [state.time_step_estimate()[0] for state in states]
    assert steps[0] == pytest.approx(steps[1], rel=0.02)  # the spectrum is known to a hundredth


def undrained(**changes):
    water = scene().water.model_copy(update={"drainage": "undrained"})
    soil = scene().soils[0].model_copy(update={"hydraulic_conductivity": None})
    tied = scene(water=water, soils=(soil,), **changes)
    return mpm.scene.Scene.model_validate(tied.model_dump(exclude={"ring", "limits"}))


def test_undrained_scene_is_the_limit_of_falling_permeability():
    soil = scene().soils[0].model_copy(update={"hydraulic_conductivity": 1e-12})
    one, two = stepped(undrained()), stepped(scene(soils=(soil,)))
    moved = np.hypot(two.points["velocity_solid_x"], two.points["velocity_solid_y"]).max()
    assert moved > 1.0
    assert np.array_equal(
        values(one.points, ("velocity_liquid_x", "velocity_liquid_y")),
        values(one.points, ("velocity_solid_x", "velocity_solid_y")),
    )
    # where the lining is, away from the gate, porosity is uniform: one weight, one velocity, a few roundings of k
    for name in ("soil", "water", "shear"):
        assert np.abs(one.impulse[name] - two.impulse[name]).max() < 1e-6 * two.impulse[name].max()
    # at the gate two velocities are mapped with two weights (grains, volume) that differ with the porosity, and the
    # water's remapped one slides along walls on which grains stick: differences of points within 0.1 m of the gate's
    # corner, 1.0e-3, 3.7e-3 and 6e-4; of 99 in 100 points less than 2e-4
    for columns, most in ((MOTION[2:4], 2e-3), (STRESS, 4e-3), (("pore_pressure",), 3e-3)):
        scale = np.abs(values(two.points, columns)).max()
        difference = np.abs(values(one.points, columns) - values(two.points, columns)).max(axis=1)
        assert difference.max() < most * scale and np.quantile(difference, 0.99) < 2e-4 * scale, columns


def test_wall_pushes_an_undrained_mixture_as_two_tied_phases():
    """Random nodes at a wall: reactions and velocities of the limit of infinite drag of two momentum equations."""
    n, random = 400, np.random.default_rng(2)
    sums = np.zeros((1, n), SUM_RECORD)
    row = sums[0]
    row["mass_solid"], row["mass_liquid"] = random.uniform(1, 2, n), random.uniform(0.5, 1, n)
    row["mass_pore_liquid"], row["drag"] = 0.45 * row["mass_liquid"], 1e16
    speed = random.normal(size=(2, n))
    block(row, "momentum_solid_x", "momentum_solid_y")[:] = (speed * row["mass_solid"]).T
    block(row, "momentum_liquid_x", "momentum_liquid_y")[:] = (speed * row["mass_liquid"]).T
    block(row, "force_x", "force_liquid_y")[:] = 1e3 * random.normal(size=(n, 4))
    angle = random.uniform(0, 2 * np.pi, n)
    contact = np.zeros(n, CONTACT_RECORD)
    contact["normal_x"], contact["normal_y"], contact["active"], contact["friction"] = (
        np.cos(angle),
        np.sin(angle),
        1,
        0.2,
    )
    numbered = np.arange(n, dtype=np.int32)
    found = []
    for two_phase in (True, False):
        given = sums.copy()
        if not two_phase:
            mixture = speed * (row["mass_solid"] + row["mass_pore_liquid"])
            block(given[0], "momentum_solid_x", "momentum_solid_y")[:] = mixture.T
        nodes, impulse, ledger = np.zeros(n, NODE_RECORD), np.zeros(n, REACTION_RECORD), np.zeros(1, LEDGER_RECORD)
        still = np.zeros((n, 2))
        system = System(**dict.fromkeys(System._fields) | {
            "net": Net(**dict.fromkeys(Net._fields) | {
                "which_node": numbered, "next_row": np.full(n, -1, np.int32), "level_of_row": np.zeros(n, np.int8),
                "touched": np.ones((1, n), np.uint8), "sums": given, "tied_means": np.zeros(0, TIED_RECORD),
                "nodes": nodes, "status": np.zeros(n, np.int8),
            }),
            "walls": Walls(np.zeros(n, np.int8), np.zeros(n, SIDE_RECORD), numbered, contact, still, impulse),
            "clock": Clock(**dict.fromkeys(Clock._fields) | {"dt_of_level": np.array([1e-3])}),
            "medium": Medium(9.81, 1000.0, 8e7),
            "tally": Tally(**dict.fromkeys(Tally._fields) | {"ledger": ledger}),
        })  # fmt: skip
        # a kernel's part has no code of its own to call
        needs = Needs(True, two_phase, tied=False, moving=False, laws=(soil_law("elastic"),))
        numba.njit(error_model="numpy")(solve_kernel(needs).py_func)(0, n, 0, 0, system)
        assert ledger["unexplained"] < 1e-12 * ledger["reactions"]
        reactions = values(impulse, ("soil", "water", "shear")) / 1e-3
        found.append((values(nodes, ("velocity_solid_x", "velocity_solid_y")), reactions))
    (two, of_two), (one, of_one) = found
    kinds = [(of_two[:, 0] > 0) & (of_two[:, 1] > 0), (of_two[:, 0] > 0) & (of_two[:, 1] == 0)]
    kinds += [(of_two[:, 0] == 0) & (of_two[:, 1] > 0), (of_two[:, :2] == 0).all(axis=1)]
    assert all(kind.any() for kind in kinds)  # both held, grains alone, water alone, none
    # the drag over a step is 1e13 times a mass
    assert np.abs(one - two).max() < 1e-9 * np.abs(two).max()
    assert np.abs(of_one[:, :3] - of_two[:, :3]).max() < 1e-9 * np.abs(of_two).max()


def test_undrained_scene_refuses_linings_that_move():
    tunnel = scene().tunnels[0].model_copy(update={"lining": "floating"})
    with pytest.raises(ValueError, match="drainage = 'undrained' needs linings that are held, got lining = 'floating'"):
        undrained(tunnels=(tunnel,))


def test_undrained_scene_has_one_velocity_in_the_plan():
    case = coupling.load_scene("quick", water={"drainage": "undrained"})
    velocities = [f for f in features(case, 1) if f["feature"].startswith("two velocities")]
    assert not velocities[0]["active"] and "undrained" in velocities[0]["reason"]


def test_pressures_only_keeps_pressures_and_history_and_changes_no_bit_of_them(tmp_path):
    settings = {"stop": {"time": 0.02}, "ring": "none"}
    output = {"interval": 0.005, "snapshot_interval": 0.005}
    runs = []
    for points in (True, False):
        case = small_scene(**settings, output={**output, "points": points})
        folder = tmp_path / str(points)
        coupling.run(case, out=folder, threads=1, figures=not points)
        runs.append(folder)
    for group in ("lining", "history"):
        one, other = (coupling.datasets.raw_groups(folder)[group] for folder in runs)
        for name in one.keys() - {"cpu_seconds"}:
            assert np.array_equal(one[name], other[name]), name
    kept, none = (coupling.datasets.read_points(folder) for folder in runs)
    assert kept.sizes["time"] > 2 and none.sizes["time"] == 0
    assert (runs[1] / "run.nc").stat().st_size < (runs[0] / "run.nc").stat().st_size
    pictures = {path.name for path in (runs[1] / "figures").iterdir()}
    assert "pressures.png" in pictures and "fields.png" not in pictures
