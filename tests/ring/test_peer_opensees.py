"""The beam-spring ring against the same ring in OpenSees (McKenna et al.), linear and nonlinear."""

import importlib.util
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from rings import ground, pressures, ring

from structure import BeamSpringLining
from structure.beams.sections import forces_at
from structure.springs import soil_springs

PROGRAM = Path(__file__).with_name("opensees_ring.py")

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("openseespy") is None,
    reason="openseespy is absent: uv sync --extra peer (Linux on x86-64, Python below 3.13)",
)


def ask_opensees(model, loads, joint_changes=None):
    """Response of OpenSees to the nodal loads (n_nodes, 3) of a beam-spring model."""
    lining, mesh = model.ring, model.mesh
    soil = None
    if lining.ground is not None:
        normal, tangential = soil_springs(lining)
        soil = {
            "law": lining.ground.law,
            "two_way": lining.ground.two_way,
            "lever": lining.thickness / 2 if lining.ground.slip_at == "outer_face" else 0.0,
            "normal": {"stiffness": normal.stiffness, "limit": min(normal.limit, 1e30)},
            "tangential": {"stiffness": tangential.stiffness, "limit": min(tangential.limit, 1e30)},
        }
    joints = []
    for number, (angle, before, after) in enumerate(
        zip(np.radians(lining.joint_angles), mesh.joint_before, mesh.joint_after, strict=True)
    ):
        joint = {
            "angle": angle,
            "before": int(before),
            "after": int(after),
            "normal": lining.joint_normal_stiffness,
            "shear": lining.joint_shear_stiffness,
            "rotational": lining.joint_rotational_stiffness,
        }
        joints.append(joint | (joint_changes[number] if joint_changes else {}))
    timoshenko = lining.section == "timoshenko"
    given = {
        "radius": lining.centre_radius,
        "node_angle": mesh.node_angle.tolist(),
        "node_area": (lining.outer_radius * mesh.node_span).tolist(),
        "elements": np.stack([mesh.first, mesh.second], axis=1).tolist(),
        # E, G, A, I written out, so that the ring's own stiffnesses are compared too
        "youngs_modulus": lining.concrete_modulus / (1 - lining.concrete_poissons_ratio**2),
        "shear_modulus": lining.concrete_modulus / (2 * (1 + lining.concrete_poissons_ratio)),
        "area": lining.thickness,
        "second_moment": lining.thickness**3 / 12,
        "shear_area": 5 / 6 * lining.thickness if timoshenko else 0.0,
        "joints": joints,
        "soil": soil,
        "clamped": [int(np.argmin(np.abs(mesh.node_angle % (2 * np.pi) - np.pi)))] if soil is None else [],
        "loads": loads.tolist(),
    }
    run = subprocess.run(
        [sys.executable, PROGRAM], input=json.dumps(given), capture_output=True, text=True, timeout=300
    )
    lines = [line for line in run.stdout.splitlines() if line.startswith("RESULT ")]
    assert lines, f"OpenSees gave nothing (exit code {run.returncode}; libblas.so.3 missing?): {run.stderr[-2000:]}"
    answer = json.loads(lines[0].removeprefix("RESULT "))
    assert answer["failed"] == 0, run.stderr[-2000:]
    return {name: np.array(answer[name]) for name in ("displacement", "forces", "jumps", "joint_forces")}


