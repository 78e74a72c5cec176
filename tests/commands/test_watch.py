"""A run that goes on is followed until it ends, without touching it."""

import json

import numpy as np
import pytest
from running import gush

from coupling import datasets
from coupling.commands import watch
from coupling.files.folder import claimed
from coupling.files.provenance import root_attributes
from verification.synthetic_run import TwoTriangles, make_quick_scene, record


@pytest.mark.slow
def test_run_is_followed_until_it_ends(tmp_path, monkeypatch):
    scene = make_quick_scene(stop={"inflow_mass": 90.0, "time": 5.0})  # a record has 300 kg/m after a second
    with claimed(tmp_path / "run") as folder:
        writer = datasets.RunWriter(folder / "run.nc", root_attributes(scene), scene, TwoTriangles())
        writer.append(record(0.0))
        writer.flush()
        looks, later = [], iter((0.1, 0.2, 0.3))

        def sleep(seconds):
            looks.append(seconds)
            writer.append(record(next(later)))
            writer.flush()
            if len(looks) == 3:
                writer.close("finished")

        monkeypatch.setattr(watch.clock, "sleep", sleep)
        result = gush("watch", folder, "--interval", "0.5", "--json", tmp_path / "last.json")
    assert result.exit_code == 0, result.output
    data = json.loads((tmp_path / "last.json").read_text())
    assert looks == [0.5] * 3 and (data["status"], data["records"], data["share"]) == ("finished", 4, 1.0)
    assert "90 kg/m" in result.output and "finished" in result.output and "100%" in result.output


def test_one_look_says_how_far_a_run_is(tmp_path, monkeypatch):
    scene = make_quick_scene(stop={"inflow_mass": 100.0, "time": 5.0})
    with claimed(tmp_path / "run") as folder:
        writer = datasets.RunWriter(folder / "run.nc", root_attributes(scene), scene, TwoTriangles())
        for time in (0.0, 0.1, 0.2):
            writer.append(record(time))
        writer.flush()
        monkeypatch.setattr(watch.clock, "sleep", lambda _: pytest.fail("one look only"))
        before = (folder / "run.nc").read_bytes()
        result = gush("watch", folder, "--once", "--json", "-")
        assert (folder / "run.nc").read_bytes() == before
    data = json.loads(result.stdout)
    assert data["status"] == "running" and data["share"] == pytest.approx(0.6)  # 60 of 100 kg/m, 0.2 of 5 s


def test_folder_without_a_run_is_refused(tmp_path):
    result = gush("watch", tmp_path)
    assert result.exit_code == 2 and "there is no run.nc" in result.output


def test_blocks_rise_with_the_inflow():
    assert watch.blocks(np.linspace(0, 1, 8), np.linspace(0, 70, 8)) == watch.BLOCKS
    assert watch.blocks(np.array([0.0]), np.array([0.0])) == watch.BLOCKS[0]
