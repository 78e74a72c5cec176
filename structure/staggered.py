"""Two rings as one: matrices of a ring and of the one beside it, coupled along their circumferential joint."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee

from structure.bolts import BoltLaw
from structure.nodal_forces import RingParts, springs_at
from structure.ring import Neighbour


def coupling_springs(neighbour: Neighbour, centre_radius: float, lined: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Radial and tangential stiffness between two rings at angles evenly around them, (n_theta,) each [N/m2].

    A ring has a circumferential joint to either side, so per metre of tunnel there are two over its width.

    lined : (n_theta,) float64, share of the tunnel's length where both rings are.
    """
    arc = 2 * np.pi * centre_radius / len(lined)
    per_metre = 2 / neighbour.ring_width * arc * lined
    return neighbour.radial_stiffness * per_metre, neighbour.tangential_stiffness * per_metre


def paired(one: RingParts, other: RingParts, apart: sparse.csr_array, springs: np.ndarray, clamped: bool) -> RingParts:
    """Both rings in one set of unknowns, those of the first before those of the other.

    apart : (k, n_one + n_other) sparse, by how much the two part;  springs : (k,) float64 against that [N/m2];
    clamped : whether both are held; else the first holds the other.
    """
    size = one.segments.shape[0]
    held = np.concatenate([one.held, other.held + size]) if clamped else one.held

    def both(first, second):
        return sparse.block_diag([first, second], format="csr")

    def in_turn(first, second):
        """Of springs: all normal ones, then all tangential ones."""
        halves = [np.split(each, 2) for each in (first, second)]
        return np.concatenate([half[k] for k in (0, 1) for half in halves])

    feel = both(one.feel, other.feel)[in_turn(np.arange(len(one.area)), len(one.area) + np.arange(len(other.area)))]
    parts = RingParts(
        segments=(both(one.segments, other.segments) + springs_at(apart, springs)).tocsr(),
        jumps=both(one.jumps, other.jumps),
        feel=feel,
        area=in_turn(one.area, other.area),
        weight=np.concatenate([one.weight, other.weight]),
        mass=both(one.mass, other.mass),
        place=np.zeros(size + other.segments.shape[0], dtype=int),
        held=held,
        nodes=np.concatenate([one.nodes, other.nodes + size]),
        node_angle=np.concatenate([one.node_angle, other.node_angle]),
        rigid=np.hstack([one.rigid, other.rigid]),
        mean=np.hstack([one.mean, other.mean]) / 2,
        arm=np.concatenate([one.arm, other.arm]),
        law=one.law.followed_by(other.law),
        moves=both(one.moves, other.moves),
        bolts=both(one.bolts, other.bolts),
        bolt_law=BoltLaw(*map(np.concatenate, zip(one.bolt_law, other.bolt_law, strict=True))),
        bolts_reach=one.bolts_reach,
    )
    return parts._replace(place=_narrow(parts))


def _narrow(parts):
    """Place of every unknown in a narrow band."""
    near = abs(parts.linear) + abs(parts.feel.T) @ abs(parts.feel)
    if not parts.bolts_reach:
        near = near + abs(parts.bolts.T) @ abs(parts.bolts)
    order = reverse_cuthill_mckee(near.tocsr(), symmetric_mode=True)
    place = np.empty(len(order), dtype=int)
    place[order] = np.arange(len(order))
    return place
