"""The largest eigenfrequency of the points on their mesh, and the critical time step that follows from it.

With nodal velocities u of both phases, a FLIP step of a resting, elastic state multiplies stresses and velocities so
that, for every mode with stiffness k, mass m and drag c (implicit), z obeys (m + dt c) (z - 1)^2 + .. = 0, or
    (m + dt c) z^2 - (2 m + dt c - dt^2 k) z + m = 0,
whose roots leave the unit circle at z = -1, that is where dt^2 k = 4 m + 2 dt c. So the critical step is
dt = 2 / sqrt(lambda) with the largest eigenvalue lambda of the stiffness over the mass plus dt/2 times the drag.
The stiffness holds what the kernels hold: mean volume changes, element strains, pore water; the mass is that of the
nodes, twice, with the points between (velocities return to the nodes through them, MUSL), which takes the shortest
waves of consistent-mass kind away. Altitude over wave speed knows none of this.

With local time stepping the step of level 0 is sought for which the same holds when the stiffness of every element is
multiplied by the square of its own step over that of level 0, and the drag of a node by the step of its finest level.
Where the stress that acts runs ahead by a share a of a step, dt^2 k (1 + 2 a) = 4 m: a damping of a dt k, explicit.

With a share s of PIC velocities are multiplied by g = 1 - s + s f in a step, where 0 <= f <= 1 is what the way
through the points leaves of the mode; then dt^2 k = 2 (1 + g) m, and dt sqrt(1 - s/2) is not above any of these.
"""

import math

import numpy as np

from mpm.contact import FIXED_X, FIXED_Y, free_pair
from mpm.jit import kernel
from mpm.transfer import spread_volume
from mpm.variables import MASS, S_DRAG, S_G, S_LAMBDA, S_RHO_S, S_SIN_DIL, N, X, Y

SAFETY = 0.9  # Ritz values come from below, and points move until the next estimate
TOLERANCE = 1e-2  # of the largest eigenvalue
KRYLOV = 10  # vectors: from a wrong mode within 0.4 % of the step that many more give
ROUNDS = 3  # of the step that the drag depends on, from below, at the first call

# What an element sums over its points: volume, the share that takes its own rates, moduli and water's stiffness times
# volume, its volume as spread over what is around over its own, and the upper triangles of the consistent masses of
# grains and of water, row by row.
(E_V, E_OWN, E_LAMBDA, E_G, E_QS, E_QL, E_SPREAD) = range(7)
E_GRAINS, E_WATER, ELEMENT_WIDTH = 7, 13, 19


@kernel
def sum_points(
    occupied, start, order, points, soil_of_point, soils, density_liquid, bulk_liquid, elements, rows, geometry,
    stiffened, held, nodal, row_volume,
):  # fmt: skip
    """Sum the points in their elements and at the nodes.

    stiffened : (n_elements,) float64
        Factor of the stiffness of an element.
    held : (n_occupied, 19) float64
        Written: see the columns `E_`.
    nodal : (n_nodes, 4) float64
        Added: masses of grains, of water as if it filled all, of pore water [kg/m]; drag [kg/m/s].
    row_volume : (n_rows,) float64
        Added: volume of the elements around [m2].
    """
    for k in range(occupied.size):
        e = occupied[k]
        held[k] = 0.0
        for j in range(start[e], start[e + 1]):
            i = order[j]
            s = soil_of_point[i]
            dx, dy = points[i, X] - geometry[e, 4], points[i, Y] - geometry[e, 5]
            n1, n2 = geometry[e, 0] * dx + geometry[e, 1] * dy, geometry[e, 2] * dx + geometry[e, 3] * dy
            weight = (1.0 - n1 - n2, n1, n2)
            mass, n = points[i, MASS], points[i, N]
            volume = mass / (soils[s, S_RHO_S] * (1.0 - n))
            water = volume * density_liquid
            stiff = volume * stiffened[e]
            held[k, E_V] += volume
            if soils[s, S_SIN_DIL] > 0.0:
                held[k, E_OWN] += volume
            held[k, E_LAMBDA] += stiff * soils[s, S_LAMBDA]
            held[k, E_G] += stiff * soils[s, S_G]
            held[k, E_QS] += stiff * bulk_liquid * (1.0 - n) / n
            held[k, E_QL] += stiff * bulk_liquid
            column = 0
            for a in range(3):
                for b in range(a, 3):
                    held[k, E_GRAINS + column] += mass * weight[a] * weight[b]
                    held[k, E_WATER + column] += water * weight[a] * weight[b]
                    column += 1
                c = elements[e, a]
                nodal[c, 0] += weight[a] * mass
                nodal[c, 1] += weight[a] * water
                nodal[c, 2] += weight[a] * n * water
                nodal[c, 3] += weight[a] * n * water * soils[s, S_DRAG]
        held[k, E_OWN] /= held[k, E_V]
        for a in range(3):
            row_volume[rows[e, a]] += held[k, E_V]


