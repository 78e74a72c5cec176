"""A study of synthetic runs, run by the program's own study command: for tests of its page."""

from dataclasses import replace
from importlib import import_module

import numpy as np

import coupling
from coupling import datasets
from coupling.files.provenance import root_attributes
from mpm.solver import RunFailed
from verification.synthetic_run import TIMES, TwoTriangles, moving_record

REASON = "no initial equilibrium <b>at all</b>; make the elements smaller"


def synthetic_run(scene, folder, **_):
    """Stands for `coupling.run`: pressures grow with the friction angle; one case fails, one ends half way."""
    soil, gate = scene.soils[0], scene.gate
    if gate.angle == 45.0 and soil.friction_angle == 35.0:
        raise RunFailed(REASON, 0.0, (0.0, -20.0))
    folder.mkdir(parents=True, exist_ok=True)
    writer = datasets.RunWriter(folder / "run.nc", root_attributes(scene), scene, TwoTriangles())
    for time in TIMES[:3] if gate.angle == 45.0 else TIMES:
        made = replace(moving_record(time), points=None)
        turn = np.radians(made.lining[0]["theta"] - gate.angle)
        made.lining[0]["soil_pressure"] = made.lining[0]["soil_pressure"] + soil.friction_angle * 1e3 * np.cos(turn)
        writer.append(made)
    writer.close("finished", wall_seconds=12.0, cpu_seconds=11.0)


def write_study(folder, monkeypatch, backends=("beam-spring", "continuum"), **changes):
    """Run the study of two gates and two soils into a folder; `changes` of its definition."""
    monkeypatch.setattr(import_module("coupling.runs.run"), "run", synthetic_run)
    plan = {
        "name": "gates", "scene": "quick", "records": 5, "backends": backends, "fixed": {"stop.inflow_mass": 300.0},
        "parameters": {"gate.angle": [90.0, 45.0], "soils.0.friction_angle": [25.0, 35.0]}, **changes,
    }  # fmt: skip
    coupling.study(plan, folder, workers=0)
    return folder
