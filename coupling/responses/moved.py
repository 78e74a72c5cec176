"""The response of a ring that has moved in the ground: what it carried there, and how it moved."""

import numpy as np
import xarray as xr

from coupling.refused import Refused
from structure.lining import check_pressures, response_dataset
from structure.response import FORCES, RESPONSE
from structure.ring import Ring

MOVEMENTS = ("displacement_radial", "displacement_tangential")


def as_it_moved(ring: Ring, pressures: xr.Dataset, model: str) -> xr.Dataset:
    """Response of a ring to pressures that it has answered already, while they came about.

    Another answer to them would be wrong: in soil springs the ring would give way twice, and alone it is out of balance
    by what accelerates it.

    Parameters
    ----------
    pressures : xarray.Dataset
        `/lining` of a run, of one tunnel, with the ring's own forces.
    model : str
        By which it has moved.

    Returns
    -------
    xarray.Dataset
        The variables of :data:`structure.response.RESPONSE` but residuals, sums and reactions, at the end of every
        interval, with the attribute `answered`. Displacements are those of the outer face since the ground was
        undisturbed.

    Raises
    ------
    coupling.refused.Refused
        A run of an earlier version.
    """
    at_joints = [str(name) for name, values in pressures.data_vars.items() if "joint" in values.dims]
    if ring.joint_angles and "joint_axial_force" not in at_joints:
        raise Refused("the run is of an earlier version, which did not keep the forces in the joints; run it again")
    fields = {}
    for name in (*FORCES, *MOVEMENTS, *at_joints):
        values = pressures[name]
        fields[name] = values.values if name in RESPONSE else (values.dims, values.values, values.attrs)
    theta, (outward, along) = np.radians(pressures["theta"].values), (fields[name] for name in MOVEMENTS)
    crown, right_waist, invert, left_waist = outward[:, :: len(theta) // 4].T
    fields |= {
        "convergence_horizontal": -(right_waist + left_waist),
        "convergence_vertical": -(crown + invert),
        "settlement": -(outward * np.cos(theta) - along * np.sin(theta)).mean(axis=1),
    }
    answered = {"answered": "in the ground, as it moved there"}
    response = response_dataset(ring, check_pressures(pressures, ring), fields, model, answered)
    for name in MOVEMENTS:
        response[name].attrs["long_name"] = pressures[name].attrs["long_name"]
    return response
