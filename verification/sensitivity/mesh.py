"""A mesh ladder (`gush accuracy --scene`): every quantity on the scene's mesh and on an infinitely fine one."""

import math
from pathlib import Path

import numpy as np
import xarray as xr

import coupling
from coupling.refused import Refused
from verification.pages import Page, made_by, picture, provenance, rendered
from verification.sensitivity.variants import at_size_zero, meshes, quantities, run_variants

#: Mesh sizes over that of the scene. Those of one level differ by a few per cent, which shows what the arrangement of
#: elements alone does.
FACTORS = tuple(
    level * (1 + change)
    for level, count in ((2.0, 3), (2**0.5, 3), (1.0, 2), (0.5**0.5, 1), (0.5, 1))
    for change in (0.0, 0.03, -0.03)[:count]
)
#: Shares of the last inflow mass at which a mesh ladder is compared; 0 is the initial state.
SHARES = (0.0, 0.1, 0.25, 0.5, 1.0)


def scene_ladder(name, inflow_mass, out, tell, factors=FACTORS):
    """Run a scene on a ladder of meshes and write its page; what is finished in OUT/runs is not run again."""
    if not inflow_mass > 0:
        raise Refused(f"inflow_mass: must be above 0 kg/m, got {inflow_mass:g}; 1000 is the published one")
    scene = coupling.load_scene(name)
    variants = {f"mesh {factor:.3f}": meshes(scene, factor) for factor in factors}
    data = run_variants(name, variants, inflow_mass, Path(out) / "runs", tell=tell)
    gate = scene.gate.angle
    found = {share * inflow_mass: quantities(data, share * inflow_mass, gate) for share in SHARES}
    return write_ladder(scene.name, np.array(factors), found, data["cpu_seconds"].values, Path(out))


def ladder_dataset(factor, found):
    """All quantities on all meshes, and their extrapolations.

    Returns xarray.Dataset: value (mesh, inflow_mass, quantity), extrapolated, error_bar, scatter (inflow_mass,
    quantity) in the unit that the name of the quantity ends with; factor (mesh).
    """
    fits = [at_size_zero(factor, state) for state in found.values()]
    names = [name if not name.startswith("time") else "time [s]" for name in next(iter(found.values()))]
    state = ("inflow_mass", "quantity")
    values = np.stack([np.stack(list(part.values()), axis=1) for part in found.values()], axis=1)
    data = {"value": (("mesh", *state), values, {"long_name": "value on a mesh"})}
    for key, k, text in (
        ("extrapolated", 0, "value at mesh size zero"), ("error_bar", 1, "error of the extrapolated value"),
        ("scatter", 2, "scatter about the fit"),
    ):  # fmt: skip
        data[key] = (state, np.array([[one[k] for one in fit.values()] for fit in fits]), {"long_name": text})
    return xr.Dataset(data, {
        "factor": ("mesh", factor, {"units": "1", "long_name": "mesh size over that of the scene"}),
        "inflow_mass": ("inflow_mass", np.array(list(found), float), {"units": "kg/m"}), "quantity": names,
    })  # fmt: skip


def write_ladder(name, factor, found, cpu_seconds, folder):
    """Write NAME-ladder.md, .nc and pictures into a folder.

    factor, cpu_seconds : (n_meshes,) float64, mesh size over the scene's; processor time [s];  found : dict, inflow
    mass [kg/m] to :func:`verification.sensitivity.variants.quantities`.

    Returns a dict: page, data : paths as text.
    """
    ladder, own = ladder_dataset(factor, found), abs(factor - 1).argmin()
    states = {}
    for mass in ladder["inflow_mass"].values:
        state = ladder.sel(inflow_mass=mass)
        columns = state["value"][own], state["extrapolated"], state["error_bar"], state["scatter"]
        states[mass] = list(zip(state["quantity"].values, *(column.values for column in columns), strict=True))
        draw(state, folder / "images" / f"{name}-ladder-{mass:g}.png")
    meshes_run = list(zip(factor, cpu_seconds, strict=True))
    about = {"name": name, "made": made_by(f"gush accuracy --scene {name}"), "meshes": meshes_run, "states": states}
    page = Page(folder / f"{name}-ladder.md", f"How far {name} is from a fine mesh", ["ladder"])
    made = provenance()
    ladder.attrs = {"title": f"mesh ladder of {name}", "revision": made["revision"], "created": made["date"]}
    written = {"page": page.fill(rendered("ladder", **about)), "data": str(folder / f"{name}-ladder.nc")}
    ladder.to_netcdf(written["data"], engine="h5netcdf")
    return written


def draw(state, path):
    """Quantities over mesh size at one inflow mass, with the fit to mesh size zero and its error bar."""
    names = [name for name in state["quantity"].values if not name.startswith("opening")]
    columns, factor = 3, state["factor"].values
    rows = math.ceil(len(names) / columns)
    with picture(path, 7.4, 2.0 * rows) as figure:
        grid = figure.subplots(rows, columns, squeeze=False, sharex=True)
        for axes, name in zip(grid.flat, names, strict=False):
            one = state.sel(quantity=name)
            end, bar = float(one["extrapolated"]), float(one["error_bar"])
            axes.plot(factor, one["value"].values, "o", ms=3.5, color="#0b5394")
            slope = np.polyfit(factor, one["value"].values, 1)[0] if np.ptp(factor) else 0.0
            axes.plot([0, factor.max()], [end, end + slope * factor.max()], "-", lw=0.8, color="0.5")
            axes.errorbar([0], [end], [bar], fmt="s", ms=3.5, color="#c1272d", capsize=3)
            axes.set_title(name, fontsize=8)
            axes.grid(True)
        for axes in grid.flat[len(names) :]:
            axes.set_visible(False)
        for axes in grid[-1]:
            axes.set_xlabel("mesh size over the scene's")
        figure.suptitle(f"{float(state['inflow_mass']):g} kg/m", fontsize=9)
