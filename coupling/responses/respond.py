"""The answer of a ring to pressures: by a lining model of some name, held against limits, and where it is stored."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import xarray as xr

from coupling.datasets import write_dataset, write_response
from coupling.datasets.geometry import on_tunnel, tunnels_beside
from coupling.files.provenance import origin, with_history
from coupling.refused import Refused, SceneError
from coupling.responses.moved import as_it_moved
from coupling.responses.source import Source
from coupling.scenes.rings import gate_tunnel, limits_at, moved_by, ring_of
from coupling.scenes.scene import Scene
from structure import Limits, check, lining_model
from structure.lining import at_whole_degrees
from structure.models import model_name
from structure.ring import Ring


def respond(scene: Scene, pressures: xr.Dataset, backend: str | None = None, tunnel: int | None = None) -> xr.Dataset:
    """Response of the scene's ring to the pressures on a tunnel, by the lining model of that name, with its checks.

    A ring that has moved in the ground has answered there: its forces are the response (:func:`check_backend`).

    backend : None: the model that has moved the ring, else "beam-spring";  tunnel : None: the one with the gate.

    Raises Refused: no ring, no such model, or pressures or ring that the model does not take; structure.LiningFailure:
    no equilibrium.
    """
    number = gate_tunnel(scene) if tunnel is None else tunnel
    pressures, moved = on_tunnel(pressures, number), moved_by(scene, number)
    try:
        ring = ring_of(scene, number)
    except SceneError as problem:
        raise Refused(str(problem)) from None
    response = respond_by_name(ring, pressures, backend or _usual(moved), moved)
    return with_checks(response, limits_at(scene, number, scene.limits))


def responses_on(
    scene: Scene, pressures: xr.Dataset, backend: str | None = None
) -> Iterator[tuple[tuple[str, int | None], xr.Dataset]]:
    """Responses of all tunnels, each of its own ring: (model, tunnel as of :func:`respond`) and response."""
    for tunnel in (None, *tunnels_beside(pressures)):
        model = backend or _usual(moved_by(scene, gate_tunnel(scene) if tunnel is None else tunnel))
        yield (model_name(model), tunnel), respond(scene, pressures, model, tunnel)


def _usual(moved):
    """The lining model that answers where none is named."""
    return moved or "beam-spring"


def check_backend(backend: str, moved: str | None) -> None:
    """Refuse a lining model by name for a ring that another one (:func:`coupling.scenes.rings.moved_by`) has moved."""
    if moved is not None and model_name(backend) != moved:
        raise Refused(
            f"lining model {model_name(backend)!r}: must be {moved!r}, which has moved this ring in the ground; under"
            f" another the ground would press otherwise: choose {moved!r}, or run the scene with that lining_model of"
            " the tunnel"
        )


def respond_by_name(
    ring: Ring, pressures: xr.Dataset, backend: str, moved: str | None = None, **options: Any
) -> xr.Dataset:
    """Response of a ring by the lining model of that name; `options` go to the model.

    moved : the model that has moved the ring in the ground, as of :func:`coupling.scenes.rings.moved_by`.

    Raises Refused, structure.LiningFailure: as :func:`respond`.
    """
    check_backend(backend, moved)
    if moved is not None:
        return as_it_moved(ring, pressures, moved)
    try:
        return at_whole_degrees(lining_model(backend)(ring, **options).respond(pressures))
    except ValueError as problem:
        raise Refused(str(problem)) from problem


def read_limits(path: Path) -> Limits:
    """The limits of a TOML file.

    Raises Refused, structure.InputError: not readable; or no TOML, or no limits: every mistake with key, rule, value
    and remedy.
    """
    try:
        return Limits.from_toml(path)
    except OSError as problem:
        raise Refused(f"limits '{path}': cannot be read: {problem.strerror}; give a TOML file") from problem


def with_checks(response: xr.Dataset, limits: Limits | None) -> xr.Dataset:
    """The response with the variables of `structure.check`; as it is for None.

    Raises Refused: the response lacks what a limit needs.
    """
    if limits is None:
        return response
    try:
        return check(response, limits)
    except ValueError as problem:
        raise Refused(f"limits: {problem}") from problem


def chosen_file(source: Source, model: str, out: Path | None = None, overwrite: bool = False) -> Path | None:
    """The file of its own that a response goes into, checked before it is computed; None: it belongs into the run.

    Without `out` that is the run where pressures and ring are its own, else `<file>-<model>.nc` beside the file. With
    the number of a tunnel without the gate, `-tunnel-<number>` stands before the ending.

    Raises Refused: the file is there, or its folder is not; or it is the one that the pressures come from.
    """
    if out is None and source.is_own:
        return None
    path = source.file.with_name(f"{source.file.stem}-{model}.nc") if out is None else out
    if source.tunnel is not None:
        path = path.with_name(f"{path.stem}-tunnel-{source.tunnel}{path.suffix}")
    if path.exists() and path.samefile(source.file):
        raise Refused(f"output '{path}': must not be the file of the pressures; choose another --out")
    if path.is_dir() or not path.absolute().parent.is_dir():
        raise Refused(f"output '{path}': must be a file in an existing folder; choose another --out")
    if path.exists() and not overwrite:
        raise Refused(f"output '{path}': is there already; choose another --out, or ask for --overwrite")
    return path


def store_response(response: xr.Dataset, source: Source, model: str, path: Path | None) -> Path:
    """Store a response in the file from :func:`chosen_file`, or in the run for None; returns the file."""
    if path is None:
        write_response(source.file, response, model, source.tunnel)
        return source.file
    about = {"Conventions": "CF-1.11", **origin(), **response.attrs}
    about["history"] = with_history("", f"response of {model} to the pressures of {source.file.name}")
    path.unlink(missing_ok=True)
    write_dataset(path, response.assign_attrs(about))
    return path
