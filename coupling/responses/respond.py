"""The answer of a ring to the pressures on its tunnel, by a lining model of some name."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from coupling.datasets.geometry import on_tunnel, tunnels_beside
from coupling.refused import Refused, SceneError
from coupling.scenes.rings import gate_tunnel, ring_of
from structure.models import model_name

if TYPE_CHECKING:
    from collections.abc import Iterator

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
    number = gate_tunnel(scene) if tunnel is None else tunnel
    pressures = on_tunnel(pressures, number)
    try:
        ring = ring_of(scene, number)
    except SceneError as problem:
        raise Refused(str(problem)) from None
    return respond_by_name(ring, pressures, backend)


def responses_on(
    scene: Scene, pressures: xr.Dataset, backend: str = "beam-spring"
) -> Iterator[tuple[tuple[str, int | None], xr.Dataset]]:
    """Responses of all tunnels, each of its own ring: (model, tunnel as of :func:`respond`) and response."""
    for tunnel in (None, *tunnels_beside(pressures)):
        yield (model_name(backend), tunnel), respond(scene, pressures, backend, tunnel)


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
