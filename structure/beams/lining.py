"""A ring of beams, joint and soil springs, loaded on its outer face (load-structure model, Xie et al., Eq. 9)."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import sparse

from structure import joint_laws
from structure.banded import folded
from structure.beams.elements import (
    joint_jumps,
    nodal_masses,
    segment_stiffness,
    self_weight,
    traction_operator,
)
from structure.beams.mesh import RingMesh
from structure.beams.sections import displacements_at, section_forces
from structure.bolts import bolt_law
from structure.discrete import SIDES, DiscreteLining, Readings
from structure.joint_laws import FaceLaw, FacePoints, JointLaw
from structure.lining import THETA
from structure.nodal_forces import RingParts, tilted, whole_movements
from structure.ring import Ring, alone, check_ring


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
        beside = None if ring.neighbour is None else BeamSpringLining(alone(ring.beside))
        super().__init__(ring, _parts(ring, self.mesh), _readings(ring, self.mesh), beside)

    def tractions(self, theta: np.ndarray) -> tuple[sparse.csr_array, sparse.csr_array]:
        return traction_operator(self.ring, self.mesh, theta)


def _parts(ring: Ring, mesh: RingMesh) -> RingParts:
    size, node = 3 * mesh.n_nodes, np.arange(mesh.n_nodes)
    nodes = mesh.unknowns(node)[:, :2]
    whole = whole_movements(size, nodes, mesh.node_angle, 1.0)
    rigid = whole.copy()
    rigid[2, 2::3] = 1 / ring.centre_radius
    invert = int(np.argmin(np.abs(mesh.node_angle % (2 * np.pi) - np.pi)))
    jumps = tilted(joint_jumps(mesh), ring.tilts)
    # Tangential springs on the outer face also feel the rotation.
    on_face = ring.ground is not None and ring.ground.slip_at == "outer_face"
    lever = np.full(mesh.n_nodes, ring.thickness / 2 if on_face else 0.0)
    place = (np.concatenate([node, mesh.n_nodes + node, mesh.n_nodes + node]), mesh.unknowns(node).T.ravel())
    values = np.concatenate([np.ones(2 * mesh.n_nodes), lever])
    return RingParts(
        segments=segment_stiffness(ring, mesh),
        jumps=jumps,
        **_joints(ring, jumps),
        feel=sparse.coo_array((values, place), shape=(2 * mesh.n_nodes, size)).tocsr(),
        area=np.tile(ring.outer_radius * mesh.node_span, 2),
        weight=self_weight(ring, mesh),
        mass=sparse.diags_array(nodal_masses(ring, mesh)).tocsr(),
        place=mesh.unknowns(folded(mesh.n_nodes)).ravel(),
        held=np.zeros(0, dtype=int) if ring.ground is not None else mesh.unknowns(invert),
        nodes=nodes,
        node_angle=mesh.node_angle,
        rigid=rigid,
        mean=whole * np.repeat(mesh.node_span / (2 * np.pi), 3),
        arm=np.tile([1.0, 1.0, ring.centre_radius], mesh.n_nodes),
    )


def _joints(ring: Ring, jumps: sparse.csr_array) -> dict[str, Any]:
    """Laws of joints and bolts, with what they take of the unknowns: plane sections stay plane."""
    law, moves, count = JointLaw(ring), jumps, len(ring.joint_angles)
    if ring.joint_contact == "face":
        each = joint_laws.FACE_POINTS
        joint, place = np.repeat(np.arange(count), each), (np.arange(each) + 0.5) / each - 0.5
        lever = np.outer(ring.contact_heights, place).ravel()
        points = FacePoints(joint, lever, ring.contact_heights[joint] / each)
        gap = jumps[3 * joint] + sparse.diags_array(lever) @ jumps[3 * joint + 2]
        in_turn = np.arange(2 * len(joint)).reshape(2, -1).T.ravel()
        law, moves = FaceLaw(ring, points), sparse.vstack([gap, jumps[3 * joint + 1]]).tocsr()[in_turn]
    bolts = jumps[:0]
    if ring.bolts:
        offset = sparse.diags_array(np.array([bolts.offset for bolts in ring.bolts]))
        bolts = (jumps[::3] + offset @ jumps[2::3]).tocsr()
    return {"law": law, "moves": moves, "bolts": bolts, "bolt_law": bolt_law(ring)}


def _readings(ring: Ring, mesh: RingMesh) -> Readings:
    theta = np.radians(THETA)
    sides = [displacements_at(mesh, theta + side, ring.centre_radius) for side in SIDES]
    movement = tuple((one + other) / 2 for one, other in zip(*sides, strict=True))
    return Readings(
        forces=section_forces(ring, mesh, theta),
        movement=movement,
        quarters=movement[0][:: len(THETA) // 4],
        spring_angle=mesh.node_angle,
    )
