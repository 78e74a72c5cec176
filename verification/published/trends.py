"""What the source says of its cases beside each other, answered one by one from the study `cases` at 1000 kg/m."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from verification.published.case_figures import at_study_inflow

#: Soil pressure has fallen where it is below this share of the initial one.
FALLEN = 0.5


class Trend(NamedTuple):
    """What is published, what we find, and whether both agree (None: no verdict)."""

    statement: str
    ours: str
    agrees: bool | None


def trends(study, inflow_mass: float) -> list[Trend]:
    """Answers to section 5 of the source; those whose cases are not finished are left out.

    Parameters
    ----------
    study : xarray.Dataset
        With the scenes case-1 to case-10.
    inflow_mass : float
        [kg/m]
    """
    one = study.sel(model="beam-spring")
    now, first = at_study_inflow(one, inflow_mass), one.isel(progress=0, drop=True)
    scenes = study["scene"].values.tolist()
    added = {name: now[name] - first[name] for name in
             ("bending_moment", "axial_force", "shear_force", "displacement_radial", "convergence_horizontal",
              "convergence_vertical", "settlement", "joint_rotation", "joint_opening", "joint_dislocation")}  # fmt: skip
    most = {name: np.abs(values).max([d for d in values.dims if d != "case"]) for name, values in added.items()}
    known = {f"case-{k}": scenes.index(f"case-{k}") for k in range(1, 11) if f"case-{k}" in scenes}
    known = {name: k for name, k in known.items() if np.isfinite(float(most["bending_moment"][k]))}
    ratio = (now["soil_pressure"] / first["soil_pressure"]).transpose("case", "theta").values

    def of(name, quantity, unit=1.0):
        return float(most[quantity][known[name]]) / unit

    found = []

    def answer(needs, statement, ours, agrees):
        if set(needs) <= set(known):
            found.append(Trend(statement, *(part() if callable(part) else part for part in (ours, agrees))))

    def half(name):
        return _fallen(ratio[known[name]], study["gate_angle"].values[known[name]])

    upper = ("case-1", "case-2")
    answer(upper, "gates at 0° and 45°: soil pressure falls within ±30° of the gate",
           lambda: "below half of the initial one within " + ", ".join(f"±{half(n):.0f}°" for n in upper),
           lambda: all(20 <= half(name) <= 40 for name in upper))  # fmt: skip
    invert = lambda name: 100 * (ratio[known[name]][180] - 1)  # noqa: E731
    answer(("case-3",), "gate at 90°: soil pressure at the invert +100 %", lambda: f"{invert('case-3'):+.0f} %",
           lambda: 75 <= invert("case-3") <= 125)  # fmt: skip
    ring = ("case-1", "case-2", "case-3", "case-4", "case-5")
    shape = {name: max(of(name, "convergence_horizontal"), of(name, "convergence_vertical")) for name in known}
    answer(ring, "gate at 180°: the ring deforms less than with other gates, and mostly settles",
           lambda: ", ".join(f"{1e3 * shape[name]:.1f}" for name in ring) + " mm of convergence; settlement "
           f"{of('case-5', 'settlement', 1e-3):.1f} mm",
           lambda: shape["case-5"] < min(shape[n] for n in ring[:4]) and of("case-5", "settlement") > shape["case-5"])  # fmt: skip
    depths = ("case-9", "case-10", "case-3")
    names = {"axial_force": "N", "bending_moment": "M", "shear_force": "Q", "convergence_horizontal": "convergence",
             "joint_opening": "opening", "joint_rotation": "rotation"}  # fmt: skip

    def factors(quantity):
        return tuple(of(name, quantity) / of("case-9", quantity) for name in depths[1:])

    answer(depths, "cover 5, 10, 20 m: what is added grows by factors of 7.4 and 13.9",
           lambda: "; ".join(f"{text} {factors(name)[0]:.1f}, {factors(name)[1]:.1f}" for name, text in names.items()),
           lambda: any(abs(factors(n)[0] / 7.4 - 1) < 0.25 and abs(factors(n)[1] / 13.9 - 1) < 0.25 for n in names))  # fmt: skip
    answer(("case-7", "case-8"), "Young's modulus of the ground has no effect",
           lambda: f"additional M {of('case-7', 'bending_moment', 1e3):.0f} and {of('case-8', 'bending_moment', 1e3):.0f} kN m/m",
           lambda: abs(of("case-8", "bending_moment") / of("case-7", "bending_moment") - 1) < 0.1)  # fmt: skip
    answer(("case-3", "case-6", "case-7"), "more is added with friction and with cohesion",
           lambda: f"additional M {of('case-3', 'bending_moment', 1e3):.0f}, with friction of 35° "
           f"{of('case-7', 'bending_moment', 1e3):.0f}, with cohesion {of('case-6', 'bending_moment', 1e3):.0f} kN m/m",
           lambda: min(of("case-6", "bending_moment"), of("case-7", "bending_moment")) > of("case-3", "bending_moment"))  # fmt: skip

    def worst(quantity, count, names):
        total = np.abs(added[quantity]).isel(case=[known[name] for name in names]).mean("case").values
        return sorted(int(joint) for joint in study["joint"].values[np.argsort(-total)[:count]])

    answer(ring, "joints 1, 2, 5, 6 turn, joints 3 and 4 slip (mean over gates)",
           lambda: f"turn most: {worst('joint_rotation', 4, ring)}; slip most: {worst('joint_dislocation', 2, ring)}",
           lambda: worst("joint_rotation", 4, ring) == [1, 2, 5, 6] and worst("joint_dislocation", 2, ring) == [3, 4])  # fmt: skip
    return found


def _fallen(ratio, gate):
    """Half of the sector around the gate, in one piece, in which the ratio (360,) is below :data:`FALLEN` [degree]."""
    below, count = np.roll(ratio, -int(round(float(gate)))) < FALLEN, len(ratio)
    right = int(np.argmin(below)) if not below.all() else count
    left = int(np.argmin(below[::-1])) if not below.all() else 0
    return 0.5 * (right + left)
