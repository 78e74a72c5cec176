"""Key numbers of a run with what the run itself can say about their error, its quality line and its warnings."""

from typing import NamedTuple

import numpy as np

from coupling.datasets import HISTORY, structure_group
from coupling.datasets.geometry import gate_of, has_tunnels, on_tunnel, tunnel_of, tunnels_beside
from coupling.datasets.tree import match_times, model_names
from coupling.postprocess.extremes import RING_EXTREMES, ring_extremes, shown_extreme
from coupling.postprocess.quality import ERRORS, STATES
from coupling.postprocess.summary import PLACES
from mpm.variables import CLAMPS

#: What it means that points meet a limit, by its name in :data:`mpm.variables.CLAMPS`.
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
DIFFERENCE = "difference from"


class Number(NamedTuple):
    """A number of the run: SI values and how they are shown.

    initial, final : float or None;  scale : factor from SI to `unit`;  error : float (SI) or None;  basis : str, what
    the error is; one that begins with `DIFFERENCE` is no error but how far another lining model is from this one.
    """

    key: str
    label: str
    unit: str
    scale: float
    initial: float | None
    final: float | None
    error: float | None
    basis: str

    @property
    def is_difference(self):
        """Whether `error` is the difference from another lining model."""
        return self.basis.startswith(DIFFERENCE)


def key_numbers(run):
    """What the run came to.

    Parameters
    ----------
    run : xarray.DataTree
        From :func:`coupling.read_run`, with at least one record.

    Returns
    -------
    dict
        Title of a group to its list of Number; groups without numbers are left out.
    """
    groups = {"Gushing": _inflow_numbers(run)}
    for tunnel in (None, *tunnels_beside(run["lining"])):
        of = "" if tunnel is None else f" of tunnel {tunnel}"
        groups[f"Pressures on the lining{of}"] = _pressure_numbers(run["lining"].to_dataset(), tunnel)
        title = ", ".join([f"Forces and deformation of the ring{of}", *model_names(run, tunnel)[:1]])
        groups[title] = _ring_numbers(run, tunnel)
    return {title: numbers for title, numbers in groups.items() if numbers}


def _inflow_numbers(run):
    history = run["history"].to_dataset()
    last, mass = history.isel(time=-1), history["grain_mass"].values
    one_point = _mass_of_a_point_inside(run)
    numbers = [
        Number("inflow_mass", "inflow mass", "kg/m", 1.0, None, float(last["inflow_mass"]),
               float(np.abs(mass - mass[0]).max()) + one_point, "change of all mass, and one point"),
    ]  # fmt: skip
    rate = inflow_rate(history)
    if rate is not None:
        numbers.append(Number("inflow_rate", "inflow rate, second half of the time", "kg/m/s", 1.0, None, *rate,
                              "scatter between four parts"))  # fmt: skip
    for name, label in (("flow_zone_area", "flow zone (moved over 50 mm)"),
                        ("disturbed_area", "disturbed zone (10 to 50 mm)")):  # fmt: skip
        numbers.append(Number(name, label, "m²", 1.0, None, float(last[name]), None, ""))
    numbers.append(Number("max_velocity", "largest velocity of the grains", "m/s", 1.0, None,
                          float(last["max_velocity"]), None, ""))  # fmt: skip
    return numbers


def _mass_of_a_point_inside(run):
    """Largest grain mass of a point inside the gate's tunnel at the last snapshot [kg/m]: inflow is counted in them."""
    points = run["points"].to_dataset() if "points" in run.children else None
    if points is None or "grain_mass" not in points or not points.sizes["time"] or not has_tunnels(points):
        return 0.0
    last, tunnel = points.isel(time=-1), tunnel_of(points)
    inside = tunnel.distance(last["x"].values, last["y"].values) < tunnel.inner
    return float(np.nanmax(last["grain_mass"].values[inside])) if inside.any() else 0.0


