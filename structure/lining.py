"""What every lining model takes and gives: the template, and its response as a dataset; signs: `structure.response`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from structure.limits import CHECK_VARIABLES
from structure.pressures import PRESSURES, check_pressures
from structure.response import COORDINATES, NOT_ADDITIONAL, RESPONSE
from structure.springs import limit_pressures
from structure.stability import resultants

if TYPE_CHECKING:
    from structure.ring import Ring

__all__ = ["PRESSURES", "RESPONSE", "check_pressures"]  # of other modules, for models

#: Angles of every response [degree]: those of the pressures of a run, so that the two meet in one expression.
THETA = np.arange(360.0)


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

    #: What its responses are called after.
    name = "own"

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


def origin(ring: Ring, model: str) -> dict[str, str]:
    """Where the answer of a lining model comes from: the model, the ring and what its ground bears."""
    attributes = {"Conventions": "CF-1.11", "model": model, "ring": ring.model_dump_json()}
    if ring.ground is not None:
        normal, tangential = limit_pressures(ring.ground)
        attributes["limit_pressures"] = f"normal {normal:.6g} Pa, tangential {tangential:.6g} Pa"
    return attributes


def response_dataset(
    ring: Ring, pressures: xr.Dataset, fields: dict[str, Any], model: str, details: dict[str, Any] | None = None
) -> xr.Dataset:
    """Response to pressures with the schema's dimensions, units and names, and where it comes from.

    What the pressures come to is added.

    fields : name of :data:`structure.response.RESPONSE` to array, of further variables to (dimensions, array,
    attributes);  model : its name;  details : further attributes.
    """
    fields = resultants(pressures, ring.outer_radius) | fields
    variables = {name: (RESPONSE[name][0], value) if name in RESPONSE else value for name, value in fields.items()}
    joints = np.array(ring.joint_angles, dtype=float)
    axes = {
        "time": ("time", pressures["time"].values, pressures["time"].attrs),
        "theta": ("theta", THETA),
        "joint": ("joint", np.arange(1, len(joints) + 1)),
        "joint_angle": ("joint", joints),
    }
    title = f"response of the lining: {model} model"
    attributes = {"title": title} | origin(ring, model) | (details or {})
    response = xr.Dataset(variables, coords=axes, attrs=attributes)
    known = {name: meaning[-2:] for name, meaning in (COORDINATES | RESPONSE).items()}
    for name in known.keys() & response.variables.keys():
        units, long_name = known[name]
        response[name].attrs = {"units": units, "long_name": long_name} | response[name].attrs
    if "inflow_mass" in pressures:
        response = response.assign_coords(inflow_mass=pressures["inflow_mass"])
    return response


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
        ``inflow_mass`` is carried along as it is; residuals and checks, which are no states, are left out.
    """
    if response.sizes.get("time", 0) == 0:
        raise ValueError(
            "additional: response must have a time dimension with at least one record, got"
            f" {dict(response.sizes)}; keep the initial state, do not select a single time"
        )
    changed = {}
    for name, variable in response.drop_vars(CHECK_VARIABLES, errors="ignore").data_vars.items():
        if name == "inflow_mass":
            changed[str(name)] = variable
        elif "time" in variable.dims and name not in NOT_ADDITIONAL:
            difference = variable - variable.isel(time=0, drop=True)
            changed[str(name)] = difference.assign_attrs(
                variable.attrs, long_name=f"additional {variable.attrs.get('long_name', name)}"
            )
    return xr.Dataset(changed, coords=response.coords, attrs=response.attrs)
