"""Pictures show the numbers of their datasets, in the units that their labels name."""

import subprocess
import sys

import numpy as np
import pytest
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg

import structure
from coupling import datasets, figures, postprocess
from coupling.files.provenance import root_attributes
from coupling.measurements import misfit
from coupling.responses.respond import respond
from verification.synthetic_run import TwoTriangles, make_quick_scene, record


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """File of a synthetic run with a response."""
    path = tmp_path_factory.mktemp("run") / "run.nc"
    scene = make_quick_scene()
    writer = datasets.RunWriter(path, root_attributes(scene), scene, TwoTriangles())
    for time in (0.0, 0.5, 1.0):
        writer.append(record(time, snapshot=True))
    writer.close("finished")
    datasets.write_response(path, respond(scene, datasets.read_pressures(path)))
    return path


def line(axis, label):
    (found,) = [item for item in axis.lines if item.get_label() == label]
    return found


def test_polar_pressures_are_drawn_in_kilopascal(run):
    pressures = datasets.read_pressures(run)
    figure = figures.pressures_polar(pressures)
    for axis, name in zip(figure.axes, ("soil_pressure", "water_pressure"), strict=True):
        assert "[kPa]" in axis.get_title()
        angle, drawn = line(axis, "initial").get_data()
        np.testing.assert_allclose(drawn[:-1], pressures[name].isel(time=0) / 1e3)
        np.testing.assert_allclose(np.degrees(angle[:-1]), pressures["theta"])
        np.testing.assert_allclose(line(axis, "1 s, 300 kg/m").get_ydata()[:-1], pressures[name].isel(time=-1) / 1e3)
        assert np.degrees(line(axis, "gate").get_xdata()) == pytest.approx(90.0)
        assert axis.get_theta_direction() == -1


def test_internal_forces_are_drawn_in_kilonewton_with_their_extremes(run):
    response = datasets.read_response(run)
    figure = figures.internal_forces(response)
    units = {"axial_force": "[kN/m]", "shear_force": "[kN/m]", "bending_moment": "[kN m/m]"}
    for axis, (name, unit) in zip(figure.axes, units.items(), strict=True):
        assert unit in axis.get_title()
        np.testing.assert_allclose(line(axis, "initial").get_ydata()[:-1], response[name].isel(time=0) / 1e3)
        assert f"max {float(response[name].isel(time=-1).max()) / 1e3:.0f} at" in axis.get_xlabel().replace(
            "\N{MINUS SIGN}", "-"
        )


def test_deformed_ring_is_drawn_relative_to_its_mean_motion():
    theta = np.arange(0.5, 360.0)
    angle = np.radians(theta)
    shape = 0.01 * np.cos(2 * angle)
    # a sideways and downward motion of the whole ring is no deformation
    radial = shape + 0.03 * np.sin(angle) - 0.02 * np.cos(angle)
    tangential = 0.03 * np.cos(angle) + 0.02 * np.sin(angle)
    response = xr.Dataset(
        {
            "displacement_radial": (("time", "theta"), [radial, radial]),
            "displacement_tangential": (("time", "theta"), [tangential, tangential]),
        },
        coords={"time": [0.0, 1.0], "theta": theta},
        attrs={"ring": '{"outer_diameter": 6.6, "inner_diameter": 5.9}'},
    )
    axis = figures.deformed_ring(response).axes[0]
    x, y = line(axis, "initial").get_data()
    drawn = np.hypot(x, y)[:-1] - 3.125
    factor = drawn[0] / shape[0]
    assert f"{factor:.0f} times" in axis.get_title() and "10.0 mm" in axis.get_title()
    # the tangential part of a pure cos 2 shape is nil, so the radius changes by the radial part alone
    np.testing.assert_allclose(drawn, factor * shape, atol=1e-12)
    assert axis.get_xlabel() == "x [m]"


def test_joints_are_numbered_with_rotation_and_opening(run):
    response = datasets.read_response(run)
    texts = [text.get_text().replace("\N{MINUS SIGN}", "-") for text in figures.deformed_ring(response).axes[0].texts]
    assert len(texts) == 6
    rotation = 1e3 * float(response["joint_rotation"].isel(time=-1, joint=1))
    assert texts[1].startswith(f"2:  {rotation:+.2f} mrad")


