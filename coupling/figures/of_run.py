"""Every picture that a run has data for."""

from __future__ import annotations

from pathlib import Path

from coupling.datasets import RunFileError, read_history, read_mesh, read_points, read_pressures, read_response
from coupling.datasets.geometry import has_tunnels, tunnels_beside
from coupling.figures.ground import fields_around_tunnel, mesh_near_gate
from coupling.figures.history import inflow
from coupling.figures.picture import RESOLUTION
from coupling.figures.ring import deformed_ring, internal_forces, pressures_polar


def draw_run(run: str | Path, folder: str | Path) -> list[Path]:
    """Draw every picture a run has data for, as PNG.

    Parameters
    ----------
    run : str or path
        Run folder or file.
    folder : str or path
        Where the pictures go; made when absent.

    Returns
    -------
    list of Path
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    sources = {
        "mesh": (mesh_near_gate, lambda: read_mesh(run)),
        "fields": (fields_around_tunnel, lambda: read_points(run, -1)),
        "pressures": (pressures_polar, lambda: read_pressures(run)),
        "internal_forces": (internal_forces, lambda: read_response(run)),
        "deformed_ring": (deformed_ring, lambda: read_response(run)),
        "inflow": (inflow, lambda: read_history(run)),
    }
    pressures = read_pressures(run)
    lined = has_tunnels(pressures)
    for tunnel in tunnels_beside(pressures):
        sources |= _of_tunnel(run, tunnel)
    written = []
    for name, (draw, read) in sources.items():
        if not lined and name != "inflow":
            continue
        try:
            dataset = read()
        except RunFileError:
            if name.startswith(("internal_forces", "deformed_ring", "fields")):
                continue  # a scene without a ring has no response, and one may keep no points
            raise
        path = folder / f"{name}.png"
        draw(dataset).savefig(path, dpi=RESOLUTION)
        written.append(path)
    return written


def _of_tunnel(run, tunnel):
    """Pictures of a tunnel without the gate: name to what draws and what reads it."""

    def pressures(dataset):
        return pressures_polar(dataset, tunnel=tunnel)

    def response():
        return read_response(run, tunnel=tunnel)

    def fields(points):
        return fields_around_tunnel(points, tunnel=tunnel)

    return {
        f"fields_tunnel_{tunnel}": (fields, lambda: read_points(run, -1)),
        f"pressures_tunnel_{tunnel}": (pressures, lambda: read_pressures(run)),
        f"internal_forces_tunnel_{tunnel}": (internal_forces, response),
        f"deformed_ring_tunnel_{tunnel}": (deformed_ring, response),
    }
