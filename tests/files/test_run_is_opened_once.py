"""How often a run's file is opened: each time costs a check of the whole file, and time on a shared disk."""

import h5py
import pytest
from typer.testing import CliRunner

from coupling import datasets
from coupling.cli import app
from coupling.files.journal import Overlay
from coupling.report.page import write_report
from verification.small_event import small_scene


@pytest.fixture
def openings(monkeypatch):
    """Names of run files, and objects that show one changed, as the HDF5 library opens them."""
    found, init = [], h5py.File.__init__

    def counted(self, name, *args, **kwargs):
        if isinstance(name, Overlay) or "run.nc" in str(name):
            found.append(name)
        init(self, name, *args, **kwargs)

    monkeypatch.setattr(h5py.File, "__init__", counted)
    return found


@pytest.mark.slow
def test_run_with_forces_and_pictures_opens_its_file_five_times_beside_the_batches(openings, tmp_path, monkeypatch):
    monkeypatch.setattr(datasets.writer, "SECONDS_BETWEEN_WRITES", 1e9)  # one batch: the first record
    scene = tmp_path / "small.toml"
    scene.write_text(small_scene(stop={"time": 0.02}).source, encoding="utf-8")
    result = CliRunner().invoke(app, ["run", str(scene), "--out", str(tmp_path / "run"), "--quiet"])
    assert result.exit_code == 0, result.output
    # the first batch, the last one with how it ended, the responses, the pictures, what the command prints
    assert len(openings) <= 5
    openings.clear()
    tree = datasets.read_run(tmp_path / "run")
    assert {"lining", "history", "points", "mesh", "structure"} == set(tree.children) and len(openings) == 1
    openings.clear()
    write_report(tmp_path / "run")
    assert len(openings) == 1
