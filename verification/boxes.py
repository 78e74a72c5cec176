"""A box of soil: its scene, its mesh of crossed triangles, the state of its points by name, and a run to a time."""

import time as clock
from types import SimpleNamespace

import numpy as np

from mpm.fields import FIXED_X, FIXED_Y, values
from mpm.mesh.build import crossed
from mpm.scene import Numerics, Scene

SOIL, EMPTY = 0, 3
STRESS = ("stress_xx", "stress_yy", "stress_zz", "stress_xy")
_SAND = {
    "model": "mohr-coulomb", "youngs_modulus": 2e7, "poissons_ratio": 0.3, "cohesion": 0.0, "friction_angle": 30.0,
    "dilatancy_angle": 0.0, "porosity": 0.4, "loose_porosity": 0.85, "grain_density": 2650.0, "k0": 0.5,
}  # fmt: skip
_WATER = ("bulk_modulus", "table_depth", "density", "drainage", "sides")


def box_scene(name, size, width, depth, gravity=9.81, points=3, **settings):
    """A scene of one soil without a tunnel, with elements of one size [m].

    Parameters
    ----------
    name : str
        Of the scene and of its soil.
    size, width, depth, gravity : float
        [m], [m/s2]
    points : int
        Per element.
    settings
        Fields of `mpm.scene.Numerics`, `Water` and `Soil`; of the soil those that a cohesionless sand does not have so.
        Without a `bulk_modulus` the ground is dry.
    """
    return Scene.model_validate(box_tables(name, size, width, depth, gravity, points, **settings))


def box_tables(name, size, width, depth, gravity=9.81, points=3, **settings):
    """The tables of :func:`box_scene`, not validated: to be changed before they are."""
    numerics = {key: settings.pop(key) for key in list(settings) if key in Numerics.model_fields}
    water = {"table_depth": 0.0, "density": 1000.0} | {key: settings.pop(key) for key in _WATER if key in settings}
    return {
        "name": name, "gravity": gravity, "box": {"width": width, "depth": depth},
        "water": water if water.get("bulk_modulus") is not None else None,
        "soils": [{"name": name, "top_depth": 0.0} | _SAND | settings],
        "discretisation": {
            "element_size": size, "element_size_lining": size, "element_size_interior": size, "gate_radius": size,
            "points_per_element": points,
        },
        "numerics": numerics, "stop": {"time": 1.0}, "output": {"interval": 1.0},
    }  # fmt: skip


def box_mesh(x, y, filled=None, fixed_bottom=True):
    """Rectangles of a grid, each cut by both diagonals, with the fields that :class:`mpm.Solver` reads of a mesh.

    Parameters
    ----------
    x, y : (n,), (m,) float64
        Grid lines, ascending [m]; the ground surface is y = 0. Left and right are smooth walls.
    filled : callable or None
        filled(x, y) of the elements' centres says which hold material at the start; None: those below y = 0.
    fixed_bottom : bool
        Bottom nodes are held in both directions; else only what the caller sets.

    Returns
    -------
    types.SimpleNamespace
        nodes, elements, region, boundary node lists; no lining, no gate.
    """
    x, y = np.asarray(x, float), np.asarray(y, float)
    columns, rows = len(x) - 1, len(y) - 1
    gx, gy = np.meshgrid(x, y)
    nodes = np.column_stack([gx.ravel(), gy.ravel()])
    j, i = np.divmod(np.arange(columns * rows), columns)
    a = j * (columns + 1) + i
    nodes, elements = crossed(nodes, np.column_stack([a, a + 1, a + columns + 2, a + columns + 1]))
    elements = elements.astype(np.int32)
    cx, cy = nodes[elements].mean(axis=1).T
    inside = cy < 0 if filled is None else np.asarray(filled(cx, cy), bool)
    none = np.zeros(0, np.int32)
    number = np.arange((rows + 1) * (columns + 1)).reshape(rows + 1, columns + 1)
    return SimpleNamespace(
        nodes=nodes, elements=elements, region=np.where(inside, SOIL, EMPTY).astype(np.int8),
        outer_nodes=(), outer_theta=(), opening_nodes=none, corner_nodes=none, wall_nodes=none, wall_side=none,
        inner_nodes=none, left=number[:, 0].astype(np.int32), right=number[:, -1].astype(np.int32),
        bottom=number[0].astype(np.int32) if fixed_bottom else none, top=number[-1].astype(np.int32),
    )  # fmt: skip


