"""The quantities of a response: their dimensions, units, signs and meaning, and how people are shown them.

Signs, in one place:

- Angles theta run clockwise from the crown; s is the arc length of the centre line in that direction.
- Soil and water pressure push inward; soil shear positive drags the lining clockwise. All act on the outer face.
- N compression positive; M positive with tension on the outer face; Q = -dM/ds - m, with m the
  clockwise couple per arc that shear on the outer face brings half a thickness from the centre line: Q positive where
  the part at larger s pushes the part at smaller s inward.
- Radial displacement outward, tangential displacement and rotation clockwise positive.
- Joint opening positive for a gap; N = -k_n opening in a linear joint. Joint rotation positive when the joint opens on
  the outside; M = k_theta rotation. Joint dislocation positive when the clockwise segment steps inward;
  Q = k_s dislocation. Nonlinear joints (:mod:`structure.joint_laws`) start with these slopes.
- Convergence positive when the diameter shortens; settlement downward positive.
"""

from typing import Any, NamedTuple

#: name: (dimensions, units, long name)
RESPONSE = {
    "axial_force": (("time", "theta"), "N/m", "axial force per metre of tunnel, compression positive"),
    "shear_force": (("time", "theta"), "N/m", "shear force per metre of tunnel, Q = -dM/ds"),
    "bending_moment": (("time", "theta"), "N m/m", "bending moment per metre of tunnel, tension outside positive"),
    "displacement_radial": (("time", "theta"), "m", "radial displacement of the lining, outward positive"),
    "displacement_tangential": (("time", "theta"), "m", "tangential displacement of the lining, clockwise positive"),
    "joint_axial_force": (("time", "joint"), "N/m", "axial force in the joint, compression positive"),
    "joint_shear_force": (("time", "joint"), "N/m", "shear force in the joint, Q = -dM/ds"),
    "joint_bending_moment": (("time", "joint"), "N m/m", "bending moment in the joint, tension outside positive"),
    "joint_opening": (("time", "joint"), "m", "joint opening on the centre line, gap positive"),
    "joint_dislocation": (("time", "joint"), "m", "joint dislocation, clockwise segment inward positive"),
    "joint_rotation": (("time", "joint"), "rad", "joint rotation, opening on the outside positive"),
    "convergence_horizontal": (("time",), "m", "shortening of the horizontal diameter"),
    "convergence_vertical": (("time",), "m", "shortening of the vertical diameter"),
    "settlement": (("time",), "m", "mean downward displacement of the ring"),
    "equilibrium_residual": (("time",), "1", "unbalanced force on the ring or a node over the sum of all nodal loads"),
    "shear_moment_residual": (("time",), "N/m", "largest departure from Q + dM/ds + couple of outer-face shear = 0"),
    "load_sum_horizontal": (("time",), "N/m", "horizontal sum of pressures, weight and balance, right positive"),
    "load_sum_vertical": (("time",), "N/m", "vertical sum of pressures, weight and balance, up positive"),
    "spring_sum_horizontal": (("time",), "N/m", "horizontal sum of soil springs and support, right positive"),
    "spring_sum_vertical": (("time",), "N/m", "vertical sum of soil springs and support, up positive"),
    "balanced_uplift": (("time",), "N/m", "vertical sum of pressures and weight balanced by radial soil pressure"),
    "water_uplift": (("time",), "N/m", "upward resultant of the water pressure on the outer face"),
    "soil_support": (("time",), "Pa", "mean vertical soil stress on the lower half, upward, over the outer diameter"),
    "unborne_resultant": (
        ("time",),
        "1",
        "force or torque that nothing bears, taken out evenly, over the sum of loads",
    ),
}

#: Units and long name of the one variable that only rings with bolts have.
BOLT_FORCE = {"units": "N/m", "long_name": "force in the bolts of a joint per metre of tunnel, tension positive"}

#: Variables of a response that are no state of the ring: their change since the first record says nothing.
NOT_ADDITIONAL = ("equilibrium_residual", "shear_moment_residual", "unborne_resultant", "inflow_mass")

#: name: (units, long name)
COORDINATES = {
    "time": ("s", "time since the gate opened"),
    "theta": ("degree", "angle from the crown, clockwise"),
    "joint": ("1", "joint number, clockwise from the crown"),
    "joint_angle": ("degree", "angle of the joint from the crown, clockwise"),
}

#: What acts on the outer face of a lining.
PRESSURES = ("soil_pressure", "water_pressure", "soil_shear")
#: What the cross sections of a ring carry.
FORCES = ("axial_force", "shear_force", "bending_moment")


def described(
    dimensions: str | tuple[str, ...], fields: dict[str, tuple[Any, str, str]]
) -> dict[str, tuple[str | tuple[str, ...], Any, dict[str, str]]]:
    """Variables as xarray takes them, all over the same dimensions, from name: (values, units, long name)."""
    return {
        name: (dimensions, values, {"units": units, "long_name": long_name})
        for name, (values, units, long_name) in fields.items()
    }


class Shown(NamedTuple):
    """How people are shown a quantity: in a word, by its name, in this unit; factor to it from the dataset's."""

    short: str
    name: str
    unit: str
    scale: float

    @property
    def label(self) -> str:
        """Name and unit, of an axis."""
        return f"{self.name} [{self.unit}]"


SHOWN = {
    "soil_pressure": Shown("soil pressure", "effective soil pressure", "kPa", 1e-3),
    "water_pressure": Shown("water pressure", "water pressure", "kPa", 1e-3),
    "soil_shear": Shown("soil shear", "shear of the soil on the lining", "kPa", 1e-3),
    "axial_force": Shown("N", "axial force N", "kN/m", 1e-3),
    "shear_force": Shown("Q", "shear force Q", "kN/m", 1e-3),
    "bending_moment": Shown("M", "bending moment M", "kN m/m", 1e-3),
    "displacement_radial": Shown("radial displacement", "radial displacement", "mm", 1e3),
    "displacement_tangential": Shown("tangential displacement", "tangential displacement", "mm", 1e3),
    "joint_axial_force": Shown("joint N", "axial force N in the joint", "kN/m", 1e-3),
    "joint_shear_force": Shown("joint Q", "shear force Q in the joint", "kN/m", 1e-3),
    "joint_bending_moment": Shown("joint M", "bending moment M in the joint", "kN m/m", 1e-3),
    "joint_opening": Shown("joint opening", "joint opening (+) or closing (\N{MINUS SIGN})", "mm", 1e3),
    "joint_dislocation": Shown("joint dislocation", "joint dislocation", "mm", 1e3),
    "joint_rotation": Shown("joint rotation", "joint rotation", "mrad", 1e3),
    "convergence_horizontal": Shown(
        "horizontal convergence", "horizontal diameter shorter (+) or longer (\N{MINUS SIGN})", "mm", 1e3
    ),
    "convergence_vertical": Shown(
        "vertical convergence", "vertical diameter shorter (+) or longer (\N{MINUS SIGN})", "mm", 1e3
    ),
    "settlement": Shown("settlement", "settlement", "mm", 1e3),
}