def largest_differences(lining, changes_of=None, loads=None):
    """Largest difference of every quantity over its largest value, beam-spring model against OpenSees."""
    model = BeamSpringLining(lining)
    loads = pressures() if loads is None else loads
    response = model.respond(loads).isel(time=0)
    nodal = model.loads(loads)[0].reshape(-1, 3)
    at_theta = forces_at(model.mesh, np.radians(response["theta"].values))
    peer = ask_opensees(model, nodal, changes_of(response) if changes_of else None)
    if lining.ground is not None:
        # some springs press and some are open, or the comparison would say nothing about them
        assert response["displacement_radial"].min() < 0 < response["displacement_radial"].max()
    pairs = {
        name: (response[name].values, at_theta @ peer["forces"][:, column])
        for column, name in enumerate(("axial_force", "shear_force", "bending_moment"))
    }
    for kind, names in (
        ("jumps", ("joint_opening", "joint_dislocation", "joint_rotation")),
        ("joint_forces", ("joint_axial_force", "joint_shear_force", "joint_bending_moment")),
    ):
        for column, name in enumerate(names):
            if len(lining.joint_angles):
                pairs[name] = (response[name].values, peer[kind][:, column])
    if lining.ground is not None:
        radial = model.readings.movement[0] @ peer["displacement"].ravel()
        ours = np.stack([response[f"convergence_{way}"].values for way in ("vertical", "horizontal")])
        pairs["convergence"] = (ours, -(radial[[0, 90]] + radial[[180, 270]]))
    return {name: np.abs(one - other).max() / np.abs(other).max() for name, (one, other) in pairs.items()}


LINEAR_GROUND = dict(law="linear", two_way=True)


@pytest.mark.parametrize("section", ["timoshenko", "euler-bernoulli"])
@pytest.mark.parametrize("slip_at", ["outer_face", "centre_line"])
def test_linear_ring_in_two_way_springs(section, slip_at):
    lining = ring(section=section, ground=ground(slip_at=slip_at, **LINEAR_GROUND))
    # 1e-7 is asked for: both solve the same equations up to rounding.
    assert max(largest_differences(lining).values()) < 1e-7


def test_linear_ring_on_a_clamped_invert():
    # 1e-7 is asked for.
    assert max(largest_differences(ring(ground=None, support="invert")).values()) < 1e-7


def test_springs_that_only_press():
    lining = ring(ground=ground(law="linear"))
    # 1e-7: piecewise linear, so the same equations once the same springs are open.
    assert max(largest_differences(lining).values()) < 1e-7


@pytest.mark.parametrize("slip_at", ["outer_face", "centre_line"])
def test_hyperbolic_springs_that_only_press(slip_at):
    # 1e-4 is asked for; OpenSees' hyperbola is the same, its Newton stops at 1e-13 m.
    assert max(largest_differences(ring(ground=ground(slip_at=slip_at))).values()) < 1e-4


@pytest.mark.parametrize("height", [0.35, 0.175])
def test_gaping_joints_through_points_of_the_published_curve(height):
    """The curve of every joint is Janssen's phi(M) at its own axial force, on which the two must agree as well."""

    def curves(response):
        changes = []
        for force in response["joint_axial_force"].values:
            closed = np.array([force * height / 6])
            opened = force * height / 2 * (1 - 2 / 3 * np.geomspace(1, 3e-2, 3000)[1:])
            modulus = 12 * 5e8 / height**2
            rotation = 8 * force / (9 * height * modulus * (1 - 2 * opened / (force * height)) ** 2)
            rotation, moment = np.concatenate([closed / 5e8, rotation]), np.concatenate([closed, opened])
            changes.append({"rotation": rotation.tolist(), "moment": moment.tolist()})
        return changes

    differences = largest_differences(ring(joint_contact_height=height), curves)
    # 1e-4 is asked for; chords of the curve between 3000 points a tenth of a percent apart lie (1e-3)^2 below it.
    assert max(differences.values()) < 1e-4


def test_sliding_joints_as_elastic_plastic_springs():
    """Every joint yields at friction times its own axial force, on which the two must agree as well."""
    friction = 0.1

    def yields(response):
        sliding = np.abs(response["joint_shear_force"]) > 0.999 * friction * response["joint_axial_force"]
        assert sliding.any() and not sliding.all()
        return [{"yield": friction * force} for force in response["joint_axial_force"].values]

    # 1e-7: piecewise linear, so the same equations once the same joints slide.
    assert max(largest_differences(ring(joint_friction_coefficient=friction), yields).values()) < 1e-7
