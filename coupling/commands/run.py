"""The command `gush run`."""

import contextlib
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from coupling.commands.events import EventStream
from coupling.commands.exit_codes import JsonPath, answering, say, warn
from coupling.commands.options import Changes, Quiet, Threads, completed
from coupling.commands.tables import print_ring, table
from coupling.runs.progress_line import ProgressLine


def run_command(
    scene: Annotated[
        str | None,
        typer.Argument(
            help="A built-in scene (see `gush scenes`) or a TOML file; quick when left out.",
            autocompletion=completed("scenes"),
        ),
    ] = None,
    changes: Changes = None,
    out: Annotated[Path | None, typer.Option(help="Folder of the run; runs/SCENE, numbered, when left out.")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an earlier run in that folder.")] = False,
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue the run in --out, however it was stopped.")
    ] = False,
    checkpoint_interval: Annotated[
        float, typer.Option(min=0.0, help="Seconds between checkpoints, from which --resume goes on.")
    ] = 60.0,
    threads: Threads = None,
    no_figures: Annotated[bool, typer.Option("--no-figures", help="No pictures.")] = False,
    no_response: Annotated[bool, typer.Option("--no-response", help="No forces in the ring.")] = False,
    json_path: JsonPath = None,
    events: Annotated[
        Path | None, typer.Option("--events", help="Also write what happens as JSON lines while it does; - prints.")
    ] = None,
    quiet: Quiet = False,
):
    """Open the gate of a scene and compute inflow, lining pressures and ring forces.

    JSON: keys of `coupling.postprocess.summary.summarise_run`, and `run` (folder), `figures` (paths), `response`
    (keys of `coupling.postprocess.summary.summarise_response`, or null). Events:
    see `coupling.commands.events.EventStream`.
    """
    with answering(json_path) as answer, EventStream(events) as stream:
        from coupling.datasets import RunFileError, opened, read_response
        from coupling.files.folder import FIGURES
        from coupling.postprocess.quality import quality_line, states_line, verdicts
        from coupling.postprocess.summary import summarise_response, summarise_run
        from coupling.refused import Refused
        from coupling.runs.run import run
        from coupling.scenes.layers import parse_changes
        from coupling.scenes.scene import load_scene

        if resume and scene is None and changes:
            raise Refused("--set: changes a scene, got --resume without one; name the scene or leave --set out")
        loaded = None if resume and scene is None else load_scene(scene or "quick", **parse_changes(changes or []))
        with ProgressLine(quiet) as line:
            pressures = run(
                loaded, out, overwrite, stream.following(line), threads, not no_figures, resume, checkpoint_interval,
                warn=stream.warning(warn), response=not no_response,
            )  # fmt: skip
        folder = Path(pressures.attrs["run"])
        with opened(folder) as file:
            data = {"run": str(folder), **summarise_run(file), "response": None}
            with contextlib.suppress(RunFileError):
                data["response"] = summarise_response(read_response(file))
                if data["response"]["equilibrium_residual"] is not None:
                    data["quality"]["lining_equilibrium"] = data["response"]["equilibrium_residual"]
                data["verdicts"] = verdicts(data["quality"])
                for tunnel, one in data["tunnels"].items():
                    one["response"] = summarise_response(read_response(file, tunnel=tunnel))
        data["figures"] = sorted(str(path) for path in (folder / FIGURES).glob("*.png"))
        printed = answer(data) and not quiet and not stream.printing
        stream.tell("result", **data)
        if printed:
            Console().print(_run_table(data))
            for tunnel, one in {None: data, **data["tunnels"]}.items():
                if one["response"]:
                    print_ring(one["response"], tunnel)
            say(f"errors: {quality_line(data['quality'])}")
            say(f"states of the points, no errors: {states_line(data['quality'])}")
            say(f"results in {folder}")


def _run_table(data):
    rows = [
        ("simulated time", f"{data['time']:.3f} s"),
        ("inflow mass", f"{data['inflow_mass']:.0f} kg/m"),
        ("flow zone, disturbed zone", f"{data['flow_zone_area']:.1f}, {data['disturbed_area']:.1f} m²"),
    ]
    for tunnel, one in {None: data, **data["tunnels"]}.items():
        where = "" if tunnel is None else f", tunnel {tunnel}"
        for name, label in (("soil_pressure", "soil pressure"), ("water_pressure", "water pressure")):
            for place, values in one.get(name, {}).items():
                pressure = f"{values['initial'] / 1e3:.0f} -> {values['final'] / 1e3:.0f} kPa"
                rows.append((f"{label}, {place}{where}", pressure))
    rows += [
        ("steps, mean dt", f"{data['steps']}, {1e6 * data['mean_dt']:.0f} µs ({data['dt_limit']})"),
        ("point-steps per CPU second", f"{data['point_steps_per_cpu_second'] / 1e6:.1f} million"),
        ("wall, CPU time", f"{data['wall_seconds']:.0f} s, {data['cpu_seconds']:.0f} s"),
    ]
    return table(("quantity", "value"), rows, f"{data['scene']}: {data['status']}")
