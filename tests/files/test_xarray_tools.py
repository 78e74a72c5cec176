"""The datasets of a run in the hands of those who use xarray: its own tools, cf_xarray, pint-xarray, pandas, UGRID."""

import subprocess
import sys

import h5netcdf
import numpy as np
import pytest
import xarray as xr

import coupling
from coupling import datasets
from coupling.postprocess import at_inflow, by_inflow
from verification.synthetic_run import TIMES, write_run

GROUPS = ("lining", "history", "points", "mesh", "structure/beam_spring", "structure/continuum")


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return write_run(tmp_path_factory.mktemp("xarray") / "run.nc")


@pytest.fixture(scope="module")
def run(file):
    return coupling.read_run(file)


def test_table_of_pressures_has_one_row_a_time_and_angle(run, file):
    for read in (run["lining"].to_dataset(), datasets.read_pressures(file)):
        table = read.to_dataframe()
        assert len(table) == len(TIMES) * 360 and "inflow_mass" in table
    response = run["structure/beam_spring"].to_dataset()
    forces = response[["axial_force", "bending_moment"]].to_dataframe()
    assert len(forces) == response.sizes["time"] * response.sizes["theta"]


@pytest.mark.slow
def test_bounds_are_a_coordinate_of_one_name_for_whoever_opens_the_file(file):
    with xr.open_datatree(file, engine="h5netcdf", decode_timedelta=False) as tree:
        pressures = tree["lining"].to_dataset()
        assert pressures["theta"].attrs["bounds"] == "theta_bnds" and "theta_bnds" in pressures.coords
        assert pressures["theta_bnds"].dims == ("theta", "bounds")
        for model in ("beam_spring", "continuum"):  # forces are those at an angle, not means over a cell
            assert "bounds" not in tree.structure[model]["theta"].attrs and "bounds" not in tree.structure[model].dims
        assert tree.structure.beam_spring["bending_moment"].sizes["time"] == len(TIMES)
        assert "inflow_mass" in tree["lining"].to_dataset()["soil_pressure"].coords


def test_tree_is_reached_by_attributes(run):
    assert run.structure.beam_spring.bending_moment.sizes["time"] == len(TIMES)
    assert run.structure.beam_spring.attrs["model"] == "beam-spring"


def test_group_of_an_earlier_version_is_read_and_replaced(file, tmp_path):
    old = tmp_path / "run.nc"
    old.write_bytes(file.read_bytes())
    response = datasets.read_response(file)
    with h5netcdf.File(old, "r+") as content:
        content._h5file["structure"].move("beam_spring", "beam-spring")
    xr.testing.assert_identical(datasets.read_response(old), response)
    assert set(coupling.read_run(old).structure.children) == {"beam_spring", "continuum"}
    datasets.write_response(old, response.isel(time=[0]))
    assert datasets.read_response(old).sizes["time"] == 1
    with h5netcdf.File(old) as content:
        assert set(content["structure"].groups) == {"beam_spring", "continuum"}


def with_pauses(run):
    """Pressures of a run in which nothing has come in at the first three records and some has gone again."""
    pressures = run["lining"].to_dataset()
    return pressures.assign_coords(inflow_mass=("time", [0.0, 0.0, 0.0, 30.0, 29.0]))


def test_records_are_selected_and_interpolated_by_inflow_mass(run):
    pressures = run["lining"].to_dataset()
    assert "inflow_mass" in pressures.coords and "inflow_mass" in pressures["soil_pressure"].coords
    over = by_inflow(pressures)
    np.testing.assert_array_equal(over.sel(inflow_mass=160.0, method="nearest")["time"], 0.5)
    halfway = at_inflow(pressures, 200.0)
    np.testing.assert_allclose(over.interp(inflow_mass=200.0)["soil_pressure"], halfway["soil_pressure"])
    assert float(halfway["inflow_mass"]) == pytest.approx(200.0)
    # strictly increasing as it is: xarray alone does it
    plain = pressures.swap_dims(time="inflow_mass").sel(inflow_mass=160.0, method="nearest")
    assert float(plain["time"]) == 0.5


