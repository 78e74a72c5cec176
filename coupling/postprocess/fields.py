"""Fields of the ground on the mesh, snapshot by snapshot: what can be interpolated to an inflow mass."""

import numpy as np
import xarray as xr

from coupling.postprocess.elements import cell_means, element_centres, element_of_points
from coupling.postprocess.ground_axes import QUANTITIES, point_quantities


def element_fields(points: xr.Dataset, mesh: xr.Dataset) -> xr.Dataset:
    """Means by volume of the points in every element, for every snapshot.

    Points have no lasting order in a run file, elements have: fields of elements can be compared between snapshots and
    interpolated in time.

    Parameters
    ----------
    points : xarray.Dataset
        `/points` of a run, all snapshots or one.
    mesh : xarray.Dataset
        `/mesh` of the run.

    Returns
    -------
    xarray.Dataset
        Variables of :data:`coupling.postprocess.ground_axes.QUANTITIES` and deviatoric_strain [-] (time, element), NaN
        in empty elements; x, y (element): centres [m]. Attributes of the mesh.
    """
    if "time" not in points.dims:
        points = points.expand_dims("time")
    about = {**QUANTITIES, "deviatoric_strain": ("1", "accumulated equivalent deviatoric strain")}
    rows = {name: [] for name in about}
    count = mesh.sizes["element"]
    for k in range(points.sizes["time"]):
        now = points.isel(time=k)
        element, weight = element_of_points(now, mesh), now["volume"].values
        fields = {**point_quantities(now), "deviatoric_strain": now["deviatoric_strain"].values}
        for name, values in fields.items():
            rows[name].append(cell_means(element, weight, values, count))
    centre = element_centres(mesh)
    return xr.Dataset(
        {
            name: (("time", "element"), np.array(rows[name]), {"units": units, "long_name": text})
            for name, (units, text) in about.items()
        },
        coords={"time": points["time"], "x": ("element", centre[:, 0]), "y": ("element", centre[:, 1])},
        attrs=mesh.attrs,
    )
