"""Pictures of a run, each a function of its datasets, in kPa, kN, mm and degrees.

Every function returns a `matplotlib.figure.Figure` that belongs to the caller; nothing touches pyplot's global state.
"""

from coupling.figures.comparison import forces_compared, joints_compared
from coupling.figures.ground import common_tops, fields_around_tunnel, mesh_near_gate
from coupling.figures.history import inflow
from coupling.figures.of_run import draw_run
from coupling.figures.picture import GATE, INITIAL, NOW, RESOLUTION, SECOND, STYLE, Picture
from coupling.figures.residuals import residuals
from coupling.figures.ring import deformed_ring, internal_forces, pressures_polar
from coupling.figures.settlement import settlement_trough
from coupling.figures.utilisations import checks

__all__ = [
    "GATE", "INITIAL", "NOW", "Picture", "RESOLUTION", "SECOND", "STYLE", "checks", "common_tops", "deformed_ring",
    "draw_run", "fields_around_tunnel", "forces_compared", "inflow", "internal_forces", "joints_compared",
    "mesh_near_gate", "pressures_polar", "residuals", "settlement_trough",
]  # fmt: skip
