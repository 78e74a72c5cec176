"""A ring of few coordinates that another program may move step by step, reduced from a lining model without a loss.

Whatever the joints do, a ring at rest obeys (K + J^T k J) q = f + J^T (k J q - s), with K the stiffness of its
segments (and of gaps that are not plane), J the jumps of its joints and how much their bolts grow, s the forces in
them and k any springs in their place. So all its equilibria are sums of answers of the ring with these springs: to the
loads on its face, and to a pair of forces at every joint. The first are taken as harmonics, which is the only error;
beside these the ring moves as a whole.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from structure.arcs import periodic_shares
from structure.discrete import DiscreteLining
from structure.inputs import InputError
from structure.lining import THETA
from structure.newton import NoEquilibrium
from structure.nodal_forces import springs_at
from structure.ring import Ring

#: Angles of the outer face at which displacements are kept; linear in between.
FACE = np.radians(np.arange(0, 360, 0.5))
#: Share of the largest eigenvalue of their scalar products below which answers count as combinations of the others.
DEPENDENT = 1e-12
#: Of Newton's method for the joints alone; smallest part of a step; the roundings of the terms of a sum of forces at
#: which it stops.
MAX_ITERATIONS, SMALLEST_SHARE, ROUNDINGS, EPSILON = 100, 1e-3, 16, np.finfo(float).eps


def check_movable(ring: Ring) -> None:
    """Refuse a ring that cannot move in the ground. Raises structure.InputError."""
    if ring.neighbour is not None:
        raise InputError("ring: neighbour must be left out of a ring that moves in the ground, got one")
    if ring.joint_contact == "face":
        raise InputError(
            "ring: joint_contact must be 'section' for a ring that moves in the ground, got 'face'; give"
            " joint_contact_height and joint_contact_only instead"
        )


class ReducedRing:
    """Mass, stiffness, weight and joints of a ring in m coordinates, per metre of tunnel.

    The first three move the ring to the right, up, and clockwise by one over the radius of the centre line [m]; the
    others deform it, in the mean of their squares by 1 m, and are orthogonal in mass to the first and to each other.

    Parameters
    ----------
    lining : DiscreteLining
        Its soil springs are left out: it is for the caller to say what works on the ring.
    density : float
        Of the concrete [kg/m3].
    gravity : float
        [m/s2]
    n_harmonics : int
        Of pressure and shear on the outer face whose equilibria are exact; at least 2.

    Attributes
    ----------
    mass, stiffness : (m, m) float64
        [kg/m], [N/m2]; the stiffness is that of the segments, and of the joints where their law is linear.
    weight : (m,) float64
        [N/m]
    jumps : (n_joints, 3, m) float64
        Opening [m], dislocation [m] and rotation [rad] of the joints.
    moves : (n, m) float64
        What joints whose forces the stiffness does not contain feel: none where they are linear and have no bolts, else
        opening, dislocation and rotation of one joint after the other, then the elongations of their bolts.
    """

    def __init__(self, lining: DiscreteLining, density: float, gravity: float, n_harmonics: int = 8):
        ring, parts = lining.ring, lining.parts
        self.outer_radius, self.radius = ring.outer_radius, ring.centre_radius
        check_movable(ring)
        self._lining, self.law, self.bolt_law = lining, parts.law, parts.bolt_law
        linear = self.law.linear and not ring.bolts
        mass, rigid = density * parts.mass, parts.rigid.T
        deformed = _orthonormal(_answers(lining, mass, rigid, n_harmonics), mass)
        deformed *= np.sqrt(mass_of_ring := float(rigid[:, 0] @ (mass @ rigid[:, 0])))
        self.basis = np.hstack([rigid, deformed])
        self.mass = np.zeros((self.basis.shape[1],) * 2)
        self.mass[:3, :3] = rigid.T @ (mass @ rigid)
        np.fill_diagonal(self.mass[3:, 3:], mass_of_ring)
        self.weight = -gravity * (self.basis.T @ (mass @ rigid[:, 1]))
        held = parts.linear if linear else parts.segments
        self.stiffness = np.zeros_like(self.mass)
        self.stiffness[3:, 3:] = deformed.T @ (held @ deformed)
        jumps = parts.jumps @ self.basis
        jumps[:, :3] = 0.0
        self.jumps = jumps.reshape(-1, 3, self.basis.shape[1])
        self.moves = jumps[:0] if linear else np.vstack([jumps, parts.bolts @ self.basis])
        self.moves[:, :3] = 0.0
        self._bolt_shares = lining.readings.bolt_shares
        self._readings = [part @ self.basis for part in lining.readings.forces]
        arc = self.outer_radius * FACE[1]
        inward, clockwise = lining.tractions(FACE)
        self._outward, self._clockwise = -(inward.T @ deformed) / arc, (clockwise.T @ deformed) / arc

    def motion(self, theta: np.ndarray, radius: np.ndarray | float) -> np.ndarray:
        """Displacement (x to the right, y up) of points at theta [rad] and radius [m] for unit coordinates: (n, 2, m).

        Radii other than that of the outer face move with a plane section.
        """
        theta = np.asarray(theta, float)
        lever = (np.broadcast_to(radius, theta.shape) - self.outer_radius) / self.outer_radius
        outward, along = self._on_face(theta)
        ahead, behind = self._on_face(theta + FACE[1])[0], self._on_face(theta - FACE[1])[0]
        slope = (ahead - behind) / (2 * np.sin(FACE[1]))  # exact for the ring as a whole
        along = along + lever[:, None] * (along - slope)
        sine, cosine = np.sin(theta), np.cos(theta)
        result = np.zeros((len(theta), 2, len(self.weight)))
        result[:, 0, 0] = result[:, 1, 1] = 1.0
        turned = np.broadcast_to(radius, theta.shape) / self.radius
        result[:, 0, 2], result[:, 1, 2] = turned * cosine, -turned * sine
        result[:, 0, 3:] = sine[:, None] * outward + cosine[:, None] * along
        result[:, 1, 3:] = cosine[:, None] * outward - sine[:, None] * along
        return result

    def _on_face(self, theta):
        (first, second), (near, far) = periodic_shares(FACE, theta)
        return tuple(
            near[:, None] * part[first] + far[:, None] * part[second] for part in (self._outward, self._clockwise)
        )

    def joint_forces(self, moved: np.ndarray, slip: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Forces that joints and bolts resist with, their tangent, and the slips then: (n,), (n, n), (n_joints,).

        Parameters
        ----------
        moved : (n,) float64
            Of `moves`.
        slip : (n_joints,) float64
            Irreversible dislocations before [m].
        """
        ways, joint = 3 * self.law.count, np.arange(self.law.count)
        resisting, tangents, slip = self.law.forces(moved[:ways].reshape(-1, 3), slip)
        force, tangent = np.zeros(len(moved)), np.zeros((len(moved),) * 2)
        force[:ways] = resisting.ravel()
        tangent[:ways, :ways].reshape(-1, 3, self.law.count, 3)[joint, :, joint] = tangents
        bolts = np.arange(ways, len(moved))
        force[bolts], tangent[bolts, bolts] = self.bolt_law.pull(moved[bolts])
        return force, tangent, slip

    def joints_between(
        self, flexibility: np.ndarray, free: np.ndarray, start: np.ndarray, slip: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Forces of joints and bolts between surroundings that answer to them linearly, by Newton's method.

        Its unknowns are forces plus movements times the stiffness of the surroundings: of these the movement is a
        smooth enough function however stiff a joint is, and one that sticks can be told from one that slides the other
        way. Sources: Alart & Curnier (1991), Comput. Methods Appl. Mech. Eng. 92, 353; Hintermueller, Ito & Kunisch
        (2003), SIAM J. Optim. 13, 865.

        Parameters
        ----------
        flexibility : (n, n) float64
            By how much `moves` are less per force of each.
        free : (n,) float64
            What they are without these forces.
        start : (n,) float64
            Near to what they are.
        slip : (n_joints,) float64
            Irreversible dislocations before [m].

        Returns
        -------
        force, slip : (n,), (n_joints,) float64

        Raises
        ------
        structure.newton.NoEquilibrium
        """
        ways, unslipped, beyond = 3 * self.law.count, np.zeros_like(slip), np.zeros_like(free)
        beyond[1:ways:3] = slip  # forces follow what is beyond the slip: its size brings no rounding
        free, moved, stiffness = free - beyond, start - beyond, 1 / flexibility.diagonal()
        least, share, step, both = np.inf, 1.0, np.zeros_like(free), np.zeros_like(free)
        for _ in range(MAX_ITERATIONS):
            force, tangent, more = self.joint_forces(moved, unslipped)
            apart = free - moved - flexibility @ force
            terms = (
                np.abs(free) + np.abs(moved) + np.abs(flexibility) @ (np.abs(force) + np.abs(tangent) @ np.abs(moved))
            )
            if np.all(np.abs(apart) <= ROUNDINGS * EPSILON * terms):
                return force, slip + more
            missed = np.sum(stiffness * apart**2)
            if missed < least or share < SMALLEST_SHARE:
                change = np.linalg.solve(np.eye(len(free)) + flexibility @ tangent, apart)
                both, step = force + stiffness * moved, stiffness * change + tangent @ change
                least, share = missed, 1.0
            else:  # joints that turn or slide back and forth: half the way
                share *= 0.5
            tried, moved = both + share * step, np.empty_like(free)
            moved[:ways] = self.law.between(tried[:ways].reshape(-1, 3), stiffness[:ways].reshape(-1, 3)).ravel()
            moved[ways:] = self.bolt_law.between(tried[ways:], stiffness[ways:])
        raise NoEquilibrium(f"joints are {np.abs(apart).max():.3g} m apart after {MAX_ITERATIONS} iterations")

    def joints(self, displacement: np.ndarray, slip: np.ndarray) -> dict[str, np.ndarray]:
        """Movements of and forces in the joints and their bolts, (n_joints,) float64 each, named as in a response.

        slip : (n_joints,) float64, irreversible dislocations [m]; empty where joints are linear.
        """
        slips = slip if slip.size else np.zeros(self.law.count)
        fields = self._lining.joint_fields((self.basis @ displacement)[None], slips[None])
        return {name: values[0] for name, values in fields.items()}

    def internal_forces(self, displacement: np.ndarray, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """N, Q [N/m] and M [N m/m] at theta [rad], (n,) float64 each; signs: `structure.response`."""
        around = np.degrees(theta)
        forces = [part @ displacement for part in self._readings]
        if self._bolt_shares is not None:
            pull, _ = self.bolt_law.pull(self.moves[3 * self.law.count :] @ displacement)
            forces = [force + share @ pull for force, share in zip(forces, self._bolt_shares, strict=True)]
        return tuple(np.interp(around, THETA, force, period=360.0) for force in forces)


def _answers(lining: DiscreteLining, mass: sparse.csr_array, rigid: np.ndarray, n_harmonics: int) -> np.ndarray:
    """Displacements without those of the ring as a whole, (n, n_answers): to harmonics on the face and to joint forces.

    What a load has left over accelerates the ring as a whole; where loads balance each other so do these forces.
    """
    ring, parts = lining.ring, lining.parts
    along, across = ring.axial_stiffness / ring.centre_radius, ring.bending_stiffness / ring.centre_radius
    joints = springs_at(parts.jumps, np.tile([along, along, across], parts.law.count))
    held, carried = (parts.segments + joints).tocsr(), mass @ rigid
    phase = np.outer(FACE, np.arange(n_harmonics + 1))
    harmonics = np.hstack([np.cos(phase), np.sin(phase[:, 1:])])
    pairs = [part.T.toarray() for part in (parts.jumps, parts.bolts)]
    loads = np.hstack([*(part @ harmonics for part in lining.tractions(FACE)), *pairs])
    loads = loads / np.abs(loads).max(axis=0)
    loads -= carried @ np.linalg.solve(rigid.T @ carried, rigid.T @ loads)
    # Held at three displacements of two nodes a quarter apart, which takes no force from loads in balance.
    quarter = int(np.argmin(np.abs((parts.node_angle - parts.node_angle[0]) % (2 * np.pi) - np.pi / 2)))
    free = np.setdiff1d(np.arange(len(rigid)), [*parts.nodes[0], parts.nodes[quarter, 0]])
    answers = np.zeros_like(loads)
    answers[free] = splu(held[free][:, free].tocsc()).solve(loads[free])
    return answers - rigid @ np.linalg.solve(rigid.T @ carried, carried.T @ answers)


def _orthonormal(columns: np.ndarray, mass: sparse.csr_array) -> np.ndarray:
    """Combinations of columns, orthonormal in mass, without those that depend on the others."""
    columns = columns / np.sqrt(np.sum(columns * (mass @ columns), axis=0))
    sizes, ways = np.linalg.eigh(columns.T @ (mass @ columns))
    kept = sizes > DEPENDENT * sizes[-1]
    return columns @ (ways[:, kept] / np.sqrt(sizes[kept]))
