"""The answer of a ring to the pressures on its tunnel, by a lining model of some name."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from coupling.datasets import read_pressures, write_response
from coupling.datasets.geometry import on_tunnel
from coupling.files.folder import RUN_FILE
from coupling.refused import Refused, SceneError
from coupling.scenes.rings import gate_tunnel, ring_of
from structure.models import model_name

if TYPE_CHECKING:
    import xarray as xr

    from coupling.scenes.scene import Scene
    from structure.ring import Ring


def respond(scene: Scene, pressures: xr.Dataset, backend: str = "beam-spring", tunnel: int | None = None) -> xr.Dataset:
    """Response of the scene's ring to the pressures on a tunnel, by the lining model of that name.

    tunnel : int or None, None: the one with the gate.

    Raises
    ------
    Refused
        No ring, no such model, or pressures or ring that the model does not take.
    structure.LiningFailure
        No equilibrium.
    """
    number = gate_tunnel(scene.mpm) if tunnel is None else tunnel
    pressures = on_tunnel(pressures, number)
    try:
        ring = ring_of(scene, number)
    except SceneError as problem:
        raise Refused(str(problem)) from None
    return respond_by_name(ring, pressures, backend)


def respond_beside(scene: Scene, folder: Path, backend: str = "beam-spring") -> list[int]:
    """Store the responses of the tunnels without the gate, each of its own ring; returns their numbers."""
    if scene.ring is None:
        return []
    others = [k for k in range(len(scene.mpm.tunnels)) if k != gate_tunnel(scene.mpm)]
    for k in others:
        response = respond(scene, read_pressures(folder), backend, k)
        write_response(folder / RUN_FILE, response, model_name(backend), tunnel=k)
    return others


def respond_by_name(ring: Ring, pressures: xr.Dataset, backend: str, **options: Any) -> xr.Dataset:
    """Response of a ring by the lining model of that name; `options` go to the model.

    Raises
    ------
    Refused, structure.LiningFailure
        As :func:`respond`.
    """
    from structure import lining_model
    from structure.lining import at_whole_degrees

    try:
        return at_whole_degrees(lining_model(backend)(ring, **options).respond(pressures))
    except ValueError as problem:
        raise Refused(str(problem)) from problem
