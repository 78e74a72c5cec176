"""The exact one-step amplification matrix of a small column of the real solver, and its critical time step.

A step is affine in the state about a rest state as long as points stay in their elements, soils are elastic and
pore pressures positive. So differences of steps from perturbed states are the columns of the matrix. A step adds to
a point only what nodes and elements carry; therefore a small space is invariant, and what lies outside of it keeps
its value or shrinks: velocities interpolated from the nodes, stresses constant in an element, pressures linear in it.
The matrix is formed on that space, and `Amplification.leak` measures how invariant it was. Its step begins where points
have new velocities and not yet the stresses of them: there the points are all of the state, also where the stress that
acts runs ahead of theirs.
"""

import math
from dataclasses import dataclass

import numpy as np

from mpm.fields import (
    block,
    numbers,
    values,
)
from mpm.pace.spectrum import Spectrum, spectral_time_step
from mpm.scene import Numerics, Scene
from mpm.solver import Solver
from mpm.step.substep import ADVANCE, FOLLOW, PLAN, REMAP, SOLVE
from verification.problems.boxes import box_mesh

DEFAULT = Numerics()

# Excess of the spectral radius over 1 that ends stability. At the limit a pair of eigenvalues splits at -1, and one per
# cent further the excess is above 0.1. What grows by less is not hidden: `critical_map` keeps it as `excess`.
STABLE = 1e-2
SCANNED = (0.1, 0.3, 0.5, 0.7, 0.85, 1.0, 1.1, 1.2, 1.4, 2.0, 4.0)  # steps looked at, over the spectral one
SMALL = 1e-6  # speed of a perturbation over the wave speed: what it moves is nothing beside an element


@dataclass(frozen=True)
class Column:
    """A column of saturated elastic soil, two cells wide, walls left and right, held at the bottom, free on top.

    Parameters
    ----------
    bulk_modulus : float or None
        Of the water [Pa]; None: dry.
    hydraulic_conductivity : float
        [m/s]
    youngs_modulus : float
        [Pa]
    porosity : float
        [-]
    size : float
        Height of a cell [m].
    aspect : float
        Width of a cell over its height [-].
    cells : int
        Over the height.
    points : int
        Per element.
    positions : str
        "layout", as the program places them; "random"; "edges"; "vertices": within 1e-4 of one.
    seed : int
        Of random positions.
    skew : float
        Largest shift of the inner nodes over the cell [-].
    drainage
        As in `mpm.scene.Water`.
    pic_rate, pressure_filter, stress_damping
        As in `mpm.scene.Numerics`.
    """

    bulk_modulus: float | None = 8e7
    hydraulic_conductivity: float = 1e-4
    youngs_modulus: float = 4e7
    porosity: float = 0.45
    size: float = 0.1
    aspect: float = 1.0
    cells: int = 4
    points: int = 3
    positions: str = "layout"
    seed: int = 0
    skew: float = 0.0
    pic_rate: float = DEFAULT.pic_rate
    pressure_filter: float = DEFAULT.pressure_filter
    stress_damping: float = DEFAULT.stress_damping
    poissons_ratio: float = 0.3
    drainage: str = "two-phase"

    def scene(self):
        """The scene of the column."""
        width, height = 2 * self.size * self.aspect, self.cells * self.size
        size = {f"element_size{part}": self.size for part in ("", "_lining", "_interior")}
        wet = self.bulk_modulus is not None
        water = {
            "table_depth": 0.0, "density": 1000.0, "bulk_modulus": self.bulk_modulus, "drainage": self.drainage,
        } if wet else None  # fmt: skip
        return Scene.model_validate({
            "name": "column",
            "box": {"width": width, "depth": height},
            "water": water,
            "soils": [{
                "name": "soil", "top_depth": 0.0, "model": "elastic", "youngs_modulus": self.youngs_modulus,
                "poissons_ratio": self.poissons_ratio, "cohesion": 0.0, "friction_angle": 30.0, "dilatancy_angle": 0.0,
                "porosity": self.porosity, "loose_porosity": 0.9, "grain_density": 2650.0,
                "hydraulic_conductivity": self.hydraulic_conductivity, "k0": 0.5,
            }],
            "discretisation": {**size, "gate_radius": self.size, "points_per_element": self.points},
            "numerics": {
                "courant": 1.0, "pic_rate": self.pic_rate, "pressure_filter": self.pressure_filter,
                "stress_damping": self.stress_damping, "critical_step": "altitude", "local_time_stepping": False,
            },
            "stop": {"time": 1.0},
            "output": {"interval": 1.0},
        })  # fmt: skip

    def mesh(self):
        """Crossed triangles, inner nodes shifted by up to `skew`."""
        rng = np.random.default_rng(self.seed)
        x = (np.arange(3) - 1) * self.size * self.aspect
        y = (np.arange(self.cells + 1) - self.cells) * self.size
        mesh = box_mesh(x, y)
        shift = rng.uniform(-self.skew, self.skew, mesh.nodes.shape) * self.size * np.array([self.aspect, 1.0])
        shift[np.concatenate([mesh.left, mesh.right]), 0] = 0.0
        shift[np.concatenate([mesh.bottom, mesh.top]), 1] = 0.0
        mesh.nodes += shift
        return mesh


