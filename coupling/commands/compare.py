"""The command `gush compare`."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from coupling.commands.exit_codes import JsonPath, answering, say
from coupling.commands.options import SOURCE, RingScene
from coupling.commands.own_folder import claim
from coupling.commands.tables import table
from coupling.refused import Refused

FOLDER, DIFFERENCES = "comparison", "differences.nc"
STATES, REPORT_FILE = "runs.nc", "report.html"


def store(comparison, source, out=None):
    """Write differences, both responses and figures into a folder; returns what a table or JSON needs.

    Without `out` the folder is `comparison/` beside the file; only files of an earlier comparison are replaced. Tunnels
    without the gate have folders of their own in it.

    Returns a dict: models, times (count), cpu_seconds, rows, differences (path), responses (paths by model), figures
    (paths).

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
    runs: Annotated[
        list[Path],
        typer.Argument(help=f"{SOURCE} Of one both lining models are compared, several are compared with each other."),
    ],
    first: Annotated[
        str | None, typer.Option(help="Of one run: lining model, as for gush respond; beam-spring when left out.")
    ] = None,
    second: Annotated[
        str | None, typer.Option(help="Of one run: lining model compared with it; continuum when left out.")
    ] = None,
    open_gate: Annotated[
        float | None,
        typer.Option(
            help="Of one run: cut the gate out of a continuum ring over this share of the tunnel's length (1: a slot)."
        ),
    ] = None,
    scene: RingScene = None,
    along: Annotated[
        str | None,
        typer.Option(help="Of several runs: equal inflow_mass or equal time; inflow_mass when left out."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder for the results; comparison beside RUN, of several runs runs/compared, when left out."
        ),
    ] = None,
    json_path: JsonPath = None,
):
    """Compare two lining models on one run, or several runs: largest differences with place and time; figures, a page.

    Nothing in the runs changes. JSON of one: `run`, `models`, `cpu_seconds`, `rows` (see
    `coupling.responses.comparison.compare`), `differences`, `responses`, `figures` (paths); of several tunnels that
    with the gate, the others under `tunnels`. JSON of several: `runs`, `names`, `along`, `to` (the last state),
    `model`, `rows` (the same with `run`, each less the first run), `data`, `report` (paths).
    """
    with answering(json_path) as answer:
        of_models = {"--first": first, "--second": second, "--open-gate": open_gate, "--scene": scene}
        several = len(runs) > 1
        given = [name for name, value in (of_models if several else {"--along": along}).items() if value is not None]
        if given:
            of = "one run" if several else "several runs"
            raise Refused(f"{given[0]}: is for comparing {of}, got {len(runs)}; leave it out")
        if several:
            data = _compare_runs(runs, along or "inflow_mass", out)
            if answer(data):
                for name in data["names"][1:]:
                    rows = [row for row in data["rows"] if row["run"] == name]
                    Console().print(_differences_table(rows, f"{name} less {data['names'][0]}"))
                say(f"results in {Path(data['data']).parent}")
        else:
            data = _compare_models(runs[0], first or "beam-spring", second or "continuum", open_gate, scene, out)
            if answer(data):
                _print_models(data)


def _compare_runs(runs, along, out):
    from coupling.datasets import write_dataset
    from coupling.report.page import write_runs_report
    from coupling.studies.side_by_side import TITLE, side_by_side

    compared = side_by_side(runs, along)
    states, folder = compared.states[0], Path("runs") / "compared" if out is None else out
    data, page = folder / STATES, folder / REPORT_FILE
    claim(folder, (data, page), STATES, TITLE)
    write_dataset(data, compared.dataset())
    return {
        "runs": [str(run) for run in runs],
        "names": [case.parameters["run"] for case in compared.cases],
        "along": along,
        "to": float(states[along][-1]),
        "model": str(states["model"].values[0]) if "model" in states.dims else None,
        "rows": compared.rows,
        "data": str(data),
        "report": str(write_runs_report(compared, page)),
    }


def _compare_models(run, first, second, open_gate, scene, out):
    from coupling.responses.comparison import compare
    from coupling.responses.source import read_sources

    found = {}
    for source in read_sources(run, scene):
        # the gate is in one tunnel only
        comparison = compare(source, first, second, open_gate if source.tunnel is None else None)
        found[source.tunnel] = store(comparison, source, out)
    others = {tunnel: one for tunnel, one in found.items() if tunnel is not None}
    return {"run": str(run), **found[None], **({"tunnels": others} if others else {})}


def _print_models(data):
    for tunnel, one in {None: data, **data.get("tunnels", {})}.items():
        first, second = one["models"]
        of = "" if tunnel is None else f", tunnel {tunnel}"
        Console().print(_differences_table(one["rows"], f"{second} less {first}{of}"))
        times = ", ".join(f"{name} {seconds:.2f} s" for name, seconds in one["cpu_seconds"].items())
        say(f"CPU time for {one['times']} times: {times}")
        say(f"results in {Path(one['differences']).parent}")


def _differences_table(rows, title):
    from coupling.responses.comparison import HEADS, difference_cells

    causes = any(row["cause"] for row in rows)
    cells = ((*difference_cells(row), *((row["cause"] or "-",) if causes else ())) for row in rows)
    return table((*HEADS, *(("known cause",) if causes else ())), cells, title)
