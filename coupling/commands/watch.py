"""The command `gush watch`."""

import contextlib
import time as clock
from typing import Annotated

import typer
from rich.console import Console
from rich.live import Live
from rich.table import Table

from coupling.commands.exit_codes import JsonPath, answering, plain
from coupling.commands.options import Run

BLOCKS, MOST_BLOCKS = "▁▂▃▄▅▆▇█", 40


def watch_command(
    run: Run,
    interval: Annotated[float, typer.Option(min=0.1, help="Seconds between two looks.")] = 2.0,
    once: Annotated[bool, typer.Option("--once", help="Look once.")] = False,
    json_path: JsonPath = None,
):
    """Follow a computation in the terminal until it ends or Ctrl-C; it is only read.

    JSON: of the last look, keys of `coupling.postprocess.summary.summarise_run` and `share` (of the stop, 0 to 1).
    """
    with answering(json_path) as answer:
        from coupling.datasets import read_attributes
        from coupling.scenes.scene import parse_scene

        stop = parse_scene(read_attributes(run)["scene"], str(run)).stop
        data, history = look(run, stop)
        begin = clock.monotonic(), data["share"]
        with Live(_view(run, data, history, begin), console=Console(stderr=str(json_path) == "-")) as live:
            with contextlib.suppress(KeyboardInterrupt):  # leaving is no failure
                while data["status"] == "running" and not once:
                    clock.sleep(interval)
                    data, history = look(run, stop)
                    live.update(_view(run, data, history, begin))
        answer(data)


def look(run, stop):
    """The summary of a run as it is now, with the share of the scene's stop that it has come to; and its history."""
    from coupling.datasets import opened, read_history
    from coupling.postprocess.summary import summarise_run

    with opened(run) as file:
        data, history = summarise_run(file), read_history(file)
    pairs = ((data.get("time", 0.0), stop.time), (data.get("inflow_mass", 0.0), stop.inflow_mass))
    return data | {"share": min(1.0, max(done / whole for done, whole in pairs if whole))}, history


def _view(run, data, history, begin):
    """A table of one look; `begin`: clock and share of the first, for the time that is left."""
    from coupling.postprocess.quality import quality_line
    from coupling.runs.progress_line import duration

    table = Table("what", "now", title=plain(f"{run}: {data['scene']}"))
    table.add_row("status", plain(f"{data['status']} {data['status_message']}".strip()))
    elapsed, gained = clock.monotonic() - begin[0], data["share"] - begin[1]
    left = f", {duration(elapsed * (1 - data['share']) / gained)} left" if 0 < gained and data["share"] < 1 else ""
    table.add_row("of the stop", f"{data['share']:.0%}{left}")
    table.add_row("records", str(data["records"]))
    if not data["records"]:
        return table
    table.add_row("simulated time", f"{data['time']:.3f} s")
    table.add_row("inflow mass", f"{data['inflow_mass']:.0f} kg/m")
    table.add_row("inflow over time", blocks(history["time"].values, history["inflow_mass"].values))
    table.add_row("flow zone, disturbed zone", f"{data['flow_zone_area']:.1f}, {data['disturbed_area']:.1f} m²")
    table.add_row("steps, mean dt", f"{data['steps']}, {1e6 * data['mean_dt']:.0f} µs ({data['dt_limit']})")
    table.add_row("errors", quality_line(data["quality"]))
    return table


def blocks(time, values):
    """A line of blocks as high as values that begin at 0, evenly over time."""
    import numpy as np

    at = np.interp(np.linspace(time[0], time[-1], min(MOST_BLOCKS, len(time))), time, values)
    heights = np.clip(at / max(at.max(), 1e-300) * (len(BLOCKS) - 1), 0, None).round().astype(int)
    return "".join(BLOCKS[height] for height in heights)