def test_inflow_that_pauses_can_be_selected_all_the_same(run):
    over = by_inflow(with_pauses(run))
    np.testing.assert_array_equal(over["inflow_mass"], [0.0, 30.0])
    np.testing.assert_array_equal(over["time"], [0.0, 0.75])  # of the zeros the initial state, of 30 and 29 the first
    assert over.indexes["inflow_mass"].is_unique and over.indexes["inflow_mass"].is_monotonic_increasing
    assert float(over.sel(inflow_mass=25.0, method="nearest")["time"]) == 0.75


@pytest.mark.slow
def test_units_are_those_that_pint_knows(file):
    """In a process of its own: nothing else may have taught pint other units."""
    code = f"""
import xarray as xr, pint_xarray, coupling
run, file = coupling.read_run({str(file)!r}), xr.open_datatree({str(file)!r}, engine="h5netcdf", decode_timedelta=False)
for group in {GROUPS!r}:
    for data in (run[group].to_dataset(), file[group].to_dataset()):
        quantities = data.drop_vars("topology", errors="ignore").pint.quantify()
        for name, variable in quantities.data_vars.items():
            assert variable.pint.units is not None, name
moment = run.structure.beam_spring.to_dataset().pint.quantify().bending_moment
print(moment.isel(time=0, theta=0).pint.to("kN").item().magnitude)
"""
    done = subprocess.run([sys.executable, "-W", "ignore", "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    first = datasets.read_response(file)["bending_moment"].isel(time=0, theta=0)
    assert float(done.stdout) == pytest.approx(float(first) / 1e3)


def test_checked_response_has_units_that_pint_knows(run):
    pint = pytest.importorskip("pint")
    from structure import Limits, check
    from structure.lining import RESPONSE

    checked = check(run["structure/beam_spring"].to_dataset(), Limits(convergence_per_mille=3.0))
    registry = pint.UnitRegistry()
    for name, variable in checked.data_vars.items():
        registry.parse_units(variable.attrs["units"])
        assert name not in RESPONSE or variable.attrs["units"] == RESPONSE[name][1]
    assert registry.Quantity(1.0, checked["convergence_per_mille"].attrs["units"]).to("").magnitude == 1e-3


def test_cf_xarray_finds_axes_and_cells(run):
    cf_xarray = pytest.importorskip("cf_xarray")
    assert cf_xarray
    pressures = run["lining"].to_dataset()
    assert pressures.cf.axes["T"] == ["time"]
    assert pressures.cf.isel(T=0)["soil_pressure"].dims == ("theta",)
    bounds = pressures.cf.add_bounds("theta")["theta_bounds"]
    np.testing.assert_allclose(bounds.isel(theta=slice(1, 359)), datasets.cell_bounds()[1:359])
    mesh = run["mesh"].to_dataset()
    assert mesh.cf.axes == {"X": ["x"], "Y": ["y"]}
    assert mesh.cf.cf_roles["mesh_topology"] == ["topology"]


def test_mesh_is_one_that_ugrid_describes(run):
    """Follow the attributes alone, as a reader of UGRID does, from the topology to the corners of every triangle."""
    mesh = run["mesh"].to_dataset()
    (topology,) = (v for v in mesh.data_vars.values() if v.attrs.get("cf_role") == "mesh_topology")
    assert topology.attrs["topology_dimension"] == 2
    x, y = (mesh[name] for name in topology.attrs["node_coordinates"].split())
    faces = mesh[topology.attrs["face_node_connectivity"]]
    assert faces.dims[0] == topology.attrs["face_dimension"] and faces.attrs["start_index"] == 0
    assert faces.attrs["cf_role"] == "face_node_connectivity"
    corners = np.stack([x.values[faces.values], y.values[faces.values]], axis=-1)
    assert corners.shape == (mesh.sizes["element"], 3, 2)
    side, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    assert (side[:, 0] * other[:, 1] - side[:, 1] * other[:, 0] > 0).all()  # counter-clockwise
    assert mesh["region"].attrs["mesh"] == topology.name and mesh["region"].attrs["location"] == "face"
