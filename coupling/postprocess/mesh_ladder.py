"""How far forces of a run are from an infinitely fine mesh, by the ladder that `gush accuracy --scene` leaves."""

from pathlib import Path

import numpy as np
import xarray as xr

from coupling.datasets import stored_title
from coupling.postprocess.answer import Extreme
from coupling.refused import Refused
from structure.response import SHOWN

TITLE = "mesh ladder of "


def read_ladder(path: str | Path, scene_name: str) -> xr.Dataset:
    """The ladder of a scene, SCENE-ladder.nc.

    Raises Refused: no such file, no ladder, or that of another scene.
    """
    if not Path(path).is_file():
        raise Refused(f"mesh ladder '{path}': there is no such file; `gush accuracy --scene {scene_name}` makes it")
    title = stored_title(Path(path))
    if title != f"{TITLE}{scene_name}":
        raise Refused(
            f"mesh ladder '{path}': must be that of scene '{scene_name}', got {title or 'no ladder'!r}; "
            f"make it by `gush accuracy --scene {scene_name}` or leave --ladder out"
        )
    return xr.load_dataset(path, engine="h5netcdf")


def mesh_error(ladder: xr.Dataset, extreme: Extreme) -> float | None:
    """Distance of the scene's mesh from size zero and the error bar of that, SI; None where the ladder does not say.

    Of the ladder's state that is nearest in inflow mass; it holds the extremes of forces.
    """
    shown, kind = SHOWN[extreme.name], extreme.kind
    kind = ("max" if extreme.value > 0 else "min") if kind == "size" else kind
    name = f"{shown.short} {kind} [{shown.unit}]"
    if name not in ladder["quantity"].values or "inflow_mass" not in extreme.at:
        return None
    state = ladder.sel(quantity=name).sel(inflow_mass=extreme.at["inflow_mass"], method="nearest")
    own = state["value"].isel(mesh=int(np.abs(ladder["factor"].values - 1).argmin()))
    error = float(abs(own - state["extrapolated"]) + state["error_bar"]) / shown.scale
    return error if np.isfinite(error) else None
