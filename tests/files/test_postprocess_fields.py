"""Stages, profiles, influence, arch, settlement and extremes on made fields whose answers are known by hand."""

import numpy as np
import pytest
import xarray as xr

from coupling import postprocess

GEOMETRY = {
    "tunnel_x": [0.0], "tunnel_axis_depth": [23.3], "tunnel_outer_radius": [3.3], "tunnel_inner_radius": [2.95],
    "gate_tunnel": 0, "gate_angle": 90.0, "gate_width": 0.2,
}  # fmt: skip


def ground(change=None, settle=None):
    """Two snapshots of points on a grid of a quarter of a metre with stresses of 10 kPa a metre of depth.

    change : factor of the vertical stress of the second snapshot from x; settle : its settlement from x.
    """
    x, y = np.meshgrid(np.arange(-39.875, 40.0, 0.25), np.arange(-39.875, 0.0, 0.25))
    x, y = x.ravel(), y.ravel()
    down = np.zeros_like(x) if settle is None else settle(x)
    factor = np.ones_like(x) if change is None else change(x)
    fields = {
        "x": (x, x), "y": (y, y - down), "displacement_x": (0 * x, 0 * x), "displacement_y": (0 * x, -down),
        "stress_yy": (1e4 * y, 1e4 * y * factor), "stress_xx": (5e3 * y, 5e3 * y),
        "pore_pressure": (-1e4 * y, -1e4 * y), "volume": (0 * x + 0.0625, 0 * x + 0.0625),
        "deviatoric_strain": (0 * x, 0 * x),
    }  # fmt: skip
    return xr.Dataset(
        {name: (("time", "point"), np.stack(values)) for name, values in fields.items()},
        coords={"time": [0.0, 1.0]}, attrs=GEOMETRY,
    )  # fmt: skip


def test_profile_reads_the_stress_along_the_axis_and_nothing_inside_the_lining():
    axis = postprocess.profile(ground(), "horizontal")
    # the mean over a symmetric cell of a field linear in depth is the value on the axis, but for half a row of points
    np.testing.assert_allclose(axis["soil_stress_vertical"].isel(time=0), 1e4 * 23.3, atol=1.3e3)
    inside = axis["distance"].where((axis["distance"] < -0.5) & (axis["distance"] > -6.1)).dropna("distance")
    assert inside.size == 0
    vertical = postprocess.profile(ground(), "vertical")
    np.testing.assert_allclose(
        vertical["pore_pressure"].isel(time=0), 1e4 * (23.3 - vertical["distance"]), atol=1.3e3  # half a row of points
    )  # fmt: skip


def test_influence_ends_where_the_change_falls_below_the_threshold():
    # change of 20 % at the gate, falling by 1 % a metre: 5 % at 15 m
    axis = postprocess.profile(ground(lambda x: 1 - 0.01 * np.clip(20 - (x - 3.3), 0, 20)), "horizontal")
    reach = postprocess.influence_distance(axis, "soil_stress_vertical")
    assert float(reach[0]) == 0.0 and float(reach[1]) == pytest.approx(15.0, abs=0.5)  # one cell
    assert postprocess.influence_distance(axis, "pore_pressure").values.tolist() == [0.0, 0.0]


def test_arch_stands_where_the_stress_is_raised_most():
    bump = lambda x: 1 + 0.3 * np.exp(-(((x - 3.3 - 6.6) / 3.0) ** 2))  # noqa: E731
    arch = postprocess.arch(postprocess.profile(ground(bump), "horizontal"))
    assert np.isnan(arch["distance"][0]) and float(arch["diameters"][1]) == pytest.approx(1.0, abs=0.08)  # one cell
    assert float(arch["ratio"][1]) == pytest.approx(1.3, abs=0.02)  # the running mean flattens the top


def test_stress_variation_is_the_relative_change():
    now, first = xr.DataArray([3.0, 1.0, 5.0], dims="x"), xr.DataArray([2.0, 2.0, 0.01], dims="x")
    found = postprocess.stress_variation(now, first)
    np.testing.assert_allclose(found, [0.5, -0.5, np.nan])


