"""The largest eigenfrequency of the points on their mesh, and the critical time step that follows from it.

With nodal velocities u of both phases, a FLIP step of a resting, elastic state multiplies stresses and velocities so
that, for every mode with stiffness k, mass m and drag c (implicit), z obeys (m + dt c) (z - 1)^2 + .. = 0, or
    (m + dt c) z^2 - (2 m + dt c - dt^2 k) z + m = 0,
whose roots leave the unit circle at z = -1, that is where dt^2 k = 4 m + 2 dt c. So the critical step is
dt = 2 / sqrt(lambda) with the largest eigenvalue lambda of the stiffness over the mass plus dt/2 times the drag.
The stiffness holds what the kernels hold: element strains, pore water; the mass is that of the nodes, twice, with the
points between (velocities return to the nodes through them, MUSL), which takes the shortest waves of consistent-mass
kind away. Altitude over wave speed knows none of this.

With local time stepping the step of level 0 is sought for which the same holds when the stiffness of every element is
multiplied by the square of its own step over that of level 0, and the drag of a node by the step of its finest level.
Where the stress that acts runs ahead by a share a of a step, dt^2 k (1 + 2 a) = 4 m: a damping of a dt k, explicit.

With a share s of PIC velocities are multiplied by g = 1 - s + s f in a step, where 0 <= f <= 1 is what the way
through the points leaves of the mode; then dt^2 k = 2 (1 + g) m, and dt sqrt(1 - s/2) is not above any of these.
"""

import math
from functools import cache

import numpy as np

from mpm.time_step.krylov import CORNER_PAIRS, KRYLOV, NODAL_RECORD, STIFFNESS_RECORD, Operator, krylov_kernel

SAFETY = 0.9  # Ritz values come from below, and points move until the next estimate
TOLERANCE = 1e-2  # of the largest eigenvalue
MOST_RESTARTS = 40  # with the best mode of the vectors so far
ROUNDS = 3  # of the step that the drag depends on, from below, at the first call


class Spectrum:
    """Largest eigenvalue of a solver's state; the arrays for it are kept for the next state.

    Parameters
    ----------
    solver : mpm.solver.Solver
        All its points count as stiff, and as under pressure: what is loose may close, what is slack may fill.
    """

    def __init__(self, solver):
        mesh, levels, parts = solver.mesh, solver.levels, solver.parts
        n_nodes = len(mesh.nodes)
        self.solver, self.wet = solver, solver.scene.is_two_phase
        self.shape = n_nodes, 4 if self.wet else 2
        self.operator = Operator(
            elements=mesh.elements,
            geometry=solver.geometry,
            contents=solver.contents,
            stiffened=levels.stiffened(solver.scene.numerics.stress_damping),
            fixed=solver.fixed,
            step_of_node=2.0 ** levels.of_row[:n_nodes],
            stiffness=np.zeros(len(mesh.elements), STIFFNESS_RECORD),
            masses=np.zeros((len(mesh.elements), 2, CORNER_PAIRS)),
            nodal=np.zeros(n_nodes, NODAL_RECORD),
            free=np.zeros((n_nodes, 4), bool),
            element_cuts=np.zeros(parts + 1, np.int64),
            node_cuts=np.linspace(0, n_nodes, parts + 1).astype(np.int64),
            at_nodes=np.zeros((parts, n_nodes, 4)),
            acceleration=np.zeros(self.shape),
            dots=np.zeros((parts, KRYLOV + 1)),
        )
        self.basis = np.zeros((KRYLOV + 1, *self.shape))
        self._fresh = True

    @property
    def arrays(self):
        """All arrays that were made for it."""
        shared = {"elements", "geometry", "contents", "stiffened", "fixed"}
        own = [value for name, value in self.operator._asdict().items() if name not in shared]
        return [self.basis, *(value for value in own if isinstance(value, np.ndarray))]

    def of_state(self):
        """The same for the state of the solver as it is now."""
        self.operator.element_cuts[:] = np.linspace(0, self.solver.n_occupied, self.solver.parts + 1)
        self._fresh = True
        return self

    def _krylov(self, dt, start):
        """Ritz values [1/s2], their vectors in the basis, and how far each is from an eigenvalue [1/s2]."""
        self.basis[0] = start.reshape(self.shape) / _norm(start)
        hessenberg, s = np.zeros((KRYLOV + 1, KRYLOV)), self.solver
        s.workers.together(
            krylov_kernel(s.needs), self._fresh, s.ground, s.medium, self.operator, 0.5 * dt, self.basis, hessenberg
        )
        self._fresh = False
        size = next((k for k in range(1, KRYLOV) if hessenberg[k, k - 1] == 0.0), KRYLOV)
        values, vectors = np.linalg.eig(hessenberg[:size, :size])
        return values, vectors, np.abs(hessenberg[size, size - 1] * vectors[-1])

    def largest(self, dt, start=None):
        """Largest eigenvalue [1/s2] with drag over dt [s], and its mode; start: a guess of the mode."""
        # alone, a mode does not feel another that has grown where it is zero
        anywhere = _anywhere(self.basis[0].size)
        start = anywhere if start is None else start / _norm(start) + anywhere
        for _ in range(MOST_RESTARTS):
            values, vectors, error = self._krylov(dt, start)
            best = int(np.argmax(np.abs(values)))
            value = float(np.abs(values[best]))
            if value == 0.0:
                return 0.0, None
            # einsum, no dot products: those of BLAS depend on its number of threads in the last bits
            mode = np.einsum("k,kix->ix", np.real(vectors[:, best]), self.basis[: len(vectors)]).ravel()
            if error[best] <= TOLERANCE * value:
                return value, mode
            start = mode
        return math.inf, None


@cache
def _anywhere(size):
    """A unit vector that no mode is at right angles to."""
    vector = np.random.default_rng(0).standard_normal(size)
    return vector / _norm(vector)


def _norm(vector):
    return float(np.sqrt(np.sum(vector**2)))


def spectral_time_step(spectrum, shortest, start=None):
    """Critical time step from the largest eigenvalue.

    Parameters
    ----------
    spectrum : Spectrum
        Of the state.
    shortest : float
        A time step that is certainly not above the critical one [s]; the nearer, the sharper the drag.
    start : (k,) float64 or None
        Mode of an earlier call, whose step `shortest` then comes from: one round will do.

    Returns
    -------
    dt : float
        [s], `shortest` where the eigenvalue was not found.
    mode : (k,) float64 or None
    """
    solver, dt = spectrum.solver, shortest
    for _ in range(ROUNDS if spectrum.wet and start is None else 1):
        value, start = spectrum.largest(dt, start)
        if not 0 < value < math.inf:
            return shortest, None
        dt = 2.0 / math.sqrt(value)
    longest = dt * 2.0 ** (solver.levels.count - 1)
    pic_share = -math.expm1(-solver.scene.numerics.pic_rate * longest)
    return SAFETY * math.sqrt(1 - 0.5 * pic_share) * dt, start