@kernel
def spread_elements(occupied, rows, geometry, fill, held, row_spread):
    """Spread the volumes of the elements as the step does (:func:`mpm.transfer.spread_volume`); sums them at the rows.

    fill, row_spread : (n_rows,) float64
        Volume over area of the elements around a row; added: spread volumes [m2].
    """
    for k in range(occupied.size):
        e = occupied[k]
        a, b, c = rows[e, 0], rows[e, 1], rows[e, 2]
        spread = spread_volume(held[k, E_V], geometry[e, 6], fill[a], fill[b], fill[c])
        held[k, E_SPREAD] = spread / held[k, E_V]
        row_spread[a] += spread
        row_spread[b] += spread
        row_spread[c] += spread


@kernel
def sum_divergences(occupied, elements, rows, geometry, held, velocity, divergence):
    """Add the divergences of the grains and of the water relative to them, times volumes, to rows: (n_rows, 2)."""
    wet = velocity.shape[1] == 4
    for k in range(occupied.size):
        e = occupied[k]
        a, b, c = elements[e, 0], elements[e, 1], elements[e, 2]
        before, weight = 0.0, held[k, E_V]
        for phase in range(2 if wet else 1):
            x, y = 2 * phase, 2 * phase + 1
            rate = geometry[e, 0] * (velocity[b, x] - velocity[a, x]) + geometry[e, 2] * (
                velocity[c, x] - velocity[a, x]
            )
            rate += geometry[e, 1] * (velocity[b, y] - velocity[a, y]) + geometry[e, 3] * (
                velocity[c, y] - velocity[a, y]
            )
            for corner in range(3):
                divergence[rows[e, corner], phase] += weight * (rate - before)
            before, weight = rate, held[k, E_V] * held[k, E_SPREAD]


