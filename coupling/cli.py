"""The command line `gush`. Commands that show results, and those that packages join, stand in modules of their own.

Exit codes: 0 done, 1 rerun differs, 2 refused input, 3 run failed, 130 interrupted. Heavy libraries load inside the
commands.
"""

import contextlib
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from coupling.events import EventStream
from coupling.exit_codes import DIFFERENT, JsonPath, checked_json, failures, told_warnings, warn, write_json
from coupling.joined_commands import JoinedCommands
from coupling.progress_line import ProgressLine, duration
from coupling.result_commands import export_command, info_command, report_command
from coupling.study_command import study_command

app = typer.Typer(
    cls=JoinedCommands,
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="Water and soil gushing into a shield tunnel: two-phase MPM, lining pressures, forces in the ring.",
    epilog="Exit codes: 0 done, 1 rerun differs, 2 refused input, 3 run failed, 130 interrupted.",
)

SceneName = Annotated[str, typer.Argument(help="A built-in scene (see `gush scenes`) or a TOML file.")]
SOURCE = "Folder or run.nc of a run, or a netCDF-4 file with pressures that follow the schema."
RingScene = Annotated[
    str | None, typer.Option("--scene", help="Scene whose ring is taken; that of the run when left out.")
]
Changes = Annotated[
    list[str] | None,
    typer.Option("--set", help="Change one value of the scene: gate.angle=45, 'gate.width=20 cm'; may be repeated."),
]
Threads = Annotated[int | None, typer.Option(min=1, help="Threads; all cores when left out. Does not change results.")]


def _tell_version(asked: bool):
    if asked:
        from importlib.metadata import version

        typer.echo(f"gush {version('gushing')}")
        raise typer.Exit()


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_tell_version, is_eager=True, help="Show the version and exit.")
    ] = False,
):
    pass


@app.command("run")
def run_command(
    scene: Annotated[
        str | None, typer.Argument(help="A built-in scene (see `gush scenes`) or a TOML file; quick when left out.")
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
    quiet: Annotated[bool, typer.Option("--quiet", help="Print errors only.")] = False,
):
    """Open the gate of a scene and compute inflow, lining pressures and ring forces.

    JSON: keys of `coupling.summary.summarise_run`, and `run` (folder), `figures` (paths), `response` (keys of
    `coupling.summary.summarise_response`, or null). Events: see `coupling.events.EventStream`.
    """
    with failures(), checked_json(json_path), checked_json(events), EventStream(events) as stream, told_warnings():
        from coupling.datasets import RunFileError, read_response
        from coupling.quality import quality_line, states_line, verdicts
        from coupling.run import run
        from coupling.run_folder import FIGURES, RunRefused
        from coupling.scene import load_scene, parse_changes
        from coupling.summary import summarise_response, summarise_run

        if resume and scene is None and changes:
            raise RunRefused("--set: changes a scene, got --resume without one; name the scene or leave --set out")
        loaded = None if resume and scene is None else load_scene(scene or "quick", **parse_changes(changes or []))
        with ProgressLine(quiet) as line:
            pressures = run(
                loaded, out, overwrite, stream.following(line), threads, not no_figures, resume, checkpoint_interval,
                warn=stream.warning(warn), response=not no_response,
            )  # fmt: skip
        folder = Path(pressures.attrs["run"])
        data = {"run": str(folder), **summarise_run(folder), "response": None}
        with contextlib.suppress(RunFileError):
            data["response"] = summarise_response(read_response(folder))
            data["quality"]["lining_equilibrium"] = data["response"]["equilibrium_residual"]
            data["verdicts"] = verdicts(data["quality"])
            for tunnel, one in data["tunnels"].items():
                one["response"] = summarise_response(read_response(folder, tunnel=tunnel))
        data["figures"] = sorted(str(path) for path in (folder / FIGURES).glob("*.png"))
        write_json(json_path, data)
        stream.tell("result", **data)
        if not quiet and str(json_path) != "-" and not stream.printing:
            console = Console()
            console.print(_run_table(data))
            if data["response"]:
                console.print(_response_table(data["response"]))
            for tunnel, one in data["tunnels"].items():
                if one["response"]:
                    console.print(_response_table(one["response"], tunnel))
            console.print(f"errors: {quality_line(data['quality'])}", highlight=False)
            console.print(f"states of the points, no errors: {states_line(data['quality'])}", highlight=False)
            console.print(f"results in {folder}", highlight=False, soft_wrap=True)


@app.command("rerun")
def rerun_command(
    run: Annotated[Path, typer.Argument(help="Folder or run.nc of the run to repeat.")],
    out: Annotated[
        Path | None, typer.Option(help="Folder of the repetition; runs/SCENE-rerun, numbered, when left out.")
    ] = None,
    threads: Threads = None,
    json_path: JsonPath = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="Print errors only.")] = False,
):
    """Repeat a run from what its file says and compare all records bit for bit; exit code 1 when they differ.

    JSON: keys of `coupling.rerun.rerun`.
    """
    with failures(), checked_json(json_path):
        from coupling.rerun import rerun

        with ProgressLine(quiet) as line:
            data = rerun(run, out, line, threads, warn)
        write_json(json_path, data)
        if not quiet and str(json_path) != "-":
            tell = Console().print
            for row in data["differences"]:
                tell(f"{row['variable']}: first at t {row['time']} s, by at most {row['largest']}", highlight=False)
            of = f" of {data['records_run']}" if data["records"] < data["records_run"] else ""
            verdict = "identical bit for bit" if data["identical"] else "different"
            tell(f"{verdict}: {data['records']}{of} records of {run} and {data['rerun']}", soft_wrap=True)
    if not data["identical"]:
        raise typer.Exit(DIFFERENT)


