"""Levels of local time stepping: elements grouped by powers of two of their own time step.

The elements of a level are a mesh of their own with its own nodal sums. Where levels
meet, a node has one *row* a level, and the rows are tied: they share mass, forces and velocity. The node takes the step
of its finest level. A coarser row's forces stay as they were at the beginning of its own, longer step, its momentum
follows the node's velocity, and its points are moved at the end by what the node did in all of its steps. The forces of
an element add up to zero over its nodes and act for one and the same time on all of them, so momentum is conserved.
A force is held over the step of its element, not given as one kick at its beginning: kicks of prestressed ground would
shake nodes that are in equilibrium. But a held force acts late at a finer node, by half of what the steps differ, and a
late spring feeds motion; so the stress of elements that meet a finer level runs ahead by that (`Levels.ahead`).

Source: nodes with steps of their own after Belytschko, Yen & Mullen (1979), Mixed methods for time integration;
elements with steps of their own after Lew, Marsden, Ortiz & West (2003), Asynchronous variational integrators.
"""

import copy
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

MOST_LEVELS = 8
OFFSETS = np.linspace(0.5, 1.0, 17)  # of the shortest altitude: where the borders between levels may lie


@dataclass(frozen=True, eq=False)
class Levels:
    """How a mesh is cut into levels, the finest one 0.

    Attributes
    ----------
    of_element : (n_elements,) int8
        Ascending.
    rows : (n_elements, 3) int32
        Row of each corner. Row i is that of the finest level at node i; rows of coarser levels follow after all nodes.
    next_row : (n_rows,) int32
        The next coarser row of the same node, or -1.
    node_of_row : (n_rows,) int32
    of_row : (n_rows,) int8
    nodes : (n_nodes,) int32
        Nodes by their finest level, and in a level by the first element that they belong to, `first_of_node`;
        `node_cuts` (n_levels + 1,) says where each level begins; `element_cuts` does so for elements.
    """

    of_element: NDArray[np.int8]
    rows: NDArray[np.int32]
    next_row: NDArray[np.int32]
    node_of_row: NDArray[np.int32]
    of_row: NDArray[np.int8]
    nodes: NDArray[np.int32]
    first_of_node: NDArray[np.int32]
    node_cuts: NDArray[np.int64]
    element_cuts: NDArray[np.int64]

    @property
    def count(self):
        """Number of levels."""
        return len(self.element_cuts) - 1

    def stiffened(self, damping):
        """Factor by which its own step makes an element stiffer for a spectrum in steps of level 0: (n_elements,).

        damping : how far all stress runs ahead, in steps of its element [-].
        """
        return 4.0**self.of_element * (1 + 2 * (damping + self.ahead(2 ** np.arange(self.count))))

    @cached_property
    def finest_around(self):
        """Finest level at the nodes of each element: (n_elements,) int8; its own where it meets no finer one."""
        return self.of_row[self.node_of_row[self.rows]].min(axis=1)

    def ahead(self, periods):
        """How far the stress of elements that meet a finer level has to run ahead, in steps of the element.

        At a node of a finer level a force held over N of its steps acts later than the stress that it comes from, by
        (N - 1)/2 of them in the mean. Held back, a spring drives the motion that stretches it.

        Returns
        -------
        (n_elements,) float64
            (N - 1) / (2 N) by the finest level at the element's nodes; 0 where they all are of its own.
        """
        return 0.5 * (1.0 - periods[self.finest_around] / periods[self.of_element])


