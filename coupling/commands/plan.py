"""The command `gush plan`."""

from typing import Annotated

import typer
from rich.console import Console

from coupling.commands.exit_codes import JsonPath, answering, warn
from coupling.commands.options import Changes, SceneName, Threads
from coupling.commands.tables import table
from coupling.runs.progress_line import duration


def plan_command(
    scene: SceneName,
    changes: Changes = None,
    threads: Threads = None,
    rough: Annotated[bool, typer.Option("--rough", help="From formulas alone, without building the mesh.")] = False,
    json_path: JsonPath = None,
):
    """What a run would do and cost: active parts, points, time step, steps, memory, time.

    JSON: keys of `coupling.runs.plan.plan`, with --rough of `coupling.runs.plan.rough_plan`; and `warnings`.
    """
    with answering(json_path) as answer:
        from coupling.runs.plan import plan, rough_plan
        from coupling.scenes.layers import parse_changes
        from coupling.scenes.scene import load_scene

        loaded, told = load_scene(scene, **parse_changes(changes or [])), []

        def tell(message):
            told.append(message)
            warn(message)

        data = {**(rough_plan if rough else plan)(loaded, threads, tell), "warnings": told}
        if answer(data):
            parts = ((row["feature"], "active" if row["active"] else "left out", row["reason"])
                     for row in data["features"])  # fmt: skip
            computed = table(("part", "", "why"), parts, f"{data['scene']}: what is computed")
            Console().print(computed, _cost_table(data), sep="\n")


def _cost_table(data):
    most = data["steps_to_stop_time"]
    most = "no stop time given" if most is None else f"{most} until the stop time"
    free, meshed = data["free_memory_bytes"], "nodes" in data
    rows = [
        ("elements, nodes, points", f"{data['elements']}, {data['nodes']}, {data['points']}"),
        ("flattest triangle, smallest angle", f"{data['min_altitude']:.3f} m, {data['min_angle']:.0f} deg"),
        ("time step", f"{1e6 * data['dt']:.0f} µs ({data['dt_limit']})"),
    ] if meshed else [
        ("elements, points", f"some {data['elements']}, {data['points']}"),
        ("time step", f"some {1e6 * data['dt']:.2g} µs"),
    ]  # fmt: skip
    rows += [
        ("simulated time", f"about {data['expected_time']:.2g} s (a guess where an inflow mass ends the run)"),
        ("steps", f"about {data['expected_steps']}, {most}"),
        ("records", f"about {data['records']}"),
        ("memory", f"{data['memory_bytes'] / 1e6:.0f} MB" + (f" of {free / 1e9:.1f} GB free" if free else "")),
    ]
    if meshed:
        rows.append(("speed measured now", f"{data['point_steps_per_second'] / 1e6:.1f} M point-steps/s"))
        rows.append(("time of stepping", f"about {duration(data['expected_seconds'])}"))
    return table(("cost", ""), rows, f"{data['scene']}: what it costs")
