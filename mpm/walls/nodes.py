"""Nodes of a lining: what pushes where, with the gate shut and open."""

from types import SimpleNamespace

import numpy as np

from mpm.fields import CONTACT_RECORD
from mpm.k0_procedure import initial_stress
from mpm.mesh.half import ring_factors, whole_ring
from mpm.walls.gate import channel_nodes, corner_normals


def contact_nodes(scene, mesh):
    """Nodes of the outer faces, of the channel's walls and of the inner face beside it, in this order.

    Returns
    -------
    SimpleNamespace
        node: (n_contact,) int; closed, open: (n_contact,) records of `mpm.fields.CONTACT`, with the gate shut and
        open; lining: a SimpleNamespace for each tunnel with theta [deg], arc [m], rows of the contact arrays, factors
        of their impulses, and whether they bear with the gate open; moved_by: rows that move with each tunnel's lining.
    """
    node, closed, opened, active_closed, active_open, friction = [], [], [], [], [], []
    lining, corners = [], corner_normals(scene, mesh)
    opening = set(mesh.opening_nodes.tolist()) if scene.gate is not None else set()
    for t, tunnel in enumerate(scene.tunnels):
        outer = mesh.outer_nodes[t]
        first = len(node)
        for i, outward in zip(outer, balanced_normals(scene, mesh, outer), strict=True):
            node.append(i)
            closed.append(outward)
            opened.append(corners.get(int(i), outward))
            active_closed.append(True)
            active_open.append(int(i) not in opening)
            friction.append(tunnel.friction_coefficient)
        theta, ring = mesh.outer_theta[t], ring_positions(scene, mesh, outer)
        rows, factors = np.arange(first, len(node)), np.ones((1, 5))
        if scene.is_half:
            place = whole_ring(len(outer))
            outer, rows, factors = outer[place], rows[place], ring_factors(len(outer))
            theta = np.where(np.arange(len(place)) < len(theta), theta[place], 360.0 - theta[place])
        edge = np.linalg.norm(np.roll(ring, -1, axis=0) - ring, axis=1)
        arc = 0.5 * (edge + np.roll(edge, 1))
        bears_open = np.array([int(i) not in opening and int(i) not in corners for i in outer])
        lining.append(SimpleNamespace(theta=theta, arc=arc, rows=rows, factors=factors, bears=bears_open))
    rows = [part.rows for part in lining]
    if scene.gate is not None:
        gated, (channel, inward) = scene.gate.tunnel, channel_nodes(scene, mesh)
        rows[gated] = np.r_[rows[gated], len(node) : len(node) + len(channel)]
        for listed, more in ((node, channel), (closed, inward), (opened, inward)):
            listed.extend(more)
        for listed in (active_closed, active_open):
            listed.extend([True] * len(channel))
        friction += [scene.tunnels[gated].friction_coefficient] * len(channel)
    records = {}
    for name, normals, active in (("closed", closed, active_closed), ("open", opened, active_open)):
        records[name] = np.zeros(len(node), CONTACT_RECORD)
        records[name]["normal_x"], records[name]["normal_y"] = np.array(normals, float).reshape(-1, 2).T
        records[name]["active"], records[name]["friction"] = active, friction
    return SimpleNamespace(
        node=np.array(node, int),
        **records,
        lining=lining,
        moved_by=rows,
    )


def nodes_of_moving_linings(scene, mesh):
    """Nodes that a lining touches which is not held: (n_nodes,) bool."""
    touched = np.zeros(len(mesh.nodes), bool)
    for t, tunnel in enumerate(scene.tunnels):
        if scene.lining_of(tunnel) != "fixed":
            touched[mesh.outer_nodes[t]] = True
            if scene.gate is not None and scene.gate.tunnel == t:
                touched[mesh.wall_nodes] = touched[mesh.inner_nodes] = True
    return touched


def ring_positions(scene, mesh, outer):
    """Positions of all nodes of a ring, clockwise: those of a half model and their mirror images [m]."""
    position = mesh.nodes[outer]
    if not scene.is_half:
        return position
    place = whole_ring(len(outer))
    image = np.arange(len(place)) >= len(outer)
    return position[place] * np.column_stack([np.where(image, -1.0, 1.0), np.ones(len(place))])


def balanced_normals(scene, mesh, outer):
    """Normals of the outer face along the resultant of the hydrostatic pressure at each node.

    On a polygon the resultant of a pressure on the two edges of a node is not radial. A wall
    that can only push along the radius would let still water creep along it.
    """
    position = ring_positions(scene, mesh, outer)
    _, pressure = initial_stress(scene, -position[:, 1])
    pressure = np.maximum(pressure, 1.0)  # above the water table: as for a uniform pressure
    edge = np.roll(position, -1, axis=0) - position  # clockwise to the next node
    outward = np.column_stack([-edge[:, 1], edge[:, 0]])
    after = np.roll(pressure, -1)
    force = outward * (2 * pressure + after)[:, None]
    force += np.roll(outward * (pressure + 2 * after)[:, None], 1, axis=0)
    return (force / np.linalg.norm(force, axis=1)[:, None])[: len(outer)]