@kernel
def sum_forces(occupied, elements, rows, geometry, held, velocity, smoothing, divergence, force):
    """Add the forces of the stresses that `velocity` builds in a second to the nodes.

    divergence : (n_rows, 2) float64
        Means at the rows, of the grains and of the water relative to them; used where `smoothing`.
    force : (n_nodes, 4) float64
        Of the mixture, and of the pore pressure on the water.
    """
    wet = velocity.shape[1] == 4
    third = 1.0 / 3.0
    for k in range(occupied.size):
        e = occupied[k]
        a, b, c = elements[e, 0], elements[e, 1], elements[e, 2]
        g1x, g1y, g2x, g2y = geometry[e, 0], geometry[e, 1], geometry[e, 2], geometry[e, 3]
        ux1, ux2 = velocity[b, 0] - velocity[a, 0], velocity[c, 0] - velocity[a, 0]
        uy1, uy2 = velocity[b, 1] - velocity[a, 1], velocity[c, 1] - velocity[a, 1]
        xx, yy = g1x * ux1 + g2x * ux2, g1y * uy1 + g2y * uy2
        xy = 0.5 * (g1y * ux1 + g2y * ux2 + g1x * uy1 + g2x * uy2)
        own = volume = xx + yy
        liquid = 0.0
        if wet:
            liquid = g1x * (velocity[b, 2] - velocity[a, 2]) + g2x * (velocity[c, 2] - velocity[a, 2])
            liquid += g1y * (velocity[b, 3] - velocity[a, 3]) + g2y * (velocity[c, 3] - velocity[a, 3])
        if smoothing:
            r, s, t = rows[e, 0], rows[e, 1], rows[e, 2]
            volume = third * (divergence[r, 0] + divergence[s, 0] + divergence[t, 0])
            liquid = volume + third * (divergence[r, 1] + divergence[s, 1] + divergence[t, 1])
        skeleton = volume + held[k, E_OWN] * (own - volume)
        correction = 0.5 * (skeleton - own)
        pressure = -(held[k, E_QS] * volume + held[k, E_QL] * liquid) if wet else 0.0
        sxx = held[k, E_LAMBDA] * skeleton + 2.0 * held[k, E_G] * (xx + correction) - pressure
        syy = held[k, E_LAMBDA] * skeleton + 2.0 * held[k, E_G] * (yy + correction) - pressure
        sxy = 2.0 * held[k, E_G] * xy
        if smoothing:
            pressure *= held[k, E_SPREAD]
        for corner in range(3):
            if corner == 0:
                i, gx, gy = a, -g1x - g2x, -g1y - g2y
            elif corner == 1:
                i, gx, gy = b, g1x, g1y
            else:
                i, gx, gy = c, g2x, g2y
            force[i, 0] -= gx * sxx + gy * sxy
            force[i, 1] -= gx * sxy + gy * syy
            force[i, 2] += gx * pressure
            force[i, 3] += gy * pressure


@kernel
def accelerate_nodes(force, nodal, drag_time, free, acceleration):
    """Accelerations of both phases from the forces at the nodes; those that are not free keep theirs at zero.

    drag_time : (n_nodes,) float64
        Time over which the implicit drag acts [s].
    """
    wet = acceleration.shape[1] == 4
    for i in range(len(force)):
        for axis in range(2):
            if free[i, axis] and wet:
                acceleration[i, axis], acceleration[i, axis + 2] = free_pair(
                    force[i, axis],
                    force[i, axis + 2],
                    nodal[i, 0],
                    nodal[i, 1],
                    nodal[i, 2],
                    drag_time[i] * nodal[i, 3],
                )
            elif free[i, axis]:
                acceleration[i, axis] = force[i, axis] / nodal[i, 0]


