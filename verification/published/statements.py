"""The statements of the published study on case 3 and the twin tunnels, each a number that must lie in an interval."""

from functools import cache
from importlib import resources
from typing import NamedTuple

import numpy as np

from coupling import postprocess
from verification.published.evidence import LAST, RunEvidence, initial_theory

#: Records of a run that says anything of the event.
FEWEST = 12


class Statement(NamedTuple):
    """A statement of the source as a number.

    text, published : as the page shows them;  stated : the published number, or the interval of a statement in words;
    accepted : interval in which ours agrees as run, None where no verdict is given;  rule : the same in words;
    form : how a value of ours is shown;  factor : changes by factors, so that its band adds logarithms.
    """

    text: str
    published: str
    stated: tuple[float, float]
    rule: str
    form: str
    accepted: tuple[float, float] | None = None
    factor: bool = False


class Found(NamedTuple):
    """A value of ours, and what the page says beside it."""

    value: float
    more: str = ""


@cache
def published_numbers() -> dict:
    """statements.toml: source, numbers, and the tables `initial`, `gushing` (case 3) and `twin` of statements."""
    import tomllib

    text = (resources.files("verification") / "published" / "statements.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


def statements(*groups: str) -> dict[str, Statement]:
    """Statements of "initial", "gushing" and "twin" by their keys."""
    rows = [row for group in groups for row in published_numbers()[group]]
    return {row["key"]: Statement(**{name: value for name, value in row.items() if name != "key"}) for row in rows}


def measured_initially(case: RunEvidence, states) -> dict[str, Found]:
    """Ours to the initial statements; states: of :meth:`RunEvidence.states`."""
    numbers, first = published_numbers()["numbers"], states.isel(time=0)
    found = {}
    for letter, name in (("N", "axial_force"), ("Q", "shear_force"), ("M", "bending_moment")):
        for k, value in enumerate(first[f"joint_{name}"].values, start=1):
            found[f"{letter}{k}"] = Found(value / 1e3)
    found["M invert"] = Found(float(first["bending_moment"].sel(theta=180, method="nearest")) / 1e3)
    axial = first["axial_force"].values / 1e3
    low, high = numbers["axial_force_range"]
    off = max(abs(axial.min() / low - 1), abs(axial.max() / high - 1))
    found["N range"] = Found(off, f"{axial.min():.0f}, {axial.max():.0f}")
    for letter, name in (("N", "axial_force"), ("Q", "shear_force"), ("M", "bending_moment")):
        values = np.abs(first[name].values) if letter == "Q" else first[name].values
        angle = float(first["theta"].values[values.argmax()])
        away = min(abs((angle - place + 180) % 360 - 180) for place in numbers[f"{name}_largest_at"])
        found[f"angle {letter}"] = Found(away, f"{angle:g}")
    return found


def measured_while_gushing(case: RunEvidence, states) -> dict[str, Found]:
    """Ours to the statements on the event, those that the run got far enough for."""
    if case.history.sizes["time"] < FEWEST:
        return {}
    mass = case.compared
    rate, straight = postprocess.inflow_linearity(case.history, 0.1 * mass, mass)
    found = {"straight": Found(straight), "rate": Found(rate)}
    if states.sizes["time"] < 2:
        return found
    found |= _pressures(case, mass)
    first, now = states.isel(time=0), states.isel(time=1)
    for key, name, pick in (("Q", "shear_force", _largest), ("M+", "bending_moment", np.max),
                            ("M-", "bending_moment", np.min), ("N", "axial_force", np.max)):  # fmt: skip
        before, after = (float(pick(state[name].values)) for state in (first, now))
        found[key] = Found(100 * (after / before - 1), f"{before / 1e3:.0f} to {after / 1e3:.0f}")
    turned = np.abs((now["joint_rotation"] - first["joint_rotation"]).values)
    worst = sorted(int(first["joint"].values[k]) for k in np.argsort(-turned)[:2])
    numbers = published_numbers()["numbers"]
    found["worst joints"] = Found(len(set(worst) & set(numbers["worst_joints"])), " and ".join(map(str, worst)))
    found["joint 2"] = Found(1e3 * float(now["joint_rotation"].sel(joint=numbers["joint_open_outside"])))
    if states.sizes["time"] > 2:
        stages = postprocess.flow_zone_stages(case.history)
        told = "{:.3g}, {:.3g}, {:.3g} m²/s, bends at {:.3g} and {:.3g} s".format(*stages.rates, *stages.bends)
        found["stages"] = Found(stages.rates[1] / max(stages.rates[0], stages.rates[2], 1e-9), told)
        last = states.isel(time=2)
        for key, name in (("Q", "shear_force"), ("M", "bending_moment"), ("N", "axial_force")):
            pick = _largest if key == "Q" else np.max
            found[f"level {key}"] = Found(100 * float(pick(last[name].values) / pick(now[name].values) - 1))
        drift = [postprocess.pressure_ratio(case.of_gate, "water_pressure", m).values for m in (mass, LAST)]
        found["stable"] = Found(float(np.median(np.abs(drift[1] - drift[0]))))
    diameter = postprocess.gate_diameter(case.horizontal)
    for key, over_time in (
        ("influence_soil", postprocess.influence_distance(case.horizontal, "soil_stress_vertical") / diameter),
        ("influence_water", postprocess.influence_distance(case.horizontal, "pore_pressure") / diameter),
        ("arch", postprocess.arch(case.horizontal)["diameters"]),
    ):
        data = over_time.rename("distance").to_dataset().assign(inflow_mass=case.horizontal["inflow_mass"])
        found[key] = Found(float(postprocess.at_inflow(data, mass)["distance"]))
    return found


def _pressures(case, mass):
    """Pressures on the lining over the initial ones at an inflow mass."""
    pressures, found = case.of_gate, {}
    gate, degrees = float(case.scene.gate.angle), {}
    for name in ("soil", "water"):
        beside = [gate - 5, gate + 5]
        found[f"{name} gate"] = Found(postprocess.ratio_to_initial(pressures, f"{name}_pressure", mass, beside))
        ratio = postprocess.pressure_ratio(pressures, f"{name}_pressure", mass).values
        degrees[name] = int(np.sum(np.abs(ratio - 1) > 0.1))
        found[f"{name} relief"] = Found(case.relieved(f"{name}_pressure"))
    found["wider"] = Found(degrees["soil"] - degrees["water"], f"water {degrees['water']}, soil {degrees['soil']}")
    for angle, where in ((0, "crown"), (180, "invert")):
        found[where] = Found(100 * (postprocess.ratio_to_initial(pressures, "soil_pressure", mass, [angle]) - 1))
    return found


def measured_case(case: RunEvidence, ring=None) -> dict[str, Found]:
    """All that case 3, or a change of it, says; ring: another one than that of the scene."""
    states = case.states(ring)
    return measured_initially(case, states) | measured_while_gushing(case, states)


def measured_twin(twin: RunEvidence, masses=None) -> dict[str, Found]:
    """Ours to the statements on the twin tunnels; the trough at these inflow masses [kg/m], all it got to if None."""
    first, found = (twin.at_rest if twin.at_rest is not None else twin.pressures).isel(time=0), {}
    theory = [initial_theory(twin.scene, tunnel) for tunnel in twin.scene.tunnels]
    for name in ("soil", "water"):
        column = f"{name}_pressure"
        errors = [float(np.abs(first[column].isel(tunnel=k) / one[column] - 1).max()) for k, one in enumerate(theory)]
        found[f"theory {name}"] = Found(max(errors), ", ".join(f"{error:.1%}" for error in errors))
    masses = twin.masses if masses is None else masses
    return found if masses[-1] > twin.reached else found | measured_trough(twin.settlement, masses)


def measured_trough(settlement, masses) -> dict[str, Found]:
    """Growth, width and reach of a settlement trough (time, x) at some inflow masses [kg/m]."""
    states = [postprocess.at_inflow(settlement, mass)["settlement"] for mass in masses]
    largest = [1e3 * float(state.max()) for state in states]
    widths = [float(postprocess.trough(state.expand_dims("time"))["width"][0]) for state in states]
    known = [width for width in widths if np.isfinite(width)]
    ratio = max(known) / min(known) if len(known) > 1 else np.nan
    reach = published_numbers()["numbers"]["trough_within"]
    return {
        "grows": Found(float(np.diff(largest).min()) if len(largest) > 1 else np.nan,
                       ", ".join(f"{value:.1f}" for value in largest) + " mm"),
        "width": Found(ratio, ", ".join(f"{width:.1f}" for width in widths) + " m"),
        "within": Found(float(postprocess.share_within(states[-1], reach))),
    }  # fmt: skip


def _largest(values):
    return np.abs(values).max()
