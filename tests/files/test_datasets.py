"""The run file keeps what it was given, survives kills, and says clearly when it cannot be used."""

import subprocess
import sys

import numpy as np
import pytest
import xarray as xr

import coupling
from coupling import datasets
from coupling.files.provenance import root_attributes
from verification.synthetic_run import lining, make_quick_scene, record


def write(path, times, status="finished", scene=None, **options):
    scene = make_quick_scene() if scene is None else scene
    writer = datasets.RunWriter(path, root_attributes(scene), scene)
    for time in times:
        writer.append(record(time, snapshot=True, **options))
    writer.close(status, "as asked")
    return path


def test_uniform_pressure_stays_uniform_on_the_cells():
    weights = datasets.cell_mean_weights(np.sort(np.random.default_rng(2).uniform(0, 360, 37)))
    np.testing.assert_allclose(weights @ np.full(37, 5.0), 5.0, rtol=1e-13)


def test_resampling_keeps_the_integral_of_the_interpolation():
    rng = np.random.default_rng(3)
    theta, values = np.sort(rng.uniform(0, 360, 53)), rng.normal(size=53)
    gap = np.diff(theta, append=theta[0] + 360)
    trapezoids = np.sum(0.5 * gap * (values + np.roll(values, -1)))
    # round-off of a sum of 360 terms
    assert np.sum(datasets.cell_mean_weights(theta) @ values) == pytest.approx(trapezoids, rel=1e-11)


def test_nodes_on_cell_edges_give_the_mean_of_both_edges():
    theta = np.arange(360) + 0.5
    values = np.random.default_rng(4).normal(size=360)
    expected = 0.5 * (values + np.roll(values, 1))
    np.testing.assert_allclose(datasets.cell_mean_weights(theta) @ values, expected, atol=1e-13)


def test_cosine_is_resampled_with_second_order():
    centre, half = np.radians(datasets.cell_centres()), np.radians(0.5)
    exact = np.cos(2 * centre) * np.sin(2 * half) / (2 * half)
    errors = []
    for n in (90, 180):
        theta = np.arange(n) * 360 / n + 0.3
        errors.append(np.abs(datasets.cell_mean_weights(theta) @ np.cos(2 * np.radians(theta)) - exact).max())
    # interpolation error of a chord: k^2 h^2 / 8
    assert errors[0] < 4 * np.radians(4) ** 2 / 8
    assert errors[1] < 0.27 * errors[0]


def test_unsorted_angles_are_refused():
    with pytest.raises(ValueError, match="ascending"):
        datasets.cell_mean_weights(np.array([10.0, 5.0, 100.0]))


def test_round_trip_keeps_values_units_and_provenance(tmp_path):
    path = write(tmp_path / "run.nc", [0.0, 0.5, 1.0])
    pressures, history, points = datasets.read_pressures(path), datasets.read_history(path), datasets.read_points(path)
    np.testing.assert_array_equal(pressures["time"], [0.0, 0.5, 1.0])
    given = lining(0.5)
    weights = datasets.cell_mean_weights(given["theta"])
    for name in datasets.PRESSURES:
        assert pressures[name].dims == ("time", "theta")
        assert pressures[name].attrs["units"] == "Pa" and pressures[name].attrs["long_name"]
        np.testing.assert_array_equal(pressures[name].isel(time=1), weights @ given[name])
    with xr.open_dataset(path, group="lining", decode_timedelta=False) as stored:
        np.testing.assert_array_equal(stored.coords["theta_bnds"], datasets.cell_bounds())
    np.testing.assert_array_equal(pressures["inflow_mass"], history["inflow_mass"])
    assert history["dt_limit"].attrs["flag_meanings"].split()[int(history["dt_limit"][0])] == "acoustic"
    assert points.sizes["time"] == 3
    # one point was taken out, and the file says so by leaving it out
    assert int(np.isfinite(points["x"].isel(time=-1)).sum()) == 399
    attributes = datasets.read_attributes(path)
    assert attributes["status"] == "finished" and attributes["scene"] == make_quick_scene().source


def test_every_variable_has_units_and_a_long_name(tmp_path):
    tree = datasets.read_run(write(tmp_path / "run.nc", [0.0, 1.0]))
    for node in tree.subtree:
        for name, variable in node.data_vars.items():
            if not name.endswith("_bnds"):
                assert variable.attrs["units"] and variable.attrs["long_name"], f"{node.path}/{name}"


def test_several_tunnels_add_a_dimension(tmp_path):
    scene = coupling.load_scene("twin-tunnels")
    pressures = datasets.read_pressures(write(tmp_path / "run.nc", [0.0, 1.0], scene=scene, n_tunnels=2))
    assert pressures["soil_pressure"].dims == ("time", "tunnel", "theta")
    np.testing.assert_array_equal(pressures["soil_pressure"][:, 0], pressures["soil_pressure"][:, 1])


