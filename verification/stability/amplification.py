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
from dataclasses import asdict, dataclass

import numpy as np

from mpm.fields import block, numbers
from mpm.scene import Numerics
from mpm.solver import Solver
from mpm.step.substep import ADVANCE, PLAN, REMAP, SOLVE, UPDATE
from mpm.time_step.spectrum import Spectrum, spectral_time_step
from verification.boxes import box_mesh, box_scene, hat_functions, place, put, state

DEFAULT = Numerics()

# Excess of the spectral radius over 1 that ends stability. At the limit a pair of eigenvalues splits at -1, and one per
# cent further the excess is above 0.1. What grows by less is not hidden: `critical_map` keeps it as `excess`.
STABLE = 1e-2
SCANNED = (0.1, 0.3, 0.5, 0.7, 0.85, 1.0, 1.1, 1.2, 1.4, 2.0, 4.0)  # steps looked at, over the spectral one
ARRAYS = ("points", "nodes", "element_of_point", "start", "order", "occupied", "contents")  # state of a solver
SMALL = 1e-6  # speed of a perturbation over the wave speed: what it moves is nothing beside an element


@dataclass(frozen=True)
class Column:
    """A column of saturated elastic soil, two cells wide, walls left and right, held at the bottom, free on top.

    Its geometry: `size`, height of a cell [m]; `aspect`, width over height; `cells` over the height; `points` an
    element; `positions`, as of `verification.boxes.place`, and `seed`; `skew`, largest shift of the inner nodes over
    the cell. The others are those of `mpm.scene`; a bulk modulus of None is dry.
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
        geometry = ("size", "aspect", "cells", "positions", "seed", "skew")
        settings = {name: value for name, value in asdict(self).items() if name not in geometry}
        return box_scene(
            "column", self.size, 2 * self.size * self.aspect, self.cells * self.size, model="elastic",
            loose_porosity=0.9, courant=1.0, critical_step="altitude", local_time_stepping=False, **settings,
        )  # fmt: skip

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
        self._run(REMAP, UPDATE)
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
        place(solver, column.positions, column.seed, off=1e-4)
        put(solver, stress_xx=0.0, stress_yy=0.0, stress_xy=0.0)
        self._wet = column.bulk_modulus is not None
        speed = solver.wave_speed * SMALL
        stress = speed * solver.wave_speed * 2000.0
        put(solver, pore_pressure=10 * stress * self._wet)  # positive, whatever is added
        solver.limit_speed = solver.wave_speed
        self.altitude = solver.time_step_estimate()[0]
        self.spectral, _ = spectral_time_step(Spectrum(solver).of_state(), 0.5 * self.altitude)
        self._start = {name: getattr(solver, name).copy() for name in ARRAYS}
        self._spaces = self._bases(speed, stress)
        self.leak = 0.0

    @property
    def size(self):
        """Number of degrees of freedom."""
        return sum(basis.shape[1] for _, basis, _ in self._spaces)

    def matrix(self, dt):
        """Amplification matrix of a step of dt [s]: (size, size) float64."""
        rest, columns = self._stepped({}, dt), []
        for k, (_, basis, scale) in enumerate(self._spaces):
            for shape in basis.T:
                change, column = self._stepped({k: scale * shape}, dt), []
                for now, then, (_, b, s) in zip(change, rest, self._spaces, strict=True):
                    c = (now - then) / s
                    column.append(b.T @ c)
                    self.leak = max(self.leak, float(np.linalg.norm(c - b @ column[-1]) / max(np.linalg.norm(c), 1e-3)))
                columns.append(np.concatenate(column))
        return np.stack(columns, axis=1)

    def step(self, perturbation, dt):
        """State after one step of the solver itself from the rest state plus `perturbation`: (size,) float64."""
        rest = self._stepped({}, dt)
        parts = np.split(perturbation, np.cumsum([basis.shape[1] for _, basis, _ in self._spaces])[:-1])
        begin = {k: s * b @ part for k, ((_, b, s), part) in enumerate(zip(self._spaces, parts, strict=True))}
        change = zip(self._stepped(begin, dt), rest, self._spaces, strict=True)
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
        """Invariant space: (name of the points' variable, orthonormal basis, scale) a field."""
        solver = self.solver
        element, weights = solver.element_of_point, hat_functions(solver)
        hats = np.zeros((len(element), len(solver.mesh.nodes)))
        for k in range(3):
            np.add.at(hats, (np.arange(len(element)), solver.mesh.elements[element, k]), weights[:, k])
        steps = (element[:, None] == np.arange(len(solver.geometry))).astype(float)
        slopes = np.hstack([steps * weights[:, 1:2], steps * weights[:, 2:]])
        hats, steps, linear = (_orthonormal(a) for a in (hats, steps, np.hstack([steps, slopes])))
        phases = ("solid", "liquid") if self._wet else ("solid",)
        spaces = [(f"velocity_{phase}_{axis}", hats, speed) for phase in phases for axis in "xy"]
        spaces += [(f"stress_{part}", steps, stress) for part in ("xx", "yy", "xy")]
        return [*spaces, ("pore_pressure", linear, stress)] if self._wet else spaces

    def _stepped(self, changes, dt):
        """Fields of the spaces a step after the rest state with changes, number of the space to (n_points,)."""
        solver = self.solver
        for name, values in self._start.items():
            getattr(solver, name)[...] = values
        solver.time, solver.step_count, solver.long_step_count = 0.0, 0, 0
        for k, values in changes.items():
            name = self._spaces[k][0]
            put(solver, **{name: state(solver, name) + values})
        solver.step_of(dt)
        return [state(solver, name) for name, _, _ in self._spaces]


def _orthonormal(vectors):
    u, s, _ = np.linalg.svd(vectors, full_matrices=False)
    return u[:, s > 1e-9 * s[0]]
