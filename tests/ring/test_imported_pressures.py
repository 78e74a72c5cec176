"""Pressures of other programs and of measurements: read in their own units, or refused or warned of with the remedy."""

import random
import warnings

import numpy as np
import pytest
import xarray as xr
from running import gush

import coupling
import structure
from coupling.datasets import RunFileError
from coupling.responses.source import read_source
from structure.pressures import WIDEST_GAP, check_pressures
from verification.robustness.wild_pressures import judged, wild_pressures

RING = coupling.load_scene("case-3").ring


def loads(theta=None):
    """Undisturbed pressures around case 3, twice."""
    one = structure.theoretical_pressures(
        outer_diameter=6.6, cover=20.0, buoyant_unit_weight=8.9e3, coefficient_at_rest=0.577,
        theta=np.arange(0.0, 360.0, 5.0) if theta is None else theta,
    )  # fmt: skip
    later = one.assign_coords(time=("time", [60.0], one["time"].attrs))
    return xr.concat([one, later], "time")


@pytest.fixture(scope="module")
def right():
    return structure.BeamSpringLining(RING).respond(loads())


def with_theta(data, values, units=None):
    return data.assign_coords(theta=("theta", values, {} if units is None else {"units": units}))


def same(response, right):
    # angles that went through another unit are right to some 1e-13 of a turn
    np.testing.assert_allclose(response["bending_moment"], right["bending_moment"], rtol=0, atol=1e-3)
    assert response["theta"].attrs["units"] == "degree" and response["time"].attrs["units"] == "s"
    np.testing.assert_allclose(response["time"], [0.0, 60.0])


@pytest.mark.parametrize(
    ("units", "factor"), [("rad", np.pi / 180), ("radian", np.pi / 180), ("radians", np.pi / 180), ("gon", 10 / 9),
                          ("degrees", 1.0), ("deg", 1.0)],
)  # fmt: skip
def test_angles_are_read_in_their_units(right, units, factor):
    data = loads()
    same(structure.BeamSpringLining(RING).respond(with_theta(data, data["theta"].values * factor, units)), right)


def test_angles_may_begin_anywhere_in_any_order_and_close_the_circle(right):
    data = loads()
    around = (data["theta"].values + 180) % 360 - 180
    same(structure.BeamSpringLining(RING).respond(with_theta(data, around)), right)
    closed = xr.concat([data, with_theta(data.isel(theta=[0]), [360.0])], "theta")
    same(structure.BeamSpringLining(RING).respond(closed), right)
    closed["water_pressure"][:, -1] += 1.0
    with pytest.raises(ValueError, match="got 0 degrees twice with different values; drop one"):
        check_pressures(closed)


@pytest.mark.slow
@pytest.mark.parametrize(
    "time",
    [
        ("time", [0.0, 60e3], {"units": "ms"}),
        ("time", [0.0, 1.0], {"units": "min"}),
        ("time", np.array([0, 60], "timedelta64[s]").astype("timedelta64[ns]")),
        ("time", np.array(["2026-03-01T10:00:00", "2026-03-01T10:01:00"], "datetime64[ns]")),
        ("time", [10.0, 11.0], {"units": "minutes since 2026-03-01"}),
    ],
    ids=["ms", "min", "durations", "dates", "dates of CF"],
)
def test_times_are_read_in_their_units_and_can_be_stored(right, time, tmp_path):
    data = loads().assign_coords(time=time)
    for model in ("beam-spring", "continuum"):
        response = structure.lining_model(model)(RING).respond(data)
        response.to_netcdf(tmp_path / f"{model}.nc", engine="h5netcdf")
        with xr.open_dataset(tmp_path / f"{model}.nc", engine="h5netcdf", decode_timedelta=False) as stored:
            np.testing.assert_allclose(stored["time"], [0.0, 60.0])
        if model == "beam-spring":
            same(response, right)


def test_dates_and_angles_in_radians_go_through_the_command_line(right, tmp_path):
    data = loads().assign_coords(time=np.array(["2026-03-01T10:00", "2026-03-01T10:01"], "datetime64[ns]"))
    data = with_theta(data, np.radians(data["theta"].values), "rad").assign_attrs(ring=RING.model_dump_json())
    data.to_netcdf(tmp_path / "mine.nc", engine="h5netcdf")
    result = gush("respond", tmp_path / "mine.nc")
    assert result.exit_code == 0, result.output
    with xr.open_dataset(tmp_path / "mine-beam-spring.nc", engine="h5netcdf", decode_timedelta=False) as stored:
        same(stored, right)


def test_pressures_are_read_in_their_units(right):
    data = loads()
    for name, units, factor in (("soil_pressure", "kPa", 1e-3), ("water_pressure", "kN m-2", 1e-3),
                                ("soil_shear", "N/mm^2", 1e-6)):  # fmt: skip
        data[name] = (data[name] * factor).assign_attrs(units=units)
    same(structure.BeamSpringLining(RING).respond(data), right)


