"""Tables of the terminal: from rows, and those that several commands show."""

from rich.console import Console
from rich.table import Table

from structure.response import FORCES, SHOWN


def table(heads, rows, title=None):
    """A table with headings and a row a line."""
    made = Table(*heads, title=title)
    for row in rows:
        made.add_row(*row)
    return made


def response_table(data, tunnel=None):
    """Extremes of the ring's forces, and its joints; `data` as of `summarise_response`."""
    rows = []
    for name in FORCES:
        for extreme in ("max", "min"):
            cells = (
                f"{SHOWN[name].scale * data[name][state][extreme]:.0f} at "
                f"{data[name][state][f'{extreme}_theta'] % 360:.4g} deg"
                for state in ("initial", "final")
            )
            rows.append((f"{SHOWN[name].short} {extreme} \\[{SHOWN[name].unit}]", *cells))
    for name in ("joint_opening", "joint_rotation"):
        if data[name]["final"]:
            scale = SHOWN[name].scale
            cells = (" ".join(f"{scale * value:.2f}" for value in data[name][state]) for state in ("initial", "final"))
            rows.append((SHOWN[name].label.replace("[", "\\["), *cells))
    return table(("ring" if tunnel is None else f"ring of tunnel {tunnel}", "initial", "final"), rows)


def print_ring(data, tunnel=None):
    """The same, and utilisations of limits with where they pass 1, where there are any."""
    from coupling.postprocess.limits import HEADS, limit_rows

    Console().print(response_table(data, tunnel))
    if data["utilisations"]:
        title = None if tunnel is None else f"limits of the ring of tunnel {tunnel}"
        Console().print(table(HEADS, limit_rows(data["utilisations"]), title))
