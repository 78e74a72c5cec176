"""A scene without a known answer, on meshes of several sizes, compared at equal inflow mass."""

from __future__ import annotations

from pathlib import Path

import numpy as np

#: Half width of the arcs over which pressures are averaged [degree]: single cells scatter (docs/numerics.md).
HALF_ARC = 10.0
#: Mesh size over that of the scene, and number of meshes of that size: their sizes differ by a few per cent, which
#: shows what the arrangement of elements alone does.
LEVELS = ((2.0, 3), (2**0.5, 3), (1.0, 2), (0.5**0.5, 1), (0.5, 1))
#: Relative changes of the mesh size among meshes of one level.
CHANGES = (0.0, 0.03, -0.03)


def refined(scene, factor):
    """The scene with every mesh length multiplied by `factor`, elements across the gate and point counts kept in step.

    Elements across the gate are whole and at least two; their width is the gate's over their number.

    Parameters
    ----------
    scene : coupling.Scene
    factor : float

    Returns
    -------
    dict
        Changes for :func:`coupling.load_scene`, as keyword `discretisation`.
    """
    mesh = scene.discretisation
    return {
        "element_size": mesh.element_size * factor,
        "element_size_lining": mesh.element_size_lining * factor,
        "element_size_interior": mesh.element_size_interior * factor,
        "size_growth": mesh.size_growth * factor,
        "elements_across_gate": max(2, round(mesh.elements_across_gate / factor)),
    }


def quantities(pressures, response, inflow_mass):
    """What people read off a run, at an inflow mass: name to (value, unit).

    Parameters
    ----------
    pressures, response : xarray.Dataset
        Of a run: :func:`coupling.datasets.read_pressures`, a response of the ring.
    inflow_mass : float
        [kg/m]; 0: the initial state.
    """
    from coupling.postprocess import at_inflow, extremes
    from structure.response import FORCES, SHOWN

    def now(dataset):
        return dataset.isel(time=0) if inflow_mass == 0 else at_inflow(dataset, inflow_mass)

    state, forces = now(pressures), now(response)
    theta = state["theta"].values
    values = {"time since the gate opened": (float(state["time"]), "s")}
    for where, angle in (("crown", 0), ("invert", 180), ("waist across", 270)):
        near = np.abs((theta - angle + 180) % 360 - 180) <= HALF_ARC
        for name in ("soil", "water"):
            values[f"{name} pressure, {where}"] = (float(state[f"{name}_pressure"].values[near].mean()) / 1e3, "kPa")
    for name in FORCES:
        shown, found = SHOWN[name], extremes(forces, [name])
        for kind in ("max", "min"):
            values[f"{shown.short} {kind}"] = (shown.scale * found[f"{name}_{kind}"].item(), shown.unit)
    for joint in (2, 3):
        rotation = forces["joint_rotation"].sel(joint=joint)
        values[f"rotation, joint {joint}"] = (float(rotation) * 1e3, "mrad")
        values[f"opening, joint {joint}"] = (float(forces["joint_opening"].sel(joint=joint)) * 1e3, "mm")
    return values


def run_ladder(name, folder, inflow_mass, levels=LEVELS, progress=None):
    """Run a scene on all meshes; finished runs in `folder` are read instead of computed again.

    Parameters
    ----------
    name : str
        Built-in scene or TOML file; needs a gate and a ring.
    folder : path
        One subfolder a mesh.
    inflow_mass : float
        Where every run stops [kg/m].
    levels : sequence of (float, int)
    progress : callable or None
        Called with one line of text a run.

    Returns
    -------
    list of dict
        factor [-], folder, points, steps, cpu_seconds, time [s] (to the last record), revision.
    """
    import coupling
    from coupling.datasets import read_attributes, read_history, write_response
    from coupling.files.folder import RUN_FILE
    from coupling.responses.respond import respond
    from coupling.runs.run import run

    base = coupling.load_scene(name)
    runs = []
    for factor, count in levels:
        for change in CHANGES[:count]:
            size = factor * (1 + change)
            scene = coupling.load_scene(name, discretisation=refined(base, size), stop={"inflow_mass": inflow_mass})
            place = Path(folder) / f"{size:.4f}"
            done = (place / RUN_FILE).is_file()
            attributes = read_attributes(place) if done else {}
            if attributes.get("status") != "finished" or attributes["scene"] != scene.source:
                pressures = run(scene, place, overwrite=True, threads=1)
                write_response(place / RUN_FILE, respond(scene, pressures))
                attributes = read_attributes(place)
            history = read_history(place)
            runs.append(
                {
                    "factor": size,
                    "folder": str(place),
                    "points": int(history["point_steps"][-1] / max(int(history["steps"][-1]), 1)),
                    "steps": int(history["steps"][-1]),
                    "cpu_seconds": float(attributes["cpu_seconds"]),
                    "time": float(history["time"][-1]),
                    "revision": str(attributes["revision"]),
                }
            )
            if progress is not None:
                progress(f"{name}, mesh {size:.3g}: {runs[-1]['points']} points, {runs[-1]['cpu_seconds']:.0f} s CPU")
    return runs


def ladder_dataset(runs, inflow_masses):
    """All quantities on all meshes, and their extrapolations.

    Returns
    -------
    xarray.Dataset
        value (mesh, inflow_mass, quantity), extrapolated, error_bar, scatter (inflow_mass, quantity) in the unit of the
        quantity; factor, points, steps, cpu_seconds (mesh).
    """
    import xarray as xr

    from coupling.datasets import read_pressures, read_response
    from verification.accuracy.orders import extrapolate

    table = []
    for entry in runs:
        pressures, response = read_pressures(entry["folder"]), read_response(entry["folder"])
        table.append([quantities(pressures, response, mass) for mass in inflow_masses])
    names = list(table[0][0])
    units = [table[0][0][name][1] for name in names]
    values = np.array([[[state[name][0] for name in names] for state in states] for states in table])
    factor = np.array([entry["factor"] for entry in runs])
    fits = [[extrapolate(factor, values[:, m, q]) for q in range(len(names))] for m in range(len(inflow_masses))]
    note = "in the unit of the quantity, see coordinate `unit`"
    state = ("inflow_mass", "quantity")
    return xr.Dataset(
        {
            "value": (("mesh", *state), values, {"long_name": "value on a mesh", "comment": note}),
            "extrapolated": (state, _pick(fits, 0), {"long_name": "value at mesh size zero", "comment": note}),
            "error_bar": (state, _pick(fits, 1), {"long_name": "error of the extrapolated value", "comment": note}),
            "scatter": (state, _pick(fits, 2), {"long_name": "scatter about the fit", "comment": note}),
            **{
                key: ("mesh", np.array([entry[key] for entry in runs]), {"units": unit})
                for key, unit in (("points", "1"), ("steps", "1"), ("cpu_seconds", "s"), ("time", "s"))
            },
        },
        coords={
            "factor": ("mesh", factor, {"units": "1", "long_name": "mesh size over that of the scene"}),
            "inflow_mass": ("inflow_mass", np.asarray(inflow_masses, float), {"units": "kg/m"}),
            "quantity": names,
            "unit": ("quantity", units),
        },
    )


def _pick(fits, which):
    return np.array([[fit[which] for fit in row] for row in fits])