def test_inflow_is_drawn_over_time(run):
    history = datasets.read_history(run)
    upper, lower = figures.inflow(history).axes
    np.testing.assert_allclose(upper.lines[0].get_data(), [history["time"], history["inflow_mass"]])
    np.testing.assert_allclose(lower.lines[0].get_ydata(), history["flow_zone_area"])
    assert "[kg/m]" in upper.get_ylabel() and "[m²]" in lower.get_ylabel() and "[s]" in lower.get_xlabel()


def test_fields_show_every_point_in_view_and_name_their_units(run):
    points = datasets.read_points(run, -1)
    figure = figures.fields_around_tunnel(points)
    panels = {axis.get_title(): axis.collections[0] for axis in figure.axes if axis.get_title()}
    assert list(panels) == [
        "displacement [mm]",
        "deviatoric strain [-]",
        "pore pressure [kPa]",
        "vertical effective stress [kPa]",
    ]
    pore = np.sort(panels["pore pressure [kPa]"].get_array())
    expected = points["pore_pressure"].values
    np.testing.assert_allclose(pore, np.sort(expected[np.isfinite(expected)]) / 1e3)
    top = 1e3 * np.nanmax(np.abs(points["displacement_x"]))
    assert panels["displacement [mm]"].get_array().max() == pytest.approx(float(top))


def test_full_elements_show_the_mean_of_their_points_and_others_the_points():
    # two triangles of a square: four points fill the lower one, one point lies in the upper one
    x, y = np.array([0.2, 0.6, 0.8, 0.5, 0.2]), np.array([0.1, 0.1, 0.5, 0.3, 0.9])
    pore = np.array([1e3, 2e3, 3e3, 6e3, 9e3])
    points = xr.Dataset({name: ("point", values) for name, values in {
        "x": x, "y": y, "pore_pressure": pore, "volume": np.full(5, 0.125), "stress_yy": -pore,
        "displacement_x": 0 * x, "displacement_y": 0 * x, "deviatoric_strain": 0 * x}.items()},
        {"time": 1.0}, {"tunnel_x": [0.5], "tunnel_axis_depth": [-0.5], "tunnel_outer_radius": [0.3],
                        "tunnel_inner_radius": [0.2]})  # fmt: skip
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    mesh = xr.Dataset({"x": ("node", square[:, 0]), "y": ("node", square[:, 1]),
                       "element_nodes": (("element", "corner"), [[0, 1, 2], [0, 2, 3]])})  # fmt: skip
    figure = figures.fields_around_tunnel(points, mesh=mesh)
    elements, discs = figure.axes[2].collections
    assert figure.axes[2].get_title() == "pore pressure [kPa]"
    np.testing.assert_allclose(elements.get_array(), [3.0])
    np.testing.assert_allclose(discs.get_array(), [9.0])
    # an element among full ones that no point happens to lie in takes the mean of its nodes
    moved = points.assign(x=("point", [0.5, 0.45, 0.8, 0.9, 0.2]), y=("point", [0.3, 0.35, 0.5, 0.5, 0.9]))
    thirds = np.vstack([square[:3], [[2 / 3, 1 / 3]]])
    mesh = xr.Dataset({"x": ("node", thirds[:, 0]), "y": ("node", thirds[:, 1]),
                       "element_nodes": (("element", "corner"), [[0, 1, 3], [1, 2, 3], [2, 0, 3]])})  # fmt: skip
    elements = figures.fields_around_tunnel(moved, mesh=mesh).axes[2].collections[0]
    np.testing.assert_allclose(elements.get_array(), [3.0, 4.5, 1.5])
    # what has not moved is drawn at the lower end of a logarithmic scale, not left white
    assert figure.axes[0].collections[0].get_array().min() == 1.0


