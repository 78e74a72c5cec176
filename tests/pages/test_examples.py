"""The examples run, and the third-party model among them is a lining model like the others."""

import runpy
import subprocess
import sys
import warnings
from pathlib import Path

import matplotlib
import numpy as np
import pytest

from coupling import load_scene
from structure import BeamSpringLining, Ring, theory
from structure.lining import RESPONSE
from verification.reports.ring import costs

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.stem)
def test_example_runs(path, monkeypatch, capfd):
    monkeypatch.chdir(ROOT)
    with matplotlib.rc_context(), warnings.catch_warnings():
        warnings.simplefilter("error")
        runpy.run_path(str(path), run_name="__main__")
    printed = capfd.readouterr()
    assert printed.out.strip() and not printed.err


@pytest.fixture(scope="module")
def example():
    return runpy.run_path(str(EXAMPLES / "equivalent_stiffness_ring.py"))


@pytest.fixture(scope="module")
def ring():
    return Ring(
        outer_diameter=6.6,
        inner_diameter=5.9,
        concrete_modulus=34.5e9,
        concrete_poissons_ratio=0.2,
        concrete_unit_weight=0.0,
        joint_angles=(45.0, 225.0),
        joint_rotational_stiffness=5e8,
        joint_normal_stiffness=6e8,
        joint_shear_stiffness=8e7,
        balance_uplift=True,
        section="euler-bernoulli",
    )


@pytest.fixture(scope="module")
def loads():
    return theory.theoretical_pressures(
        outer_diameter=6.6, cover=20.0, buoyant_unit_weight=8900.0, coefficient_at_rest=0.43
    )


def test_third_party_model_follows_the_schema(example, ring, loads):
    response = example["EquivalentStiffnessLining"](ring, efficiency=0.7, moment_increase=0.3).respond(loads)
    for name, (dimensions, units, long_name) in RESPONSE.items():
        assert response[name].dims == dimensions
        assert response[name].attrs == {"units": units, "long_name": long_name}
    assert response.attrs["model"] == "equivalent-stiffness"


def test_efficiency_softens_bending_but_not_stretching(example, ring, loads):
    respond = {eta: example["EquivalentStiffnessLining"](ring, eta).respond(loads) for eta in (0.5, 1.0)}
    change = {eta: (r["convergence_vertical"] - r["convergence_horizontal"]).item() for eta, r in respond.items()}
    stretch = {eta: (r["convergence_vertical"] + r["convergence_horizontal"]).item() for eta, r in respond.items()}
    # 1e-2: the ovalisation of a free ring is bending over EI, and 0.6 % stretching.
    assert change[0.5] / change[1.0] == pytest.approx(2.0, rel=1e-2)
    # 1e-2: the mean shortening is N R/EA, and the bending's share in it through the curvature.
    assert stretch[0.5] / stretch[1.0] == pytest.approx(1.0, rel=1e-2)
    unjointed = BeamSpringLining(ring.model_copy(update={"joint_angles": ()})).respond(loads)
    # 1e-3 of the largest: a uniform EI leaves a free ring's moments alone but for EI/(EA R^2) = (t/R)^2/12 = 1e-3.
    largest = np.abs(unjointed["bending_moment"]).max().item()
    np.testing.assert_allclose(respond[0.5]["bending_moment"], unjointed["bending_moment"], atol=1e-3 * largest)


@pytest.mark.parametrize("efficiency", [0.0, 1.2])
def test_impossible_efficiency_is_refused(example, ring, efficiency):
    with pytest.raises(ValueError, match="efficiency"):
        example["EquivalentStiffnessLining"](ring, efficiency)


def test_figures_of_the_ring_are_drawn_by_their_script(tmp_path):
    command = [sys.executable, "-W", "error", "-m", "verification.reports", "ring", tmp_path]
    subprocess.run(command, cwd=ROOT, check=True)
    assert {path.name for path in tmp_path.iterdir()} == {"joint_laws.png", "ring_checks.png"}


def test_cost_of_the_ring_is_measured_and_small():
    rows = {name: float(seconds) for name, seconds, *_ in costs(load_scene("case-3"), 100)}
    # 0.5 s of CPU for 100 records is the 5 s asked for 1000; 0.06 to 0.1 s measured.
    assert rows["linear joints, linear two-way ground"] < 0.5
    assert rows["linear joints, hyperbolic ground"] < 0.5
