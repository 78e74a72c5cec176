"""The page about the mesh ladder of a scene: every quantity on the scene's mesh and on an infinitely fine one."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

from coupling.files.provenance import revision
from verification.accuracy import figures
from verification.pages import made_by


def write_ladder(ladder, name: str, runs: list[dict], folder: Path) -> dict:
    """Write NAME-ladder.md, .nc and pictures of a mesh ladder into a folder.

    Parameters
    ----------
    ladder : xarray.Dataset
        Of :func:`verification.accuracy.mesh_ladder.ladder_dataset`.
    """
    folder = Path(folder)
    (folder / "images").mkdir(parents=True, exist_ok=True)
    page = [
        f"# How far {name} is from a fine mesh",
        "",
        f"{made_by(f'gush accuracy --scene {name}')}. Every mesh length is multiplied by a factor; states are",
        "compared at equal inflow mass. Meshes of nearly one size show what the arrangement of elements alone does.",
        "Value at size zero: straight line in mesh size, least squares (stresses of linear triangles: first order).",
        "Error bar: the larger of its distance from the finest mesh and twice the standard error of the fit. Pressures",
        "are means over ten degrees to either side. The runs were computed with revision "
        f"{', '.join(sorted({r['revision'] for r in runs}))}.",
        "",
        "| mesh over the scene's | point updates a step | steps | CPU s | time of the last record [s] |",
        "|---|---|---|---|---|",
        *(
            f"| {r['factor']:.3f} | {r['points']} | {r['steps']} | {r['cpu_seconds']:.0f} | {r['time']:.2f} |"
            for r in runs
        ),
    ]
    factor = ladder["factor"].values
    own = abs(factor - 1).argmin()
    for mass in ladder["inflow_mass"].values:
        state = ladder.sel(inflow_mass=mass)
        page += [
            "",
            f"## {mass:g} kg/m" if mass else "## Initial state",
            "",
            "| quantity | the scene's mesh | size zero | error bar | scatter | scene's mesh less size zero |",
            "|---|---|---|---|---|---|",
        ]
        for quantity in ladder["quantity"].values:
            one = state.sel(quantity=quantity)
            here, end = float(one["value"].values[own]), float(one["extrapolated"])
            page.append(
                f"| {quantity} [{one['unit'].values!s}] | {here:.4g} | {end:.4g} | ±{float(one['error_bar']):.2g} |"
                f" {float(one['scatter']):.2g} | {here - end:+.2g} |"
            )
        picture = f"{name}-ladder-{mass:g}.png"
        names = [str(q) for q in ladder["quantity"].values if not str(q).startswith("opening")]
        figures.save(figures.ladder_figure(ladder, float(mass), names), folder / "images" / picture)
        page += ["", f"![{mass:g} kg/m](images/{picture})"]
    (folder / f"{name}-ladder.md").write_text("\n".join(page) + "\n", encoding="utf-8")
    ladder.attrs = {
        "title": f"mesh ladder of {name}",
        "revision": revision(),
        "created": f"{datetime.now(UTC):%Y-%m-%d}",
    }
    ladder.to_netcdf(folder / f"{name}-ladder.nc", engine="h5netcdf")
    return {"page": str(folder / f"{name}-ladder.md"), "data": str(folder / f"{name}-ladder.nc")}
