"""Every picture that a run has data for."""

import contextlib
from pathlib import Path

from coupling.datasets import (
    RunFileError,
    opened,
    read_history,
    read_mesh,
    read_points,
    read_pressures,
    read_response,
    structure_group,
)
from coupling.datasets.geometry import has_tunnels, joints_of, tunnels_beside
from coupling.datasets.open_run import Run
from coupling.figures.comparison import forces_compared
from coupling.figures.ground import fields_around_tunnel, mesh_near_gate
from coupling.figures.history import inflow
from coupling.figures.picture import RESOLUTION
from coupling.figures.ring import deformed_ring, internal_forces, pressures_polar
from coupling.figures.settlement import settlement_trough
from coupling.figures.utilisations import checks
from coupling.postprocess.answer import settled

#: Names of the pictures; of tunnels without the gate they end in _tunnel_ and its number.
NAMES = (
    "mesh", "fields", "pressures", "internal_forces", "deformed_ring", "checks", "lining_models", "settlement",
    "inflow",
)  # fmt: skip


def draw_run(run: Run, folder: str | Path, kind: str = "png") -> list[Path]:
    """Draw every picture a run has data for.

    Parameters
    ----------
    run : str, path or OpenRun
        Run folder or file, or one that is open.
    folder : str or path
        Where the pictures go; made when absent.
    kind : {"png", "svg", "pdf"}
        Lines are vectors in the last two, fields of many values pixels in all.

    Returns
    -------
    list of Path
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    with opened(run) as file:
        for name, picture in _pictures(file):
            written.append(folder / f"{name}.{kind}")
            picture.savefig(written[-1], dpi=RESOLUTION)
    return written


def _pictures(run):
    """Names and pictures."""
    pressures = read_pressures(run)
    if has_tunnels(pressures):
        mesh = read_mesh(run)
        yield "mesh", mesh_near_gate(mesh)
        for tunnel in (None, *tunnels_beside(pressures)):
            end = "" if tunnel is None else f"_tunnel_{tunnel}"
            with contextlib.suppress(RunFileError):  # a scene may keep no points
                yield f"fields{end}", fields_around_tunnel(read_points(run, -1), tunnel=tunnel, mesh=mesh)
            responses = {m: read_response(run, m, tunnel) for m in run.models(structure_group("", tunnel).rstrip("/"))}
            response = next(iter(responses.values()), None)  # a scene without a ring has none
            joints = () if response is None else joints_of(response)
            yield f"pressures{end}", pressures_polar(pressures, tunnel=tunnel, joints=joints)
            if response is not None:
                yield f"internal_forces{end}", internal_forces(response)
                yield f"deformed_ring{end}", deformed_ring(response)
                if "largest_utilisation" in response:
                    yield f"checks{end}", checks(response)
            if len(responses) > 1:
                yield f"lining_models{end}", forces_compared(responses)
        with contextlib.suppress(RunFileError):
            found = settled(read_points(run, -1))
            if found is not None:
                yield "settlement", settlement_trough(*found)
    yield "inflow", inflow(read_history(run))