@kernel
def through_points(occupied, elements, held, nodal, free, velocity, returned):
    """From nodal velocities to the points and back: consistent over lumped mass. `returned` is added to, from zero."""
    for k in range(occupied.size):
        e = occupied[k]
        a, b, c = elements[e, 0], elements[e, 1], elements[e, 2]
        for x in range(velocity.shape[1]):
            m = E_GRAINS if x < 2 else E_WATER
            u, v, w = velocity[a, x], velocity[b, x], velocity[c, x]
            returned[a, x] += held[k, m] * u + held[k, m + 1] * v + held[k, m + 2] * w
            returned[b, x] += held[k, m + 1] * u + held[k, m + 3] * v + held[k, m + 4] * w
            returned[c, x] += held[k, m + 2] * u + held[k, m + 4] * v + held[k, m + 5] * w
    for i in range(len(returned)):
        for x in range(velocity.shape[1]):
            returned[i, x] = returned[i, x] / nodal[i, x // 2] if free[i, x % 2] else 0.0


class Spectrum:
    """Linear operator of a solver's state: accelerations from the stresses that nodal velocities build in a second.

    Parameters
    ----------
    solver : mpm.solver.Solver
        All its points count as stiff, and as under pressure: what is loose may close, what is slack may fill.
    """

    def __init__(self, solver):
        mesh, levels = solver.mesh, solver.levels
        n_nodes = len(mesh.nodes)
        self.wet = solver.scene.water is not None
        self.smoothing = solver.scene.numerics.volumetric_smoothing
        self.step_of_node = 2.0 ** levels.of_row[:n_nodes]
        occupied = solver.occupied[: solver.n_occupied]
        self.layout = occupied, mesh.elements, levels.rows, solver.geometry
        self.held = np.empty((len(occupied), ELEMENT_WIDTH))
        self.nodal = np.zeros((n_nodes, 4))
        row_volume = np.zeros(len(levels.of_row))
        ahead = levels.ahead(2 ** np.arange(levels.count))
        sum_points(
            occupied, solver.start, solver.order, solver.points, solver.soil_of_point, solver.soils,
            solver._water_density, solver._water_modulus, mesh.elements, levels.rows, solver.geometry,
            4.0**levels.of_element * (1 + 2 * ahead), self.held, self.nodal, row_volume,
        )  # fmt: skip
        row_spread = np.zeros_like(row_volume)
        row_area = np.bincount(
            levels.rows[occupied].ravel(), np.repeat(solver.geometry[occupied, 6], 3), len(row_volume)
        )
        fill = np.divide(row_volume, row_area, out=np.zeros_like(row_volume), where=row_area > 0)
        spread_elements(occupied, levels.rows, solver.geometry, fill, self.held, row_spread)
        volumes = np.column_stack([row_volume, row_spread])
        self.per_volume = np.divide(1.0, volumes, out=np.zeros_like(volumes), where=volumes > 0)
        fixed = solver.fixed[:, None] & np.array([FIXED_X, FIXED_Y], np.int8)
        self.free = (self.nodal[:, :1] > 0) & (fixed == 0)

    def accelerations(self, velocity, dt):
        """Nodal accelerations [1/s2 times velocity]: (n_nodes, 4 or 2); dt [s] is that of the implicit drag."""
        occupied, elements, rows, geometry = self.layout
        divergence, force = np.zeros((len(self.per_volume), 2)), np.zeros((len(velocity), 4))
        if self.smoothing:
            sum_divergences(occupied, elements, rows, geometry, self.held, velocity, divergence)
            divergence *= self.per_volume
        sum_forces(occupied, elements, rows, geometry, self.held, velocity, self.smoothing, divergence, force)
        before, result = np.zeros_like(velocity), np.zeros_like(velocity)
        accelerate_nodes(force, self.nodal, 0.5 * dt * self.step_of_node, self.free, before)
        through_points(occupied, elements, self.held, self.nodal, self.free, before, result)
        return result

    def largest(self, dt, start=None):
        """Largest eigenvalue [1/s2] with drag over dt [s], and its mode; start: a guess of the mode."""
        from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigs
        from threadpoolctl import threadpool_limits

        shape = (len(self.nodal), 4 if self.wet else 2)
        size = shape[0] * shape[1]
        operator = LinearOperator(
            (size, size), matvec=lambda u: -self.accelerations(u.reshape(shape), dt).ravel(), dtype=float
        )
        if start is None or not operator.matvec(start).any():  # points have left the nodes of an earlier mode
            start = np.random.default_rng(0).standard_normal(size)
            if not operator.matvec(start).any():
                return 0.0, None
        try:
            # one thread: the bits must not depend on how many there are, and small products gain nothing from more
            with threadpool_limits(1, user_api="blas"):
                values, modes = eigs(
                    operator, k=1, which="LM", v0=start, ncv=min(KRYLOV, size), tol=TOLERANCE, maxiter=40
                )
        except ArpackNoConvergence:
            return math.inf, None
        return float(np.abs(values[0])), np.real(modes[:, 0])


def spectral_time_step(solver, shortest, start=None):
    """Critical time step from the largest eigenvalue.

    Parameters
    ----------
    solver : mpm.solver.Solver
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
    spectrum, dt = Spectrum(solver), shortest
    for _ in range(ROUNDS if spectrum.wet and start is None else 1):
        value, start = spectrum.largest(dt, start)
        if not 0 < value < math.inf:
            return shortest, None
        dt = 2.0 / math.sqrt(value)
    longest = dt * 2.0 ** (solver.levels.count - 1)
    pic_share = -math.expm1(-solver.scene.numerics.pic_rate * longest)
    return SAFETY * math.sqrt(1 - 0.5 * pic_share) * dt, start
