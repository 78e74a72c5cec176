"""Pictures of a run over time."""

import xarray as xr

from coupling.figures.picture import GATE, NOW, SECOND, Picture, styled


def inflow(history: xr.Dataset) -> Picture:
    """Inflow mass, and areas of flow zone and disturbed zone, over time."""
    time = history["time"].values
    with styled(4.6, 4.4) as figure:
        upper, lower = figure.subplots(2, 1, sharex=True)
        upper.plot(time, history["inflow_mass"].values, color=NOW)
        upper.set_ylabel("inflow mass [kg/m]")
        lower.plot(time, history["flow_zone_area"].values, color=GATE, label="flow zone (> 50 mm)")
        lower.plot(time, history["disturbed_area"].values, color=SECOND, ls="--", label="disturbed (10 to 50 mm)")
        lower.set_ylabel("area [m²]")
        lower.set_xlabel("time since the gate opened [s]")
        lower.legend(loc="best")
        for axis in (upper, lower):
            axis.set_ylim(bottom=0)
            axis.set_xlim(0, max(float(time[-1]), 1e-9))
            axis.grid(True)
            axis.spines[["top", "right"]].set_visible(False)
        figure.align_ylabels()
    return figure