def element_levels(elements, n_nodes, altitude, weight, finest):
    """Level of every element, such that its altitude is at least 2^level times that of level 0.

    The altitude where level 0 begins lies between half and all of the shortest one: where the work is least. The four
    elements of a cell, one after the other, are of one level, that of the lowest.

    Parameters
    ----------
    elements : (n_elements, 3) int32
    n_nodes : int
    altitude : (n_elements,) float64
        Smallest altitude [m]; the time step is proportional to it.
    weight : (n_elements,) float64
        Work of an element in a step, in any unit.
    finest : (n_nodes,) bool
        Nodes that are of level 0 with all their elements.

    Returns
    -------
    (n_elements,) int8
    """
    cells = elements.reshape(-1, 12)
    first = finest[cells].any(axis=1)
    altitude, weight = altitude.reshape(-1, 4).min(axis=1), weight.reshape(-1, 4).sum(axis=1)
    best, least = np.zeros(len(cells), np.int8), float(weight.sum())
    for offset in OFFSETS[::-1]:
        own = np.floor(np.log2(altitude / (offset * altitude.min())) + 1e-9).astype(np.int8)
        level = _widened(np.where(first, 0, np.minimum(own, MOST_LEVELS - 1)), cells, n_nodes)
        work = float((weight / 2.0**level).sum()) / offset
        if work < 0.999 * least:
            best, least = level, work
    return np.repeat(best, 4)


def _finest_at_nodes(level, cells, n_nodes):
    finest = np.full(n_nodes, MOST_LEVELS, np.int8)
    np.minimum.at(finest, cells.ravel(), np.repeat(level, cells.shape[1]))
    return finest


def _widened(level, cells, n_nodes):
    """Give all cells around a node its finest level, so that the smallest cell has a whole patch around it."""
    return _finest_at_nodes(level, cells, n_nodes)[cells].min(axis=1)


def sorted_by_level(mesh, level):
    """The mesh with its elements in the order of their level, and the levels in that order."""
    order = np.argsort(level, kind="stable")
    if np.array_equal(order, np.arange(len(order))):
        return mesh, level
    mesh = copy.copy(mesh)
    object.__setattr__(mesh, "elements", np.ascontiguousarray(mesh.elements[order]))
    object.__setattr__(mesh, "region", np.ascontiguousarray(mesh.region[order]))
    return mesh, level[order]


def tie(elements, n_nodes, level):
    """Rows of the nodes for elements in the order of their level.

    Returns
    -------
    Levels
    """
    count = int(level.max()) + 1
    pairs = np.unique(np.column_stack([elements.ravel(), np.repeat(level, 3)]).astype(np.int64), axis=0)
    node, of_pair = pairs.T
    first = np.ones(len(pairs), bool)
    first[1:] = node[1:] != node[:-1]
    row = np.where(first, node, 0)
    row[~first] = n_nodes + np.arange((~first).sum())
    n_rows = n_nodes + int((~first).sum())
    next_row, node_of_row = np.full(n_rows, -1, np.int32), np.arange(n_rows, dtype=np.int32)
    of_row = np.zeros(n_rows, np.int8)  # a node of no element: level 0, without mass
    of_row[row] = of_pair
    node_of_row[row] = node
    next_row[row[:-1][~first[1:]]] = row[1:][~first[1:]]
    number = np.full((n_nodes, count), -1, np.int32)
    number[node, of_pair] = row
    row_of_corner = np.ascontiguousarray(number[elements, level[:, None]])
    first_element = np.full(n_nodes, len(elements), np.int32)
    own = row_of_corner < n_nodes
    np.minimum.at(
        first_element, row_of_corner[own], np.repeat(np.arange(len(elements), dtype=np.int32), 3)[own.ravel()]
    )
    nodes = np.lexsort((first_element, of_row[:n_nodes]))
    edges = np.arange(count + 1)
    return Levels(
        of_element=np.ascontiguousarray(level, np.int8),
        rows=row_of_corner,
        next_row=next_row,
        node_of_row=node_of_row,
        of_row=of_row,
        nodes=nodes.astype(np.int32),
        first_of_node=first_element[nodes],
        node_cuts=np.searchsorted(of_row[:n_nodes][nodes], edges),
        element_cuts=np.searchsorted(level, edges),
    )
