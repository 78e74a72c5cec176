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
from typing import NamedTuple

import numpy as np

from mpm.contact import FIXED_X, FIXED_Y, free_pair
from mpm.jit import index, kernel, kernel_part
from mpm.meeting import next_part, next_stage, take_part
from mpm.system import Ground, Medium
from mpm.transfer import felt_share
from mpm.variables import E_FILL, MASS, S_DRAG, S_G, S_LAMBDA, S_RHO_S, N, X, Y

SAFETY = 0.9  # Ritz values come from below, and points move until the next estimate
TOLERANCE = 1e-2  # of the largest eigenvalue
KRYLOV = 10  # vectors: from a wrong mode within 0.4 % of the step that many more give
MOST_RESTARTS = 40  # with the best mode of the vectors so far
ROUNDS = 3  # of the step that the drag depends on, from below, at the first call

GATHERINGS = 2  # stages in which the operator is set up
# And those from one vector to the next.
(FORCES, ACCELERATIONS, THROUGH_POINTS, IMAGE, ORTHOGONAL, UNIT) = range(6)

# What an element sums over its points: moduli and water's stiffness times volume, and the upper triangles of the
# consistent masses of grains and of water, row by row.
(E_LAMBDA, E_G, E_QS, E_QL) = range(4)
E_GRAINS, E_WATER, ELEMENT_WIDTH = 4, 10, 16


class Operator(NamedTuple):
    """What the largest eigenvalue is sought of, and arrays for the way there; those of parts are zeros between uses."""

    elements: np.ndarray
    geometry: np.ndarray
    contents: np.ndarray
    stiffened: np.ndarray
    fixed: np.ndarray
    step_of_node: np.ndarray
    undrained: bool
    held: np.ndarray
    nodal: np.ndarray
    free: np.ndarray  # (n_nodes, 2) bool
    element_cuts: np.ndarray  # (n_parts + 1,) as the others; of the occupied elements
    node_cuts: np.ndarray
    at_nodes: np.ndarray  # (n_parts, n_nodes, 4) what parts sum there, one after the other: masses, forces, momenta
    acceleration: np.ndarray  # (n_nodes, 4 or 2)
    dots: np.ndarray  # (n_parts, KRYLOV + 1)


@kernel_part
def sum_points(
    first, last, ground, medium, elements, geometry, contents, stiffened, undrained, held, nodal
):  # fmt: skip
    """Sum the points of a range of elements in these and at the nodes.

    contents : (n_elements, 5) float64
        With the share of their area that stresses count with (`mpm.transfer.fill_of_cell`).
    stiffened : (n_elements,) float64
        Factor of the stiffness of an element.
    undrained : bool
        The pore water moves with the grains: its mass counts as theirs.
    held : (n_elements, 16) float64
        Written, the occupied elements one after the other: see the columns `E_`.
    nodal : (n_nodes, 4) float64
        Added: masses of grains, of water as if it filled all, of pore water [kg/m]; drag [kg/m/s].
    """
    points, soils = ground.points, ground.soils
    for k in range(first, last):
        e = index(ground.occupied[k])
        for column in range(ELEMENT_WIDTH):
            held[k, column] = 0.0
        g1x, g1y, g2x, g2y = geometry[e, 0], geometry[e, 1], geometry[e, 2], geometry[e, 3]
        total = 0.0
        for j in range(ground.start[e], ground.start[e + 1]):
            i = index(ground.order[j])
            s = index(ground.soil_of_point[i])
            dx, dy = points[i, X] - geometry[e, 4], points[i, Y] - geometry[e, 5]
            n1, n2 = g1x * dx + g1y * dy, g2x * dx + g2y * dy
            weight = (1.0 - n1 - n2, n1, n2)
            mass, n = points[i, MASS], points[i, N]
            volume = mass / (soils[s, S_RHO_S] * (1.0 - n))
            water = volume * medium.density_liquid
            stiff = volume * stiffened[e]
            total += volume
            if undrained:
                mass += n * water
            held[k, E_LAMBDA] += stiff * soils[s, S_LAMBDA]
            held[k, E_G] += stiff * soils[s, S_G]
            held[k, E_QS] += stiff * medium.bulk_liquid * (1.0 - n) / n
            held[k, E_QL] += stiff * medium.bulk_liquid
            column = 0
            for a in range(3):
                for b in range(a, 3):
                    held[k, E_GRAINS + column] += mass * weight[a] * weight[b]
                    held[k, E_WATER + column] += water * weight[a] * weight[b]
                    column += 1
                c = index(elements[e, a])
                nodal[c, 0] += weight[a] * mass
                nodal[c, 1] += weight[a] * water
                nodal[c, 2] += weight[a] * n * water
                nodal[c, 3] += weight[a] * n * water * soils[s, S_DRAG]
        share = felt_share(total, geometry[e, 6], contents[e, E_FILL])
        for column in range(E_GRAINS):
            held[k, column] *= share


