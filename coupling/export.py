"""Points and mesh of a run over time as files for ParaView and PyVista, and as an animation."""

from __future__ import annotations

import fnmatch
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from coupling.datasets import RunFileError, read_mesh, read_points, run_file
from coupling.run_folder import FIELDS, RunRefused

if TYPE_CHECKING:
    import meshio
    import xarray as xr

#: Format: names of the files it writes, replaced by the next export into the same folder.
FILES = {
    "vtu": ("points_*.vtu", "mesh_*.vtu", "points.pvd", "mesh.pvd"),
    "xdmf": ("points.xdmf", "points.h5", "mesh.xdmf", "mesh.h5"),
    "gif": ("gushing.gif",),
}
VECTORS = ("velocity_solid", "velocity_liquid", "displacement")
#: What elements show: means over the points in them, weighted with their volume.
ELEMENT_MEANS = ("pore_pressure", "porosity", "deviatoric_strain", "stress_xx", "stress_yy", "stress_xy")
SECONDS_OF_ANIMATION, LONGEST_FRAME, LAST_FRAME = 6.0, 0.5, 1.5


def export(run: str | Path, kind: str, out: str | Path | None = None) -> list[Path]:
    """Write the fields of a run.

    Parameters
    ----------
    run : str or path
        Run folder or file with snapshots of the points.
    kind : {"vtu", "xdmf", "gif"}
        "vtu": a file a time and `.pvd` series; "xdmf": two series with their HDF5 files; "gif": an animation.
    out : str or path, optional
        Folder; `fields` in the run's folder when left out. Files of an earlier export are replaced, nothing else.

    Returns
    -------
    list of pathlib.Path
        Files to open.

    Raises
    ------
    RunFileError
        No run, or no snapshots.
    RunRefused
        An unknown format, or a folder with other files.
    """
    if kind not in FILES:
        raise RunRefused(f"export: format must be one of {', '.join(FILES)}, got '{kind}'")
    file = run_file(run)
    points = read_points(file)
    if "x" not in points or not points.sizes.get("time"):
        raise RunFileError(
            f"run file '{file}': holds no snapshot of the points, nothing can be exported; did the "
            "scene say output.points = false, or is the run at its beginning?"
        )
    folder = _prepared(file.parent / FIELDS if out is None else Path(out), kind)
    if kind == "gif":
        return [_animation(points, folder / "gushing.gif")]
    write = _write_vtu if kind == "vtu" else _write_xdmf
    times, shots = points["time"].values, [points.isel(time=k) for k in range(points.sizes["time"])]
    written = [write(folder / "points", times, (point_grid(shot) for shot in shots))]
    try:
        mesh = read_mesh(file)
    except RunFileError:
        return written  # a run without a stored mesh
    return [*written, write(folder / "mesh", times, mesh_grids(shots, mesh))]


def point_grid(snapshot: xr.Dataset) -> meshio.Mesh:
    """Points of one time as vertices: a `meshio.Mesh` with every variable, velocities and displacement as vectors.

    snapshot : xarray.Dataset, one time of `/points`.
    """
    import meshio

    here = np.isfinite(snapshot["x"].values)
    data = {name: snapshot[name].values[here] for name in snapshot.data_vars if snapshot[name].dims == ("point",)}
    position = _vector(data.pop("x"), data.pop("y"))
    for name in VECTORS:
        if f"{name}_x" in data:
            data[name] = _vector(data.pop(f"{name}_x"), data.pop(f"{name}_y"))
    return meshio.Mesh(position, [("vertex", np.arange(len(position))[:, None])], point_data=data)