@app.command("plan")
def plan_command(
    scene: SceneName,
    changes: Changes = None,
    threads: Threads = None,
    rough: Annotated[bool, typer.Option("--rough", help="From formulas alone, without building the mesh.")] = False,
    json_path: JsonPath = None,
):
    """What a run would do and cost: active parts, points, time step, steps, memory, time.

    JSON: keys of `coupling.plan.plan`, with --rough of `coupling.plan.rough_plan`; and `warnings`.
    """
    with failures(), checked_json(json_path):
        from coupling.plan import plan, rough_plan
        from coupling.scene import load_scene, parse_changes

        loaded, told = load_scene(scene, **parse_changes(changes or [])), []

        def tell(message):
            told.append(message)
            warn(message)

        data = {**(rough_plan if rough else plan)(loaded, threads, tell), "warnings": told}
        write_json(json_path, data)
        if str(json_path) != "-":
            console = Console()
            console.print(_feature_table(data))
            console.print(_cost_table(data))


@app.command("respond")
def respond_command(
    run: Annotated[Path, typer.Argument(help=SOURCE)],
    backend: Annotated[
        str, typer.Option(help="Lining model: beam-spring, continuum, an installed one, or yours as FILE.py:CLASS.")
    ] = "beam-spring",
    scene: RingScene = None,
    limits: Annotated[
        Path | None, typer.Option(help="TOML file of structure.Limits: checks the response and draws its utilisations.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="File for the response; when left out RUN itself, beside it where RUN is none.")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the file of an earlier response.")] = False,
    json_path: JsonPath = None,
):
    """Compute the ring's response to the pressures of a run, and store it with them as /structure/BACKEND.

    The response of another ring (--scene), or to pressures that are no run, goes into a file of its own beside them:
    FILE-BACKEND.nc.

    JSON: keys of `coupling.summary.summarise_response`, and `run`, `backend`, `file` (path of the response); with
    --limits `utilisations` (largest of every check, 1 is its limit) and `figure` (path). Of several tunnels these are
    of that with the gate, `tunnels` has the same of the others.
    """
    with failures(), checked_json(json_path), told_warnings():
        from coupling.checked_response import draw_checks, read_limits, with_checks
        from coupling.pressure_source import read_sources
        from coupling.run import respond_by_name
        from coupling.stored_response import chosen_file, store_response
        from coupling.summary import summarise_response

        sources = read_sources(run, scene)
        given = None if limits is None else read_limits(limits)
        name = backend.rpartition(":")[2]
        targets = [chosen_file(source, name, out, overwrite) for source in sources]
        answers = []
        for source, target in zip(sources, targets, strict=True):
            response = respond_by_name(source.ring, source.pressures, backend)
            answer = summarise_response(response)
            if given is not None:
                response, answer["utilisations"] = with_checks(response, given)
            answer["file"] = str(store_response(response, source, name, target))
            if given is not None:
                answer["figure"] = draw_checks(response, source.file, name, target, source.tunnel)
            answers.append(answer)
        data = {"run": str(run), "backend": name, **answers[0]}
        if len(sources) > 1:
            data["tunnels"] = {source.tunnel: answer for source, answer in zip(sources[1:], answers[1:], strict=True)}
        write_json(json_path, data)
        if str(json_path) != "-":
            console = Console()
            for source, answer in zip(sources, answers, strict=True):
                console.print(_response_table(answer, source.tunnel))
                if given is not None:
                    shares = ", ".join(
                        f"{check.replace('_', ' ')} {share:.2f}" for check, share in answer["utilisations"].items()
                    )
                    console.print(f"largest of its limit: {shares}", highlight=False)
                    console.print(f"picture in {answer['figure']}", highlight=False, soft_wrap=True)
                console.print(f"response in {answer['file']}", highlight=False, soft_wrap=True)