def test_trough_finds_the_gauss_curve_that_was_put_in():
    curve = lambda x: 0.04 * np.exp(-((x - 2.0) ** 2) / (2 * 6.0**2))  # noqa: E731
    settlement = postprocess.surface_settlement(ground(settle=curve))
    trough = postprocess.trough(settlement)
    assert np.isnan(trough["width"][0]) and float(trough["largest"][0]) == 0.0
    # 1 %: cells of a metre average a curve of 6 m width
    assert float(trough["width"][1]) == pytest.approx(6.0, rel=0.01)
    assert float(trough["centre"][1]) == pytest.approx(2.0, abs=0.05)
    assert float(trough["peak"][1]) == pytest.approx(0.04, rel=0.01) and float(trough["error"][1]) < 1e-4
    assert float(trough["volume"][1]) == pytest.approx(0.04 * 6.0 * np.sqrt(2 * np.pi), rel=0.01)
    # 68.3 % of a Gauss curve lies within one width
    assert float(postprocess.share_within(settlement, 6.0, centre=2.0)[1]) == pytest.approx(0.683, abs=0.02)


def test_settlement_needs_points_at_the_surface():
    with pytest.raises(ValueError, match="raise depth"):
        postprocess.surface_settlement(ground(), depth=0.1)


def history(area):
    time = np.linspace(0.0, 10.0, 101)
    return xr.Dataset({"flow_zone_area": ("time", area(time)), "inflow_mass": ("time", 100 * time)},
                      coords={"time": time})  # fmt: skip


def test_three_stages_are_found_where_they_were_put():
    found = postprocess.flow_zone_stages(history(lambda t: np.interp(t, [0, 3, 5, 10], [0, 6, 86, 96])))
    assert found.appear and found.bends == pytest.approx((3.0, 5.0), abs=0.17)  # one sixtieth of the record
    assert found.rates == pytest.approx((2.0, 40.0, 2.0), rel=0.25)
    assert found.r_squared > 0.999
    over_mass = postprocess.flow_zone_stages(
        history(lambda t: np.interp(t, [0, 3, 5, 10], [0, 6, 86, 96])), "inflow_mass"
    )
    assert over_mass.bends == pytest.approx((300.0, 500.0), abs=17)


def test_steady_growth_has_no_stages():
    assert not postprocess.flow_zone_stages(history(lambda t: 5 * t)).appear


def test_extremes_say_where_they_are():
    theta = np.arange(0.0, 360.0)
    moment = np.stack([np.cos(np.radians(theta - 90)), 2 * np.cos(np.radians(theta - 30))])
    data = xr.Dataset({"bending_moment": (("time", "theta"), moment, {"units": "N m/m"})},
                      coords={"time": [0.0, 1.0], "theta": theta})  # fmt: skip
    found = postprocess.extremes(data, ["bending_moment"])
    assert found["bending_moment_max_angle"].values.tolist() == [90.0, 30.0]
    assert found["bending_moment_min_angle"].values.tolist() == [270.0, 210.0]
    assert found["bending_moment_min"].values == pytest.approx([-1.0, -2.0])


def test_fields_on_the_mesh_keep_means_by_volume():
    mesh = xr.Dataset(
        {"x": ("node", [0.0, 1.0, 0.0, 1.0]), "y": ("node", [-1.0, -1.0, 0.0, 0.0]),
         "element_nodes": (("element", "corner"), [[0, 1, 2], [1, 3, 2]])}, attrs=GEOMETRY,
    )  # fmt: skip
    points = ground().isel(time=[0]).isel(point=[0, 1])
    points["x"][:], points["y"][:] = [[0.2, 0.3]], [[-0.8, -0.9]]
    points["stress_yy"][:], points["volume"][:] = [[-1.0, -4.0]], [[2.0, 1.0]]
    found = postprocess.element_fields(points, mesh)["soil_stress_vertical"].values
    np.testing.assert_allclose(found, [[2.0, np.nan]])
