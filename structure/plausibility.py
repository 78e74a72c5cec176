"""Numbers of a ring that are possible but of another order of magnitude than any: usually a wrong unit."""

from __future__ import annotations

import math
from typing import Any

PRESSURE = {"kPa": 1e3, "MPa": 1e6, "GPa": 1e9}
LENGTH = {"mm": 1e-3, "cm": 1e-2}
PERCENT = {"percent": 1e-2}
RADIANS = {"rad": 180 / math.pi}
DENSITY = {"t/m3": 1e3}
FORCE = {"kN": 1e3, "MN": 1e6}

#: Ranges of one table: key to (lowest, highest, unit, other units that people use with their factors).
Usual = dict[str, tuple[float, float, str, dict[str, float]]]

#: Zero always passes: it leaves a property out. The ranges are those of handbooks, widened until soft clay, rock and
#: small models fit in.
RING: Usual = {
    "outer_diameter": (0.5, 25, "m", LENGTH),
    "inner_diameter": (0.5, 25, "m", LENGTH),
    "concrete_modulus": (1e9, 5e11, "Pa", PRESSURE),
    "concrete_unit_weight": (1e3, 2e5, "N/m3", {"kN/m3": 1e3}),
    "joint_rotational_stiffness": (1e6, 1e13, "N m/rad", FORCE),
    "joint_normal_stiffness": (1e6, 1e13, "N/m", FORCE),
    "joint_shear_stiffness": (1e6, 1e13, "N/m", FORCE),
    "joint_friction_coefficient": (0.02, 2, "as a ratio", PERCENT),
}
GROUND: Usual = {
    "youngs_modulus": (2e5, 1e11, "Pa", PRESSURE),
    "cohesion": (100, 5e6, "Pa", PRESSURE),
    "friction_angle": (5, 50, "degrees", RADIANS),
    "vertical_stress": (500, 5e7, "Pa", PRESSURE),
    "horizontal_stress": (100, 5e7, "Pa", PRESSURE),
    "limit_pressure_normal": (500, 1e9, "Pa", PRESSURE),
    "limit_pressure_tangential": (500, 1e9, "Pa", PRESSURE),
}
#: What is told of limits: a metre that was meant as a millimetre, or the reverse.
LIMITS: Usual = {
    "gasket_opening": (1e-4, 0.1, "m", LENGTH),
    "joint_dislocation": (1e-4, 0.2, "m", LENGTH),
    "joint_contact_height": (0.02, 2, "m", LENGTH),
    "crack_width": (1e-5, 5e-3, "m", LENGTH),
    "convergence_per_mille": (0.05, 200, "per mille", {"as a ratio": 1e3}),
}
SEGMENT: Usual = {
    **{f"cover_{face}": (0.005, 0.2, "m", LENGTH) for face in ("outer", "inner")},
    **{f"bar_diameter_{face}": (0.004, 0.06, "m", LENGTH) for face in ("outer", "inner")},
    **{f"bar_spacing_{face}": (0.02, 1, "m", LENGTH) for face in ("outer", "inner")},
}


def unusual(value: Any, low: float, high: float, unit: str, others: dict[str, float]) -> str:
    """What to think of a number outside of its usual range; empty inside, and for what is no number."""
    if not is_number(value) or value == 0 or low <= value <= high:
        return ""
    told = f"is unusual, got {value:g}: between {low:g} and {high:g} {unit} is usual"
    for other, factor in others.items():
        if low <= value * factor <= high:
            return f"{told}; if {value:g} {other} was meant, write {value * factor:.6g}"
    return f"{told}; check the number and its unit"


def joints_in_radians(joints: Any) -> str:
    """What to think of joint angles [degree] that all lie near the crown; empty where they do not."""
    if not isinstance(joints, list | tuple) or len(joints) < 2 or not all(is_number(joint) for joint in joints):
        return ""
    if min(joints) < 0 or max(joints) > 2 * math.pi:
        return ""
    degrees = ", ".join(f"{math.degrees(joint):.4g}" for joint in joints)
    return f"all lie within 6.3 degrees of the crown; if radians were meant, write [{degrees}]"


def is_number(value: Any) -> bool:
    """Whether a value is a number that a scene can hold."""
    # an integer of any length has no place in a scene, and none in a float
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300
