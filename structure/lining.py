"""What every lining model takes and gives: input checks, response variables with units, and the sign conventions.

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

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
import xarray as xr

from structure.pressures import PRESSURES, check_pressures

__all__ = ["PRESSURES", "check_pressures"]  # of `structure.pressures`, for models

#: Angles of every response [degree]: those of the pressures of a run, so that the two meet in one expression.
THETA = np.arange(360.0)
#: Both sides of an angle [rad]: at a joint the mean of the two is given.
SIDES = (-1e-9, 1e-9)

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
    "unborne_resultant": (
        ("time",),
        "1",
        "force or torque that nothing bears, taken out evenly, over the sum of loads",
    ),
}

#: Variables of a response that are no state of the ring: their change since the first record says nothing.
NOT_ADDITIONAL = ("equilibrium_residual", "shear_moment_residual", "unborne_resultant", "inflow_mass")

#: name: (units, long name)
COORDINATES = {
    "time": ("s", "time since the gate opened"),
    "theta": ("degree", "angle from the crown, clockwise"),
    "joint": ("1", "joint number, clockwise from the crown"),
    "joint_angle": ("degree", "angle of the joint from the crown, clockwise"),
}


class LiningFailure(RuntimeError):
    """The ring found no equilibrium: a mechanism, or loads beyond what the ground can carry.

    Attributes
    ----------
    time : float
        Time of the record that failed [s].
    """

    def __init__(self, message: str, time: float):
        super().__init__(message)
        self.time = time


class LiningModel(ABC):
    """A structural model of the lining: pressures in, response out, one time after the other."""

    @abstractmethod
    def respond(self, pressures: xr.Dataset) -> xr.Dataset:
        """Response of the lining to its pressures.

        Parameters
        ----------
        pressures : xarray.Dataset
            soil_pressure, water_pressure, soil_shear (time, theta) [Pa] on the outer face; theta [degree] in any
            periodic sampling, linear in between.

        Returns
        -------
        xarray.Dataset
            The variables of :data:`RESPONSE` at :data:`THETA`, with ``inflow_mass`` (time) carried along where it is
            given.

        Raises
        ------
        ValueError
            The pressures are not what the schema asks for, or cannot be carried without a support.
        LiningFailure
            No equilibrium at some time.
        """


def response_dataset(
    fields: dict[str, np.ndarray], coordinates: dict[str, tuple[str, np.ndarray]], attributes: dict[str, str]
) -> xr.Dataset:
    """Response with the schema's dimensions, units and names.

    fields : name of :data:`RESPONSE` to array;  coordinates : name to (dimension, array).
    """
    variables = {}
    for name, values in fields.items():
        dimensions, units, long_name = RESPONSE[name]
        variables[name] = (dimensions, values, {"units": units, "long_name": long_name})
    axes = {}
    for name, (dimension, values) in coordinates.items():
        units, long_name = COORDINATES[name]
        axes[name] = (dimension, values, {"units": units, "long_name": long_name})
    return xr.Dataset(variables, coords=axes, attrs=attributes)


def at_whole_degrees(dataset: xr.Dataset, along: str = "theta") -> xr.Dataset:
    """A response at :data:`THETA`, linear between its own angles: of another model, or of an earlier version's file.

    Parameters
    ----------
    dataset : xarray.Dataset
        What is at these angles already is given back as it is.
    along : str
        Its dimension around the ring [degree], ascending; becomes ``theta``.
    """
    if along not in dataset.dims or (along == "theta" and np.array_equal(dataset["theta"], THETA)):
        return dataset
    names = [name for name, variable in dataset.data_vars.items() if along in variable.dims and name != "theta_bnds"]
    around = dataset[names]
    around = around.drop_vars([name for name in around.coords if along in around[name].dims and name != along])
    last, first = around.isel({along: [-1]}), around.isel({along: [0]})
    last, first = last.assign_coords({along: last[along] - 360}), first.assign_coords({along: first[along] + 360})
    moved = xr.concat([last, around, first], dim=along).interp({along: THETA})
    if along != "theta":
        moved = moved.rename({along: "theta"})
    units, long_name = COORDINATES["theta"]
    moved["theta"].attrs = {"units": units, "long_name": long_name}
    rest = dataset.drop_dims(along)
    if "theta" in rest.coords:
        moved = moved.drop_vars("theta")
    return rest.assign(moved)


def additional(response: xr.Dataset) -> xr.Dataset:
    """What the event adds: every force and displacement less that of the first record.

    The first record is the initial state, before the gate opens. The difference is one of total states, so it holds
    for nonlinear springs and joints too; it is not the response to the difference of the pressures.

    Parameters
    ----------
    response : xarray.Dataset
        What :meth:`LiningModel.respond` returned, at least one record.

    Returns
    -------
    xarray.Dataset
        The same variables and coordinates, zero at the first record, long names beginning with "additional".
        ``inflow_mass`` is carried along as it is; the residuals, which are no states, are left out.
    """
    if response.sizes.get("time", 0) == 0:
        raise ValueError(
            "additional: response must have a time dimension with at least one record, got"
            f" {dict(response.sizes)}; keep the initial state, do not select a single time"
        )
    changed = {}
    for name, variable in response.data_vars.items():
        if name == "inflow_mass":
            changed[str(name)] = variable
        elif "time" in variable.dims and name not in NOT_ADDITIONAL:
            difference = variable - variable.isel(time=0, drop=True)
            changed[str(name)] = difference.assign_attrs(
                variable.attrs, long_name=f"additional {variable.attrs.get('long_name', name)}"
            )
    return xr.Dataset(changed, coords=response.coords, attrs=response.attrs)
