"""Files of synthetic runs in which everything moves, with the answers of two lining models: for tests of the page."""

import numpy as np
from synthetic_run import make_quick_scene, record
from test_figures import TwoTriangles

from coupling import datasets
from coupling.provenance import root_attributes
from coupling.run import respond

TIMES = (0.0, 0.25, 0.5, 0.75, 1.0)


def moving_record(time):
    """A record in which every quantity of the lining and of the points changes with time."""
    made = record(time, snapshot=True)
    for part in made.lining:
        part["water_pressure"] = part["water_pressure"] + 20e3 * time * np.cos(np.radians(part["theta"]))
        part["soil_shear"] = part["soil_shear"] * (1 + 0.2 * time)
    return made


def write_run(path, scene=None, times=TIMES, models=("beam-spring", "continuum"), status="finished"):
    """File of a synthetic run; the second model is a ring of another theory of bending."""
    scene = make_quick_scene() if scene is None else scene
    writer = datasets.RunWriter(path, root_attributes(scene), scene.mpm, TwoTriangles())
    for time in times:
        writer.append(moving_record(time))
    writer.close(status, wall_seconds=12.0, cpu_seconds=11.0)
    pressures = datasets.read_pressures(path)
    theories = {"beam-spring": "timoshenko", "continuum": "euler-bernoulli"}
    for model in models:
        ring = scene.ring.model_copy(update={"section": theories[model]})
        response = respond(scene.model_copy(update={"ring": ring}), pressures)
        datasets.write_response(path, response, model)
    return path