@kernel_part
def gather_part(which, part, ground, medium, o):
    """One part of a stage of setting the operator up for the points as they are."""
    parts = o.at_nodes.shape[0]
    if which == 0:
        sum_points(
            o.element_cuts[part], o.element_cuts[part + 1], ground, medium, o.elements, o.geometry, o.contents,
            o.stiffened, o.undrained, o.held, o.at_nodes[part],
        )  # fmt: skip
    elif which == 1:
        for i in range(o.node_cuts[part], o.node_cuts[part + 1]):
            for column in range(4):
                total = 0.0
                for p in range(parts):
                    total += o.at_nodes[p, i, column]
                    o.at_nodes[p, i, column] = 0.0
                o.nodal[i, column] = total
            o.free[i, 0] = o.nodal[i, 0] > 0.0 and not o.fixed[i] & FIXED_X
            o.free[i, 1] = o.nodal[i, 0] > 0.0 and not o.fixed[i] & FIXED_Y


@kernel_part
def sum_forces(first, last, occupied, elements, geometry, held, velocity, force):
    """Add the forces of the stresses that `velocity` builds in a second to the nodes.

    force : (n_nodes, 4) float64
        Of the mixture, and of the pore pressure on the water.
    """
    wet = velocity.shape[1] == 4
    for k in range(first, last):
        e = index(occupied[k])
        a, b, c = index(elements[e, 0]), index(elements[e, 1]), index(elements[e, 2])
        g1x, g1y, g2x, g2y = geometry[e, 0], geometry[e, 1], geometry[e, 2], geometry[e, 3]
        ux1, ux2 = velocity[b, 0] - velocity[a, 0], velocity[c, 0] - velocity[a, 0]
        uy1, uy2 = velocity[b, 1] - velocity[a, 1], velocity[c, 1] - velocity[a, 1]
        xx, yy = g1x * ux1 + g2x * ux2, g1y * uy1 + g2y * uy2
        xy = 0.5 * (g1y * ux1 + g2y * ux2 + g1x * uy1 + g2x * uy2)
        volume = liquid = xx + yy
        if wet:
            liquid = g1x * (velocity[b, 2] - velocity[a, 2]) + g2x * (velocity[c, 2] - velocity[a, 2])
            liquid += g1y * (velocity[b, 3] - velocity[a, 3]) + g2y * (velocity[c, 3] - velocity[a, 3])
        pressure = -(held[k, E_QS] * volume + held[k, E_QL] * liquid)
        sxx = held[k, E_LAMBDA] * volume + 2.0 * held[k, E_G] * xx - pressure
        syy = held[k, E_LAMBDA] * volume + 2.0 * held[k, E_G] * yy - pressure
        sxy = 2.0 * held[k, E_G] * xy
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


@kernel_part
def accelerate_nodes(first, last, force, nodal, drag_time, step_of_node, free, acceleration):
    """Accelerations of both phases of a range of nodes; those that are not free have none.

    force : (n_parts, n_nodes, 4) float64
        Added up, and cleared.
    drag_time, step_of_node : float, (n_nodes,) float64
        Time over which the implicit drag acts on level 0 [s], and the node's step over that of level 0.
    """
    wet = acceleration.shape[1] == 4
    for i in range(first, last):
        for axis in range(2):
            total = liquid = 0.0
            for part in range(force.shape[0]):
                total += force[part, i, axis]
                liquid += force[part, i, axis + 2]
                force[part, i, axis] = force[part, i, axis + 2] = 0.0
            acceleration[i, axis] = 0.0
            if wet:
                acceleration[i, axis + 2] = 0.0
            if free[i, axis] and wet:
                acceleration[i, axis], acceleration[i, axis + 2] = free_pair(
                    total,
                    liquid,
                    nodal[i, 0],
                    nodal[i, 1],
                    nodal[i, 2],
                    drag_time * step_of_node[i] * nodal[i, 3],
                )
            elif free[i, axis]:
                acceleration[i, axis] = total / nodal[i, 0]


@kernel_part
def product(u, v, first, last):
    """Dot product of a range of two vectors, in four sums that run beside each other."""
    a = b = c = d = 0.0
    i = first
    while i + 4 <= last:
        a += u[i] * v[i]
        b += u[i + 1] * v[i + 1]
        c += u[i + 2] * v[i + 2]
        d += u[i + 3] * v[i + 3]
        i += 4
    for k in range(i, last):
        a += u[k] * v[k]
    return (a + b) + (c + d)


