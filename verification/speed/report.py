"""Facts, picture and page of `gush bench`."""

from pathlib import Path

from verification.pages import Page, made_by, picture, provenance, table, write_data

BLOCKS = ("made", "facts", "configurations", "threads", "kernels", "sizes", "start", "study")


def facts(data):
    """What was measured besides the tables: pairs of texts."""
    rate = {name: data[f"{name}_points_per_second"] / 1e6 for name in ("step", "reference", "roofline")}
    counted = data["bytes_per_point_step"]
    parts = ", ".join(f"{name} {number:.0f}" for name, number in counted.items())
    yield "scene, points, elements", f"{data['scene']}, {data['points']}, {data['elements']}"
    yield "running programs, before and after", f"{data['load'][0]:.1f}, {data['load'][1]:.1f}"
    yield "two-phase step of this program, million point-steps a CPU s", f"{rate['step']:.1f}"
    yield "plain one-phase reference loop, the same", f"{rate['reference']:.1f}"
    yield "step over reference", f"{data['step_to_reference_ratio']:.2f}"
    yield "copy of memory by one core, GB/s", f"{data['copy_bytes_per_second'] / 1e9:.1f}"
    yield "bytes a point-step moves, as counted", f"{sum(counted.values()):.0f} ({parts})"
    yield "bound by memory, million point-steps a s", f"{rate['roofline']:.0f}"
    yield "step over that bound", f"{rate['step'] / rate['roofline']:.2f}"
    yield "memory of the solver, bytes a point", f"{data['bytes_per_point']:.0f}"
    if "start" not in data:
        return
    share = data["throughput"]
    yield "cost of a step over the number of points (from 5000 on), power", f"{data['size_slope']:.2f}"
    yield "compilation, once, CPU s", f"{data['start']['compilation']:.1f}"
    yield "first step of `gush run quick`, warm, s by the clock", f"{data['first_step_wall_seconds']:.1f}"
    yield "imports, CPU s", ", ".join(f"{name} {seconds:.2f}" for name, seconds in data["imports"].items())
    yield f"{share['runs']} runs at once over as many times the throughput of one", f"{share['share_of_ideal']:.2f}"
    alone, each = share["processor_share_of_one"], share["processor_share_of_each"]
    yield "processors that one run alone had, and each of those at once", f"{alone:.2f}, {each:.2f}"
    yield "the whole measurement, CPU s", f"{data['cpu_seconds']:.0f}"


def bench_page(out):
    """The page in a folder."""
    return Page(Path(out) / "performance.md", "Performance", BLOCKS)


def write(data, page):
    """Fill the page of `bench_page`, and write performance.json and images/performance.png; returns the paths."""
    folder, name = page.path.parent, "images/performance.png"
    draw(data, folder / name)
    numbers = write_data(folder / "performance.json", {**provenance(), **data})
    return [page.fill(blocks(data)), numbers, str(folder / name)]


def blocks(data):
    """Generated blocks of docs/performance.md."""
    reference, start, kernels = data["reference_points_per_second"], data["start"], data["kernels"]

    def million(row, key="points_per_second"):
        return f"{row[key] / 1e6:.1f}"

    return {
        "made": made_by("gush bench --out docs"),
        "facts": table(("measured", ""), facts(data)),
        "configurations": table(
            ("configuration", "million a CPU s", "of the reference", "simulated s a CPU s", "bytes a point"),
            (
                (r["configuration"], million(r), f"{r['points_per_second'] / reference:.2f}",
                 f"{r['simulated_per_cpu_second']:.2e}", f"{r['bytes_per_point']:.0f}")
                for r in data["configurations"]
            ),
        ),
        "threads": table(
            ("threads", "million a CPU s", "million a s by the clock", "speed-up"),
            (
                (r["threads"], million(r), million(r, "points_per_wall_second"), f"{r.get('speed_up', 1.0):.2f}")
                for r in data["threads"]
            ),
        ),
        "kernels": table(
            ("kernel", "ns a point-step", "share"),
            ((name, f"{1e9 * s:.1f}", f"{100 * s / sum(kernels.values()):.0f} %") for name, s in kernels.items()),
        ),
        "sizes": table(
            ("points", "million a CPU s", "bytes a point"),
            ((r["points"], million(r), f"{r['bytes_per_point']:.0f}") for r in data["sizes"]),
        ),
        "start": table(
            ("part", "cold [s]", "warm [s]"),
            ((part, f"{start['cold'][part]:.2f}", f"{seconds:.2f}") for part, seconds in start["warm"].items()),
        ),
        "study": study_block(data["study"]),
    }  # fmt: skip


def study_block(data):
    """Lines about the study of `verification.speed.studies`."""
    path = " + ".join(f"{seconds:.1f}" for seconds in data["path"])
    rows = [(name, f"{wall:.1f}", f"{used:.1f}") for name, (wall, used) in data["best"].items()]
    return [
        *table(("", "s by the clock", "s of processor time"), rows), "",
        f"The study takes {data['share_of_loop']:.2f} of the faster loop by the clock; mean number of running programs "
        f"{data['load'][0]:.1f} before, {data['load'][1]:.1f} after. Its longest path has {path} s of processor time, "
        f"**{data['share_on_idle_cores']:.2f}** of that of the loop of one thread. Measured {data['date']} at revision "
        f"{data['revision']} on {data['machine']}, the fastest of {len(data['rounds']['loop, all cores'])} each.",
    ]  # fmt: skip


def draw(data, path):
    """Rates of the configurations and sizes beside the reference loop and the roofline, kernels, parts of a start."""
    from coupling.figures import GATE, NOW

    with picture(path, 7.2, 5.6) as figure:
        (rates, kernels), (sizes, starts) = figure.subplots(2, 2)
        rows = data["configurations"]
        rates.barh([r["configuration"] for r in rows], [r["points_per_second"] / 1e6 for r in rows], color=NOW)
        rates.axvline(data["reference_points_per_second"] / 1e6, color=GATE, label="reference loop")
        rates.axvline(data["roofline_points_per_second"] / 1e6, color="0.3", ls="--", label="memory bound")
        rates.set_xlabel("million point-steps per CPU second")
        rates.legend(loc="lower center", bbox_to_anchor=(0.3, 1.0), ncol=2, fontsize=6, frameon=False)
        kernels.barh(list(data["kernels"]), [1e9 * s for s in data["kernels"].values()], color=NOW)
        kernels.set_xlabel("CPU time of a point-step [ns]")
        costs = [1e9 / r["points_per_second"] for r in data["sizes"]]
        sizes.semilogx([r["points"] for r in data["sizes"]], costs, "o-", color=NOW)
        sizes.set_ylim(0.0, 1.15 * max(costs))
        sizes.set_xlabel("points")
        sizes.set_ylabel("CPU time of a point-step [ns]")
        sizes.set_title(f"cost of a step ~ points^{data['size_slope']:.2f} (from 5000 on)")
        left = {"cold": 0.0, "warm": 0.0}
        for k, part in enumerate(name for name in data["start"]["warm"] if name != "sum"):
            widths = [data["start"][state][part] for state in left]
            starts.barh(list(left), widths, left=list(left.values()), label=part, color=f"C{k}")
            left = {state: left[state] + width for state, width in zip(left, widths, strict=True)}
        starts.set_xlabel("CPU time of a start [s]")
        starts.legend(fontsize=6)
        for axes in figure.axes:
            axes.grid(True)
            axes.set_axisbelow(True)
