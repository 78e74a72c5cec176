"""A run for other programs: fields over time for ParaView and PyVista, an animation, tables, pictures."""

import contextlib
import fnmatch
from pathlib import Path

from coupling.datasets import RunFileError, opened, read_mesh, read_points, read_run
from coupling.export.animation import animation
from coupling.export.grids import mesh_grids, point_grid, ring_series
from coupling.export.tables import EXCEL_FILE, write_tables
from coupling.export.tables import NAMES as TABLE_NAMES
from coupling.export.xdmf import XdmfSeries
from coupling.figures.of_run import NAMES as PICTURE_NAMES
from coupling.figures.of_run import draw_run
from coupling.files.folder import FIELDS, FIGURES, TABLES, made
from coupling.refused import Refused

PICTURES = ("png", "svg", "pdf")
#: Format: names of the files it writes, replaced by the next export into the same folder.
FILES = {
    "vtu": tuple(f"{stem}{end}" for stem in ("points", "mesh", "lining", "ring_*") for end in ("_*.vtu", ".pvd")),
    "xdmf": tuple(f"{stem}{end}" for stem in ("points", "mesh", "lining", "ring_*") for end in (".xdmf", ".h5")),
    "gif": ("gushing.gif",),
    "csv": tuple(f"{name}.csv" for name in TABLE_NAMES),
    "xlsx": (EXCEL_FILE,),
    **{kind: tuple(f"{name}{end}.{kind}" for name in PICTURE_NAMES for end in ("", "_tunnel_*")) for kind in PICTURES},
}


def export(run: str | Path, kind: str, out: str | Path | None = None) -> list[Path]:
    """Write a run for other programs.

    Parameters
    ----------
    run : str or path
        Run folder or file; for fields and animation with snapshots of the points.
    kind : {"vtu", "xdmf", "gif", "csv", "xlsx", "png", "svg", "pdf"}
        "vtu": a file a time and `.pvd` series; "xdmf": series with their HDF5 files; "gif": an animation. A series each
        of the points, of the mesh, of the pressures on the lining, and of the forces of every lining model. "csv",
        "xlsx": see :func:`coupling.export.tables.run_tables`; "png", "svg", "pdf": the pictures of `gush run`.
    out : str or path, optional
        Folder; `fields`, `tables` or `figures` in the run's folder when left out. Files of an earlier export are
        replaced, nothing else.

    Returns
    -------
    list of pathlib.Path
        Files to open.

    Raises
    ------
    RunFileError
        No run, or no snapshots of its points for fields.
    Refused
        An unknown format, a folder with other files, or Excel without openpyxl.
    """
    if kind not in FILES:
        raise Refused(f"export: format must be one of {', '.join(FILES)}, got '{kind}'")
    with opened(run) as file:
        if kind in ("csv", "xlsx"):
            return write_tables(file, _prepared(file, out, kind, TABLES), kind)
        if kind in PICTURES:
            return draw_run(file, _prepared(file, out, kind, FIGURES), kind)
        return _fields(file, kind, out)


def _fields(file, kind, out):
    points = read_points(file)
    if "x" not in points or not points.sizes.get("time"):
        raise RunFileError(
            f"run file '{file.path}': holds no snapshot of the points, nothing can be exported; did the "
            "scene say output.points = false, or is the run at its beginning?"
        )
    folder = _prepared(file, out, kind, FIELDS)
    if kind == "gif":
        with contextlib.suppress(RunFileError):
            return [animation(points, folder / "gushing.gif", read_mesh(file))]
        return [animation(points, folder / "gushing.gif")]
    write = _write_vtu if kind == "vtu" else _write_xdmf
    times, shots = points["time"].values, [points.isel(time=k) for k in range(points.sizes["time"])]
    written = [write(folder / "points", times, (point_grid(shot) for shot in shots))]
    with contextlib.suppress(RunFileError):  # a run without a stored mesh
        written.append(write(folder / "mesh", times, mesh_grids(shots, read_mesh(file))))
    for stem, at, grids in ring_series(read_run(file), times):
        written.append(write(folder / stem, at, grids))
    return written


def _write_vtu(stem, times, grids):
    lines = ['<?xml version="1.0"?>', '<VTKFile type="Collection" version="0.1">', "<Collection>"]
    for k, (time, grid) in enumerate(zip(times, grids, strict=True)):
        path = stem.with_name(f"{stem.name}_{k:04d}.vtu")
        grid.write(path)
        lines.append(f'<DataSet timestep="{float(time)!r}" part="0" file="{path.name}"/>')
    series = stem.with_suffix(".pvd")
    series.write_text("\n".join([*lines, "</Collection>", "</VTKFile>", ""]), encoding="utf-8")
    return series


def _write_xdmf(stem, times, grids):
    path = stem.with_suffix(".xdmf")
    with XdmfSeries(path) as series:
        for time, grid in zip(times, grids, strict=True):
            series.append(time, grid)
    return path


def _prepared(file, out, kind, home):
    """The folder, `out` or that of the run, made or emptied of an earlier export of that format."""
    folder = made(file.path.parent / home if out is None else out, "export folder")
    known = [pattern for patterns in FILES.values() for pattern in patterns]
    strange = [p.name for p in folder.iterdir() if not any(fnmatch.fnmatch(p.name, known_) for known_ in known)]
    if strange and not (out is None and home == FIGURES):  # other commands draw there, too
        raise Refused(f"export folder '{folder}': holds other files ({strange[0]}); choose another --out")
    for pattern in FILES[kind]:
        for earlier in folder.glob(pattern):
            earlier.unlink()
    return folder
