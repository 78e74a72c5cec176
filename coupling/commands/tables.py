"""Tables that several commands show."""

import math

from rich.table import Table

from structure.limits import UTILISATIONS
from structure.response import FORCES, SHOWN


def response_table(data, tunnel=None):
    """Extremes of the ring's forces, and its joints; `data` as of `summarise_response`."""
    table = Table("ring" if tunnel is None else f"ring of tunnel {tunnel}", "initial", "final")
    for name in FORCES:
        for extreme in ("max", "min"):
            cells = (
                f"{SHOWN[name].scale * data[name][state][extreme]:.0f} at "
                f"{data[name][state][f'{extreme}_theta'] % 360:.4g} deg"
                for state in ("initial", "final")
            )
            table.add_row(f"{SHOWN[name].short} {extreme} \\[{SHOWN[name].unit}]", *cells)
    for name in ("joint_opening", "joint_rotation"):
        if data[name]["final"]:
            scale = SHOWN[name].scale
            cells = (" ".join(f"{scale * value:.2f}" for value in data[name][state]) for state in ("initial", "final"))
            table.add_row(SHOWN[name].label.replace("[", "\\["), *cells)
    return table


def limits_table(found, tunnel=None):
    """Utilisations of limits with where they pass 1; `found` as of :func:`structure.utilisations`."""
    of = "limits" if tunnel is None else f"limits of the ring of tunnel {tunnel}"
    table = Table(of, "largest", "at", "passes 1")
    for name, one in found.items():
        largest = f"{one['largest']:.2f}" if math.isfinite(one["largest"]) else "not carried"
        passes = "never" if one["passes"] is None else where_and_when(one["passes"])
        table.add_row(UTILISATIONS[name], largest, where_and_when(one["at"]), passes)
    return table


def where_and_when(at):
    """A place and time of :func:`structure.utilisations` in words."""
    told = [f"{at['time']:.3g} s"]
    told += [f"{at['inflow_mass']:.4g} kg/m"] if "inflow_mass" in at else []
    told += [f"{at['theta']:.4g}°"] if "theta" in at else []
    return ", ".join(told + ([f"joint {at['joint']:.0f}"] if "joint" in at else []))
