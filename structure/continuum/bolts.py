"""Straight bolts across the joints of a continuum ring: springs between two places inside the segments."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from structure.continuum.mesh import ContinuumMesh
from structure.continuum.sections import edge_shapes
from structure.ring import Ring


def check_anchors(ring: Ring) -> None:
    """Refuse bolts whose anchors lie outside the concrete or in no neighbouring segment. Raises ValueError."""
    half_angle, radius = anchor_places(ring)
    segments = np.array(ring.segment_angles)
    shorter = np.minimum(segments, np.roll(segments, 1))
    for joint, bolts in enumerate(ring.bolts):
        if radius[joint] > ring.outer_radius:
            raise ValueError(
                f"joint_bolts: anchors must lie inside the concrete, below {ring.outer_radius:g} m from the axis, got"
                f" {radius[joint]:.4g} m; a straight bolt this long leaves the curved segment: shorten it or move it"
                " inward"
            )
        if 2 * half_angle[joint] >= np.radians(shorter[joint]):
            raise ValueError(
                f"joint_bolts: length must leave anchors in neighbouring segments, got {bolts.length:g} m, which spans"
                f" a segment of {shorter[joint]:g} degrees; shorten it"
            )


def bolt_elongation(ring: Ring, mesh: ContinuumMesh) -> sparse.csr_array:
    """How much the bolts of every joint grow, from node displacements, (n_joints, n_unknowns) [m/m].

    Displacements at the anchors are those of the elements around them.

    Raises
    ------
    ValueError
        An anchor lies in the open gate.
    """
    half_angle, radius = anchor_places(ring)
    joint = np.radians(ring.joint_angles)
    elongation = sparse.csr_array((len(joint), mesh.n_unknowns))
    layer = np.clip(np.searchsorted(mesh.radius[::2], radius) - 1, 0, mesh.layers - 1)
    across = edge_shapes((radius - mesh.radius[2 * layer]) / mesh.layer_height[layer])
    for side in (1, -1):
        column, place = mesh.locate((joint + side * half_angle) % (2 * np.pi))
        if (column < 0).any():
            raise ValueError(
                f"joint_bolts: anchors must lie in concrete, got one of joint {int(np.argmax(column < 0)) + 1} in the"
                " open gate; shorten the bolts or move the gate"
            )
        weights = side * edge_shapes(place)[:, :, None] * across[:, None, :]
        lines = mesh.column_lines[column]
        nodes = lines[:, :, None] * mesh.n_levels + 2 * layer[:, None, None] + np.arange(3)
        lean = mesh.angle[lines][:, :, None] - joint[:, None, None]
        elongation = elongation + mesh.gathered(nodes, weights * np.sin(lean), weights * np.cos(lean))
    return elongation.tocsr()


def bolt_shares(ring: Ring, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """N, Q and M of whole sections at theta [rad] from the pull of the bolts they cut, (n_theta, n_joints) each."""
    half_angle, _ = anchor_places(ring)
    lean = (theta[:, None] - np.radians(ring.joint_angles) + np.pi) % (2 * np.pi) - np.pi
    cut = np.abs(lean) < half_angle
    from_axis = (ring.centre_radius + _offsets(ring)) / np.cos(np.where(cut, lean, 0.0))
    along = np.where(cut, np.cos(lean), 0.0)
    return -along, np.where(cut, -np.sin(lean), 0.0), along * (from_axis - ring.centre_radius)


def near_anchors(ring: Ring, angle: np.ndarray) -> np.ndarray:
    """Whether an anchor lies within 3.5 degrees of angles [rad], (n,) bool: its pull is concentrated there."""
    half_angle, _ = anchor_places(ring)
    lean = np.abs((angle[:, None] - np.radians(ring.joint_angles) + np.pi) % (2 * np.pi) - np.pi)
    return (np.abs(lean - half_angle) < np.radians(3.5)).any(axis=1)


def anchor_places(ring: Ring) -> tuple[np.ndarray, np.ndarray]:
    """Angle [rad] from the joint, and distance from the axis [m], of either anchor of every joint, (n_joints,) each."""
    from_axis, half = ring.centre_radius + _offsets(ring), np.array([bolts.length for bolts in ring.bolts]) / 2
    return np.arctan2(half, from_axis), np.hypot(half, from_axis)


def _offsets(ring):
    return np.array([bolts.offset for bolts in ring.bolts])
