"""What the source says of its cases beside each other, answered one by one at 1000 kg/m."""

from typing import NamedTuple

import numpy as np

from coupling import postprocess

RING = ("case-1", "case-2", "case-3", "case-4", "case-5")
DEPTHS = ("case-9", "case-10", "case-3")
GROWS = {"axial_force": "N", "bending_moment": "M", "shear_force": "Q", "convergence_horizontal": "convergence",
         "joint_opening": "opening", "joint_rotation": "rotation"}  # fmt: skip


class Trend(NamedTuple):
    """What is published, what we find, and whether both agree."""

    statement: str
    ours: str
    agrees: bool


def trends(cases) -> list[Trend]:
    """Answers to section 5 of the source; those whose cases are not there are left out.

    cases : dict of str to RunEvidence, by scene; one that did not get to 1000 kg/m speaks of where it ended.
    """
    return [trend(cases) for needs, trend in (
        (RING[:2], _upper_gates), (RING[2:3], _invert), (RING, _gate_below), (DEPTHS, _depths),
        (("case-7", "case-8"), _stiffness), (("case-3", "case-6", "case-7"), _strength), (RING, _joints),
    ) if set(needs) <= set(cases)]  # fmt: skip


def _most(run, name):
    return float(np.abs(run.added[name].values).max())


def _upper_gates(cases):
    halves = [cases[name].relieved("soil_pressure") for name in RING[:2]]
    return Trend(
        "gates at 0° and 45°: soil pressure falls within ±30° of the gate",
        "below half of the initial one within " + ", ".join(f"±{half:.0f}°" for half in halves),
        all(20 <= half <= 40 for half in halves),
    )


def _invert(cases):
    run = cases["case-3"]
    rise = 100 * (postprocess.ratio_to_initial(run.of_gate, "soil_pressure", run.compared, [180]) - 1)
    return Trend("gate at 90°: soil pressure at the invert +100 %", f"{rise:+.0f} %", 75 <= rise <= 125)


def _gate_below(cases):
    shape = [max(_most(cases[name], f"convergence_{way}") for way in ("horizontal", "vertical")) for name in RING]
    settled = _most(cases["case-5"], "settlement")
    return Trend(
        "gate at 180°: the ring deforms less than with other gates, and mostly settles",
        f"convergence {', '.join(f'{1e3 * one:.1f}' for one in shape)} mm by gate; settlement {1e3 * settled:.1f} mm",
        shape[-1] < min(shape[:-1]) and settled > shape[-1],
    )


def _depths(cases):
    shallow, *deep = (cases[name] for name in DEPTHS)
    grows = {name: [_most(run, name) / _most(shallow, name) for run in deep] for name in GROWS}
    return Trend(
        "cover 5, 10, 20 m: what is added grows by factors of 7.4 and 13.9 (of what, is not known to us)",
        "; ".join(f"{GROWS[name]} {ten:.1f}, {twenty:.1f}" for name, (ten, twenty) in grows.items()),
        any(abs(ten / 7.4 - 1) < 0.25 and abs(twenty / 13.9 - 1) < 0.25 for ten, twenty in grows.values()),
    )


def _stiffness(cases):
    one, other = (_most(cases[name], "bending_moment") / 1e3 for name in ("case-7", "case-8"))
    ours = f"additional M {one:.0f} with 40 MPa, {other:.0f} kN m/m with 30"
    return Trend("Young's modulus of the ground has no effect", ours, abs(other / one - 1) < 0.1)


def _strength(cases):
    sand, clay, silt = (_most(cases[name], "bending_moment") / 1e3 for name in ("case-3", "case-6", "case-7"))
    ours = f"additional M {sand:.0f}, with friction of 35° {silt:.0f}, with cohesion {clay:.0f} kN m/m"
    return Trend("more is added with friction and with cohesion", ours, min(silt, clay) > sand)


def _joints(cases):
    def worst(name, count):
        total = np.mean([np.abs(cases[case].added[name].values) for case in RING], axis=0)
        return sorted(int(k) + 1 for k in np.argsort(-total)[:count])

    turn, slip = worst("joint_rotation", 4), worst("joint_dislocation", 2)
    ours = f"turn most: {turn}; slip most: {slip}"
    agrees = turn == [1, 2, 5, 6] and slip == [3, 4]
    return Trend("joints 1, 2, 5, 6 turn, joints 3 and 4 slip (mean over gates)", ours, agrees)
