"""A command writes into its own output only: what it reads it leaves alone, what it would replace it asks for."""

import hashlib
from pathlib import Path

import pytest
import xarray as xr
from running import gush
from test_lining_models import LIMITS

from coupling.datasets import read_response
from verification.synthetic_run import write_run


@pytest.fixture
def folder(tmp_path):
    """A run that both models have answered."""
    (tmp_path / "run").mkdir()
    write_run(tmp_path / "run" / "run.nc")
    return tmp_path / "run"


def contents(folder):
    return {path: hashlib.sha256(path.read_bytes()).hexdigest() for path in Path(folder).rglob("*") if path.is_file()}


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_comparison_leaves_the_run_as_it_is(folder, tmp_path):
    before = contents(folder)
    result = gush("compare", folder, "--open-gate", "0.17", "--out", tmp_path / "compared")
    assert result.exit_code == 0, result.output
    assert contents(folder) == before
    # the ring with a hole is kept where it belongs
    with xr.open_dataset(tmp_path / "compared" / "continuum.nc", engine="h5netcdf") as stored:
        assert stored.attrs["gate_cut"] == 0.17


@pytest.mark.usefixtures("undrawn")
def test_response_to_own_pressures_leaves_their_file_as_it_is(written, tmp_path):
    (tmp_path / "limits.toml").write_text(LIMITS)
    before = contents(tmp_path)
    assert gush("respond", written, "--limits", tmp_path / "limits.toml").exit_code == 0
    after = contents(tmp_path)
    assert {path.name for path in set(after) - set(before)} == {"mine-beam-spring.nc", "mine-beam-spring-checks.png"}
    assert before.items() <= after.items()
    with xr.open_datatree(written, engine="h5netcdf") as tree:
        assert not tree.children
    report = gush("report", written)
    assert report.exit_code == 2 and "mine.nc" in report.output, report.output


@pytest.mark.usefixtures("undrawn")
def test_response_of_another_ring_does_not_take_the_place_of_the_runs_own(folder, tmp_path):
    own = read_response(folder)["bending_moment"]
    other = tmp_path / "stiff.toml"
    other.write_text('base = "quick"\n[ring]\nconcrete_modulus = 60e9\n')
    assert gush("respond", folder, "--scene", other).exit_code == 0
    xr.testing.assert_identical(read_response(folder)["bending_moment"], own)
    with xr.open_dataset(folder / "run-beam-spring.nc", engine="h5netcdf") as stored:
        assert float(abs(stored["bending_moment"] - own.values).max()) > 1e3


@pytest.mark.usefixtures("undrawn")
def test_response_asks_before_it_replaces(written, tmp_path):
    target = tmp_path / "mine-beam-spring.nc"
    target.write_text("somebody's")
    refused = gush("respond", written)
    assert refused.exit_code == 2 and "--overwrite" in refused.output and target.read_text() == "somebody's"
    assert gush("respond", written, "--overwrite").exit_code == 0
    assert target.read_bytes()[1:4] == b"HDF"
    own = gush("respond", written, "--out", written, "--overwrite")
    assert own.exit_code == 2 and "must not be the file of the pressures" in own.output


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_comparison_replaces_earlier_comparisons_only(written, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "forces.png").write_text("somebody's")
    refused = gush("compare", written, "--out", out)
    assert refused.exit_code == 2 and "forces.png" in refused.output
    assert contents(out).keys() == {out / "forces.png"}
    (out / "forces.png").unlink()
    assert gush("compare", written, "--out", out).exit_code == 0
    assert gush("compare", written, "--out", out).exit_code == 0
