"""What the kernels of a step read and write, in named groups: arrays of :class:`mpm.Solver` and numbers of the scene.

Records are those of `mpm.fields`. Rows of nodes: those of the nodes themselves, then one for each coarser level that a
node ties to its finest (:class:`mpm.time_step.levels.Levels`). Parts: of the mesh, each the work of one thread at a
time (`mpm.machine.team`).
"""

from typing import NamedTuple

import numpy as np

from mpm.time_step.clock import Clock, Pace


class Needs(NamedTuple):
    """What a scene needs of the kernels; the rest is compiled out."""

    wet: bool  # pore water
    two_phase: bool  # with a velocity of its own
    tied: bool  # levels of local time stepping
    moving: bool  # linings that move
    laws: tuple[type, ...]  # classes of the soils' laws


class Layout(NamedTuple):
    """Where the levels lie in the lists of elements and nodes: see :class:`mpm.time_step.levels.Levels`."""

    element_cuts: np.ndarray
    node_cuts: np.ndarray
    first_of_node: np.ndarray


class Cuts(NamedTuple):
    """Where the lists of occupied elements and nodes of each level are cut: (n_levels, n_parts + 1) int64."""

    elements: np.ndarray
    nodes: np.ndarray
    solved: np.ndarray  # `nodes` at the beginning of the long step: the others change while nodes are solved


class Ground(NamedTuple):
    """Points by element, and the soils."""

    occupied: np.ndarray  # (n_elements,) int32, elements that hold points
    start: np.ndarray  # (n_elements + 1,) int32, where the points of an element begin in `order`
    order: np.ndarray  # (n_points,) int32
    points: np.ndarray  # (n_points,) records
    element_of_point: np.ndarray  # (n_points,) int32; -1: taken out, -2 - e: left element e, not found again yet
    soil_of_point: np.ndarray  # (n_points,) int32
    soils: np.ndarray  # (n_soils,) records of `mpm.laws.soil_table`


class Net(NamedTuple):
    """Elements and the rows of their nodes."""

    rows: np.ndarray  # (n_elements, 3) int32, rows of the corners
    geometry: np.ndarray  # (n_elements,) records
    neighbours: np.ndarray  # (n_elements, 3) int32, of `mpm.tables.element_neighbours`
    level_of_element: np.ndarray  # (n_elements,) int8
    layout: Layout
    contents: np.ndarray  # (n_elements,) records
    which_node: np.ndarray  # (n_nodes,) int32, the nodes by their finest level
    next_row: np.ndarray  # (n_rows,) int32, of the same node on a coarser level, or -1
    level_of_row: np.ndarray  # (n_rows,) int8
    nodes: np.ndarray  # (n_rows,) records
    tied_means: np.ndarray  # (n_rows - n_nodes,) records
    status: np.ndarray  # (n_nodes,) int8, bits of the constraints that acted
    touched: np.ndarray  # (n_parts, n_rows) uint8: whether a part may have added to a row; else it holds zeros
    sums: np.ndarray  # (n_parts, n_rows) records; added in the order of the parts
    momenta: np.ndarray  # (n_parts, n_rows) records
    empty_sum: np.ndarray  # (1,) record of zeros, to clear with
    empty_momentum: np.ndarray  # (1,)


class Walls(NamedTuple):
    """Constraints of the nodes, and what they felt."""

    fixed: np.ndarray  # (n_nodes,) int8, bits of `mpm.walls.contact`
    sides: np.ndarray  # (n_nodes,) records
    contact_of_node: np.ndarray  # (n_nodes,) int32, row of the arrays that follow, or -1
    contact: np.ndarray  # (n_contact,) records
    velocity: np.ndarray  # (n_contact, 2) float64 of the lining [m/s]; read where linings move
    impulse: np.ndarray  # (n_contact,) records, added


class Medium(NamedTuple):
    """Numbers of the scene."""

    gravity: float
    density_liquid: float
    bulk_liquid: float


class Tally(NamedTuple):
    """What the passes count and leave for each other."""

    counts: np.ndarray  # (5,) int64, places in `mpm.step.substep`
    measures: np.ndarray  # (2,) float64, likewise
    limits: np.ndarray  # (2 n_parts, 2): of the time step, by part, and of the points that left their element
    suspended: np.ndarray  # (n_parts,)
    bad: np.ndarray  # (n_parts,) first point with a state that is not finite, or -1
    n_left: np.ndarray  # (n_parts,)
    first_left: np.ndarray  # (n_parts,) where the points of each part begin in the next two
    clamps: np.ndarray  # (n_parts,) records
    ledger: np.ndarray  # (n_parts,) records
    left: np.ndarray  # (n_points,) points that left their element
    origin: np.ndarray  # (n_points,) that element
    spare: np.ndarray  # (n_points,) int32, for copies of `order`


class System(NamedTuple):
    """All that a step reads and writes."""

    ground: Ground
    net: Net
    walls: Walls
    cuts: Cuts
    clock: Clock
    pace: Pace
    medium: Medium
    tally: Tally
