"""A long computation shows that it goes on where there is no terminal, and asks for no pictures to compute forces."""

import time as clock

import pytest
from running import gush

import coupling
from coupling.datasets import RunFileError, read_response
from coupling.runs import progress_line
from coupling.runs.progress_line import ProgressLine
from verification.stability import report as stability_report


@pytest.fixture
def impatient(monkeypatch):
    monkeypatch.setattr(progress_line, "SECONDS_BETWEEN_LINES", 0.05)


def test_line_is_written_now_and_then_where_there_is_no_terminal(capsys, impatient):
    with ProgressLine() as line:
        line({"stage": "mesh"})
        clock.sleep(0.2)  # nothing is told meanwhile, as while numba compiles
        line({"stage": "relax", "step": 50, "residual": 1e-3})
        clock.sleep(0.2)
    lines = capsys.readouterr().err.splitlines()
    assert 2 <= len([text for text in lines if text.endswith("s: meshing")]) <= 4
    assert lines[-1].endswith("s: initial equilibrium: step 50, residual 1.0e-03")


def test_quiet_line_and_one_that_is_over_write_nothing(capsys, impatient):
    with ProgressLine(quiet=True) as line:
        line({"stage": "mesh"})
        clock.sleep(0.1)
    assert capsys.readouterr() == ("", "")


@pytest.mark.slow
def test_run_in_python_shows_a_line_when_asked(simulated, tmp_path, capsys, impatient, monkeypatch):
    patient = coupling.run.__globals__["read_pressures"]

    def slow(path):
        clock.sleep(0.2)
        return patient(path)

    monkeypatch.setitem(coupling.run.__globals__, "read_pressures", slow)
    coupling.run("quick", tmp_path / "shown", progress=True)
    assert "t 0.200 s  inflow 60 kg/m" in capsys.readouterr().err
    coupling.run("quick", tmp_path / "silent")
    assert capsys.readouterr().err == ""


def test_linear_stability_tells_how_far_it_is(monkeypatch, impatient):
    class Stopped(ValueError):
        pass

    def slow(progress):
        for n in range(1, 4):
            progress(n, 900)
            clock.sleep(0.1)
        raise Stopped

    monkeypatch.setattr(stability_report, "critical_map", slow)
    result = gush("stability", "--linear")
    assert isinstance(result.exception, Stopped)
    assert "linear analysis: 1 of 900" in result.stderr and "linear analysis: 3 of 900" in result.stderr


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_forces_in_the_ring_need_no_pictures(simulated, tmp_path):
    assert gush("run", "quick", "--out", tmp_path / "plain", "--no-figures").exit_code == 0
    assert read_response(tmp_path / "plain").sizes["time"] == 3
    assert not list((tmp_path / "plain").glob("figures/*.png"))
    assert gush("run", "quick", "--out", tmp_path / "ground", "--no-response").exit_code == 0
    drawn = {path.stem for path in (tmp_path / "ground" / "figures").glob("*.png")}
    assert "pressures" in drawn and "internal_forces" not in drawn
    with pytest.raises(RunFileError, match="gush respond"):
        read_response(tmp_path / "ground")
