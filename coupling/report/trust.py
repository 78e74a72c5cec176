"""How far a run or a case can be trusted: balances and limits, theory of the initial state, warnings."""

import numpy as np

from coupling.datasets import HISTORY
from coupling.datasets.geometry import tunnels_beside
from coupling.datasets.tree import responses_of
from coupling.postprocess.quality import ERRORS, STATES, poor_errors
from mpm.fields import CLAMPS
from mpm.k0_procedure import bond_friction, lateral_pressure_range
from structure import theoretical_pressures

#: What it means that points meet a limit, by its name in :data:`mpm.fields.CLAMPS`.
MEANINGS = {
    "tension": "grains that are not pressed together bear no tension",
    "suspended": "looser than the loose porosity they do not touch and bear no stress",
    "cavitated": "water that is missing does not pull",
    "porosity_floor": "held there; no sound run reaches it",
    "porosity_ceiling": "held there; no sound run reaches it",
    "returned_to_mesh": "they would have left the mesh within a step",
}
SHEAR_LIMIT = 0.05  # of the largest Q; the slope of M is taken over one element
THEORY_LIMIT = 0.02  # of the mean pressure; an element at the lining sees the depth of its middle
UNEXPECTED = "Outside what is expected: "


def initial_theory(scene, theta):
    """Theoretical pressures before the gate opens, or None where the closed form does not hold.

    It holds for one tunnel in one soil that is dry, or saturated up to the surface, with one K0 beside the tunnel.

    scene : coupling.Scene or None;  theta : (n,) float64 [degree];  returns xarray.Dataset or None.
    """
    if scene is None or len(scene.soils) != 1 or len(scene.tunnels) != 1:
        return None
    soil, tunnel = scene.soils[0], scene.tunnels[0]
    if scene.water is not None and scene.water.table_depth > 0:
        return None
    least, largest = lateral_pressure_range(scene, soil, tunnel.cover, tunnel.cover + tunnel.outer_diameter)
    if least < largest:
        return None
    density = 0.0 if scene.water is None else scene.water.density
    return theoretical_pressures(
        outer_diameter=tunnel.outer_diameter,
        cover=tunnel.cover,
        buoyant_unit_weight=(1 - soil.porosity) * (soil.grain_density - density) * scene.gravity,
        coefficient_at_rest=least,
        water_unit_weight=density * scene.gravity,
        theta=theta,
    )


def ground_slips(scene):
    """Whether friction does not bear the shear of the theoretical state on the first lining: soil pressure differs."""
    tunnel = scene.tunnels[0]
    return bond_friction(scene, tunnel) > tunnel.friction_coefficient


def quality(run, summary, scene=None):
    """Balances and limits that say how far the numbers can be trusted.

    run : xarray.DataTree;  summary : dict, from :func:`coupling.postprocess.summary.summarise_run`;
    scene : coupling.Scene or None, for the theory of the initial pressures.

    Returns list of (str, str, str, bool or None): what, how much, and its verdict: a word of
    :data:`coupling.postprocess.quality.ERRORS`, or whether it is within what is expected; None where nothing is
    expected of it.
    """
    values = summary["quality"]
    rows = [(ERRORS[name].label, ERRORS[name].text(values[name]), verdict)
            for name, verdict in summary["verdicts"].items()]  # fmt: skip
    rows += against_theory(run["lining"].to_dataset().isel(time=0), scene)
    answers = {
        model if tunnel is None else f"{model}, tunnel {tunnel}": response
        for tunnel in (None, *tunnels_beside(run["lining"])) for model, response in responses_of(run, tunnel).items()
    }  # fmt: skip
    for name, response in answers.items():
        if not response.sizes["time"]:
            continue
        if "equilibrium_residual" in response:
            worst = float(np.abs(response["equilibrium_residual"]).max())
            rows.append((f"equilibrium of the ring, {name}: largest unbalanced share", f"{worst:.1e}",
                         ERRORS["lining_equilibrium"].verdict(worst)))  # fmt: skip
        if "shear_moment_residual" in response:
            share = float(np.abs(response["shear_moment_residual"]).max() / np.nanmax(np.abs(response["shear_force"])))
            rows.append((f"Q = -dM/ds, {name}: largest departure over the largest Q", f"{share:.1e}",
                         share <= SHEAR_LIMIT))  # fmt: skip
    points = {clamp: f"{values[name]:.1%} of points at most, " for name, clamp in STATES.items() if name in values}
    rows += [(f"{label}: {MEANINGS[name]}", f"{points.get(name, '')}{values['clamps'][name]:.2%} of point-steps", None)
             for name, label in CLAMPS.items()]  # fmt: skip
    for name, variable in run["history"].to_dataset().data_vars.items():
        if name not in HISTORY and variable.dims == ("time",):
            worst, unit = float(np.abs(variable).max()), variable.attrs.get("units", "")
            rows.append((f"{variable.attrs.get('long_name', name)}: largest size",
                         f"{worst:.3g} {'' if unit == '1' else unit}".strip(), None))  # fmt: skip
    return rows