def half_a_ring():
    return loads(np.arange(0.0, 181.0, 10.0))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("data", "message"),
    [
        (half_a_ring, r"no gap of more than 60 degrees, got 180 after 180 degrees; .* mirror a half ring"),
        (lambda: loads(np.linspace(85.0, 95.0, 8)), "no gap of more than 60 degrees, got 350 after 95"),
        (lambda: with_theta(loads(), np.radians(loads()["theta"].values)), "give theta its units where it is in rad"),
        (lambda: with_theta(loads(), np.where(loads()["theta"] == 90, np.nan, loads()["theta"])), "got 1 angles"),
        (lambda: with_theta(loads(), loads()["theta"].values, "m"), "theta must be in degree, got 'm'"),
        (lambda: loads().isel(time=[1, 0]), r"time must increase .* got 0 s after 60 s; sortby"),
        (lambda: loads().isel(time=[0, 0]), "got 0 s after 0 s"),
        (lambda: loads().assign_coords(time=[0.0, np.nan]), "time must be finite, got 1"),
        (lambda: loads().assign_coords(time=("time", [0.0, 1.0], {"units": "m"})), "time must be in s, got 'm'"),
        (lambda: loads().assign_coords(time=["a", "b"]), "time must be numbers in s"),
        (lambda: loads().isel(theta=slice(0, 7)), "at least 8 different angles"),
    ],
)
def test_pressures_that_cannot_be_meant_are_refused_with_the_remedy(data, message):
    for model in ("beam-spring", "continuum"):
        with pytest.raises(ValueError, match=message):
            structure.lining_model(model)(RING).respond(data())


def test_mirrored_half_is_the_whole():
    half = half_a_ring()
    other = half.isel(theta=slice(1, -1)).assign_coords(theta=360 - half["theta"][1:-1])
    other["soil_shear"] = -other["soil_shear"]
    model = structure.BeamSpringLining(RING)
    same(model.respond(xr.concat([half, other], "theta")), model.respond(loads(np.arange(0.0, 360.0, 10.0))))


@pytest.mark.slow
def test_ring_in_tension_or_under_less_than_its_own_weight_is_warned_of(tmp_path):
    ring = RING.model_copy(update={"ground": RING.ground.model_copy(update={"two_way": True, "law": "linear"})})
    pulled = -loads()
    in_kilopascal = loads().map(lambda values: values / 1e3)
    zero = loads().map(lambda values: 0 * values)
    for data, message in ((pulled, "pull the ring outward all around"), (in_kilopascal, "units = 'kPa'")):
        with pytest.warns(UserWarning, match=message):
            structure.BeamSpringLining(ring).respond(data)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        structure.BeamSpringLining(ring).respond(loads())
        structure.BeamSpringLining(ring).respond(zero)  # the weight alone is a load case
    in_kilopascal.assign_attrs(ring=ring.model_dump_json()).to_netcdf(tmp_path / "mine.nc", engine="h5netcdf")
    result = gush("compare", tmp_path / "mine.nc")
    assert result.exit_code == 0 and result.output.count("warning: pressures: ") == 1, result.output


def test_eight_cells_at_equal_spacing_are_enough():
    assert 360 / 8 < WIDEST_GAP
    assert check_pressures(loads(np.arange(0.0, 360.0, 45.0))).sizes["theta"] == 8


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (lambda: with_theta(loads(), loads()["theta"].values * 10 / 9), "within one turn, got 0 to 394.444 degrees"),
        (lambda: with_theta(loads(), loads()["theta"].values, "9**9**9"), "theta must be in degree, got '9"),
        (
            lambda: loads().assign(soil_pressure=loads()["soil_pressure"].assign_attrs(units=5)),
            "soil_pressure must be in Pa, got '5'",
        ),
    ],
)
def test_what_generated_files_found_is_refused(data, message):
    with pytest.raises(ValueError, match=message):
        check_pressures(data())


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (lambda: with_theta(loads(), loads()["theta"].values, "gon"), "but one of 40.5 after 319.5"),
        (lambda: loads().assign(soil_pressure=-loads()["soil_pressure"]), "soil alone pull the ring outward"),
        (lambda: loads().assign(soil_pressure=loads()["soil_pressure"] / 1e3), "soil_pressure never reach 1000 Pa"),
    ],
)
def test_what_generated_files_found_is_warned_of(data, message):
    with pytest.warns(structure.GushingWarning, match=message):
        check_pressures(data(), RING)


def test_angle_just_below_zero_is_zero():
    data = loads()
    assert check_pressures(with_theta(data, np.r_[-1e-20, data["theta"].values[1:]]))["theta"][0] == 0


def test_record_without_a_time_in_a_file_is_refused(tmp_path):
    data = loads().assign_coords(time=[0.0, np.nan]).assign_attrs(ring=RING.model_dump_json())
    data.to_netcdf(tmp_path / "mine.nc", engine="h5netcdf")
    with pytest.raises(RunFileError, match="time must be finite, got 1 values"):
        read_source(tmp_path / "mine.nc")


@pytest.mark.slow
def test_any_file_gives_what_was_meant_or_is_warned_of_or_refused(tmp_path):
    verdicts = set()
    for number in range(60):
        given, true, kind = wild_pressures(random.Random(number))
        given.assign_attrs(ring=RING.model_dump_json()).to_netcdf(tmp_path / "mine.nc", engine="h5netcdf")
        verdicts.add(judged(tmp_path / "mine.nc", true, kind))
    assert {"right values", "refused"} <= verdicts, verdicts


def test_few_uneven_angles_in_gon_called_degrees_are_taken_as_written(tmp_path):
    given, true, kind = wild_pressures(random.Random("0 1170"))  # eight of them, 4.8 to 345.3
    given.assign_attrs(ring=RING.model_dump_json()).to_netcdf(tmp_path / "mine.nc", engine="h5netcdf")
    assert judged(tmp_path / "mine.nc", true, kind) == "untold"
