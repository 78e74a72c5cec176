"""What the kernels of a step read and write, in named groups: arrays of :class:`mpm.Solver` and numbers of the scene.

Rows of nodes: those of the nodes themselves, then one for each coarser level that a node ties to its finest
(:class:`mpm.levels.Levels`). Parts: of the mesh, each the work of one thread at a time (`mpm.meeting`).
"""

from typing import NamedTuple

import numpy as np

from mpm.clock import Clock, Pace
from mpm.points import Cuts, Layout


class Ground(NamedTuple):
    """Points by element, and the soils; columns in `mpm.variables`."""

    occupied: np.ndarray  # (n_elements,) int32, elements that hold points
    start: np.ndarray  # (n_elements + 1,) int32, where the points of an element begin in `order`
    order: np.ndarray  # (n_points,) int32
    points: np.ndarray  # (n_points, n_columns) float64
    element_of_point: np.ndarray  # (n_points,) int32; -1: taken out, -2 - e: left element e, not found again yet
    soil_of_point: np.ndarray  # (n_points,) int8
    soils: np.ndarray  # (n_soils, n_columns) float64


class Net(NamedTuple):
    """Elements and the rows of their nodes."""

    rows: np.ndarray  # (n_elements, 3) int32, rows of the corners
    geometry: np.ndarray  # (n_elements, 8) float64, of `mpm.tables.element_geometry`
    neighbours: np.ndarray  # (n_elements, 3) int32, of `mpm.tables.element_neighbours`
    level_of_element: np.ndarray  # (n_elements,) int8
    layout: Layout
    contents: np.ndarray  # (n_elements, 5) float64: volume of the points, times it pressure and place; how full
    which_node: np.ndarray  # (n_nodes,) int32, the nodes by their finest level
    next_row: np.ndarray  # (n_rows,) int32, of the same node on a coarser level, or -1
    level_of_row: np.ndarray  # (n_rows,) int8
    nodes: np.ndarray  # (n_rows, 10) float64: velocities, increments (over their whole step for tied rows), masses
    tied_means: np.ndarray  # (n_rows - n_nodes, 6) float64: mean over a tied row's step of the velocity of the grains,
    # and of the velocities of both phases that strain, remapped
    status: np.ndarray  # (n_nodes,) int8, bits of the constraints that acted
    touched: np.ndarray  # (n_parts, n_rows) uint8: whether a part may have added to a row; else it holds zeros
    sums: np.ndarray  # (n_parts, n_rows, 12) float64: masses, momenta, drag, forces; added in the order of the parts
    momenta: (
        np.ndarray
    )  # (n_parts, n_rows, 4) float64: new momenta of both phases, or of the mixture [kg m/s per metre]


class Walls(NamedTuple):
    """Constraints of the nodes, and what they felt."""

    fixed: np.ndarray  # (n_nodes,) int8, bits of box boundary and mirror line
    contact_of_node: np.ndarray  # (n_nodes,) int32, row of the arrays that follow, or -1
    normal: np.ndarray  # (n_contact, 2) float64, into the material
    active: np.ndarray  # (n_contact,) bool, whether the wall is there
    friction: np.ndarray  # (n_contact,) float64, Coulomb coefficient [-]
    velocity: np.ndarray | None  # (n_contact, 2) float64 [m/s]; None where all stand still, which compiles motion out
    impulse: np.ndarray  # (n_contact, 5) float64, added: dt times effective normal, water normal, tangential reaction
    # [N s/m], the last along (ny, -nx) on the material, and dt times the squares of the first two


class Medium(NamedTuple):
    """Numbers of the scene."""

    gravity: float
    density_liquid: float
    bulk_liquid: float


class Tally(NamedTuple):
    """What the passes count and leave for each other."""

    counts: np.ndarray  # (5,) int64, places in `mpm.long_step`
    measures: np.ndarray  # (2,) float64, likewise
    limits: np.ndarray  # (2 n_parts, 2): of the time step, by part, and of the points that left their element
    suspended: np.ndarray  # (n_parts,)
    bad: np.ndarray  # (n_parts,) first point with a state that is not finite, or -1
    n_left: np.ndarray  # (n_parts,)
    first_left: np.ndarray  # (n_parts,) where the points of each part begin in the next two
    clamps: np.ndarray  # (n_parts, n_clamps) int64, see `mpm.variables.CLAMPS`
    ledger: np.ndarray  # (n_parts, 8) float64, see `mpm.variables.LEDGER`
    left: np.ndarray  # (n_points,) points that left their element
    origin: np.ndarray  # (n_points,) that element
    spare_start: np.ndarray
    spare_order: np.ndarray
    used: np.ndarray  # (n_passes,) processor time of each pass [microseconds], or empty: not measured


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
