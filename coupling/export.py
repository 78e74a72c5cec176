"""Points and mesh of a run over time as files for ParaView and PyVista, and as an animation."""

from __future__ import annotations

import contextlib
import fnmatch
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from coupling.datasets import RunFileError, read_mesh, read_points, read_run, run_file
from coupling.report.series import match_times
from coupling.run_folder import FIELDS, RunRefused

if TYPE_CHECKING:
    import meshio
    import xarray as xr
    from numpy.typing import NDArray

#: Format: names of the files it writes, replaced by the next export into the same folder.
FILES = {
    "vtu": tuple(f"{stem}{end}" for stem in ("points", "mesh", "lining", "ring_*") for end in ("_*.vtu", ".pvd")),
    "xdmf": tuple(f"{stem}{end}" for stem in ("points", "mesh", "lining", "ring_*") for end in (".xdmf", ".h5")),
    "gif": ("gushing.gif",),
}
TENSOR = "stress"
VECTORS = ("velocity_solid", "velocity_liquid", "displacement")
#: What elements show: means over the points in them, weighted with their volume.
ELEMENT_MEANS = (
    "pore_pressure", "porosity", "deviatoric_strain", "stress_xx", "stress_yy", "stress_zz", "stress_xy",
)  # fmt: skip
SECONDS_OF_ANIMATION, LONGEST_FRAME, LAST_FRAME = 6.0, 0.5, 1.5


def export(run: str | Path, kind: str, out: str | Path | None = None) -> list[Path]:
    """Write the fields of a run.

    Parameters
    ----------
    run : str or path
        Run folder or file with snapshots of the points.
    kind : {"vtu", "xdmf", "gif"}
        "vtu": a file a time and `.pvd` series; "xdmf": series with their HDF5 files; "gif": an animation. A series each
        of the points, of the mesh, of the pressures on the lining, and of the forces of every lining model.
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
    with contextlib.suppress(RunFileError):  # a run without a stored mesh
        written.append(write(folder / "mesh", times, mesh_grids(shots, read_mesh(file))))
    for stem, at, grids in ring_series(read_run(file), times):
        written.append(write(folder / stem, at, grids))
    return written


def point_grid(snapshot: xr.Dataset) -> meshio.Mesh:
    """Points of one time as vertices: a `meshio.Mesh` with every variable, vectors and the stress tensor as such.

    snapshot : xarray.Dataset, one time of `/points`.
    """
    import meshio

    here = np.isfinite(snapshot["x"].values)
    data = {name: snapshot[name].values[here] for name in snapshot.data_vars if snapshot[name].dims == ("point",)}
    position = _vector(data.pop("x"), data.pop("y"))
    for name in VECTORS:
        if f"{name}_x" in data:
            data[name] = _vector(data.pop(f"{name}_x"), data.pop(f"{name}_y"))
    if f"{TENSOR}_zz" in data:
        data[TENSOR] = _tensor(*(data.pop(f"{TENSOR}_{part}") for part in ("xx", "yy", "zz", "xy")))
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
        if f"{TENSOR}_zz" in data:
            data[TENSOR] = _tensor(*(data.pop(f"{TENSOR}_{part}") for part in ("xx", "yy", "zz", "xy")))
        data |= {"filled": (volume / area).astype("f4"), "region": region}
        yield meshio.Mesh(nodes, cells, cell_data={name: [values] for name, values in data.items()})


def ring_series(run: xr.DataTree, times: NDArray[np.float64]) -> Iterator[tuple[str, NDArray[np.float64], Any]]:
    """Pressures on the linings, and what every lining model made of them, as series of quadrilaterals.

    Parameters
    ----------
    run : xarray.DataTree
    times : (n,) float64
        [s]; those at which there is a record are written.

    Yields
    ------
    stem : str
        "lining", or "ring_" and the model.
    times : (m,) float64
    grids : iterator of meshio.Mesh
        A cell for each angle; cell data in SI units, `displacement` a vector, `tunnel` the number of the tunnel.
    """
    lining = run["lining"].to_dataset() if "lining" in run.children else None
    if lining is None or "soil_pressure" not in lining:
        return
    gate = int(lining.attrs.get("gate_tunnel", 0))
    tunnels = range(len(np.atleast_1d(lining.attrs["tunnel_x"])))
    parts = {"lining": [(k, lining.isel(tunnel=k) if "tunnel" in lining.dims else lining) for k in tunnels]}
    for name, group in run.children.items():
        if name.startswith("structure"):
            number = int(name.rpartition("_")[2]) if name != "structure" else gate
            for model, response in group.children.items():
                parts.setdefault(f"ring_{model}", []).append((number, response.to_dataset()))
    for stem, of_tunnels in parts.items():
        rows, present = match_times(of_tunnels[0][1]["time"].values, times)
        if present.any():
            shape = _ring_shape(lining.attrs, of_tunnels)
            grids = (_ring_grid(shape, [(k, data.isel(time=row)) for k, data in of_tunnels]) for row in rows[present])
            yield stem, times[present], grids


def _ring_shape(geometry, rings):
    """Nodes (n, 3) [m] and quadrilaterals (m, 4) of some rings: a cell for each angle, as thick as the lining."""
    nodes, cells, first = [], [], 0
    for k, ring in rings:
        x, depth, outer, inner = (
            float(np.atleast_1d(geometry[f"tunnel_{name}"])[k])
            for name in ("x", "axis_depth", "outer_radius", "inner_radius")
        )
        angle = np.radians(ring["theta"].values)
        edge = angle - 0.5 * ((angle - np.roll(angle, 1)) % (2 * np.pi))
        for radius in (outer, inner):
            nodes.append(_vector(x + radius * np.sin(edge), -depth + radius * np.cos(edge)))
        n, number = len(angle), np.arange(len(angle))
        after = (number + 1) % n
        cells.append(first + np.column_stack([number, after, n + after, n + number]))
        first += 2 * n
    return np.concatenate(nodes), np.concatenate(cells)


def _ring_grid(shape, rings):
    """Rings at one time, with everything that they have for each angle."""
    import meshio

    data = {}
    for k, ring in rings:
        values = {name: ring[name].values for name in ring.data_vars if ring[name].dims == ("theta",)}
        angle = np.radians(ring["theta"].values)
        if "displacement_radial" in values:
            radial, tangential = values.pop("displacement_radial"), values.pop("displacement_tangential")
            sine, cosine = np.sin(angle), np.cos(angle)
            values["displacement"] = _vector(radial * sine + tangential * cosine, radial * cosine - tangential * sine)
        for name, of_cells in {**values, "tunnel": np.full(len(angle), k)}.items():
            data.setdefault(name, []).append(of_cells)
    cell_data = {name: [np.concatenate(parts)] for name, parts in data.items()}
    return meshio.Mesh(shape[0], [("quad", shape[1])], cell_data=cell_data)


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


def _tensor(xx, yy, zz, xy):
    """A symmetric tensor of plane strain, row by row, (n, 9)."""
    zero = np.zeros_like(xx)
    return np.column_stack([xx, xy, zero, xy, yy, zero, zero, zero, zz])


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
