"""The ring as a chain of straight beams: its nodes, and what lies between them at any angle.

Unknowns at a node: radial w (outward), tangential v (clockwise), rotation b (clockwise). Nodes run clockwise from the
first joint (or the crown); a joint has two nodes at one place, the last of one segment and the first of the next.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from structure.ring import Ring


class RingMesh:
    """Nodes and elements of a ring.

    Attributes
    ----------
    node_angle : (n_nodes,) float64
        [rad], may exceed 2 pi.
    node_span : (n_nodes,) float64
        Tributary angle [rad].
    first : (n_elements,) int
        First node of each element; its second is the next one, modulo n_nodes.
    mid_angle, span : (n_elements,) float64
        Mid angle and angle of an element [rad].
    joint_before, joint_after : (n_joints,) int
        Nodes on the counter-clockwise and on the clockwise side of each joint.
    """

    def __init__(self, ring: Ring):
        counts = _elements_per_segment(ring)
        starts = np.radians(ring.joint_angles or (0.0,))
        gaps = np.radians(ring.segment_angles)
        jointed = bool(ring.joint_angles)
        angles, firsts = [], []
        for start, gap, count in zip(starts, gaps, counts, strict=True):
            offset = sum(map(len, angles))
            firsts.append(offset + np.arange(count))
            angles.append(start + gap * np.arange(count + jointed) / count)
        self.node_angle = np.concatenate(angles)
        self.n_nodes = len(self.node_angle)
        self.first = np.concatenate(firsts)
        self.second = (self.first + 1) % self.n_nodes
        self.span = np.repeat(gaps / counts, counts)
        self.mid_angle = self.node_angle[self.first] + self.span / 2
        self.node_span = np.bincount(self.first, self.span / 2, self.n_nodes)
        self.node_span += np.bincount(self.second, self.span / 2, self.n_nodes)
        heads = np.cumsum([0, *map(len, angles[:-1])]) if jointed else np.zeros(0, dtype=int)
        self.joint_after = heads
        self.joint_before = (heads - 1) % self.n_nodes

    def unknowns(self, nodes: np.ndarray) -> np.ndarray:
        """(..., 3) unknowns of nodes."""
        return 3 * np.asarray(nodes)[..., None] + np.arange(3)

    def gathered(self, blocks: np.ndarray, first: np.ndarray, second: np.ndarray) -> sparse.csr_array:
        """Rows that act on the unknowns of pairs of nodes, (n_rows, 3 n_nodes), from (n_rows, 6)."""
        columns = np.hstack([self.unknowns(first), self.unknowns(second)])
        rows = np.repeat(np.arange(len(columns)), 6)
        return sparse.coo_array(
            (blocks.ravel(), (rows, columns.ravel())), shape=(len(columns), 3 * self.n_nodes)
        ).tocsr()


def _elements_per_segment(ring: Ring) -> np.ndarray:
    """Elements of each segment, in proportion to its angle, n_elements in all (largest remainders)."""
    share = ring.n_elements * np.array(ring.segment_angles) / 360
    counts = np.maximum(np.floor(share + 1e-9).astype(int), 1)
    left = ring.n_elements - counts.sum()
    counts[np.argsort(counts - share, kind="stable")[:left]] += 1
    return counts
