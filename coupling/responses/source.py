"""Where pressures and a ring come from: a run, or any netCDF-4 file whose root follows the schema of the pressures."""

from pathlib import Path
from typing import NamedTuple

import xarray as xr
from pydantic import ValidationError

from coupling.datasets import RunFileError, opened, run_file
from coupling.datasets.geometry import on_tunnel, tunnels_beside
from coupling.refused import SceneError
from coupling.scenes.rings import gate_tunnel, limits_at, moved_by, ring_of
from coupling.scenes.scene import Scene, load_scene, parse_scene
from structure.inputs import mistakes, refusal
from structure.limits import Limits
from structure.lining import check_pressures
from structure.ring import Ring


class Source(NamedTuple):
    """Pressures (time, theta) [Pa] of one tunnel and the ring they act on.

    is_own : whether they are the group /lining of a run and the ring is that run's own, so that the response belongs
    into the run;  tunnel : None: the only one, or that with the gate;  scene : that with the ring, None without;
    moved : lining model of a ring that has moved in the ground, whose forces are in `pressures`.
    """

    file: Path
    is_own: bool
    pressures: xr.Dataset
    ring: Ring
    tunnel: int | None = None
    scene: Scene | None = None
    moved: str | None = None

    def limits(self, given: Limits | None = None) -> Limits | None:
        """Limits that are given, else those of the scene; what they leave out is that of the scene at the tunnel."""
        if self.scene is None:
            return given
        number = gate_tunnel(self.scene) if self.tunnel is None else self.tunnel
        return limits_at(self.scene, number, self.scene.limits if given is None else given)


def read_source(path: str | Path, scene: str | None = None) -> Source:
    """Pressures and ring of the tunnel with the gate: the first of :func:`read_sources`."""
    return read_sources(path, scene)[0]


def read_sources(path: str | Path, scene: str | None = None) -> list[Source]:
    """Pressures and rings of all tunnels, that with the gate first, of a run, or of a file of another origin.

    path : a run's folder or file, or a netCDF-4 file with soil_pressure, water_pressure, soil_shear (time, theta) [Pa];
    scene : scene whose rings are taken. Left out: the scene stored with the run, or the attribute `ring` (JSON of a
        `structure.Ring`) of the file.

    Raises RunFileError: unreadable, not following the schema, or without a ring: which file, rule, value, remedy;
    coupling.refused.SceneError: no such scene, or one whose rings do not fit its tunnels.
    """
    file = run_file(path)
    with opened(file) as run:
        is_run = "lining" in run.names()
        root = run.group(None)
        pressures = run.group("lining") if is_run else root
    chosen: Scene | None = None
    own: Scene | None = None
    if "scene" in root.attrs:
        try:
            own = chosen = parse_scene(root.attrs["scene"], str(file))
        except SceneError:  # of another version
            if scene is None:
                raise
    if scene is not None:
        chosen = load_scene(scene)
    if "tunnel" not in pressures.dims:
        return [_source(file, is_run, pressures, root, own, chosen, None)]
    numbers = [None, *tunnels_beside(pressures)]
    if chosen is not None and len(chosen.tunnels) < len(numbers):
        raise RunFileError(
            f"'{file}': holds {len(numbers)} tunnels, scene '{chosen.name}' has {len(chosen.tunnels)}; choose a "
            "--scene with as many, or select a tunnel of the pressures"
        )
    return [_source(file, is_run, on_tunnel(pressures, k), root, own, chosen, k) for k in numbers]


def _source(file, is_run, pressures, root, own, chosen, tunnel):
    ring = _ring(file, root, chosen, tunnel)
    try:
        checked = check_pressures(pressures, ring)
    except ValueError as problem:
        raise RunFileError(f"'{file}': {problem}") from problem
    is_own = is_run and own is not None and own.ring is not None and _ring(file, root, own, tunnel) == ring
    moved = moved_by(own, gate_tunnel(own) if tunnel is None else tunnel) if is_own else None
    return Source(file, is_own, checked if moved is None else pressures, ring, tunnel, chosen, moved)


def _ring(file, root, scene, tunnel):
    if scene is not None:
        if scene.ring is None:
            raise RunFileError(f"'{file}': scene '{scene.name}' has no [ring]; choose another --scene")
        return ring_of(scene, gate_tunnel(scene) if tunnel is None else tunnel)
    if "ring" not in root.attrs:
        raise RunFileError(
            f"'{file}': needs a ring, got neither a scene nor the attribute 'ring'; give --scene, e.g. --scene case-3,"
            " or store structure.Ring(..).model_dump_json() as the attribute 'ring'"
        )
    try:
        return Ring.model_validate_json(root.attrs["ring"])
    except ValidationError as problem:
        told = refusal("it", mistakes(problem, Ring))
        raise RunFileError(f"'{file}': attribute 'ring' must describe a structure.Ring: {told}") from None