def test_response_is_stored_and_replaced(tmp_path):
    path = write(tmp_path / "run.nc", [0.0, 1.0])
    response = datasets.read_pressures(path)[["soil_pressure"]]
    for factor in (1.0, 2.0):
        datasets.write_response(path, response * factor)
    np.testing.assert_array_equal(datasets.read_response(path)["soil_pressure"], 2.0 * response["soil_pressure"])


def test_file_without_response_names_the_command(tmp_path):
    path = write(tmp_path / "run.nc", [0.0])
    with pytest.raises(datasets.RunFileError, match="gush respond"):
        datasets.read_response(path)


@pytest.mark.parametrize("kept", [0.3, 0.6, 0.9, 0.999])
def test_truncated_file_gets_a_clear_error(tmp_path, kept):
    path = write(tmp_path / "run.nc", [0.0, 0.5, 1.0])
    whole = path.read_bytes()
    path.write_bytes(whole[: int(kept * len(whole))])
    with pytest.raises(datasets.RunFileError, match=r"truncated.*run\.nc|run\.nc.*truncated"):
        datasets.read_pressures(path)


def test_other_files_get_a_clear_error(tmp_path):
    path = tmp_path / "run.nc"
    path.write_text("not a result")
    with pytest.raises(datasets.RunFileError, match="not a netCDF-4 file"):
        datasets.read_pressures(path)
    with pytest.raises(datasets.RunFileError, match="no such file"):
        datasets.read_pressures(tmp_path / "absent.nc")
    with pytest.raises(datasets.RunFileError, match=r"no run\.nc"):
        datasets.read_pressures(tmp_path / "..")


@pytest.mark.slow
def test_killed_writer_leaves_a_readable_file(tmp_path):
    path = tmp_path / "run.nc"
    code = f"""
import os, sys
from verification.synthetic_run import make_quick_scene, record
import coupling
from coupling import datasets
from coupling.files.provenance import root_attributes
scene = make_quick_scene()
writer = datasets.RunWriter({str(path)!r}, root_attributes(scene), scene)
for k in range(5):
    writer.append(record(0.1 * k, snapshot=True))
    writer.flush()
writer.append(record(0.5))
os._exit(9)
"""
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 9
    pressures = datasets.read_pressures(path)
    assert pressures.sizes["time"] >= 5
    assert np.isfinite(pressures["soil_pressure"]).all()
    assert datasets.read_attributes(path)["status"] == "interrupted"


def test_batch_cut_short_before_its_times_is_not_shown(tmp_path):
    import h5netcdf

    path = write(tmp_path / "run.nc", [0.0, 0.5])
    with h5netcdf.File(path, "a", locking=False) as file:
        file["lining"].resize_dimension("time", 3)
    assert datasets.read_pressures(path).sizes["time"] == 2


def test_interrupted_write_is_repeated_in_the_same_rows(tmp_path, monkeypatch):
    scene = make_quick_scene()
    writer = datasets.RunWriter(tmp_path / "run.nc", root_attributes(scene), scene)
    writer.append(record(0.0))
    with monkeypatch.context() as patch:
        patch.setattr(writer, "_write_history", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
        writer._last_write = -np.inf
        with pytest.raises(KeyboardInterrupt):
            writer.append(record(0.5))
    writer.close("interrupted")
    for read in (datasets.read_pressures, datasets.read_history):
        np.testing.assert_array_equal(read(tmp_path)["time"], [0.0, 0.5])


@pytest.mark.slow
def test_motion_of_linings_is_written_beside_their_pressures(tmp_path):
    source = make_quick_scene()
    changes = [t.model_dump(exclude_none=True) for t in source.tunnels]
    scene = make_quick_scene(tunnels=[changes[0] | {"lining": "elastic"}])
    made = record(0.5)
    angle = np.radians(np.arange(360.0))
    made.lining[0] |= {"displacement_radial": 3e-3 * np.cos(angle), "displacement_tangential": -3e-3 * np.sin(angle)}
    made.lining[0] |= dict.fromkeys(datasets.RING_FORCES, 1e5 * np.cos(2 * angle))
    writer = datasets.RunWriter(tmp_path / "run.nc", root_attributes(scene), scene)
    writer.append(made)
    writer.close("finished")
    group = datasets.read_group(tmp_path / "run.nc", "lining").isel(time=0)
    centre = np.radians(datasets.cell_centres())
    assert group["displacement_radial"].values == pytest.approx(3e-3 * np.cos(centre))
    assert group["displacement_tangential"].values == pytest.approx(-3e-3 * np.sin(centre))
    assert group["bending_moment"].values == pytest.approx(1e5 * np.cos(2 * centre))
    assert group["bending_moment"].attrs["units"] == "N m/m" and group["displacement_radial"].attrs["units"] == "m"
    assert "displacement_radial" not in datasets.read_group(write(tmp_path / "held.nc", [0.0]), "lining")