def annulus_mesh(radii, sectors):
    """Crossed quadrilaterals on a quarter annulus about the origin, y downward from 0, all filled; smooth on its axes.

    Parameters
    ----------
    radii : (n,) float64
        Ascending [m];  sectors : elements over the quarter.

    Returns
    -------
    types.SimpleNamespace
        As :func:`box_mesh`, and `inner`, `outer`: nodes on the two arcs. Only x = 0 is in a list that the solver holds;
        hold `on_axis` (y = 0) vertically.
    """
    radii = np.asarray(radii, float)
    rings = len(radii)
    mesh = box_mesh(np.linspace(0, 1, sectors + 1), np.arange(rings) - rings - 1.0, fixed_bottom=False)
    corners = mesh.nodes[: rings * (sectors + 1)]
    angle = np.pi / 2 * corners[:, 0]
    ring = np.round(corners[:, 1] - corners[0, 1]).astype(int)
    corners = np.column_stack([radii[ring] * np.sin(angle), -radii[ring] * np.cos(angle)])
    corners[np.abs(corners) < 1e-12 * radii[-1]] = 0.0
    # the map turns the sense of the corners
    mesh.nodes, elements = crossed(corners, mesh.elements[:, 0].reshape(-1, 4)[:, ::-1])
    mesh.elements = elements.astype(np.int32)
    mesh.inner = np.flatnonzero(ring == 0)
    mesh.outer = np.flatnonzero(ring == rings - 1)
    mesh.on_axis, mesh.right, mesh.top = mesh.right, mesh.right[:0], mesh.right[:0]
    return mesh


def state(solver, *names):
    """State of all points by `mpm.fields`: a copy, (n_points,) of one name, (n_points, n_names) of several."""
    return solver.points[names[0]].copy() if len(names) == 1 else values(solver.points, names)


def put(solver, **state):
    """Set the state of all points: names of `mpm.fields` to numbers or (n_points,) arrays."""
    for name, value in state.items():
        solver.points[name] = value


def clear_stress(solver, pore_pressure=0.0):
    """No effective stress, and one pore pressure [Pa] at all points."""
    put(solver, **dict.fromkeys(STRESS, 0.0), pore_pressure=pore_pressure)


def set_porosity(solver, porosity):
    """Thin the grains of all points out to a porosity, in the volume that they have."""
    share = (1 - porosity) / (1 - state(solver, "porosity"))
    put(solver, grain_mass=state(solver, "grain_mass") * share, porosity=porosity)


def hold(solver, nodes, x=None, y=None):
    """Hold components of nodes (True), let them go (False), or leave them as they are."""
    for held, bit in ((x, FIXED_X), (y, FIXED_Y)):
        if held is not None:
            solver.fixed[nodes] = solver.fixed[nodes] | bit if held else solver.fixed[nodes] & ~bit


def inside(solver):
    """Which points are in the mesh: (n_points,) bool."""
    return solver.element_of_point >= 0


def volumes(solver):
    """Volume of every point [m2]."""
    density = np.array([soil.grain_density for soil in solver.scene.soils])[solver.soil_of_point]
    return state(solver, "grain_mass") / (density * (1 - state(solver, "porosity")))


def hat_functions(solver):
    """Values of the three hat functions of its element at every point in the mesh: (n_inside, 3)."""
    here = inside(solver)
    g = solver.geometry[solver.element_of_point[here]]
    dx, dy = state(solver, "x")[here] - g["x"], state(solver, "y")[here] - g["y"]
    first, second = g["dn1_dx"] * dx + g["dn1_dy"] * dy, g["dn2_dx"] * dx + g["dn2_dy"] * dy
    return np.column_stack([1 - first - second, first, second])


def place(solver, positions, seed, off=0.0):
    """Move every point of a solver within its element.

    positions : "layout" leaves points where they are; "random"; "edges"; "vertices": a share `off` away from one.
    """
    if positions == "layout":
        return
    rng, count = np.random.default_rng(seed), len(solver.points)
    if positions == "random":
        weight = rng.dirichlet([1.0, 1.0, 1.0], count)
    else:
        weight, rows, k = np.full((count, 3), off), np.arange(count), rng.integers(3, size=count)
        along = rng.uniform(0.1, 0.9, count) if positions == "edges" else np.ones(count)
        weight[rows, k] = along
        if positions == "edges":
            weight[rows, (k + 1) % 3] = 1 - along
        weight /= weight.sum(axis=1)[:, None]
    corners = solver.mesh.nodes[solver.mesh.elements[solver.element_of_point]]
    x, y = np.einsum("pk,pkd->dp", weight, corners)
    put(solver, x=x, y=y)


def run_to(solver, end, before=None, after=None, longest=np.inf):
    """Step to a time [s]; processor seconds that this took.

    before : called without arguments ahead of each step;  after : called with the step [s] when it is done;  longest :
    step [s].
    """
    begin = clock.process_time()
    while solver.time < end * (1 - 1e-12):
        if before is not None:
            before()
        dt, _ = solver.step(min(end - solver.time, longest))
        if after is not None:
            after(dt)
    return clock.process_time() - begin
