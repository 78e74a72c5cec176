"""Table, dataset, figure and page of `gush bench`."""

import json
from pathlib import Path

import numpy as np

from verification.pages import made_by, provenance
from verification.speed import studies


def dataset(data):
    """The measurements as an xarray.Dataset over kernel, configuration, size and thread count."""
    import xarray as xr

    def names(rows, key):
        return np.array([row[key] for row in rows], dtype=object)

    def values(rows, key):
        return [row[key] for row in rows]

    rate = {"units": "1/s", "long_name": "point-steps per second of processor time"}
    kernels, configurations, sizes = data["kernels"], data["configurations"], data["sizes"]
    result = xr.Dataset(
        {
            "kernel_seconds": ("kernel", list(kernels.values()), {"units": "s", "long_name": "per point-step"}),
            "points_per_second": ("configuration", values(configurations, "points_per_second"), rate),
            "size_points_per_second": ("size", values(sizes, "points_per_second"), rate),
            "size_bytes_per_point": ("size", values(sizes, "bytes_per_point"), {"units": "byte"}),
            "thread_points_per_second": ("threads", values(data["threads"], "points_per_second"), rate),
        },
        coords={
            "kernel": np.array(list(kernels), dtype=object),
            "configuration": names(configurations, "configuration"),
            "size": ("size", values(sizes, "points"), {"units": "1", "long_name": "number of points"}),
            "threads": values(data["threads"], "threads"),
        },
        attrs={"Conventions": "CF-1.11", **provenance(), "measurements": json.dumps(data)},
    )
    return result


def figure(data):
    """Rates of the configurations and sizes beside the reference loop and the roofline: matplotlib Figure."""
    import matplotlib

    from coupling.figures import GATE, NOW, STYLE
    from coupling.figures.picture import Picture

    with matplotlib.rc_context(STYLE):
        drawn = Picture(figsize=(7.2, 5.6), layout="constrained")
        axes = drawn.subplots(2, 2)
        rows = data["configurations"]
        axes[0, 0].barh([r["configuration"] for r in rows], [r["points_per_second"] / 1e6 for r in rows], color=NOW)
        axes[0, 0].axvline(data["reference_points_per_second"] / 1e6, color=GATE, label="reference loop")
        axes[0, 0].axvline(data["roofline_points_per_second"] / 1e6, color="0.3", ls="--", label="memory bound")
        axes[0, 0].set_xlabel("million point-steps per CPU second")
        axes[0, 0].legend(loc="lower center", bbox_to_anchor=(0.3, 1.0), ncol=2, fontsize=6, frameon=False)
        kernels = data["kernels"]
        axes[0, 1].barh(list(kernels), [1e9 * s for s in kernels.values()], color=NOW)
        axes[0, 1].set_xlabel("CPU time of a point-step [ns]")
        sizes = [r["points"] for r in data["sizes"]]
        costs = [1e9 / r["points_per_second"] for r in data["sizes"]]
        axes[1, 0].semilogx(sizes, costs, "o-", color=NOW)
        axes[1, 0].set_ylim(0.0, 1.15 * max(costs))
        axes[1, 0].set_xlabel("points")
        axes[1, 0].set_ylabel("CPU time of a point-step [ns]")
        axes[1, 0].set_title(f"cost of a step ~ points^{data['size_slope']:.2f} (from 5000 on)")
        parts = [name for name in data["start"]["warm"] if name != "sum"]
        left = {"cold": 0.0, "warm": 0.0}
        for k, part in enumerate(parts):
            widths = [data["start"][state][part] for state in left]
            axes[1, 1].barh(list(left), widths, left=list(left.values()), label=part, color=f"C{k}")
            left = {state: left[state] + width for state, width in zip(left, widths, strict=True)}
        axes[1, 1].set_xlabel("CPU time of a start [s]")
        axes[1, 1].legend(fontsize=6)
        for axis in axes.flat:
            axis.grid(True)
            axis.set_axisbelow(True)
    return drawn


def write(data, out):
    """Write performance.md, .json, .nc and images/performance.png into a folder; returns the paths."""
    out = Path(out)
    (out / "images").mkdir(parents=True, exist_ok=True)
    paths = [out / "performance.md", out / "performance.json", out / "performance.nc", out / "images/performance.png"]
    paths[0].write_text(page(data), encoding="utf-8")
    paths[1].write_text(json.dumps({**provenance(), **data}, indent=1) + "\n", encoding="utf-8")
    dataset(data).to_netcdf(paths[2], engine="h5netcdf")
    figure(data).savefig(paths[3], dpi=150)
    return [str(path) for path in paths]