class SteppedAt(Solver):
    """The solver, with steps of a length that is asked for instead of the length that its limit allows."""

    def step_of(self, dt):
        """Advance by dt [s], whatever the critical time step: from where points have moved to where they have again."""
        self.map_points()
        numbers(self.momenta)[:] = block(self.sums, "momentum_solid_x", "momentum_liquid_y")
        held = self.nodal_sums()
        self.nodes["mass_solid"], self.nodes["mass_liquid"] = held["mass_solid"], held["mass_liquid"]
        if self.scene.is_undrained:
            self.nodes["mass_solid"] += held["mass_pore_liquid"]
        self.status[:] = 0
        self._limits[:], self.longest_step = (dt, 0.0), math.inf
        return self.step()

    def _advance(self, batch):
        self._run(PLAN, PLAN, batch)
        self._run(REMAP, FOLLOW)
        self._run(SOLVE, ADVANCE)


class Amplification:
    """Amplification matrices of a column, one a time step.

    Parameters
    ----------
    column : Column

    Attributes
    ----------
    altitude, spectral : float
        Critical time step [s] by the program's two ways: its time step at Courant number 1.
    leak : float
        Largest share of a step's result that left the space of the matrix: round-off.
    """

    def __init__(self, column):
        self.column = column
        self.solver = solver = SteppedAt(column.scene(), column.mesh(), threads=1)
        if column.positions != "layout":
            block(solver.points, "x", "y")[:] = _placed(solver, column)
        solver.points[["stress_xx", "stress_yy", "stress_xy"]] = 0.0
        self._wet = column.bulk_modulus is not None
        speed = solver.wave_speed * SMALL
        stress = speed * solver.wave_speed * 2000.0
        solver.points["pore_pressure"] = 10 * stress if self._wet else 0.0  # positive, whatever is added
        solver.limit_speed = solver.wave_speed
        self.altitude = solver.time_step_estimate()[0]
        self.spectral, _ = spectral_time_step(Spectrum(solver).of_state(), 0.5 * self.altitude)
        self._start = _copied(solver)
        self._spaces = self._bases(speed, stress)
        self.leak = 0.0

    @property
    def size(self):
        """Number of degrees of freedom."""
        return sum(basis.shape[1] for _, basis, _ in self._spaces)

    def matrix(self, dt):
        """Amplification matrix of a step of dt [s]: (size, size) float64."""
        self._set({})
        self.solver.step_of(dt)
        rest = self._get()
        columns = []
        for k, (_, basis, scale) in enumerate(self._spaces):
            for shape in basis.T:
                self._set({k: scale * shape})
                self.solver.step_of(dt)
                change = [(now - then) for now, then in zip(self._get(), rest, strict=True)]
                columns.append(np.concatenate([
                    b.T @ (c / s) for c, (_, b, s) in zip(change, self._spaces, strict=True)
                ]))  # fmt: skip
                for c, (_, b, s) in zip(change, self._spaces, strict=True):
                    c = c / s
                    self.leak = max(self.leak, float(np.linalg.norm(c - b @ (b.T @ c)) / max(np.linalg.norm(c), 1e-3)))
        return np.stack(columns, axis=1)

    def step(self, state, dt):
        """State after one step of the solver itself from the rest state plus `state`: (size,) float64."""
        self._set({})
        self.solver.step_of(dt)
        rest = self._get()
        parts = np.split(state, np.cumsum([basis.shape[1] for _, basis, _ in self._spaces])[:-1])
        self._set({k: s * b @ part for k, ((_, b, s), part) in enumerate(zip(self._spaces, parts, strict=True))})
        self.solver.step_of(dt)
        change = zip(self._get(), rest, self._spaces, strict=True)
        return np.concatenate([b.T @ ((now - then) / s) for now, then, (_, b, s) in change])

    def spectral_radius(self, dt):
        """Largest modulus of the eigenvalues at time step dt [s]."""
        return float(np.abs(np.linalg.eigvals(self.matrix(dt))).max())

    def critical_time_step(self, accuracy=0.005):
        """Largest time step [s] up to which no mode grows: the first crossing above the steps scanned, bisected.

        accuracy : of the bisection, relative. Infinite where nothing grows up to `SCANNED[-1]` times the spectral step.
        """
        low = 0.0
        for courant in SCANNED:
            if self.spectral_radius(courant * self.spectral) > 1 + STABLE:
                high = courant
                break
            low = courant
        else:
            return math.inf
        while high - low > accuracy * high:
            middle = 0.5 * (low + high)
            if self.spectral_radius(middle * self.spectral) > 1 + STABLE:
                high = middle
            else:
                low = middle
        return low * self.spectral

    def _bases(self, speed, stress):
        """Invariant space: (column of the points, orthonormal basis, scale) a field."""
        solver = self.solver
        element, geometry = solver.element_of_point, solver.geometry[solver.element_of_point]
        d = values(solver.points, ("x", "y")) - values(geometry, ("x", "y"))
        n1 = geometry["dn1_dx"] * d[:, 0] + geometry["dn1_dy"] * d[:, 1]
        n2 = geometry["dn2_dx"] * d[:, 0] + geometry["dn2_dy"] * d[:, 1]
        hats = np.zeros((len(d), len(solver.mesh.nodes)))
        for k, weight in enumerate((1 - n1 - n2, n1, n2)):
            np.add.at(hats, (np.arange(len(d)), solver.mesh.elements[element, k]), weight)
        steps = (element[:, None] == np.arange(len(solver.geometry))).astype(float)
        slopes = np.hstack([steps * n1[:, None], steps * n2[:, None]])
        hats, steps, linear = (_orthonormal(a) for a in (hats, steps, np.hstack([steps, slopes])))
        velocities = (
            ("velocity_solid_x", "velocity_solid_y", "velocity_liquid_x", "velocity_liquid_y")
            if self._wet
            else ("velocity_solid_x", "velocity_solid_y")
        )
        spaces = [(k, hats, speed) for k in velocities]
        spaces += [(k, steps, stress) for k in ("stress_xx", "stress_yy", "stress_xy")]
        if self._wet:
            spaces.append(("pore_pressure", linear, stress))
        return spaces

    def _set(self, changes):
        _restore(self.solver, self._start)
        for k, change in changes.items():
            self.solver.points[self._spaces[k][0]] += change

    def _get(self):
        return [self.solver.points[column].copy() for column, _, _ in self._spaces]