@cache
def krylov_kernel(wet):
    """Kernel `build_krylov` for soil with pore water or without."""
    width = 4 if wet else 2

    @kernel_part
    def through_points(first, last, occupied, elements, held, velocity, returned):
        """Add what a range of elements passes from nodal velocities through its points and back, times mass."""
        for k in range(first, last):
            e = index(occupied[k])
            a, b, c = index(elements[e, 0]), index(elements[e, 1]), index(elements[e, 2])
            for x in range(width):
                m = E_GRAINS if x < 2 else E_WATER
                u, v, w = velocity[a, x], velocity[b, x], velocity[c, x]
                returned[a, x] += held[k, m] * u + held[k, m + 1] * v + held[k, m + 2] * w
                returned[b, x] += held[k, m + 1] * u + held[k, m + 3] * v + held[k, m + 4] * w
                returned[c, x] += held[k, m + 2] * u + held[k, m + 4] * v + held[k, m + 5] * w

    @kernel_part
    def krylov_part(which, part, j, ground, o, drag_time, basis, hessenberg):
        """One part of a stage on the way from vector `j` to the next."""
        parts, occupied = o.at_nodes.shape[0], ground.occupied
        flat = basis.reshape(basis.shape[0], width * basis.shape[1])
        velocity, image = basis[j], basis[j + 1]
        if which == FORCES:
            sum_forces(
                o.element_cuts[part], o.element_cuts[part + 1], occupied, o.elements, o.geometry, o.held,
                velocity, o.at_nodes[part],
            )  # fmt: skip
        elif which == ACCELERATIONS:
            accelerate_nodes(
                o.node_cuts[part],
                o.node_cuts[part + 1],
                o.at_nodes,
                o.nodal,
                drag_time,
                o.step_of_node,
                o.free,
                o.acceleration,
            )
        elif which == THROUGH_POINTS:
            through_points(
                o.element_cuts[part], o.element_cuts[part + 1], occupied, o.elements, o.held, o.acceleration,
                o.at_nodes[part],
            )  # fmt: skip
        elif which == IMAGE:
            first, last = o.node_cuts[part], o.node_cuts[part + 1]
            for i in range(first, last):
                for x in range(width):
                    total = 0.0
                    for p in range(parts):
                        total += o.at_nodes[p, i, x]
                        o.at_nodes[p, i, x] = 0.0
                    image[i, x] = -total / o.nodal[i, x // 2] if o.free[i, x % 2] else 0.0
            for k in range(j + 1):
                o.dots[part, k] = product(flat[k], flat[j + 1], width * first, width * last)
        elif which == ORTHOGONAL:
            first, last = width * o.node_cuts[part], width * o.node_cuts[part + 1]
            for k in range(j + 1):
                share = o.dots[:, k].sum()
                for i in range(first, last):
                    flat[j + 1, i] -= share * flat[k, i]
            o.dots[part, -1] = product(flat[j + 1], flat[j + 1], first, last)
        elif which == UNIT:
            norm = np.sqrt(o.dots[:, -1].sum())
            scale = 1.0 / norm if norm > 0.0 else 0.0
            for i in range(width * o.node_cuts[part], width * o.node_cuts[part + 1]):
                flat[j + 1, i] *= scale
            if part == 0:
                for k in range(j + 1):
                    hessenberg[k, j] = o.dots[:, k].sum()
                hessenberg[j + 1, j] = norm

    @kernel
    def build_krylov(thread, meeting, stage, fresh, ground, medium, operator, drag_time, basis, hessenberg):
        """Arnoldi's process: orthonormal vectors that span the powers of the operator on the first of them.

        The operator takes nodal velocities to accelerations, with changed sign: stresses that build in a second, mass,
        and the way through the points. Sums run over fixed parts, so the bits do not depend on the threads.

        fresh : bool
            The points are others than before.
        drag_time : float
            Time over which the implicit drag acts on level 0 [s].
        basis : (k + 1, n_nodes, 4 or 2) float64
            The first, a unit vector, is given.
        hessenberg : (k + 1, k) float64
            Written; zeros at first.
        """
        parts = operator.at_nodes.shape[0]
        for which in range(GATHERINGS if fresh else 0):
            part = take_part(meeting, stage, thread, parts)
            while part >= 0:
                gather_part(which, part, ground, medium, operator)
                part = next_part(meeting, stage, thread, parts)
            stage = next_stage(meeting, stage, parts)
        for j in range(hessenberg.shape[1]):
            for which in range(UNIT + 1):
                part = take_part(meeting, stage, thread, parts)
                while part >= 0:
                    krylov_part(which, part, j, ground, operator, drag_time, basis, hessenberg)
                    part = next_part(meeting, stage, thread, parts)
                stage = next_stage(meeting, stage, parts)

    return build_krylov


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
            undrained=solver.scene.is_undrained,
            held=np.zeros((len(mesh.elements), ELEMENT_WIDTH)),
            nodal=np.zeros((n_nodes, 4)),
            free=np.zeros((n_nodes, 2), bool),
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
        ground = Ground(s.occupied, s.start, s.order, s.points, s.element_of_point, s.soil_of_point, s.soils)
        medium = Medium(s.scene.gravity, s._water_density, s._water_modulus)
        s.workers.together(
            krylov_kernel(self.wet), self._fresh, ground, medium, self.operator, 0.5 * dt, self.basis, hessenberg
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