def inflow_rate(history):
    """Mean inflow rate over the second half of the time and its standard deviation between four equal parts [kg/m/s].

    None with fewer than nine records in that half.
    """
    time, mass = history["time"].values, history["inflow_mass"].values
    if np.sum(time >= 0.5 * time[-1]) < 9:
        return None
    parts = np.linspace(0.5 * time[-1], time[-1], 5)
    rates = np.diff(np.interp(parts, time, mass)) / np.diff(parts)
    return float(rates.mean()), float(rates.std(ddof=1))


def scatter(values, spread):
    """Standard deviation of one record: of its differences to its neighbours, and within its output interval.

    Parameters
    ----------
    values : (n,) float64
        A quantity over time; the last fifth, at least five records, is used. Differences of neighbours leave its trend
        out; of independent errors they have twice the variance.
    spread : float
        Standard deviation within the last output interval.

    Returns
    -------
    float
        None with fewer than five records.
    """
    if len(values) < 5:
        return None
    last = values[-max(5, len(values) // 5) :]
    return float(np.hypot(np.std(np.diff(last)) / np.sqrt(2), spread))


def _pressure_numbers(lining, tunnel):
    if "soil_pressure" not in lining:
        return []
    lining = on_tunnel(lining, tunnel)
    numbers, key = [], "" if tunnel is None else f"tunnel_{tunnel}_"
    for name, label in (("soil_pressure", "soil"), ("water_pressure", "water")):
        for place, theta in PLACES.items():
            series, spread = lining[name].sel(theta=theta).values, lining[f"{name}_std"].sel(theta=theta).values
            open_here = tunnel is None and len(series) > 1 and _in_gate(lining, theta)
            numbers.append(
                Number(
                    f"{key}{name}_{theta}", f"{label}, {place}{' (the gate)' if open_here else ''}", "kPa", 1e-3,
                    float(series[0]), None if open_here else float(series[-1]),
                    None if open_here else scatter(series, spread[-1]), "scatter of the last records",
                )
            )  # fmt: skip
    return numbers


def _in_gate(lining, theta):
    """Whether an angle [degree] lies in the gate, where the open lining carries no pressure."""
    gate = gate_of(lining)
    if gate is None:
        return False
    half = np.degrees(np.arcsin(min(1.0, 0.5 * gate.width / tunnel_of(lining).outer)))
    return abs((theta - gate.angle + 180) % 360 - 180) <= half


def initial_theory(scene, theta):
    """Theoretical pressures before the gate opens, or None where the closed form does not hold.

    It holds for one tunnel in one soil that is dry, or saturated up to the surface, with one K0 beside the tunnel.

    scene : coupling.Scene or None;  theta : (n,) float64 [degree];  returns xarray.Dataset or None.
    """
    if scene is None or len(scene.soils) != 1 or len(scene.tunnels) != 1:
        return None
    s = scene
    soil, tunnel = s.soils[0], s.tunnels[0]
    if s.water is not None and s.water.table_depth > 0:
        return None
    least, largest = s.lateral_pressure_range(soil, tunnel.cover, tunnel.cover + tunnel.outer_diameter)
    if least < largest:
        return None
    from structure import theoretical_pressures

    density = 0.0 if s.water is None else s.water.density
    return theoretical_pressures(
        outer_diameter=tunnel.outer_diameter,
        cover=tunnel.cover,
        buoyant_unit_weight=(1 - soil.porosity) * (soil.grain_density - density) * s.gravity,
        coefficient_at_rest=least,
        water_unit_weight=density * s.gravity,
        theta=theta,
    )


def ground_slips(scene):
    """Whether friction does not bear the shear of the theoretical state on the first lining: soil pressure differs."""
    tunnel = scene.tunnels[0]
    return scene.bond_friction(tunnel) > tunnel.friction_coefficient


def _ring_numbers(run, tunnel):
    models = model_names(run, tunnel)
    if not models:
        return []
    responses = {name: run[structure_group(name, tunnel)].to_dataset() for name in models}
    first = responses[models[0]]
    if not first.sizes["time"]:
        return []
    found = ring_extremes(first)
    start, end = ({key: float(values[row]) for key, values in found.items()} for row in (0, -1))
    others = []
    for name in models[1:]:
        rows, present = match_times(responses[name]["time"].values, first["time"].values[-1:])
        if present[0]:
            others.append({key: float(v[rows[0]]) for key, v in ring_extremes(responses[name]).items()})
    labels = ", ".join(models[1:]) if others else "another lining model: there is none"
    basis = f"{DIFFERENCE} {labels}"
    return [
        Number(key if tunnel is None else f"tunnel_{tunnel}_{key}", *shown_extreme(key), start[key], end[key],
               max((abs(other[key] - end[key]) for other in others if key in other), default=None), basis)
        for key in RING_EXTREMES if key in end
    ]  # fmt: skip


def quality(run, summary, scene=None):
    """Balances and limits that say how far the numbers can be trusted.

    Parameters
    ----------
    run : xarray.DataTree
    summary : dict
        From :func:`coupling.postprocess.summary.summarise_run`.
    scene : coupling.Scene or None
        For the theory of the initial pressures.

    Returns
    -------
    list of (str, str, str, bool or None)
        What, how much, and its verdict: a word of :data:`coupling.postprocess.quality.ERRORS`, or whether it is within
        what is expected; None where nothing is expected of it.
    """
    values = summary["quality"]
    rows = [(ERRORS[name].label, ERRORS[name].text(values[name]), verdict)
            for name, verdict in summary["verdicts"].items()]  # fmt: skip
    rows += _against_theory(run["lining"].to_dataset(), scene)
    answers = [(model, k) for k in (None, *tunnels_beside(run["lining"])) for model in model_names(run, k)]
    for model, tunnel in answers:
        response = run[structure_group(model, tunnel)].to_dataset()
        name = model if tunnel is None else f"{model}, tunnel {tunnel}"
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


def _against_theory(lining, scene):
    """Initial pressures of the first record against K0 and hydrostatic theory, the mean of which is the measure."""
    theory = initial_theory(scene, lining["theta"].values) if "soil_pressure" in lining else None
    if theory is None:
        return []
    rows = []
    for name, label in (("soil_pressure", "soil"), ("water_pressure", "water")):
        expected = theory[name].isel(time=0).values
        worst, mean = float(np.abs(lining[name].isel(time=0).values - expected).max()), float(expected.mean())
        if mean > 0:
            what = f"initial {label} pressure against theory, largest difference at any angle"
            size = f"{worst / 1e3:.2g} kPa, {100 * worst / mean:.2g} % of the mean"
            slips = name == "soil_pressure" and ground_slips(scene)
            size += ", the ground has slipped along the lining" if slips else ""
            rows.append((what, size, None if slips else worst <= THEORY_LIMIT * mean))
    return rows


def warnings(run, attributes, quality_rows):
    """What a reader must know before believing the page: list of str."""
    found = []
    if attributes["status"] != "finished":
        message = attributes.get("status_message") or "the page shows what was computed until then"
        found.append(f"The run is '{attributes['status']}': {message}.")
    remedies = {judged.label: f"; {judged.remedy}" for judged in ERRORS.values()}
    found += [
        f"Outside what is expected: {what}: {value}{remedies.get(what, '')}."
        for what, value, good in quality_rows if good in (False, "poor")
    ]  # fmt: skip
    lining = run["lining"].to_dataset()
    records = lining.sizes["time"]
    models = model_names(run)
    if "soil_pressure" in lining and not models:
        found.append("No lining model has answered to the pressures: run `gush respond` on this run.")
    for tunnel in tunnels_beside(run["lining"]) if models else ():
        if not model_names(run, tunnel):
            found.append(f"No lining model has answered for tunnel {tunnel}: run `gush respond` on this run.")
    for name in models:
        answered = run[structure_group(name)].sizes.get("time", 0)
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
