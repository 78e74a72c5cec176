"""Picture and page of `gush bench`."""

from coupling.figures import GATE, NOW
from verification.pages import made_by, picture, provenance, rendered, write_data


def write(data, page):
    """Fill the page performance.md, and write performance.json and images/performance.png beside it; the paths."""
    folder, name = page.path.parent, "images/performance.png"
    draw(data, folder / name)
    numbers = write_data(folder / "performance.json", {**provenance(), **data})
    made = made_by("gush bench --out docs")
    return [page.fill({"made": made, **rendered("performance", **data)}), numbers, str(folder / name)]


def draw(data, path):
    """Rates of the configurations and sizes beside the reference loop and the roofline, kernels, parts of a start."""
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
        sizes.set(xlabel="points", ylabel="CPU time of a point-step [ns]", ylim=(0.0, 1.15 * max(costs)))
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
