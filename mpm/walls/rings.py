"""Rings of few degrees of freedom that may stand for a lining: a rigid one that floats, and a homogeneous elastic one.

Small displacements from the circle: mass, stiffness and weight are constant, and so is the shape in which a coordinate
moves every point of the lining. Angles in radians from the crown, clockwise; e_r = (sin, cos), e_t = (cos, -sin).
"""

import math
from dataclasses import dataclass

import numpy as np

#: Share of the squared time step with which stiffness acts as mass: Newmark's beta of the constant mean acceleration.
BETA = 0.25


def effective_mass(ring, dt):
    """M + beta dt^2 K [kg/m], (m, m), of a ring.

    With velocities half a step before the displacements, u1 = u0 + dt a and x1 = x0 + dt u1, an acceleration
    (M + dt^2/4 K) a = weight - K x0 - reactions is the trapezoidal rule: every frequency of the ring is stable at any
    dt and none is damped. The rest of a coupled system, advanced by the same leapfrog without the extra mass, keeps the
    critical step that it has beside a ring without stiffness (Belytschko & Mullen 1978).
    """
    return ring.mass + BETA * dt**2 * ring.stiffness


@dataclass(frozen=True, eq=False)
class LiningRing:
    """Equation of motion M du/dt = weight - K x - reactions, per metre of tunnel, in m coordinates.

    Parameters
    ----------
    mass, stiffness : (m, m) float64
        [kg/m], [N/m2]
    weight : (m,) float64
        Generalised force of gravity [N/m].

    Notes
    -----
    Any object may stand for a lining that has these, `outer_radius` [m] and `motion`; `internal_forces` where it knows
    them; `jumps` (n_joints, 3, m) where it has joints, and `joints`, which gives movements and forces by their names,
    from displacement and memory. Joints that are not part of the stiffness feel `moves` (n, m) of the coordinates, and
    are solved by

    joints_between(flexibility, free, start, memory) : forces with which moves = free - flexibility forces, from a start
        nearby, and what the joints remember then: (n,), (n_joints,) float64; ArithmeticError where there are none
    joint_forces(moves, memory) : forces, their derivative and what is remembered: (n,), (n, n), (n_joints,)
    """

    mass: np.ndarray
    stiffness: np.ndarray
    weight: np.ndarray

    def force(self, displacement):
        """Weight and elastic force at a displacement [N/m], (m,)."""
        return self.weight - self.stiffness @ displacement

    def effective_mass(self, dt):
        """Of :func:`effective_mass`."""
        return effective_mass(self, dt)

    def step(self, displacement, velocity, reactions, dt):
        """Displacement and velocity after dt [s] under the reactions [N/m] that the ring exerts, (m,) each."""
        impulse = dt * (self.force(displacement) - reactions)
        velocity = velocity + np.linalg.solve(self.effective_mass(dt), impulse)
        return displacement + dt * velocity, velocity


@dataclass(frozen=True, eq=False)
class RigidRing(LiningRing):
    """A rigid ring; its coordinates are x, y and the clockwise way of the outer face as it turns [m]."""

    outer_radius: float

    @classmethod
    def build(cls, outer_radius, inner_radius, density, gravity):
        """Ring of the given radii [m], density [kg/m3] and gravity [m/s2]."""
        mass = density * math.pi * (outer_radius**2 - inner_radius**2)
        turning = mass * (outer_radius**2 + inner_radius**2) / (2 * outer_radius**2)
        weight = np.array([0.0, -mass * gravity, 0.0])
        return cls(np.diag([mass, mass, turning]), np.zeros((3, 3)), weight, outer_radius)

    def motion(self, theta, radius):
        """Displacement (x, y) of points at theta [rad] and radius [m] for unit coordinates: (n, 2, 3) float64."""
        theta = np.asarray(theta, float)
        result = np.zeros((len(theta), 2, 3))
        result[:, 0, 0] = result[:, 1, 1] = 1.0
        result[:, 0, 2] = radius / self.outer_radius * np.cos(theta)
        result[:, 1, 2] = -radius / self.outer_radius * np.sin(theta)
        return result