def test_trough_is_drawn_with_its_gauss_curve_and_volume_loss():
    x = np.arange(-30.0, 31.0)
    settlement = xr.DataArray([0.04 * np.exp(-(x**2) / (2 * 8.0**2))], {"time": [3.0], "x": x}, ("time", "x"))
    found = postprocess.trough(settlement).assign(volume_loss=("time", [0.02]), width_over_depth=("time", [0.4]))
    axis = figures.settlement_trough(settlement, found).axes[0]
    np.testing.assert_allclose(line(axis, "points of the surface").get_ydata(), 1e3 * settlement[0])
    curve = line(axis, "Gauss curve (Peck 1969)")
    np.testing.assert_allclose(curve.get_ydata(), 40 * np.exp(-(curve.get_xdata() ** 2) / 128), atol=1e-3)
    assert "volume loss 2 %" in axis.get_title() and axis.yaxis_inverted()


def test_view_of_a_trough_to_one_side_ends_where_the_surface_does():
    x = np.arange(-50.0, 51.0)
    settlement = xr.DataArray([0.04 * np.exp(-((x - 20) ** 2) / (2 * 12.0**2))], {"time": [3.0], "x": x}, ("time", "x"))
    settlement[0, :5] = np.nan  # no point there
    found = postprocess.trough(settlement).assign(volume_loss=("time", [0.02]), width_over_depth=("time", [0.4]))
    left, right = figures.settlement_trough(settlement, found).axes[0].get_xlim()
    assert -49 < left <= -45 and 50 <= right < 53


def test_forces_of_two_models_are_drawn_with_their_difference(run):
    response = datasets.read_response(run)
    other = response.assign(bending_moment=response["bending_moment"] + 2e3)
    drawn = figures.forces_compared({"beam-spring": response, "continuum": other})
    (axis,) = [axis for axis in drawn.axes if axis.get_title().startswith("M of continuum")]
    np.testing.assert_allclose(axis.lines[0].get_ydata(), 2.0)


@pytest.mark.slow
def test_legend_of_many_checks_stays_within_the_figure(run):
    own = {name: 1e9 for name in ("axial_force", "shear_force", "bending_moment", "convergence_vertical")}
    limits = structure.Limits(gasket_opening=1e-3, gasket_offset=0.1, joint_dislocation=0.01, own=own)
    drawn = figures.checks(structure.check(datasets.read_response(run), limits))
    canvas = FigureCanvasAgg(drawn)
    canvas.draw()
    inside = drawn.bbox
    for text in drawn.legends[0].get_texts():
        box = text.get_window_extent()
        assert inside.x0 + 2 <= box.x0 and box.x1 <= inside.x1 - 2


def test_mesh_is_drawn_around_the_tunnel_and_around_the_gate(run):
    figure = figures.mesh_near_gate(datasets.read_mesh(run))
    assert [len(axis.collections[0].get_paths()) for axis in figure.axes] == [2, 2]


@pytest.mark.slow
def test_all_pictures_of_a_run_are_written(run, tmp_path):
    written = figures.draw_run(run, tmp_path / "figures")
    assert [path.name for path in written] == [
        "mesh.png", "fields.png", "pressures.png", "internal_forces.png", "deformed_ring.png", "inflow.png",
    ]  # fmt: skip
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in written)


@pytest.mark.slow
def test_drawing_leaves_pyplot_alone():
    code = "import sys, coupling.figures; sys.exit('matplotlib.pyplot' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_residuals_are_drawn_in_errors_and_values_in_the_units_shown(run):
    given = datasets.read_response(run)[["convergence_vertical"]].reset_coords("inflow_mass", drop=True)
    given["convergence_vertical_error"] = ((), 1e-4, {"units": "m"})
    given["convergence_vertical"] = given["convergence_vertical"].copy(data=given["convergence_vertical"] - 3e-4)
    found = misfit(run, given)
    values, left = figures.residuals(found).axes
    assert values.get_ylabel() == "convergence vertical [mm]" and "χ² 9 a measurement" in left.get_title(loc="right")
    np.testing.assert_allclose(line(values, "computed").get_ydata(), 1e3 * found["computed"])
    np.testing.assert_allclose(left.lines[-1].get_ydata(), 3.0, rtol=1e-6)