def page(data):
    """The page docs/performance.md as Markdown."""
    reference = data["reference_points_per_second"]
    counted, operations = data["bytes_per_point_step"], sum(data["operations_per_point_step"].values())
    copy, share = data["copy_bytes_per_second"], data["throughput"]
    start, imports = data["start"], data["imports"]
    lines = [
        "# Performance",
        "",
        f"{made_by('gush bench --out docs')}; mean "
        f"number of running programs {data['load'][0]:.1f} before, {data['load'][1]:.1f} after; "
        f"{data['cpu_seconds']:.0f} s of processor time. Scene {data['scene']}, {data['points']} points, "
        f"{data['elements']} elements. Rates are point-steps per second of processor time; the reference is a plain "
        "88-line single-phase fluid loop with as many points in the same process, one thread.",
        "",
        f"Whole step {data['step_points_per_second'] / 1e6:.1f} million, reference {reference / 1e6:.1f} million: "
        f"ratio **{data['step_to_reference_ratio']:.2f}**.",
        "",
        "![Rates, kernels, sizes, starts](images/performance.png)",
        "",
        "## What a scene has",
        "",
        "| configuration | million a CPU s | of the reference | simulated s a CPU s | bytes a point |",
        "|---|---|---|---|---|",
        *(
            f"| {r['configuration']} | {r['points_per_second'] / 1e6:.1f} | {r['points_per_second'] / reference:.2f} "
            f"| {r['simulated_per_cpu_second']:.2e} | {r['bytes_per_point']:.0f} |"
            for r in data["configurations"]
        ),
        "",
        "| threads | million a CPU s | million a s by the clock | speed-up |",
        "|---|---|---|---|",
        *(
            f"| {r['threads']} | {r['points_per_second'] / 1e6:.1f} | {r['points_per_wall_second'] / 1e6:.1f} "
            f"| {r.get('speed_up', 1.0):.2f} |"
            for r in data["threads"]
        ),
        "",
        "## Kernels",
        "",
        "| kernel | ns a point-step | share |",
        "|---|---|---|",
        *(
            f"| {name} | {1e9 * s:.1f} | {100 * s / sum(data['kernels'].values()):.0f} % |"
            for name, s in data["kernels"].items()
        ),
        "",
        f"A copy of memory moves {copy / 1e9:.1f} GB/s on one core. Counted from the arrays, a point-step moves "
        f"{sum(counted.values()):.0f} bytes (points {counted['points']:.0f}, elements {counted['elements']:.0f}, nodes "
        f"{counted['nodes']:.0f}) if nothing stays in the cache, which bounds the rate at "
        f"{data['roofline_points_per_second'] / 1e6:.0f} million; the step reaches "
        f"{data['step_points_per_second'] / data['roofline_points_per_second']:.2f} of that. The loops over "
        f"points hold {operations} operations, all branches counted: {operations / sum(counted.values()):.2f} a byte, "
        f"{operations * data['step_points_per_second'] / 1e9:.1f} thousand million a second.",
        "",
        "## Size",
        "",
        "| points | million a CPU s | bytes a point |",
        "|---|---|---|",
        *(
            f"| {r['points']} | {r['points_per_second'] / 1e6:.1f} | {r['bytes_per_point']:.0f} |"
            for r in data["sizes"]
        ),
        "",
        f"The cost of a step grows as the number of points to the power {data['size_slope']:.2f} (from 5000 on).",
        "",
        "## Start",
        "",
        "Scene quick, processor time of a process with nothing compiled and with everything kept from an earlier one.",
        "",
        "| part | cold [s] | warm [s] |",
        "|---|---|---|",
        *(f"| {part} | {start['cold'][part]:.2f} | {start['warm'][part]:.2f} |" for part in start["warm"]),
        "",
        f"`gush run quick` reaches the first step of its initial stage {data['first_step_wall_seconds']:.1f} s by the "
        f"clock after the process starts. Imports: {', '.join(f'{k} {v:.2f} s' for k, v in imports.items())}.",
        "",
        "## Runs at once",
        "",
        f"{share['runs']} independent runs of one thread each: {share['share_of_ideal']:.2f} of {share['runs']} times "
        f"the throughput of one by the clock; each had {share['processor_share_of_each']:.2f} of a processor, the one "
        f"alone {share['processor_share_of_one']:.2f}.",
        "",
        *studies.section(data["study"]),
    ]
    return "\n".join(lines) + "\n"
