"""A jointed ring that moves in elastic ground, as far as the relaxation of the initial state takes it."""

import time

import numpy as np

import coupling
import mpm
from mpm.fields import FIXED_X, FIXED_Y, block
from mpm.mesh import SOIL, Mesh
from mpm.mesh.build import crossed
from verification.problems.exact_jointed_rings import ElasticGround, HingedRing, ring_in_ground
from verification.problems.problem import Problem, Result, register

OUTER, INNER, CONCRETE, POISSON = 3.3, 3.26, 1e13, 0.3
RADIUS, THICKNESS = (OUTER + INNER) / 2, OUTER - INNER
MODULUS = CONCRETE / (1 - 0.2**2)
AXIAL, BENDING = MODULUS * THICKNESS, MODULUS * THICKNESS**3 / 12
HINGES = (30.0, 60.0)  # and their mirror images [degrees]
VERTICAL, HORIZONTAL = 1e3, 5e2  # weight is nothing beside it [Pa]
THETA = np.arange(0.0, 91.0, 15.0)


def ring_mesh(tunnel, radii, around):
    """Mesh of the ground between circles about a tunnel, `around` cells each."""
    angle = 2 * np.pi * np.arange(around) / around
    circle, axis = np.stack([np.sin(angle), np.cos(angle)], axis=1), np.array([tunnel.x, -tunnel.axis_depth])
    nodes = (np.asarray(radii)[:, None, None] * circle).reshape(-1, 2) + axis
    layer, here = np.indices((len(radii) - 1, around)) * [[[around]], [[1]]]
    there = (here + 1) % around
    corners = layer + here, layer + there, layer + around + there, layer + around + here
    nodes, triangles = crossed(nodes, np.stack(corners, axis=-1).reshape(-1, 4))
    none = np.zeros(0, np.int32)
    names = "left", "right", "bottom", "top", "opening_nodes", "corner_nodes", "wall_nodes", "inner_nodes"
    return Mesh(
        nodes=nodes, elements=triangles.astype(np.int32), region=np.full(len(triangles), SOIL, np.int8),
        outer_nodes=(np.arange(around, dtype=np.int32),), outer_theta=(np.degrees(angle),), gate_angle=np.nan,
        wall_side=none.astype(np.int8), corner_side=none.astype(np.int8), inner_opening_nodes=none,
        **dict.fromkeys(names, none),
    )  # fmt: skip


def relaxed(radii, around, *, bonded, rotational_stiffness, youngs_modulus, lining_model="beam-spring"):
    """Solver of a ring with eight joints in equilibrium with elastic ground between circles [m], the outer one held.

    Returns it and the processor time of the relaxation [s].
    """
    ring = {
        "inner_diameter": 2 * INNER, "concrete_modulus": CONCRETE, "section": "euler-bernoulli",
        "joint_angles": sorted(a for h in HINGES for a in (h, 180 - h, 180 + h, 360 - h)),
        "joint_rotational_stiffness": rotational_stiffness, "joint_normal_stiffness": 1e12,
        "joint_shear_stiffness": 1e12,
    }  # fmt: skip
    scene = coupling.load_scene(
        "quick", water="none", gate="none", lining="jointed", initial_contact="bonded" if bonded else "frictional",
        gravity=1e-6, box={"width": 80.0, "depth": 80.0}, numerics={"relaxation_tolerance": 1e-3}, ring=ring,
    )  # fmt: skip
    soil = scene.soils[0].model_copy(
        update={"model": "elastic", "youngs_modulus": youngs_modulus, "poissons_ratio": POISSON}
    )
    geometry = {"cover": 36.7, "inner_diameter": 2 * INNER, "lining_harmonics": 16}
    kind = {"friction_coefficient": 0.0, "lining_model": lining_model}
    tunnel = scene.tunnels[0].model_copy(update=geometry | kind)
    scene = scene.model_copy(update={"soils": (soil,), "tunnels": (tunnel,)})
    mesh = ring_mesh(tunnel, radii, around)
    solver = mpm.Solver(scene, mesh, threads=1)
    stress = [-HORIZONTAL, -VERTICAL, -POISSON * (HORIZONTAL + VERTICAL), 0.0]
    block(solver.points, "stress_xx", "stress_xy")[:] = stress
    outside = np.hypot(*(mesh.nodes - [tunnel.x, -tunnel.axis_depth]).T) > radii[-1] - 1e-6
    solver.fixed[outside] |= FIXED_X | FIXED_Y
    begin = time.process_time()
    _, residual = solver.relax()
    assert residual < scene.numerics.relaxation_tolerance
    return solver, time.process_time() - begin


def exact(rotational_stiffness, *, bonded, youngs_modulus, held, hinges=HINGES):
    """The closed form of the same."""
    ring = HingedRing(RADIUS, AXIAL, BENDING, tuple(np.radians(hinges)), rotational_stiffness)
    ground = ElasticGround(OUTER, youngs_modulus, POISSON, held)
    return ring_in_ground(ring, ground, VERTICAL, HORIZONTAL, np.radians(THETA), bonded)


def jointed_ring(around=120, rotational_stiffness=2e7, bonded=False, youngs_modulus=5e6, held=13.0):
    """A ring with joints of a `rotational_stiffness` [N m/rad/m], 0 for hinges, in ground held at a radius [m]."""
    radii = OUTER * (held / OUTER) ** np.linspace(0, 1, around // 5 + 1)
    ways = {"bonded": bonded, "youngs_modulus": youngs_modulus}
    solver, seconds = relaxed(radii, around, rotational_stiffness=rotational_stiffness, **ways)
    found = solver.moving.motion_at(0, THETA)
    answer = exact(rotational_stiffness, **ways, held=held)
    rigid = exact(rotational_stiffness, **ways, held=held, hinges=()).bending_moment
    moved, moment = answer.displacement_radial, answer.bending_moment
    errors = {
        "rotation": np.abs(found["joint_rotation"][:2] / answer.rotation - 1).max(),
        "displacement": np.abs(found["displacement_radial"] - moved).max() / np.abs(moved).max(),
        "moment": np.abs(found["bending_moment"] - moment).max() / np.abs(rigid).max(),
    }
    return Result.of(solver, seconds, max(errors.values()), **errors)


register(Problem(
    name="jointed-ring", title="jointed ring that moves in elastic ground",
    source="Fourier series of a ring with springs in ground after Michell (1899)",
    norm="the largest of: rotations of the joints, relative; displacement over the largest; moment over that without "
    "joints",
    solve=jointed_ring, fast={"around": 120},
    ladder={
        "around": (30, 60, 120, 240), "rotational_stiffness": (0.0, 2e6, 2e7, 2e8), "bonded": (False, True),
        "youngs_modulus": (5e5, 5e6, 5e7),
    },
    limit=0.01, why="elements of 0.17 m for a field that bends, where joints turn most",
))  # fmt: skip