@app.command("compare")
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

    Nothing in RUN changes. JSON: `run`, `models`, `cpu_seconds`, `rows` (see `coupling.compare.compare`),
    `differences`, `responses`, `figures` (paths); of several tunnels that with the gate, the others under `tunnels`.
    """
    with failures(), checked_json(json_path), told_warnings():
        from coupling.compare import compare, store
        from coupling.pressure_source import read_sources

        found = {}
        for source in read_sources(run, scene):
            # the gate is in one tunnel only
            comparison = compare(source, first, second, open_gate if source.tunnel is None else None)
            found[source.tunnel] = store(comparison, source, out)
        others = {tunnel: one for tunnel, one in found.items() if tunnel is not None}
        data = {"run": str(run), **found[None], **({"tunnels": others} if others else {})}
        write_json(json_path, data)
        if str(json_path) != "-":
            console = Console()
            for tunnel, one in found.items():
                console.print(_comparison_table(one, tunnel))
                times = ", ".join(f"{name} {seconds:.2f} s" for name, seconds in one["cpu_seconds"].items())
                console.print(f"CPU time for {one['times']} times: {times}", highlight=False)
                console.print(f"results in {Path(one['differences']).parent}", highlight=False, soft_wrap=True)


@app.command("scenes")
def scenes_command(json_path: JsonPath = None):
    """List the built-in scenes.

    JSON: `scenes`, a list of {name, soil, cover [m], gate_angle [degree], gate_width [m], tunnels, stop_time [s],
    stop_inflow_mass [kg/m]}.
    """
    with failures(), checked_json(json_path):
        from coupling.scene import load_scene, scene_names

        data = {"scenes": [_scene_row(load_scene(name).mpm) for name in scene_names()]}
        write_json(json_path, data)
        if str(json_path) != "-":
            table = Table("scene", "soil", "cover", "gate", "tunnels", "until")
            for row in data["scenes"]:
                until = [f"{row['stop_inflow_mass']:g} kg/m"] if row["stop_inflow_mass"] else []
                until += [f"{row['stop_time']:g} s"] if row["stop_time"] else []
                table.add_row(
                    row["name"],
                    row["soil"],
                    f"{row['cover']:g} m",
                    "none" if row["gate_angle"] is None else f"{row['gate_angle']:g}°, {row['gate_width']:g} m",
                    str(row["tunnels"]),
                    ", ".join(until),
                )
            Console().print(table)


app.command("report")(report_command)
app.command("export")(export_command)
app.command("info")(info_command)
app.command("study")(study_command)


def main():
    """Entry point of the command `gush`."""
    app()


def _scene_row(scene):
    gate = scene.gate
    return {
        "name": scene.name,
        "soil": ", ".join(soil.name for soil in scene.soils),
        "cover": scene.tunnels[0].cover if scene.tunnels else None,
        "gate_angle": None if gate is None else gate.angle,
        "gate_width": None if gate is None else gate.width,
        "tunnels": len(scene.tunnels),
        "stop_time": scene.stop.time,
        "stop_inflow_mass": scene.stop.inflow_mass,
    }


def _run_table(data):
    table = Table("quantity", "value", title=f"{data['scene']}: {data['status']}")
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
    for row in rows:
        table.add_row(*row)
    return table


def _response_table(data, tunnel=None):
    table = Table("ring" if tunnel is None else f"ring of tunnel {tunnel}", "initial", "final")
    for name, label, unit in (
        ("axial_force", "N", "kN/m"),
        ("shear_force", "Q", "kN/m"),
        ("bending_moment", "M", "kN m/m"),
    ):
        for extreme in ("max", "min"):
            table.add_row(
                f"{label} {extreme} [{unit}]".replace("[", "\\["),
                *(
                    f"{data[name][state][extreme] / 1e3:.0f} at {data[name][state][extreme + '_theta'] % 360:.4g} deg"
                    for state in ("initial", "final")
                ),
            )
    for name, label in (
        ("joint_opening", "joint opening (+) or closing (-) [mm]"),
        ("joint_rotation", "joint rotation [mrad]"),
    ):
        if data[name]["final"]:
            cells = (" ".join(f"{1e3 * value:.2f}" for value in data[name][state]) for state in ("initial", "final"))
            table.add_row(label.replace("[", "\\["), *cells)
    return table


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


def _feature_table(data):
    table = Table("part", "", "why", title=f"{data['scene']}: what is computed")
    for row in data["features"]:
        table.add_row(row["feature"], "active" if row["active"] else "left out", row["reason"])
    return table


def _cost_table(data):
    most = data["steps_to_stop_time"]
    most = "no stop time given" if most is None else f"{most} until the stop time"
    table = Table("cost", "", title=f"{data['scene']}: what it costs")
    free = data["free_memory_bytes"]
    meshed = "nodes" in data
    if meshed:
        table.add_row("elements, nodes, points", f"{data['elements']}, {data['nodes']}, {data['points']}")
        table.add_row("flattest triangle, smallest angle", f"{data['min_altitude']:.3f} m, {data['min_angle']:.0f} deg")
        table.add_row("time step", f"{1e6 * data['dt']:.0f} µs ({data['dt_limit']})")
    else:
        table.add_row("elements, points", f"some {data['elements']}, {data['points']}")
        table.add_row("time step", f"some {1e6 * data['dt']:.2g} µs")
    for row in (
        ("simulated time", f"about {data['expected_time']:.2g} s (a guess where an inflow mass ends the run)"),
        ("steps", f"about {data['expected_steps']}, {most}"),
        ("records", f"about {data['records']}"),
        ("memory", f"{data['memory_bytes'] / 1e6:.0f} MB" + (f" of {free / 1e9:.1f} GB free" if free else "")),
    ):
        table.add_row(*row)
    if meshed:
        table.add_row("speed measured now", f"{data['point_steps_per_second'] / 1e6:.1f} M point-steps/s")
        table.add_row("time of stepping", f"about {duration(data['expected_seconds'])}")
    return table


if __name__ == "__main__":
    main()
