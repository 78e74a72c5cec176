"""Where pressures and a ring come from: a run, or any netCDF-4 file whose root follows the schema of the pressures."""

from pathlib import Path
from typing import NamedTuple

from pydantic import ValidationError

from coupling.datasets import RunFileError, read_group, run_file


class Source(NamedTuple):
    """Pressures of one tunnel and the ring they act on.

    file : path;  is_run : whether the pressures come from the group /lining of a run;
    pressures : xarray.Dataset (time, theta) [Pa];  ring : structure.Ring.
    """

    file: Path
    is_run: bool
    pressures: object
    ring: object


def read_source(path, scene=None):
    """Pressures and ring of a run, or of a file written by hand or by another program.

    Parameters
    ----------
    path : str or path
        A run's folder or file, or a netCDF-4 file with soil_pressure, water_pressure, soil_shear (time, theta) [Pa].
    scene : str, optional
        Scene whose ring is taken. Left out: the scene stored with the run, or the attribute `ring` (JSON of a
        `structure.Ring`) of the file.

    Returns
    -------
    Source

    Raises
    ------
    RunFileError
        Unreadable, not following the schema, or without a ring: which file, rule, value, remedy.
    coupling.scene.SceneError
        No such scene.
    """
    from coupling.scene import load_scene, parse_scene
    from structure.lining import check_pressures

    file = run_file(path)
    root = read_group(file, None)
    is_run = _has_lining(file)
    pressures = read_group(file, "lining") if is_run else root
    chosen = None
    if scene is not None:
        chosen = load_scene(scene)
    elif "scene" in root.attrs:
        chosen = parse_scene(root.attrs["scene"], str(file))
    if "tunnel" in pressures.dims:
        gate = chosen.mpm.gate if chosen is not None else None
        pressures = pressures.isel(tunnel=gate.tunnel if gate else 0, drop=True)
    try:
        check_pressures(pressures)
    except ValueError as problem:
        raise RunFileError(f"'{file}': {problem}") from problem
    return Source(file, is_run, pressures, _ring(file, root, chosen))


def _has_lining(file):
    import h5netcdf

    with h5netcdf.File(file, "r") as content:
        return "lining" in content.groups


def _ring(file, root, scene):
    from structure import Ring
    from structure.inputs import mistakes, refusal

    if scene is not None:
        if scene.ring is None:
            raise RunFileError(f"'{file}': scene '{scene.name}' has no [ring]; choose another --scene")
        return scene.ring
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
