"""A change of a file happens as a whole or not at all, wherever it is cut short."""

import h5py
import numpy as np
import pytest

from coupling import datasets
from coupling.files import journal
from coupling.files.provenance import root_attributes
from verification.synthetic_run import make_quick_scene, record


class Cut(Exception):
    """Stands for the end of the program or of the machine."""


def cut_short(monkeypatch, name, share):
    """Lets a function of the journal write only a share of its pages (and not say that it is done)."""

    def cut(path, pages, size):
        some = dict(sorted(pages.items())[: int(share * len(pages))])
        whole(path, some, size)
        raise Cut

    whole = getattr(journal, name)
    monkeypatch.setattr(journal, name, cut)


@pytest.fixture
def file(tmp_path):
    """A run file of two records."""
    scene = make_quick_scene()
    writer = datasets.RunWriter(tmp_path / "run.nc", root_attributes(scene), scene)
    for time in (0.0, 0.5):
        writer.append(record(time, snapshot=True))
    writer.flush()
    return writer


def times(path):
    return [datasets.raw_groups(path)[group]["time"].tolist() for group in ("history", "lining", "points")]


@pytest.mark.parametrize("share", [0.0, 0.3, 0.7, 1.0])
def test_change_cut_short_is_shown_and_finished_from_the_journal(file, monkeypatch, share):
    with monkeypatch.context() as patch:
        cut_short(patch, "_apply", share)
        file.append(record(1.0, snapshot=True))
        with pytest.raises(Cut):
            file.flush()
    assert times(file.path) == [[0.0, 0.5, 1.0]] * 3  # readers see it whole
    assert journal.journal_of(file.path).exists()
    assert journal.recover(file.path) and not journal.recover(file.path)
    with h5py.File(file.path, "r") as content:  # and so does any other program after that
        assert content["points/time"][:].tolist() == [0.0, 0.5, 1.0]
    given = record(1.0, snapshot=True).points
    x = datasets.read_points(file.path, -1)["x"].values
    np.testing.assert_array_equal(x[np.isfinite(x)], given["x"][~given["removed"]].astype("f4"))


@pytest.mark.parametrize("kept", [0.0, 0.01, 0.5, 0.9999])
def test_incomplete_journal_belongs_to_a_change_that_never_began(file, monkeypatch, kept):
    before = file.path.read_bytes()
    with monkeypatch.context() as patch:
        cut_short(patch, "_apply", 0.0)
        file.append(record(1.0, snapshot=True))
        with pytest.raises(Cut):
            file.flush()
    file.path.write_bytes(before)
    beside = journal.journal_of(file.path)
    beside.write_bytes(beside.read_bytes()[: int(kept * beside.stat().st_size)])
    assert times(file.path) == [[0.0, 0.5]] * 3
    assert not journal.recover(file.path) and not beside.exists()
    assert file.path.read_bytes() == before


def test_exception_inside_a_change_leaves_the_file_as_it_was(file):
    before = file.path.read_bytes()
    with pytest.raises(Cut), journal.changed(file.path) as whole:
        whole.write(b"nonsense")
        raise Cut
    assert file.path.read_bytes() == before and not journal.journal_of(file.path).exists()


def test_overlay_reads_and_writes_like_a_file(tmp_path):
    rng = np.random.default_rng(5)
    path, mirror = tmp_path / "a", bytearray(rng.bytes(30_000))
    path.write_bytes(mirror)
    with journal.changed(path) as overlay:
        for _ in range(300):
            start, length = (int(value) for value in rng.integers(0, [len(mirror) + 3000, 9000]))
            kind = rng.integers(0, 8)
            overlay.seek(start)
            if kind == 0:
                overlay.truncate(start)
                del mirror[start:]
                mirror += bytes(start - len(mirror))
            elif kind < 4:
                data = rng.bytes(length)
                overlay.write(data)
                mirror += bytes(max(0, start + length - len(mirror)))
                mirror[start : start + length] = data
            else:
                assert overlay.read(length) == mirror[start : start + length]
    assert path.read_bytes() == mirror
