"""Variants of a scene, run as a study, and what people read off a run, at equal inflow mass."""

import numpy as np

import coupling
from coupling.refused import Refused
from structure.response import FORCES, SHOWN
from verification.accuracy.orders import Extrapolation, extrapolate

RECORDS = 101  # inflow masses of the study, from 0 to the last
LATE = 0.9  # of an inflow mass: states are means from there on, since pressures of single records ring
HALF_ARC = 10  # of the arcs over which pressures are averaged [degree]: single cells scatter (docs/numerics.md)
BESIDE_GATE = 25.0  # degrees that roughness and noise leave out


def meshes(scene, factor, across=None):
    """The scene with every mesh length multiplied by `factor`, elements across the gate in step, as dotted changes.

    across : factor of the number of elements across the gate; they are whole and at least two.
    """
    mesh = scene.discretisation
    lengths = ("element_size", "element_size_lining", "element_size_interior", "size_growth")
    changes = {f"discretisation.{name}": getattr(mesh, name) * factor for name in lengths}
    count = mesh.elements_across_gate * (1.0 / factor if across is None else across)
    return changes | {"discretisation.elements_across_gate": max(2, round(count))}


def value_at(scene, name):
    """Value of a scene under a dotted name."""
    value = scene
    for part in name.split("."):
        value = value[int(part)] if part.isdecimal() else getattr(value, part)
    return value


def run_variants(name, variants, inflow_mass, folder, workers=None, tell=None, **fixed):
    """Run variants of a scene to an inflow mass [kg/m]; those that are in the folder already are not run again.

    name : str, built-in scene or TOML file; needs a gate and a ring;
    variants : dict, what is varied, in words, to dotted names with their values; what others change stays as in the
        scene;
    fixed : dotted names with the values that all variants have.

    Returns xarray.Dataset: of :func:`coupling.study`, `case_name` being what is varied.
    """
    scene = coupling.load_scene(name)
    if scene.gate is None or scene.ring is None:
        raise Refused(f"scene: a mesh ladder needs a gate and a ring, got {name!r} without; add [gate] and [ring]")
    changed = dict.fromkeys(key for changes in variants.values() for key in changes)
    parameters = {key: [changes.get(key, value_at(scene, key)) for changes in variants.values()] for key in changed}
    if len(set(zip(*parameters.values(), strict=True))) < len(variants):
        raise Refused(f"variants: must differ in what they change, got {', '.join(variants)}; leave one out")
    plan = {
        "name": f"{scene.name}-variants", "scene": str(name), "design": "list", "records": RECORDS,
        "fixed": {"stop.inflow_mass": inflow_mass, **fixed}, "parameters": parameters,
    }  # fmt: skip
    data = coupling.study(plan, folder, workers=workers, progress=tell)
    return data.assign_coords(case_name=("case", list(variants)))


def quantities(data, inflow_mass, gate=90.0):
    """What people read off a run, at an inflow mass [kg/m], of every case; 0 is the initial state.

    Returns a dict: name with unit to (n_cases,) float64: time; mean pressures over arcs and those 10 degrees beside the
    gate; extreme forces; rotation and opening of joints 2 and 3; roughness and noise of the soil pressure: its root
    mean square off the mean and off the parabola over `HALF_ARC` each side, beyond `BESIDE_GATE` from the gate.
    """
    mass = data["inflow_mass"].max("case").values  # the same of all cases
    at = int(np.abs(mass - inflow_mass).argmin())
    late = data.isel(progress=(mass >= LATE * mass[at]) & (mass <= mass[at])).mean("progress")
    late = late.isel(model=0) if "model" in late.dims else late
    theta = late["theta"].values
    found = {f"time to {mass[at]:g} kg/m [s]": data["time"].isel(progress=at).values}
    for where, angle in (("crown", 0), ("invert", 180), ("waist across", gate + 180)):
        near = np.abs((theta - angle + 180) % 360 - 180) <= HALF_ARC
        for phase in ("soil", "water"):
            mean = late[f"{phase}_pressure"].isel(theta=near).mean("theta")
            found[f"{phase} pressure, {where} [kPa]"] = mean.values / 1e3
    for phase in ("soil", "water"):
        beside = late[f"{phase}_pressure"].sel(theta=gate + 10, method="nearest")
        found[f"{phase} pressure, 10 degrees beside the gate [kPa]"] = beside.values / 1e3
    for name in FORCES:
        shown, around = SHOWN[name], [d for d in late[name].dims if d != "case"]
        for kind in ("max", "min"):
            found[f"{shown.short} {kind} [{shown.unit}]"] = shown.scale * getattr(late[name], kind)(around).values
    for joint in [j for j in (2, 3) if j in late.get("joint", ())]:
        found[f"rotation, joint {joint} [mrad]"] = 1e3 * late["joint_rotation"].sel(joint=joint).values
        found[f"opening, joint {joint} [mm]"] = 1e3 * late["joint_opening"].sel(joint=joint).values
    return found | _unevenness(late["soil_pressure"], theta, gate)


def _unevenness(soil, theta, gate):
    from scipy.signal import savgol_filter

    far, soil = np.abs((theta - gate + 180) % 360 - 180) > BESIDE_GATE, soil.transpose("case", "theta").values
    soil = np.where(np.isfinite(soil), soil, 0.0)
    found = {}
    for name, order in (("roughness [%]", 0), ("noise [%]", 2)):
        smooth = savgol_filter(soil, 2 * HALF_ARC + 1, order, mode="wrap")
        with np.errstate(invalid="ignore", divide="ignore"):
            found[name] = 100 * np.sqrt(np.mean((soil / smooth - 1)[:, far] ** 2, axis=1))
    return found


def at_size_zero(size, found):
    """Quantities of several mesh sizes extrapolated: name to :class:`verification.accuracy.orders.Extrapolation`.

    NaN where one of the meshes has no value: a run that did not reach the inflow mass.
    """
    unknown = Extrapolation(np.nan, np.nan, np.nan, np.nan)
    return {k: extrapolate(size, values) if np.isfinite(values).all() else unknown for k, values in found.items()}
