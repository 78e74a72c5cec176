"""The command `gush compare`."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from coupling.commands.exit_codes import JsonPath, answering, say
from coupling.commands.options import SOURCE, RingScene
from coupling.commands.own_folder import claim

FOLDER, DIFFERENCES = "comparison", "differences.nc"


def store(comparison, source, out=None):
    """Write differences, both responses and figures into a folder; returns what a table or JSON needs.

    Without `out` the folder is `comparison/` beside the file; only files of an earlier comparison are replaced. Tunnels
    without the gate have folders of their own in it.

    Returns
    -------
    dict
        models, times (count), cpu_seconds, rows, differences (path), responses (paths by model), figures (paths).

    Raises Refused: the folder cannot be made, or holds other files under the names that are written.
    """
    from coupling.datasets import write_dataset
    from coupling.figures import RESOLUTION
    from coupling.figures.comparison import forces_compared, joints_compared
    from coupling.responses.comparison import TITLE

    folder = source.file.parent / FOLDER if out is None else out
    if source.tunnel is not None:
        folder = folder / f"tunnel-{source.tunnel}"
    path = folder / DIFFERENCES
    responses = {name: folder / f"{name}.nc" for name in comparison.responses}
    files = (path, *responses.values(), folder / "forces.png", folder / "joints.png")
    claim(folder, files, DIFFERENCES, TITLE)
    write_dataset(path, comparison.differences)
    for name, response in comparison.responses.items():
        write_dataset(responses[name], response)
    figures = []
    drawings = {"forces": forces_compared(comparison.responses)}
    if next(iter(comparison.responses.values())).sizes["joint"]:
        drawings["joints"] = joints_compared(comparison.responses)
    for name, figure in drawings.items():
        figures.append(str(folder / f"{name}.png"))
        figure.savefig(figures[-1], dpi=RESOLUTION)
    return {
        "models": list(comparison.responses),
        "times": int(comparison.differences.sizes["time"]),
        "cpu_seconds": comparison.cpu_seconds,
        "rows": comparison.rows,
        "differences": str(path),
        "responses": {name: str(file) for name, file in responses.items()},
        "figures": figures,
    }


def compare_command(
    run: Annotated[Path, typer.Argument(help=SOURCE)],
    first: Annotated[str, typer.Option(help="Lining model, as for gush respond.")] = "beam-spring",
    second: Annotated[str, typer.Option(help="Lining model that is compared with it.")] = "continuum",
    open_gate: Annotated[
        float | None,
        typer.Option(help="Cut the gate out of a continuum ring over this share of the tunnel's length (1: a slot)."),
    ] = None,
    scene: RingScene = None,
    out: Annotated[Path | None, typer.Option(help="Folder for differences and figures; beside RUN when left out.")] = (
        None
    ),
    json_path: JsonPath = None,
):
    """Compare two lining models over the whole event: largest differences with place, time and cause; figures.

    Nothing in RUN changes. JSON: `run`, `models`, `cpu_seconds`, `rows` (see `coupling.responses.comparison.compare`),
    `differences`, `responses`, `figures` (paths); of several tunnels that with the gate, the others under `tunnels`.
    """
    with answering(json_path) as answer:
        from coupling.responses.comparison import compare
        from coupling.responses.source import read_sources

        found = {}
        for source in read_sources(run, scene):
            # the gate is in one tunnel only
            comparison = compare(source, first, second, open_gate if source.tunnel is None else None)
            found[source.tunnel] = store(comparison, source, out)
        others = {tunnel: one for tunnel, one in found.items() if tunnel is not None}
        data = {"run": str(run), **found[None], **({"tunnels": others} if others else {})}
        if answer(data):
            for tunnel, one in found.items():
                Console().print(_comparison_table(one, tunnel))
                times = ", ".join(f"{name} {seconds:.2f} s" for name, seconds in one["cpu_seconds"].items())
                say(f"CPU time for {one['times']} times: {times}")
                say(f"results in {Path(one['differences']).parent}")


def _comparison_table(data, tunnel=None):
    first, second = data["models"]
    table = Table("quantity", "largest difference", "of the extreme", "where", "when", "known cause")
    table.title = f"{second} less {first}{'' if tunnel is None else f', tunnel {tunnel}'}"
    for row in data["rows"]:
        where = f"joint {row['joint']}" if row["joint"] is not None else f"{row['theta']:.4g} deg"
        table.add_row(
            row["label"],
            f"{row['difference'] * row['scale']:+.3g} {row['unit']}",
            f"{100 * row['relative']:.2f} %",
            where,
            f"{row['time']:.3g} s",
            row["cause"] or "-",
        )
    return table
