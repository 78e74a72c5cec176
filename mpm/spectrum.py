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
from mpm.variables import MASS, S_DRAG, S_G, S_LAMBDA, S_RHO_S, S_SIN_DIL, N, X, Y

SAFETY = 0.9  # Ritz values come from below, and points move until the next estimate
TOLERANCE = 1e-2  # of the largest eigenvalue
ROUNDS = 3  # of the step that the drag depends on, from below, at the first call


class Spectrum:
    """Linear operator of a solver's state: accelerations from the stresses that nodal velocities build in a second.

    Parameters
    ----------
    solver : mpm.solver.Solver
        All its points count as stiff, and as under pressure: what is loose may close, what is slack may fill.
    """

    def __init__(self, solver):
        from scipy.sparse import csr_array

        mesh, scene = solver.mesh, solver.scene
        inside = solver.element_of_point >= 0
        points, element = solver.points[inside], solver.element_of_point[inside]
        soil = solver.soils[solver.soil_of_point[inside]]
        used = np.unique(element)
        corners, geometry, levels = mesh.elements[used], solver.geometry[used], solver.levels
        self.step_of_node = 2.0 ** levels.of_row[: len(mesh.nodes)]
        element = np.searchsorted(used, element)
        n_nodes, n_elements = len(mesh.nodes), len(used)
        g = geometry[element]
        dx, dy = points[:, X] - g[:, 4], points[:, Y] - g[:, 5]
        n1, n2 = g[:, 0] * dx + g[:, 1] * dy, g[:, 2] * dx + g[:, 3] * dy
        weights = np.column_stack([1 - n1 - n2, n1, n2])
        row, column = np.repeat(np.arange(n_elements), 3), corners.ravel()
        gx = np.column_stack([-geometry[:, 0] - geometry[:, 2], geometry[:, 0], geometry[:, 2]]).ravel()
        gy = np.column_stack([-geometry[:, 1] - geometry[:, 3], geometry[:, 1], geometry[:, 3]]).ravel()
        self.gx, self.gy = (csr_array((v, (row, column)), (n_elements, n_nodes)) for v in (gx, gy))
        porosity, mass = points[:, N], points[:, MASS]
        volume = mass / (soil[:, S_RHO_S] * (1 - porosity))

        def total(values):
            return np.bincount(element, values, n_elements)

        def at_nodes(values):
            sums = [np.bincount(corners[element, i], values * weights[:, i], n_nodes) for i in range(3)]
            return sums[0] + sums[1] + sums[2]

        def consistent_mass(mass):
            data = np.empty((n_elements, 3, 3))
            for i in range(3):
                for j in range(i, 3):
                    data[:, i, j] = data[:, j, i] = total(mass * weights[:, i] * weights[:, j])
            rows, columns = np.repeat(corners, 3, axis=1), np.tile(corners, (1, 3))
            return csr_array((data.ravel(), (rows.ravel(), columns.ravel())), (n_nodes, n_nodes))

        ahead = levels.ahead(2.0 ** np.arange(levels.count))[used]
        stiffened = volume * (4.0 ** levels.of_element[used] * (1 + 2 * ahead))[element]
        own = volume * (soil[:, S_SIN_DIL] > 0.0)
        self.own = np.divide(total(own), total(volume))  # share that takes its element's own rates
        self.lam, self.shear = total(stiffened * soil[:, S_LAMBDA]), total(stiffened * soil[:, S_G])
        self.wet = scene.water is not None
        self.through_solid, self.mass_solid = self._through(consistent_mass(mass))
        if self.wet:
            water = volume * solver._water_density
            self.q_solid = total(stiffened * solver._water_modulus * (1 - porosity) / porosity)
            self.q_liquid = total(stiffened * solver._water_modulus)
            self.through_liquid, self.mass_liquid = self._through(consistent_mass(water))
            self.mass_pore = at_nodes(porosity * water)
            self.drag = at_nodes(porosity * soil[:, S_DRAG] * water)
        self.smoothing = scene.numerics.volumetric_smoothing
        if self.smoothing:
            rows = levels.rows[used].ravel()
            self.to_nodes = csr_array((np.ones(3 * n_elements), (rows, row)), (len(levels.of_row), n_elements))
            self.volume = total(volume)
            sums = self.to_nodes @ self.volume
            self.per_volume = np.divide(1.0, sums, out=np.zeros_like(sums), where=sums > 0)
        self.free_x = (self.mass_solid > 0) & ((solver.fixed & FIXED_X) == 0)
        self.free_y = (self.mass_solid > 0) & ((solver.fixed & FIXED_Y) == 0)

    def accelerations(self, velocity, dt):
        """Nodal accelerations [1/s2 times velocity]: (4 or 2, n_nodes); dt [s] is that of the implicit drag."""
        solid = velocity[:2]
        xx, yy = self.gx @ solid[0], self.gy @ solid[1]
        xy = 0.5 * (self.gy @ solid[0] + self.gx @ solid[1])
        own = xx + yy
        volume = self._mean(own)
        skeleton = volume + self.own * (own - volume)
        correction = 0.5 * (skeleton - own)
        sxx = self.lam * skeleton + 2 * self.shear * (xx + correction)
        syy = self.lam * skeleton + 2 * self.shear * (yy + correction)
        sxy = 2 * self.shear * xy
        if self.wet:
            liquid = self._mean(self.gx @ velocity[2] + self.gy @ velocity[3])
            pressure = -(self.q_solid * volume + self.q_liquid * liquid)
            sxx, syy = sxx - pressure, syy - pressure
        force = -(self.gx.T @ sxx + self.gy.T @ sxy), -(self.gx.T @ sxy + self.gy.T @ syy)
        result = np.zeros_like(velocity)
        drag = self.drag * self.step_of_node if self.wet else None
        for k, (free, gradient) in enumerate(((self.free_x, self.gx), (self.free_y, self.gy))):
            if self.wet:
                ms, ml, mn = self.mass_solid[free], self.mass_liquid[free], self.mass_pore[free]
                push = (gradient.T @ pressure)[free]
                pair = free_pair.py_func(force[k][free], push, ms, ml, mn, 0.5 * dt * drag[free])
                result[k, free], result[k + 2, free] = pair
                result[k + 2] = np.where(free, self.through_liquid @ result[k + 2], 0.0)
            else:
                result[k, free] = force[k][free] / self.mass_solid[free]
            result[k] = np.where(free, self.through_solid @ result[k], 0.0)
        return result

    def _mean(self, rates):
        """Mean over the elements around each element's corners, weighted with the volume in them."""
        if not self.smoothing:
            return rates
        nodal = self.per_volume * (self.to_nodes @ (self.volume * rates))
        return self.to_nodes.T @ nodal / 3

    @staticmethod
    def _through(consistent):
        """From nodal velocities to the points and back, (n_nodes, n_nodes), and the nodal mass [kg/m]."""
        mass = consistent.sum(axis=1)
        inverse = np.divide(1.0, mass, out=np.zeros_like(mass), where=mass > 0)
        consistent.data *= np.repeat(inverse, np.diff(consistent.indptr))
        return consistent, mass

    def largest(self, dt, start=None):
        """Largest eigenvalue [1/s2] with drag over dt [s], and its mode; start: a guess of the mode."""
        from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigs
        from threadpoolctl import threadpool_limits

        shape = (4 if self.wet else 2, len(self.mass_solid))
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
                values, modes = eigs(operator, k=1, which="LM", v0=start, ncv=min(16, size), tol=TOLERANCE, maxiter=40)
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