def mesh_grids(snapshots: Iterable[xr.Dataset], mesh: xr.Dataset) -> Iterator[meshio.Mesh]:
    """The mesh with what its elements hold, one `meshio.Mesh` a time.

    Cell data: region, displacement, the means of `ELEMENT_MEANS` (NaN where there is no material), and filled: area of
    the material over that of the element [-].

    Parameters
    ----------
    snapshots : list of xarray.Dataset
    mesh : xarray.Dataset
    """
    import meshio

    from coupling.postprocess import element_of_points

    nodes, corners = _vector(mesh["x"].values, mesh["y"].values), mesh["element_nodes"].values
    p = nodes[corners]
    area = 0.5 * np.abs(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])[:, 2])
    region, cells = mesh["region"].values, [("triangle", corners)]
    for snapshot in snapshots:
        element = element_of_points(snapshot, mesh)
        inside = element >= 0
        weight = snapshot["volume"].values[inside].astype(float)
        volume = np.bincount(element[inside], weight, len(corners))
        share = weight / volume[element[inside]]

        def mean(name, snapshot=snapshot, element=element[inside], inside=inside, share=share, empty=volume == 0):
            sums = np.bincount(element, share * snapshot[name].values[inside], len(corners))
            return np.where(empty, np.nan, sums).astype("f4")

        data = {name: mean(name) for name in ELEMENT_MEANS if name in snapshot}
        if "displacement_x" in snapshot:
            data["displacement"] = _vector(mean("displacement_x"), mean("displacement_y"))
        data |= {"filled": (volume / area).astype("f4"), "region": region}
        yield meshio.Mesh(nodes, cells, cell_data={name: [values] for name, values in data.items()})


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
    from coupling.xdmf import XdmfSeries

    path = stem.with_suffix(".xdmf")
    with XdmfSeries(path) as series:
        for time, grid in zip(times, grids, strict=True):
            series.append(time, grid)
    return path


def _animation(points, path):
    """Fields around the tunnel, one picture a snapshot, colours the same at all times."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    from coupling.figures import common_tops, fields_around_tunnel

    if "tunnel_x" not in points.attrs:
        raise RunRefused("export: an animation shows the surroundings of a tunnel, the scene has none; take vtu")
    tops, pictures = common_tops(points), []
    for k in range(points.sizes["time"]):
        canvas = FigureCanvasAgg(fields_around_tunnel(points.isel(time=k), tops=tops))
        canvas.draw()
        pictures.append(Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB"))
    frame = int(1000 * min(LONGEST_FRAME, SECONDS_OF_ANIMATION / len(pictures)))
    lasting = [frame] * (len(pictures) - 1) + [int(1000 * LAST_FRAME)]
    palette = _palette()
    drawn = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    drawn[0].save(path, save_all=True, append_images=drawn[1:], duration=lasting, loop=0)
    return path


def _palette():
    """The 256 colours that a GIF may have, the same for all pictures: even samples of the colour maps, and greys."""
    import matplotlib
    from PIL import Image

    from coupling.figures import FIELD_COLOURS

    greys = 24
    each = (256 - greys) // len(FIELD_COLOURS)
    maps = [matplotlib.colormaps[name](np.linspace(0, 1, each), bytes=True)[:, :3] for name in FIELD_COLOURS]
    grey = np.repeat(np.linspace(0, 255, greys).astype("u1")[:, None], 3, axis=1)
    image = Image.new("P", (1, 1))
    image.putpalette(np.concatenate([*maps, grey]).tobytes())
    return image


def _vector(x, y):
    return np.column_stack([x, y, np.zeros_like(x)])


def _prepared(folder, kind):
    """The folder, made or emptied of an earlier export of that format."""
    known = [pattern for patterns in FILES.values() for pattern in patterns]
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise RunRefused(f"export folder '{folder}': it, or one above it, is a file; choose another --out") from None
    strange = [p.name for p in folder.iterdir() if not any(fnmatch.fnmatch(p.name, known_) for known_ in known)]
    if strange:
        raise RunRefused(f"export folder '{folder}': holds other files ({strange[0]}); choose another --out")
    for pattern in FILES[kind]:
        for earlier in folder.glob(pattern):
            earlier.unlink()
    return folder
