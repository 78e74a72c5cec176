"""A ring of beams, joint and soil springs, loaded on its outer face (load-structure model, Xie et al., Eq. 9)."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from structure.banded import folded
from structure.beams.elements import joint_jumps, section_operators, segment_stiffness, self_weight, traction_operator
from structure.beams.mesh import RingMesh, displacements_at, forces_at
from structure.discrete import SIDES, DiscreteLining, Readings, Stations
from structure.lining import THETA
from structure.ring import Ring, check_ring
from structure.ring_forces import RingParts, whole_movements
from structure.springs import joint_spring


class BeamSpringLining(DiscreteLining):
    """Straight Timoshenko beams on the centre line, zero-thickness joints, soil springs on the outer face.

    Parameters
    ----------
    ring : Ring

    Notes
    -----
    Forces are taken at the middle of every element, where the chord is parallel to the circle, and are linear between
    the middles. Displacements on a joint are the mean of its two sides. Soil springs start unstressed at the undeformed
    ring: the pressures given are what the soil exerts there, and the springs add what the ring's displacement
    mobilises.
    """

    name = "beam-spring"

    def __init__(self, ring: Ring):
        check_ring(ring)
        self.mesh = RingMesh(ring)
        super().__init__(ring, _parts(ring, self.mesh), _readings(ring, self.mesh))

    def tractions(self, theta: np.ndarray) -> tuple[sparse.csr_array, sparse.csr_array]:
        return traction_operator(self.ring, self.mesh, theta)


def _parts(ring: Ring, mesh: RingMesh) -> RingParts:
    size, node = 3 * mesh.n_nodes, np.arange(mesh.n_nodes)
    nodes = mesh.unknowns(node)[:, :2]
    whole = whole_movements(size, nodes, mesh.node_angle, 1.0)
    rigid = whole.copy()
    rigid[2, 2::3] = 1 / ring.centre_radius
    jumps, springs = joint_jumps(mesh), np.tile(joint_spring(ring), len(mesh.joint_after))
    # Tangential springs on the outer face also feel the rotation.
    lever = np.zeros(mesh.n_nodes) + (ring.thickness / 2 if _slips_on_face(ring) else 0.0)
    place = (np.concatenate([node, mesh.n_nodes + node, mesh.n_nodes + node]), mesh.unknowns(node).T.ravel())
    values = np.concatenate([np.ones(2 * mesh.n_nodes), lever])
    return RingParts(
        segments=segment_stiffness(ring, mesh),
        linear_joints=(jumps.T @ sparse.diags_array(springs) @ jumps).tocsr(),
        jumps=jumps,
        feel=sparse.coo_array((values, place), shape=(2 * mesh.n_nodes, size)).tocsr(),
        area=np.tile(ring.outer_radius * mesh.node_span, 2),
        weight=self_weight(ring, mesh),
        place=mesh.unknowns(folded(mesh.n_nodes)).ravel(),
        held=np.zeros(0, dtype=int) if ring.ground is not None else mesh.unknowns(_invert(mesh)),
        nodes=nodes,
        node_angle=mesh.node_angle,
        rigid=rigid,
        mean=whole * np.repeat(mesh.node_span / (2 * np.pi), 3),
        arm=np.tile([1.0, 1.0, ring.centre_radius], mesh.n_nodes),
    )


def _readings(ring: Ring, mesh: RingMesh) -> Readings:
    theta = np.radians(THETA)
    sections = section_operators(ring, mesh)
    at_theta = forces_at(mesh, theta)
    sides = [displacements_at(mesh, theta + side) for side in SIDES]
    movement = tuple((one + other) / 2 for one, other in zip(*sides, strict=True))
    return Readings(
        forces=tuple((at_theta @ part).tocsr() for part in sections),
        movement=movement,
        quarters=movement[0][:: len(THETA) // 4],
        lined=np.ones(len(THETA), dtype=bool),
        stations=_stations(ring, mesh, *sections[1:]),
    )


def _stations(ring, mesh, shear, moment):
    """Middles of the elements; between them lie the nodes, where loads and springs act."""
    following = np.roll(np.arange(len(mesh.span)), -1)
    span = mesh.span + mesh.span[following]
    middle = mesh.mid_angle + mesh.span / 2
    # Both nodes of a joint bring their springs.
    pairs = np.stack([mesh.second, mesh.first[following]], axis=1)
    share = mesh.node_span[pairs] / (span[:, None] / 2) * _slips_on_face(ring)
    share[:, 1] *= pairs[:, 0] != pairs[:, 1]
    place = (np.repeat(np.arange(len(pairs)), 2), (mesh.n_nodes + pairs).ravel())
    # The clamp's own couple is concentrated there.
    clamp = mesh.node_angle[_invert(mesh)] if ring.support == "invert" else np.inf
    return Stations(
        angle=mesh.mid_angle,
        shear=shear,
        moment=moment,
        middle=middle,
        share=mesh.span / span,
        slip=sparse.coo_array((share.ravel(), place), shape=(len(pairs), 2 * mesh.n_nodes)).tocsr(),
        lined=np.ones(len(pairs)),
        couple=np.zeros(len(pairs)),
        judged=np.abs(np.exp(1j * middle) - np.exp(1j * clamp)) > 1e-9 if np.isfinite(clamp) else middle < np.inf,
    )


def _slips_on_face(ring: Ring) -> bool:
    return ring.ground is not None and ring.ground.slip_at == "outer_face"


def _invert(mesh: RingMesh) -> int:
    """Node next to the invert."""
    return int(np.argmin(np.abs(mesh.node_angle % (2 * np.pi) - np.pi)))
