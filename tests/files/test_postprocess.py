"""What users compute from a run: checked on fields whose answer is known by hand, and on a small event."""

import numpy as np
import pytest
import xarray as xr

from coupling import postprocess
from coupling.postprocess.at_inflow import crossing_times

pytestmark = pytest.mark.slow


def history(times, masses):
    return xr.Dataset({"inflow_mass": ("time", masses), "flow_zone_area": ("time", 2.0 * np.array(masses))},
                      coords={"time": times})  # fmt: skip


def test_state_at_an_inflow_mass_lies_on_the_line_between_its_records():
    state = postprocess.at_inflow(history([0.0, 1.0, 3.0], [0.0, 10.0, 50.0]), 30.0)
    assert float(state["time"]) == pytest.approx(2.0) and float(state["flow_zone_area"]) == pytest.approx(60.0)


def test_an_inflow_mass_that_was_not_reached_is_refused():
    with pytest.raises(ValueError, match=r"99 kg/m was not reached, the run ends at 50 kg/m"):
        postprocess.at_inflow(history([0.0, 1.0], [0.0, 50.0]), 99.0)


def test_a_mass_beyond_a_pause_of_the_inflow_is_reached_after_it():
    time, mass = np.array([0.0, 1.0, 5.0, 6.0]), np.array([0.0, 10.0, 10.0, 20.0])
    np.testing.assert_allclose(crossing_times(mass, time, [0.0, 10.0, 15.0, 30.0]), [0.0, 1.0, 5.5, np.nan])


def test_straight_line_has_full_linearity_and_a_parabola_has_not():
    time = np.linspace(0.0, 2.0, 41)
    rate, r_squared = postprocess.inflow_linearity(history(time, 500.0 * time), 100.0, 1000.0)
    assert rate == pytest.approx(500.0) and r_squared == pytest.approx(1.0)
    assert postprocess.inflow_linearity(history(time, 250.0 * time**2), 0.0, 1000.0)[1] < 0.95


@pytest.fixture(scope="module")
def last_snapshot(event, quick_mesh):
    """Mesh and last snapshot of the scene `quick`, as the run file would hold them."""
    mesh, last = quick_mesh, event[1][-1]
    attributes = {
        "tunnel_x": [0.0], "tunnel_axis_depth": [23.3], "tunnel_outer_radius": [3.3], "tunnel_inner_radius": [2.95],
        "gate_tunnel": 0, "gate_angle": 90.0,
    }  # fmt: skip
    grid = xr.Dataset(
        {"x": ("node", mesh.nodes[:, 0]), "y": ("node", mesh.nodes[:, 1]), "region": ("element", mesh.region),
         "element_nodes": (("element", "corner"), mesh.elements)}, attrs=attributes,
    )  # fmt: skip
    points = xr.Dataset({name: ("point", values) for name, values in last.points.items()}, attrs=attributes)
    return points, grid


def test_a_linear_pressure_has_no_deviation_from_its_plane(last_snapshot):
    _, mesh = last_snapshot
    # one point at every centroid, so that the mean of an element is the field's value there
    nodes = mesh["element_nodes"].values
    x, y = mesh["x"].values[nodes].mean(1), mesh["y"].values[nodes].mean(1)
    linear = xr.Dataset({"x": ("point", x), "y": ("point", y), "volume": ("point", np.ones(len(x))),
                         "pore_pressure": ("point", 1e6 + 2e4 * x - 1e4 * y)})  # fmt: skip
    steps = postprocess.pore_pressure_steps(linear, mesh, 1.0, 4.0)
    assert steps["deviation"].max() < 1e-10 and steps["jump"].max() > 1e-4


def test_pore_pressure_is_smooth_in_the_flow_zone(last_snapshot):
    points, mesh = last_snapshot
    around_jet = postprocess.pore_pressure_steps(points, mesh, 2.0, 6.0)
    # a tenth of the local value is what the eye takes for smooth; the physical gradient is part of the jump
    assert np.quantile(around_jet["jump"], 0.9) < 0.10
    assert np.quantile(around_jet["deviation"], 0.9) < 0.03


def test_elements_half_full_on_the_mean_of_their_nodes_are_filled():
    nodes = np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2]])
    area = np.ones(3)
    assert postprocess.filled(np.array([2.0, 0.0, 2.0]), area, nodes).all()
    assert not postprocess.filled(np.array([1.0, 0.0, 0.0]), area, nodes)[1:].any()
