"""The command `gush study`."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from coupling.commands.exit_codes import FAILED, JsonPath, answering, say
from coupling.commands.options import Scheduler, Workers, completed
from coupling.commands.tables import table
from structure.response import SHOWN


def study_command(
    study: Annotated[
        str,
        typer.Argument(
            help="A built-in study (table-2, sensitivity, permeability, mesh, backend), a TOML file, or the folder "
            "of a study that is to go on.",
            autocompletion=completed("studies"),
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(help="Folder; that which goes on, or studies/NAME, when left out. What is there is not rerun."),
    ] = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    json_path: JsonPath = None,
):
    """Run many scenes that differ in some parameters, in parallel; one dataset of them all. Rerun to resume.

    JSON: keys of `coupling.studies.stored.run_study`.
    """
    with answering(json_path) as answer:
        from coupling.studies.limits import HEADS, limit_rows
        from coupling.studies.stored import run_study

        data = run_study(study, out, workers, scheduler, Console(stderr=True))
        if answer(data):
            Console().print(_study_table(data))
            if data["limits"]:
                names = {case["case"]: case["name"] for case in data["cases"]}
                Console().print(table(HEADS, limit_rows(data["limits"], names)))
            say(f"data: {data['data']}")
        if any(case["status"] == "failed" for case in data["cases"]):
            raise typer.Exit(FAILED)


def _study_table(data):
    made = Table(title=f"{data['study']}{', ' + data['model'] if data['model'] else ''}")
    made.add_column("case", min_width=min(22, max(len(case["name"]) for case in data["cases"])))
    axial, bending = SHOWN["axial_force"], SHOWN["bending_moment"]
    for head in ("kg/m", "after s", f"N max {axial.unit}", f"M {bending.unit}", "CPU s"):
        made.add_column(head, no_wrap=True)
    made.add_column("status")
    for case in data["cases"]:
        cells = [""] * 5
        if case["status"] == "finished":
            force, moment = case["axial_force"], case["bending_moment"]
            cells = [f"{case['inflow_mass']:.4g}", f"{case['time']:.3g}"]
            cells += [f"{axial.scale * force['max']:.0f}" if force else "-"]
            ends = (f"{bending.scale * moment[end]:.0f}" for end in ("min", "max")) if moment else ()
            cells += [" to ".join(ends) or "-"]
            cells += [f"{case['cpu_seconds']:.1f}"]
        made.add_row(case["name"], *cells, case["message"] or case["status"])
    return made
