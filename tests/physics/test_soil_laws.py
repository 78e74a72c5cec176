"""Laws of soils: those with history in a run, one of a third party, and what is refused."""

import re
from pathlib import Path

import numpy as np
import pytest

import coupling
import coupling.datasets
import mpm
from coupling.refused import SceneError
from mpm.laws.law import compiled, soil_law
from verification.problems.soil_laws import CLAY
from verification.small_event import COARSE

PAGE = Path(__file__).parents[2] / "docs" / "soil-laws.md"


def clay(**changes):
    return {f"soils.0.{key}": value for key, value in (CLAY | {"hydraulic_conductivity": 1e-6} | changes).items()}


def clay_scene(**changes):
    return coupling.load_scene("quick", discretisation=COARSE, **clay() | changes)


def test_every_law_of_the_page_is_there_with_its_keys():
    rows = [line.split("|")[1:4] for line in PAGE.read_text().splitlines() if line.startswith("| `")]
    names = [name.strip(" `") for name, _, _ in rows]
    assert sorted(names) == [name for name in mpm.soil_law_names() if name != "wearing-sand"]
    for name, (_, keys, history) in zip(names, rows, strict=True):
        law = soil_law(name)
        assert set(re.findall(r"`(\w+)`", keys)) <= set(law.model_fields)
        assert re.findall(r"`(\w+)`", history) == [entry[0] for entry in law.history]


@pytest.fixture(scope="module")
def layered():
    """Scene of clay above a depth [m] and the page's sand below it: both laws have a history, and kernels in common."""
    example, use = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.S)
    names = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("mpm.laws.law._REGISTERED", {})  # another test may have run the page
        for _ in range(2):  # as a cell of a notebook is run again
            exec(example + use, names)  # the page is ours
        (sand,) = names["scene"].soils
        assert isinstance(sand, names["WearingSand"])

        def scene(depth, **changes):
            above = clay_scene().soils[0].model_dump(exclude_none=True) | {"name": "clay"}
            below = sand.model_dump(exclude_none=True) | {"top_depth": depth}
            return names["scene"].changed(soils=[above, below], discretisation=COARSE, ring="none", **changes)

        yield scene


@pytest.mark.slow
def test_law_of_the_page_runs_and_wears(layered, tmp_path):
    scene = layered(10.0, stop={"time": 0.06}, output={"interval": 0.02, "snapshot_interval": 0.06})
    coupling.run(scene, out=tmp_path / "run", figures=False)
    points = coupling.read_run(tmp_path / "run")["points"].isel(time=-1)
    assert points["worn"].attrs["units"] == "1" and points["worn"].max() > 0.01
    # what has no effective stress is not strained by a law
    assert float((points["worn"] - points["deviatoric_strain"]).max()) < 1e-6
    # each law writes its own history only
    clay = points["soil"] == 0
    assert (points["worn"][clay] == 0).all() and (points["preconsolidation_pressure"][~clay] == 0).all()


@pytest.mark.slow
def test_clay_flows_through_the_gate_and_remembers_its_pressure(layered):
    scene = layered(32.0, stop={"time": 0.05}, output={"interval": 0.05})
    simulation = mpm.Simulation(scene)
    first = simulation.begin()
    start = simulation.solver.points["preconsolidation_pressure"][simulation.solver.soil_of_point == 0]
    last = simulation.advance()
    points = simulation.solver.points[simulation.solver.soil_of_point == 0]
    assert simulation.done and last.flow_zone_area > 0 and np.isfinite(points["stress_xx"]).all()
    assert (start > 0).all() and (
        points["preconsolidation_pressure"] < start * (1 - 1e-3)
    ).any()  # it softens at the gate
    p = -(points["stress_xx"] + points["stress_yy"] + points["stress_zz"]) / 3 + CLAY["attraction"]
    q2 = 0.5 * (
        (points["stress_xx"] - points["stress_yy"]) ** 2 + (points["stress_yy"] - points["stress_zz"]) ** 2
        + (points["stress_zz"] - points["stress_xx"]) ** 2
    ) + 3 * points["stress_xy"] ** 2  # fmt: skip
    held = points["porosity"] < scene.soils[0].loose_porosity
    beyond = q2 / scene.soils[0].critical_state_slope ** 2 + p * (p - points["preconsolidation_pressure"])
    scale = np.maximum(p, points["preconsolidation_pressure"]) ** 2 + CLAY["attraction"] ** 2
    # within the yield surface, but for the turn with the material, whose stresses grow by its square
    assert (beyond[held] / scale[held]).max() < 1e-2
    assert first.max_velocity == 0.0


def test_functions_of_a_law_are_compiled_as_they_are_written():
    law = soil_law("modified-cam-clay")
    for plain, kernel in zip(law.helpers, compiled(*law.helpers), strict=True):
        assert kernel.py_func.__code__ is plain.__code__


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"soils.0.model": "mohr-coulom"}, r"soils\[0\].model: must be one of .*did you mean 'mohr-coulomb'"),
        ({"soils.0.model": "nowhere.py:Law"}, "there is no file 'nowhere.py'"),
        (clay(swelling_index=0.3), "swelling_index must be below compression_index"),
        ({"soils.0.wear": 1.0}, "unknown key"),
        (clay(attraction="1 m"), "must be a quantity in Pa"),
    ],
)  # fmt: skip
def test_wrong_laws_are_refused_by_name(changes, told):
    with pytest.raises(SceneError, match=told):
        coupling.load_scene("quick", **changes)


def test_units_of_a_law_are_read_in_studies():
    from coupling.scenes.scene import unit_of

    assert unit_of("soils.0.attraction") == "Pa" and unit_of("soils.0.friction_angle") == "degree"
