"""Straight bolts across the joints of a continuum ring: springs between two places inside the segments."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import sparse

from structure.continuum.mesh import ContinuumMesh
from structure.continuum.sections import edge_shapes
from structure.ring import Ring


class Bolts(NamedTuple):
    """One row of straight bolts across every joint, square to it, besides the joint's own springs.

    offset : where they cross the joint, outward from the centre line [m];  length : between their anchors [m];
    stiffness : EA/length of all of them per metre of tunnel [N/m per m].
    They pull and press alike, as bolts do that were tightened beforehand; pockets take no concrete away.
    """

    offset: float
    length: float
    stiffness: float


def check_bolts(ring: Ring, bolts: Bolts):
    """Refuse bolts that mean nothing or whose anchors lie outside the concrete."""
    if not ring.joint_angles:
        raise ValueError("bolts: the ring must have joints, got none; leave bolts out, or give joint_angles")
    for name, value in {"length": bolts.length, "stiffness": bolts.stiffness}.items():
        if not 0 < value < np.inf:
            raise ValueError(f"bolts: {name} must be above 0, got {value:g}; leave bolts out for a joint without")
    if not abs(bolts.offset) < ring.thickness / 2:
        raise ValueError(
            f"bolts: offset must lie within half the thickness {ring.thickness / 2:g} m, got {bolts.offset:g} m;"
            " it counts outward from the centre line"
        )
    half_angle, radius = anchor_place(ring, bolts)
    if radius > ring.outer_radius:
        raise ValueError(
            f"bolts: anchors must lie inside the concrete, below {ring.outer_radius:g} m from the axis, got"
            f" {radius:.4g} m; a straight bolt this long leaves the curved segment: shorten it or move it inward"
        )
    if 2 * half_angle >= np.radians(min(ring.segment_angles)):
        raise ValueError(
            f"bolts: length must leave anchors in neighbouring segments, got {bolts.length:g} m, which spans a segment"
            f" of {min(ring.segment_angles):g} degrees; shorten it"
        )


def bolt_elongation(ring: Ring, mesh: ContinuumMesh, bolts: Bolts) -> sparse.csr_array:
    """How much the bolt of every joint grows, from node displacements, (n_joints, n_unknowns) [m/m].

    Displacements at the anchors are those of the elements around them.

    Raises
    ------
    ValueError
        An anchor lies in the open gate.
    """
    half_angle, radius = anchor_place(ring, bolts)
    joint = np.radians(ring.joint_angles)
    n_unknowns = 2 * mesh.n_lines * mesh.n_levels
    elongation = sparse.csr_array((len(joint), n_unknowns))
    layer = int(np.clip(np.searchsorted(mesh.radius[::2], radius) - 1, 0, mesh.layers - 1))
    height = (radius - mesh.radius[2 * layer]) / mesh.layer_height[layer]
    across = edge_shapes(np.array([height]))[0]
    for side in (1, -1):
        column, place = mesh.locate((joint + side * half_angle) % (2 * np.pi))
        if (column < 0).any():
            raise ValueError(
                f"bolts: anchors must lie in concrete, got one of joint {int(np.argmax(column < 0)) + 1} in the open"
                " gate; shorten the bolts or move the gate"
            )
        weights = edge_shapes(place)[:, :, None] * across
        lines = mesh.column_lines[column]
        nodes = lines[:, :, None] * mesh.n_levels + 2 * layer + np.arange(3)
        lean = mesh.angle[lines][:, :, None] - joint[:, None, None]
        rows = np.broadcast_to(np.arange(len(joint))[:, None, None], weights.shape)
        for way, axis in enumerate((np.sin(lean), np.cos(lean))):
            entries = (side * weights * axis).ravel()
            unknowns = np.broadcast_to(2 * nodes + way, weights.shape).ravel()
            elongation = elongation + sparse.coo_array((entries, (rows.ravel(), unknowns)), shape=elongation.shape)
    return elongation.tocsr()


def bolt_shares(ring: Ring, bolts: Bolts, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """N, Q and M of whole sections at theta [rad] from the pull of the bolts they cut, (n_theta, n_joints) each."""
    half_angle, _ = anchor_place(ring, bolts)
    lean = (theta[:, None] - np.radians(ring.joint_angles) + np.pi) % (2 * np.pi) - np.pi
    cut = np.abs(lean) < half_angle
    from_axis = (ring.centre_radius + bolts.offset) / np.cos(np.where(cut, lean, 0.0))
    along = np.where(cut, np.cos(lean), 0.0)
    return -along, np.where(cut, -np.sin(lean), 0.0), along * (from_axis - ring.centre_radius)


def near_anchors(ring: Ring, bolts: Bolts, angle: np.ndarray) -> np.ndarray:
    """Whether an anchor lies within 3.5 degrees of angles [rad], (n,) bool: its pull is concentrated there."""
    half_angle, _ = anchor_place(ring, bolts)
    lean = np.abs((angle[:, None] - np.radians(ring.joint_angles) + np.pi) % (2 * np.pi) - np.pi)
    return (np.abs(lean - half_angle) < np.radians(3.5)).any(axis=1)


def anchor_place(ring: Ring, bolts: Bolts) -> tuple[float, float]:
    """Angle [rad] from the joint, and distance from the axis [m], of either anchor."""
    from_axis, half = ring.centre_radius + bolts.offset, bolts.length / 2
    return float(np.arctan2(half, from_axis)), float(np.hypot(half, from_axis))
