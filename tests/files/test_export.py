"""Exported fields, read back with meshio, hold the datasets' numbers; `gush info` knows what a file is."""

import json
import sys
import xml.etree.ElementTree as ET

import meshio
import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from coupling import datasets
from coupling.cli import app
from coupling.commands.describe import describe
from coupling.export import export
from coupling.files.folder import claimed
from coupling.files.provenance import root_attributes
from coupling.report.page import write_report
from coupling.responses.respond import respond
from verification.synthetic_run import TwoTriangles, make_quick_scene, record

TIMES = (0.0, 0.5, 1.0)
STEMS = ("points", "mesh", "lining", "ring_beam_spring")


class Square(TwoTriangles):
    """Two triangles far larger than the cloud of points, so that every point lies in one of them."""

    nodes = np.array([[-20.0, -40.0], [20.0, -40.0], [20.0, 0.0], [-20.0, 0.0]])
    elements = np.array([[0, 1, 2], [0, 2, 3]])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Folder of a synthetic run with a response."""
    made = tmp_path_factory.mktemp("runs") / "a"
    made.mkdir()
    scene = make_quick_scene()
    writer = datasets.RunWriter(made / "run.nc", root_attributes(scene), scene, Square())
    for time in TIMES:
        shot = record(time, snapshot=True)
        # one point leaves at every time, so that their number changes
        shot.points["removed"][: int(2 * time)] = True
        writer.append(shot)
    writer.close("finished")
    datasets.write_response(made / "run.nc", respond(scene, datasets.read_pressures(made)))
    return made


def gush(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def same_points(grid, shot):
    """Whether a grid holds the points of one time, in their order."""
    here = np.isfinite(shot["x"].values)
    assert len(grid.points) == here.sum()
    np.testing.assert_array_equal(grid.points[:, 0], shot["x"].values[here])
    np.testing.assert_array_equal(grid.points[:, 1], shot["y"].values[here])
    assert not grid.points[:, 2].any()
    (block,) = grid.cells
    assert block.type == "vertex"
    np.testing.assert_array_equal(block.data.ravel(), np.arange(here.sum()))
    for name in ("pore_pressure", "porosity", "deviatoric_strain", "soil"):
        np.testing.assert_array_equal(grid.point_data[name].ravel(), shot[name].values[here])
    stress = {part: shot[f"stress_{part}"].values[here] for part in ("xx", "yy", "zz", "xy")}
    same_tensor(grid.point_data["stress"], stress)
    for name in ("displacement", "velocity_solid", "velocity_liquid"):
        for k, axis in enumerate("xy"):
            np.testing.assert_array_equal(grid.point_data[name][:, k], shot[f"{name}_{axis}"].values[here])


def same_tensor(tensor, parts, **tolerance):
    """Whether nine numbers a place are the symmetric tensor of these parts, with no shear out of the plane."""
    full = tensor.reshape(-1, 3, 3)
    for (i, j), part in {(0, 0): "xx", (1, 1): "yy", (2, 2): "zz", (0, 1): "xy", (1, 0): "xy"}.items():
        np.testing.assert_allclose(full[:, i, j], parts[part], **{"rtol": 0, **tolerance})
    assert not full[:, [0, 1, 2, 2], [2, 2, 0, 1]].any()


def same_mesh(grid, shot):
    """Whether a grid holds the mesh, and in its elements the means over the points there."""
    np.testing.assert_array_equal(grid.points[:, :2], Square.nodes)
    (block,) = grid.cells
    assert block.type == "triangle"
    np.testing.assert_array_equal(block.data, Square.elements)
    here = np.isfinite(shot["x"].values)
    x, y, volume = (shot[name].values[here].astype(float) for name in ("x", "y", "volume"))
    # the diagonal from (-20, -40) to (20, 0) parts the square
    for element, inside in enumerate((y + 20 < x, y + 20 > x)):
        assert inside.any()
        assert grid.cell_data["filled"][0][element] == pytest.approx(volume[inside].sum() / 800.0, rel=1e-6)

        def mean(name, inside=inside):
            return np.average(shot[name].values[here][inside], weights=volume[inside])

        # stored as float32
        assert grid.cell_data["pore_pressure"][0][element] == pytest.approx(mean("pore_pressure"), rel=1e-6)
        parts = {part: mean(f"stress_{part}") for part in ("xx", "yy", "zz", "xy")}
        same_tensor(grid.cell_data["stress"][0][[element]], parts, rtol=1e-6)
        moved = np.average(shot["displacement_x"].values[here][inside], weights=volume[inside])
        assert grid.cell_data["displacement"][0][element, 0] == pytest.approx(moved, rel=1e-6, abs=1e-12)
    np.testing.assert_array_equal(grid.cell_data["region"][0], Square.region)


def same_lining(grid, pressures):
    """Whether a grid is the ring of the quick scene, its cells at their angles, with the pressures of one time."""
    (block,) = grid.cells
    assert block.type == "quad"
    corners = grid.points[block.data][:, :, :2] - [0.0, -23.3]
    radius = np.hypot(corners[..., 0], corners[..., 1])
    np.testing.assert_allclose(radius, np.broadcast_to([3.3, 3.3, 2.95, 2.95], radius.shape))
    middle = corners.sum(axis=1)
    angle = np.degrees(np.arctan2(middle[:, 0], middle[:, 1])) % 360
    apart = (angle - pressures["theta"].values + 180) % 360 - 180
    np.testing.assert_allclose(apart, 0.0, atol=0.5 * 360 / len(angle))
    for name in pressures.data_vars:
        if pressures[name].dims == ("theta",) and not name.startswith("displacement"):
            np.testing.assert_array_equal(grid.cell_data[name][0].ravel(), pressures[name].values)
    assert not grid.cell_data["tunnel"][0].any()


def same_ring(grid, response):
    """The same of the forces; the displacement is the radial and tangential one, in the directions of the ground."""
    same_lining(grid, response)
    moved, angle = grid.cell_data["displacement"][0], np.radians(response["theta"].values)
    outward = moved[:, 0] * np.sin(angle) + moved[:, 1] * np.cos(angle)
    clockwise = moved[:, 0] * np.cos(angle) - moved[:, 1] * np.sin(angle)
    np.testing.assert_allclose(outward, response["displacement_radial"].values, atol=1e-15)
    np.testing.assert_allclose(clockwise, response["displacement_tangential"].values, atol=1e-15)


def test_vtu_files_hold_points_and_mesh_of_every_time(folder, tmp_path):
    done = gush("export", folder, "--out", tmp_path, "--json", tmp_path.parent / "files.json")
    assert done.exit_code == 0, done.output
    files = json.loads((tmp_path.parent / "files.json").read_text())["files"]
    assert files == [str(tmp_path / f"{stem}.pvd") for stem in STEMS]
    points = datasets.read_points(folder)
    assert len({int(np.isfinite(points["x"][k]).sum()) for k in range(3)}) > 1
    pressures, response = datasets.read_pressures(folder), datasets.read_response(folder)
    compared = ((same_points, points), (same_mesh, points), (same_lining, pressures), (same_ring, response))
    for series, (same, data) in zip(files, compared, strict=True):
        listed = ET.parse(series).getroot().findall("Collection/DataSet")
        assert [float(entry.get("timestep")) for entry in listed] == list(TIMES)
        for k, entry in enumerate(listed):
            same(meshio.read(tmp_path / entry.get("file")), data.isel(time=k))


def test_xdmf_series_hold_points_and_mesh_of_every_time(folder, tmp_path):
    files, points = export(folder, "xdmf", tmp_path), datasets.read_points(folder)
    pressures, response = datasets.read_pressures(folder), datasets.read_response(folder)
    compared = ((same_points, points), (same_mesh, points), (same_lining, pressures), (same_ring, response))
    for path, (same, data) in zip(files, compared, strict=True):
        series = ET.parse(path).getroot().find("Domain/Grid")
        assert series.get("CollectionType") == "Temporal"
        grids = series.findall("Grid")
        assert [float(grid.find("Time").get("Value")) for grid in grids] == list(TIMES)
        for k, grid in enumerate(grids):
            # meshio reads one grid a file, without a time
            grid.remove(grid.find("Time"))
            alone = ET.Element("Xdmf", Version="3.0")
            ET.SubElement(alone, "Domain").append(grid)
            ET.ElementTree(alone).write(tmp_path / "alone.xdmf")
            same(meshio.read(tmp_path / "alone.xdmf"), data.isel(time=k))
        (tmp_path / "alone.xdmf").unlink()


def test_tables_hold_the_datasets_with_units_in_their_headings(folder, tmp_path, monkeypatch):
    files = {path.stem: pd.read_csv(path) for path in export(folder, "csv", tmp_path)}
    history, response = datasets.read_history(folder), datasets.read_response(folder)
    np.testing.assert_array_equal(files["history"]["time [s]"], TIMES)
    np.testing.assert_allclose(files["history"]["inflow_mass [kg/m]"], history["inflow_mass"])
    forces = files["forces_beam_spring"].set_index(["time [s]", "theta [degree]"])["bending_moment [N m/m]"]
    for time in (TIMES[0], TIMES[-1]):
        np.testing.assert_allclose(forces.loc[time], response["bending_moment"].sel(time=time))
    largest = files["ring_beam_spring"]["bending_moment_max [N m/m]"]
    np.testing.assert_allclose(largest, response["bending_moment"].max("theta"))
    joints = files["joints_beam_spring"]
    assert len(joints) == response.sizes["time"] * response.sizes["joint"]
    np.testing.assert_allclose(joints["joint_opening [m]"], response["joint_opening"].values.ravel())
    told = files["answer"].set_index(["quantity", "of it"]).loc[("axial_force", "max")]
    assert told["value"] == pytest.approx(float(response["axial_force"].max())) and told["unit"] == "N/m"
    assert "limits" not in files and "pressures" in files
    (tmp_path / "notes.csv").write_text("mine")
    refused = gush("export", folder, "--format", "csv", "--out", tmp_path)
    assert refused.exit_code == 2 and "notes.csv" in refused.output
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    refused = gush("export", folder, "--format", "xlsx", "--out", tmp_path / "excel")
    assert refused.exit_code == 2 and "needs openpyxl" in refused.output.replace("\n", " ")


def test_excel_file_has_the_tables_as_sheets(folder, tmp_path):
    pytest.importorskip("openpyxl", reason="the extra 'excel'")
    (file,) = export(folder, "xlsx", tmp_path)
    sheets = pd.read_excel(file, sheet_name=None)
    assert {"answer", "history", "pressures", "forces_beam_spring"} <= sheets.keys()
    np.testing.assert_array_equal(sheets["history"]["time [s]"], TIMES)


@pytest.mark.slow
def test_pictures_are_exported_as_vectors(folder, tmp_path):
    files = export(folder, "svg", tmp_path)
    assert {"pressures.svg", "internal_forces.svg", "inflow.svg"} <= {path.name for path in files}
    assert all(ET.parse(path).getroot().tag.endswith("svg") for path in files)


def test_mesh_that_does_not_change_is_written_once(folder, tmp_path):
    import h5py

    export(folder, "xdmf", tmp_path)
    with h5py.File(tmp_path / "mesh.h5") as file:
        assert sum(file[name].shape == (4, 3) for name in file) == 1
        assert sum(file[name].dtype.kind == "i" and file[name].shape == (2, 3) for name in file) == 1


@pytest.mark.slow
def test_animation_has_a_picture_a_snapshot_in_the_colours_of_the_maps(folder, tmp_path):
    import matplotlib
    from PIL import Image

    (path,) = export(folder, "gif", tmp_path)
    with Image.open(path) as moving:
        assert moving.n_frames == len(TIMES) and moving.info["loop"] == 0
        pictures = []
        for k in range(moving.n_frames):
            moving.seek(k)
            pictures.append(np.asarray(moving.convert("RGB")).astype(int))
    assert moving.info["duration"] == 1500
    assert (pictures[0] != pictures[1]).any() and (pictures[1] != pictures[2]).any()
    # the highest displacement, 1000 mm and more, has the last colour of its map on the colour bar
    yellow = np.array(matplotlib.colormaps["viridis"](1.0, bytes=True)[:3], int)
    assert (np.abs(pictures[-1] - yellow).max(axis=2) <= 2).sum() > 10


def test_only_files_of_an_earlier_export_are_replaced(folder, tmp_path):
    export(folder, "vtu", tmp_path)
    (tmp_path / "points_0009.vtu").write_text("of a longer run")
    export(folder, "xdmf", tmp_path)
    export(folder, "vtu", tmp_path)
    assert not (tmp_path / "points_0009.vtu").exists() and (tmp_path / "mesh.xdmf").exists()
    (tmp_path / "notes.txt").write_text("mine")
    refused = gush("export", folder, "--out", tmp_path)
    assert refused.exit_code == 2 and "notes.txt" in refused.output
    assert (tmp_path / "notes.txt").read_text() == "mine"


def test_export_refuses_what_it_cannot_do(folder, tmp_path):
    assert "vtu, xdmf, gif" in gush("export", folder, "--format", "stl").output
    (tmp_path / "file").write_text("")
    assert "is a file" in gush("export", folder, "--out", tmp_path / "file").output
    scene = make_quick_scene()
    writer = datasets.RunWriter(tmp_path / "run.nc", root_attributes(scene), scene)
    writer.append(record(0.0))
    writer.close("finished")
    refused = gush("export", tmp_path / "run.nc")
    assert refused.exit_code == 2 and "no snapshot" in refused.output
    assert not (tmp_path / "fields").exists()


def test_a_new_run_takes_report_and_fields_of_the_old_one_away(folder, tmp_path):
    (tmp_path / "run.nc").write_bytes((folder / "run.nc").read_bytes())
    write_report(tmp_path)
    export(tmp_path, "xdmf")
    (tmp_path / "fields" / "notes.txt").write_text("mine")
    with claimed(tmp_path, overwrite=True):
        pass
    left = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file()}
    assert left == {"fields/notes.txt"}


@pytest.mark.slow
def test_info_tells_what_a_file_is(folder, tmp_path):
    report, picture = write_report(folder, tmp_path / "page.html"), export(folder, "gif", tmp_path / "moving")[0]
    series = export(folder, "xdmf", tmp_path / "fields")[0]
    pressures = datasets.read_pressures(folder)
    pressures.to_netcdf(tmp_path / "pressures.nc", engine="h5netcdf")
    texts = {
        "good.toml": ('base = "quick"\nname = "mine"\n', "scene"),
        "bad.toml": ('base = "quick"\n[gate]\nwidth = 99.0\n', "TOML file that is no valid scene"),
        "broken.toml": ("= =", "not a file of this program"),
        "result.json": ('{"scene": "quick", "status": "finished"}', "JSON result"),
        "letter.txt": ("Dear Sir", "not a file of this program"),
    }
    for name, (text, _) in texts.items():
        (tmp_path / name).write_text(text)
    expected = {tmp_path / name: kind for name, (_, kind) in texts.items()} | {
        folder: "run folder",
        folder / "run.nc": "run file",
        folder.parent: "folder of runs",
        report: "report of a run or a study",
        picture: "picture (GIF)",
        series: "mesh or fields for ParaView",
        tmp_path / "pressures.nc": "pressures on a lining",
        tmp_path / "moving": "folder without a run",
    }
    for path, kind in expected.items():
        assert describe(path)["kind"] == kind, path
    facts = describe(folder)["facts"]
    assert (facts["scene"], facts["records"], facts["snapshots of the points"]) == ("quick", 3, 3)
    assert facts["inflow mass [kg/m]"] == 300.0 and facts["lining models"] == "beam-spring"
    shown = gush("info", folder)
    assert shown.exit_code == 0 and "inflow mass [kg/m]" in shown.output and "gush report" in shown.output
    assert json.loads(gush("info", folder, "--json", "-").stdout)["kind"] == "run folder"
    (tmp_path / "cut.nc").write_bytes((folder / "run.nc").read_bytes()[:5000])
    for path, message in ((tmp_path / "none", "no such file"), (tmp_path / "cut.nc", "truncated")):
        refused = gush("info", path)
        assert refused.exit_code == 2 and message in refused.output