ARRAYS = ("points", "nodes", "element_of_point", "start", "order", "occupied", "contents")


def _copied(solver):
    return {name: getattr(solver, name).copy() for name in ARRAYS}


def _restore(solver, arrays):
    for name, kept in arrays.items():
        getattr(solver, name)[...] = kept
    solver.time, solver.step_count, solver.long_step_count = 0.0, 0, 0


def _orthonormal(vectors):
    u, s, _ = np.linalg.svd(vectors, full_matrices=False)
    return u[:, s > 1e-9 * s[0]]


def _placed(solver, column):
    """Other positions of the points, each in its element: (n_points, 2) [m]."""
    rng = np.random.default_rng(column.seed)
    count = len(solver.points)
    if column.positions == "random":
        weight = rng.dirichlet([1.0, 1.0, 1.0], count)
    else:
        weight = np.full((count, 3), 1e-4)
        k = rng.integers(3, size=count)
        if column.positions == "edges":
            along = rng.uniform(0.1, 0.9, count)
            weight[np.arange(count), (k + 1) % 3] = along
            weight[np.arange(count), (k + 2) % 3] = 1 - along
        else:
            weight[np.arange(count), k] = 1.0
        weight /= weight.sum(axis=1)[:, None]
    corners = solver.mesh.nodes[solver.mesh.elements[solver.element_of_point]]
    return np.einsum("pk,pkd->pd", weight, corners)