def against_theory(first, scene):
    """Initial pressures against K0 and hydrostatic theory, the mean of which is the measure: rows as of `quality`.

    first : xarray.Dataset, pressures (theta) of the first record;  scene : coupling.Scene or None.
    """
    theory = initial_theory(scene, first["theta"].values) if "soil_pressure" in first else None
    if theory is None:
        return []
    rows = []
    for name, label in (("soil_pressure", "soil"), ("water_pressure", "water")):
        expected = theory[name].isel(time=0).values
        worst, mean = float(np.abs(first[name].values - expected).max()), float(expected.mean())
        if mean > 0:
            what = f"initial {label} pressure against theory, largest difference at any angle"
            size = f"{worst / 1e3:.2g} kPa, {100 * worst / mean:.2g} % of the mean"
            slips = name == "soil_pressure" and ground_slips(scene)
            size += ", the ground has slipped along the lining" if slips else ""
            rows.append((what, size, None if slips else worst <= THEORY_LIMIT * mean))
    return rows


def balances(case):
    """What a case of a study conserves: names of `coupling.postprocess.quality` to their values, where it has them."""
    names = {name: f"quality_{name}" for name in ERRORS}
    return {name: float(case[v]) for name, v in names.items() if v in case and np.isfinite(case[v])}


def last_record(case):
    """Number of the last inflow mass that a case of a study reached, None where it holds no record."""
    reached = np.flatnonzero(np.isfinite(case["time"].values)) if "time" in case else []
    return int(reached[-1]) if len(reached) else None


def case_warnings(case, scene):
    """What a reader must know before believing a case of a study: list of str.

    case : xarray.Dataset, in memory;  scene : coupling.Scene.
    """
    end, found = last_record(case), []
    if end is None:
        return ["It holds no record."]
    masses = case["inflow_mass"].values
    if end < len(masses) - 1:
        found.append(f"It ended at {masses[end]:.4g} of {masses[-1]:.4g} kg/m.")
    found += [f"{UNEXPECTED}{text}." for text in poor_errors(balances(case))]
    theory = against_theory(case.isel(progress=0), scene)
    return found + [f"{UNEXPECTED}{what}: {size}." for what, size, good in theory if good is False]


def run_warnings(run, attributes, quality_rows):
    """What a reader must know before believing the page about a run: list of str."""
    found = []
    if attributes["status"] != "finished":
        message = attributes.get("status_message") or "the page shows what was computed until then"
        found.append(f"The run is '{attributes['status']}': {message}.")
    remedies = {judged.label: f"; {judged.remedy}" for judged in ERRORS.values()}
    found += [
        f"{UNEXPECTED}{what}: {value}{remedies.get(what, '')}."
        for what, value, good in quality_rows if good in (False, "poor")
    ]  # fmt: skip
    lining = run["lining"].to_dataset()
    records = lining.sizes["time"]
    models = responses_of(run)
    if "soil_pressure" in lining and not models:
        found.append("No lining model has answered to the pressures: run `gush respond` on this run.")
    for tunnel in tunnels_beside(run["lining"]) if models else ():
        if not responses_of(run, tunnel):
            found.append(f"No lining model has answered for tunnel {tunnel}: run `gush respond` on this run.")
    for name, response in models.items():
        answered = response.sizes.get("time", 0)
        if answered != records:
            found.append(f"The response of {name} holds {answered} of {records} records: run `gush respond` again.")
    if "soil_pressure" in lining and records > 1:
        last = lining.isel(time=-1)
        for name, label in (("soil_pressure", "soil"), ("water_pressure", "water")):
            share = float(last[f"{name}_std"].mean() / max(float(np.abs(last[name]).mean()), 1e-9))
            if share > 0.25:
                found.append(f"The {label} pressure still fluctuates: by {share:.0%} of its mean within an interval.")
    if records < 10:
        found.append(f"Only {records} records: what happens between them is not shown.")
    if str(attributes.get("revision", "")).endswith("+changed"):
        found.append(f"The program's files differed from its revision {attributes['revision']}.")
    return found
