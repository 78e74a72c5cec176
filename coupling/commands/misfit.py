"""The command `gush misfit`."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from coupling.commands.exit_codes import JsonPath, answering, plain, say, warn
from coupling.commands.options import Run
from coupling.commands.own_folder import claim
from coupling.commands.tables import table

FOLDER, DATA, FIGURE = "misfit", "misfit.nc", "residuals.png"
#: Most measurements that the terminal shows, those with the largest residuals; files hold all of them.
MOST_SHOWN = 20


def misfit_command(
    run: Run,
    measurements: Annotated[
        Path,
        typer.Argument(
            help="CSV table (quantity, place, time or inflow_mass, value, unit, error, ..), or netCDF-4 file of "
            "variables named as the quantities with NAME_error beside them."
        ),
    ],
    model: Annotated[
        str | None, typer.Option(help="Lining model whose answer is compared; the run's own when left out.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder of dataset and picture; misfit beside run.nc.")] = None,
    json_path: JsonPath = None,
):
    """Hold a run against measurements: chi square by quantity, residuals, a picture. Nothing in RUN changes.

    JSON: `run`, `measurements` (path), `count`, `not_reached`, `chi_square` (per measurement), `probability`;
    `quantities` (name, count, chi_square, mean_residual, probability), worst first; `rows` (line, sensor, quantity,
    tunnel, place, time [s], inflow_mass [kg/m], change, unit, measured, error, common_error, computed, residual);
    `data`, `figure`.
    """
    with answering(json_path) as answer:
        from coupling.datasets import run_file, write_dataset
        from coupling.figures import RESOLUTION, residuals
        from coupling.measurements.misfit import TITLE, misfit

        folder = run_file(run).parent / FOLDER if out is None else out
        found = misfit(run, measurements, model)
        claim(folder, (folder / DATA, folder / FIGURE), DATA, TITLE)
        write_dataset(folder / DATA, found)
        residuals(found).savefig(folder / FIGURE, dpi=RESOLUTION)
        data = {"run": str(run), "measurements": str(measurements), **_data(found),
                "data": str(folder / DATA), "figure": str(folder / FIGURE)}  # fmt: skip
        if found.attrs["not_reached"]:
            warn(f"{found.attrs['not_reached']} measurements are later than the run's end; they do not count")
        if answer(data):
            Console().print(_quantity_table(data), _residual_table(data), sep="\n")
            say(f"chi square per measurement {data['chi_square']:.3g}; 1: as far as the errors say")
            say(f"results in {folder}")


def _data(found):
    """What a dataset of :func:`coupling.measurements.misfit` says, as JSON takes it."""
    attributes = {name: found.attrs[name] for name in ("count", "not_reached", "chi_square", "probability")}
    sums = found[["count", "chi_square", "mean_residual", "probability"]].to_dataframe().reset_index(names="name")
    columns = ["quantity", "line", "sensor", "tunnel", "place", "time", "inflow_mass", "change", "unit", "measured",
               "error", "common_error", "computed", "residual"]  # fmt: skip
    rows = found.drop_dims("quantity").to_dataframe().rename(columns={"name": "quantity"})[columns].astype(object)
    rows["tunnel"] = rows["tunnel"].where(rows["tunnel"] >= 0)
    rows = rows.where(rows.notna(), None)
    return {**attributes, "quantities": sums.to_dict("records"), "rows": rows.to_dict("records")}


def _quantity_table(data):
    rows = ((row["name"].replace("_", " "), str(row["count"]), f"{row['chi_square']:.3g}",
             f"{row['mean_residual']:+.2f}", f"{row['probability']:.2g}") for row in data["quantities"])  # fmt: skip
    heads = ("quantity", "measurements", "chi square each", "mean residual", "probability")
    return table(heads, rows, plain(f"{data['run']} against {data['measurements']}"))


def _residual_table(data):
    from coupling.measurements import QUANTITIES

    rows = sorted(data["rows"], key=lambda row: -abs(row["residual"] or 0.0))
    more = f" (the largest {MOST_SHOWN} of {len(rows)})" if len(rows) > MOST_SHOWN else ""
    heads = ("where read", "quantity", "place", "when", "measured", "computed", "residual")
    made = Table(*heads, title=f"residuals{more}")
    made.columns[1].min_width = len("convergence")
    for row in rows[:MOST_SHOWN]:
        shown = QUANTITIES[row["quantity"]].shown
        when = f"{row['time']:.4g} s" if row["time"] is not None else f"{row['inflow_mass']:.4g} kg/m"
        measured = f"{shown.scale * row['measured']:.4g} ± {shown.scale * row['error']:.2g} {shown.unit}"
        reached = row["computed"] is not None
        made.add_row(
            plain(f"{row['line']} {row['sensor']}".strip()).replace("[", "\\["),
            row["quantity"].replace("_", " ") + (", change" if row["change"] else ""),
            ", ".join(filter(None, (row["place"], "" if row["tunnel"] is None else f"tunnel {row['tunnel']}"))),
            when,
            measured,
            f"{shown.scale * row['computed']:.4g}" if reached else "not reached",
            f"{row['residual']:+.2f}" if reached else "",
        )
    return made
