"""Pressures and responses meet at the same angles: in memory, in files of this and of earlier versions, in studies."""

import shutil

import numpy as np
import pytest
import xarray as xr

import coupling
from coupling.datasets import cell_centres, read_pressures, read_response, write_response
from coupling.report.page import write_report
from coupling.responses.respond import respond_by_name
from structure import BeamSpringLining, ContinuumLining, theory
from structure.lining import THETA, at_whole_degrees
from verification.synthetic_run import write_run

LOADS = theory.theoretical_pressures(
    outer_diameter=6.6, cover=20.0, buoyant_unit_weight=8900.0, coefficient_at_rest=3 / 7
)


def odd_ring():
    """Joints between whole degrees and elements of other lengths than a degree."""
    return coupling.load_scene("quick").ring.model_copy(
        update={"joint_angles": (8.31, 73.77, 138.02, 221.9, 300.3), "n_elements": 200}
    )


def as_of_earlier_versions(response, name="theta"):
    """The same at the middles between whole degrees."""
    middles = np.arange(359) + 0.5
    ahead = response.isel(theta=[0, -1]).mean("theta").expand_dims(theta=[359.5])
    around = [key for key, variable in response.data_vars.items() if "theta" in variable.dims]
    moved = xr.concat([response[around].interp(theta=middles), ahead[around]], dim="theta")
    return response.drop_dims("theta").assign(moved.transpose(..., "theta")).rename(theta=name)


@pytest.mark.parametrize("model", [BeamSpringLining, ContinuumLining])
def test_pressures_less_moments_is_known_at_every_angle(model):
    ring = odd_ring()
    response = model(ring).respond(LOADS)
    difference = LOADS["soil_pressure"] - response["bending_moment"]
    assert difference.sizes["theta"] == 360 and np.isfinite(difference).all()
    np.testing.assert_array_equal(THETA, cell_centres())


def test_section_forces_on_a_joint_are_those_of_the_joint():
    ring = odd_ring().model_copy(update={"joint_angles": (8.0, 73.0, 138.0, 222.0, 287.0, 352.0)})
    for model, share in ((BeamSpringLining, 5e-3), (ContinuumLining, 1e-3)):
        response = model(ring).respond(LOADS).isel(time=0)
        for name in ("axial_force", "shear_force", "bending_moment"):
            across = response[name].sel(theta=list(ring.joint_angles)).values
            # of the largest; beams: loads of an element of 1.8 degrees, continuum: discretisation
            largest = np.abs(response[name]).max().item()
            np.testing.assert_allclose(response[f"joint_{name}"], across, atol=share * largest)


def test_displacement_on_a_joint_is_the_mean_of_its_sides():
    ring = odd_ring().model_copy(update={"joint_angles": (8.0, 73.0, 138.0, 222.0, 287.0, 352.0)})
    for model in (BeamSpringLining, ContinuumLining):
        response = model(ring).respond(LOADS).isel(time=0)
        beside = response["displacement_radial"].sel(theta=[137.0, 138.0, 139.0]).values
        step = abs(response["joint_dislocation"].values[2])
        assert step > 1e-4  # or there would be nothing to see
        # a tenth of the step: the ring bends over the degree to either side
        assert beside[1] == pytest.approx((beside[0] + beside[2]) / 2, abs=0.1 * step)


def test_model_with_angles_of_its_own_is_brought_to_those_of_the_pressures(tmp_path):
    (tmp_path / "own.py").write_text(
        "import numpy as np\nfrom structure import BeamSpringLining\nfrom structure.lining import LiningModel\n"
        "class Own(LiningModel):\n"
        "    def __init__(self, ring):\n        self.beams = BeamSpringLining(ring)\n"
        "    def respond(self, pressures):\n"
        "        return self.beams.respond(pressures).interp(theta=np.arange(0.25, 359.0, 1.5))\n"
    )
    ring = odd_ring()
    own = respond_by_name(ring, LOADS, f"{tmp_path / 'own.py'}:Own")
    beams = BeamSpringLining(ring).respond(LOADS)
    np.testing.assert_array_equal(own["theta"], THETA)
    # 1e-2 of the largest: linear over 1.5 degrees, twice
    np.testing.assert_allclose(
        own["bending_moment"], beams["bending_moment"], atol=1e-2 * np.abs(beams["bending_moment"]).max().item()
    )
    assert own["bending_moment"].attrs == beams["bending_moment"].attrs


@pytest.mark.slow
def test_response_in_a_file_of_an_earlier_version_is_read_at_the_angles_of_the_pressures(tmp_path):
    write_run(tmp_path / "run.nc", models=())
    pressures = read_pressures(tmp_path)
    response = BeamSpringLining(odd_ring()).respond(pressures)
    old = as_of_earlier_versions(response)
    write_response(tmp_path / "run.nc", old)
    read = read_response(tmp_path)
    assert (read_pressures(tmp_path)["soil_pressure"] - read["bending_moment"]).sizes["theta"] == 360
    largest = np.abs(response["bending_moment"]).max().item()
    # 1e-3 of the largest: linear over a degree, twice
    np.testing.assert_allclose(read["bending_moment"], response["bending_moment"], atol=1e-3 * largest)
    np.testing.assert_array_equal(read["joint_opening"], response["joint_opening"])


@pytest.mark.slow
def test_studies_have_pressures_and_forces_at_the_same_angles_also_those_of_earlier_versions(gates, tmp_path):
    folder = shutil.copytree(gates, tmp_path / "study")
    study = coupling.read_study(folder).load()
    ratio = study["bending_moment"] / study["soil_pressure"]
    assert dict(ratio.sizes) == {"case": 4, "progress": 5, "model": 2, "theta": 360}
    for file in folder.glob("cases/*/case.nc"):
        with xr.open_dataset(file, engine="h5netcdf", decode_timedelta=False) as opened:
            now = opened.load()
        forces = [name for name in now.data_vars if {"theta", "model"} <= set(now[name].dims)]
        earlier = now.drop_vars(forces)
        for name in forces:
            moved = as_of_earlier_versions(now[[name]], "theta_ring")
            earlier[name] = moved[name]
        earlier.to_netcdf(file, engine="h5netcdf")
    old = coupling.read_study(folder).load()
    assert old["bending_moment"].dims == study["bending_moment"].dims
    largest = np.abs(study["bending_moment"]).max().item()
    # 1e-3 of the largest: linear over a degree, twice
    np.testing.assert_allclose(old["bending_moment"].transpose(*study["bending_moment"].dims), study["bending_moment"],
                               atol=1e-3 * largest)  # fmt: skip
    assert "bending_moment" in write_report(folder).read_text()


def test_linear_function_survives_the_way_to_whole_degrees_also_across_the_crown():
    middles = np.arange(360) + 0.5
    around = xr.Dataset({"rise": ("theta", np.abs(middles - 180.0))}, coords={"theta": middles})
    moved = at_whole_degrees(around)["rise"]
    # 1e-12: exact but for the two kinks, at 0 and 180 degrees, where the neighbours are half a degree off
    expected = np.abs(THETA - 180.0)
    expected[[0, 180]] = 179.5, 0.5
    np.testing.assert_allclose(moved, expected, atol=1e-12)
