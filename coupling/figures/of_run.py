"""Every picture that a run has data for."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import TYPE_CHECKING

from coupling.datasets import RunFileError, opened, read_history, read_mesh, read_points, read_pressures, read_response
from coupling.datasets.geometry import has_tunnels, tunnels_beside
from coupling.figures.ground import fields_around_tunnel, mesh_near_gate
from coupling.figures.history import inflow
from coupling.figures.picture import RESOLUTION
from coupling.figures.ring import deformed_ring, internal_forces, pressures_polar
from coupling.figures.utilisations import checks

if TYPE_CHECKING:
    from coupling.datasets.open_run import Run


def draw_run(run: Run, folder: str | Path) -> list[Path]:
    """Draw every picture a run has data for, as PNG.

    Parameters
    ----------
    run : str, path or OpenRun
        Run folder or file, or one that is open.
    folder : str or path
        Where the pictures go; made when absent.

    Returns
    -------
    list of Path
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    with opened(run) as file:
        for name, picture in _pictures(file):
            written.append(folder / f"{name}.png")
            picture.savefig(written[-1], dpi=RESOLUTION)
    return written


def _pictures(run):
    """Names and pictures."""
    pressures = read_pressures(run)
    if has_tunnels(pressures):
        yield "mesh", mesh_near_gate(read_mesh(run))
        for tunnel in (None, *tunnels_beside(pressures)):
            end = "" if tunnel is None else f"_tunnel_{tunnel}"
            with contextlib.suppress(RunFileError):  # a scene may keep no points
                yield f"fields{end}", fields_around_tunnel(read_points(run, -1), tunnel=tunnel)
            yield f"pressures{end}", pressures_polar(pressures, tunnel=tunnel)
            with contextlib.suppress(RunFileError):  # a scene without a ring has no response
                response = read_response(run, tunnel=tunnel)
                yield f"internal_forces{end}", internal_forces(response)
                yield f"deformed_ring{end}", deformed_ring(response)
                if "largest_utilisation" in response:
                    yield f"checks{end}", checks(response)
    yield "inflow", inflow(read_history(run))
