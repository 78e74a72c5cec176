"""The run file and its readers: what users read a run with.

One netCDF-4 file a run, SI units, angles in degrees from the crown, clockwise. Groups: `/lining` (pressures on a
uniform theta grid), `/history` (inflow, zones, balances, time step), `/points` (snapshots), `/mesh` (UGRID), and
`/structure/<model>` (responses; those of tunnels without the gate in `/structure_tunnel_<k>/<model>`). The root
carries attributes only: provenance and `status`.
"""

from coupling.datasets.additions import CHECKED_FORMAT, write_attributes, write_dataset, write_response, write_responses
from coupling.datasets.open_run import OpenRun, opened, run_file
from coupling.datasets.reader import (
    raw_groups,
    read_attributes,
    read_group,
    read_history,
    read_mesh,
    read_points,
    read_pressures,
    read_response,
    read_run,
    stored_title,
)
from coupling.datasets.schema import (
    BALANCES,
    ERRORS,
    HISTORY,
    MOTION,
    PRESSURES,
    PROGRESS,
    RING_FORCES,
    identifier,
    structure_group,
)
from coupling.datasets.theta_grid import cell_bounds, cell_centres, cell_mean_weights
from coupling.datasets.writer import RunWriter
from coupling.refused import RunFileError

__all__ = [
    "BALANCES", "CHECKED_FORMAT", "ERRORS", "HISTORY", "MOTION", "OpenRun", "PRESSURES", "PROGRESS", "RING_FORCES",
    "RunFileError", "RunWriter", "cell_bounds", "cell_centres", "cell_mean_weights", "identifier", "opened",
    "raw_groups", "read_attributes", "read_group", "read_history", "read_mesh", "read_points", "read_pressures",
    "read_response", "read_run", "run_file", "stored_title", "structure_group", "write_attributes", "write_dataset",
    "write_response", "write_responses",
]  # fmt: skip