@dataclass(frozen=True, eq=False)
class ElasticRing(LiningRing):
    """A homogeneous ring in plane strain: curved Euler-Bernoulli beam, displacements as Fourier series.

    The centre line at radius R moves by w outward and v clockwise, each 1 + 2 n_harmonics coordinates, in the order
    1, cos, sin, cos 2, ..; sections stay plane and normal to it: at R + z the clockwise displacement is
    v + z (v - dw)/R with dw = dw/dtheta, and the hoop strain (w + dv + z (dv - ddw)/R)/(R + z), Winkler's curved bar.
    The uniform v and the first harmonics with v = -dw are the rigid motions.
    """

    outer_radius: float
    radius: float
    section: tuple[float, float, float]
    n_harmonics: int

    @classmethod
    def build(cls, outer_radius, inner_radius, density, gravity, youngs_modulus, poissons_ratio, n_harmonics):
        """Ring of the given radii [m], density [kg/m3], gravity [m/s2], modulus [Pa] and number of harmonics."""
        radius, thickness = (outer_radius + inner_radius) / 2, outer_radius - inner_radius
        modulus = youngs_modulus / (1 - poissons_ratio**2)
        # modulus times the integrals of 1, z, z^2 over (R + z) dz: exact, though the last two nearly vanish
        first = thickness - radius * math.log(outer_radius / inner_radius)
        section = (modulus * (thickness - first) / radius, modulus * first, -modulus * radius * first)
        theta = np.arange(4 * n_harmonics + 4) * (2 * math.pi / (4 * n_harmonics + 4))  # exact for products
        stretch, bend = _strains(theta, radius, n_harmonics)
        arc = theta[1]
        # einsum, no dot products: those of BLAS depend on its number of threads in the last bits
        rows = np.stack([stretch, bend])
        law = arc * np.array([section[:2], section[1:]])
        stiffness = np.einsum("ab,api,bpj->ij", law, rows, rows)
        mass = np.zeros_like(stiffness)
        weight = np.zeros(len(stiffness))
        for node, share in zip(*np.polynomial.legendre.leggauss(3), strict=True):
            r = radius + node * thickness / 2
            moved = _motion(theta, r, radius, n_harmonics)
            area = arc * density * r * share * thickness / 2
            mass += area * np.einsum("pki,pkj->ij", moved, moved)
            weight -= gravity * area * moved[:, 1].sum(axis=0)
        return cls(mass, stiffness, weight, outer_radius, radius, section, n_harmonics)

    def motion(self, theta, radius):
        """Displacement (x, y) of points at theta [rad] and radius [m] for unit coordinates: (n, 2, m) float64."""
        return _motion(theta, radius, self.radius, self.n_harmonics)

    def internal_forces(self, displacement, theta):
        """Internal forces of a displacement at theta [rad], per metre of tunnel.

        Returns
        -------
        axial_force, shear_force, bending_moment : (n,) float64
            N [N/m], compression positive; Q = -dM/ds [N/m], without the couple of shear on the outer face;
            M [N m/m], tension on the outer face positive.
        """
        stretch, bend = (rows @ displacement for rows in _strains(theta, self.radius, self.n_harmonics))
        stretch_slope, bend_slope = (
            rows @ displacement for rows in _strains(theta, self.radius, self.n_harmonics, slope=True)
        )
        j0, j1, j2 = self.section
        shear = -(j1 * stretch_slope + j2 * bend_slope) / self.radius
        return -(j0 * stretch + j1 * bend), shear, j1 * stretch + j2 * bend


def _series(theta, n_harmonics, derivative=0):
    """Derivative of 1, cos, sin, cos 2, sin 2, .. at theta: (n, 1 + 2 n_harmonics)."""
    theta = np.asarray(theta, float)
    order = np.arange(1, n_harmonics + 1)
    phase = theta[:, None] * order + derivative * math.pi / 2
    result = np.empty((len(theta), 1 + 2 * n_harmonics))
    result[:, 0] = derivative == 0
    result[:, 1::2] = order**derivative * np.cos(phase)
    result[:, 2::2] = order**derivative * np.sin(phase)
    return result


def _strains(theta, radius, n_harmonics, slope=False):
    """Rows of w + dv and (dv - ddw)/R, or of their derivatives: (n, m) each."""
    zero, first, second = (_series(theta, n_harmonics, k + slope) for k in range(3))
    return np.hstack([zero, first]), np.hstack([-second, first]) / radius


def _motion(theta, r, radius, n_harmonics):
    series, slope = _series(theta, n_harmonics), _series(theta, n_harmonics, 1)
    lever = np.broadcast_to((np.asarray(r, float) - radius) / radius, len(series))[:, None]
    tangential = np.hstack([-lever * slope, (1 + lever) * series])
    radial = np.hstack([series, np.zeros_like(series)])
    sine, cosine = np.sin(theta)[:, None], np.cos(theta)[:, None]
    return np.stack([sine * radial + cosine * tangential, cosine * radial - sine * tangential], axis=1)
