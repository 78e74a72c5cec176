"""Records as `mpm.simulate` yields them, made from formulas, and files of them with the answers of two lining models.

For tests of files and pages, and for damage to files, without a simulation.
"""

import numpy as np

import coupling
from coupling import datasets
from coupling.datasets import BALANCES, ERRORS
from coupling.files.provenance import root_attributes
from coupling.responses.respond import respond
from mpm.simulation import Record
from mpm.variables import CLAMPS, POINT_VARIABLES

THETA = np.sort(np.concatenate([np.arange(0.0, 360.0, 4.0), [88.3, 90.0, 91.7]]))

TIMES = (0.0, 0.25, 0.5, 0.75, 1.0)


class TwoTriangles:
    """The least that a mesh must have to be stored."""

    nodes = np.array([[3.0, -23.0], [4.0, -23.0], [4.0, -24.0], [3.0, -24.0]])
    elements = np.array([[0, 2, 1], [0, 3, 2]])
    region = np.array([0, 1])


def make_quick_scene(**changes):
    """The built-in quick scene."""
    return coupling.load_scene("quick", **changes)


def lining(time, theta=THETA):
    """Pressures of one tunnel [Pa] that fall at the gate as time goes on."""
    angle = np.radians(theta)
    soil = 180e3 - 60e3 * np.sin(angle) ** 2 * (1 + 0.3 * time)
    zero = np.zeros_like(theta)
    return {
        "theta": theta,
        "arc": np.full(len(theta), 3.3 * 2 * np.pi / len(theta)),
        "soil_pressure": soil,
        "water_pressure": 230e3 - 33e3 * np.cos(angle),
        "soil_shear": 30e3 * np.sin(2 * angle),
        "soil_pressure_std": zero + 10.0,
        "water_pressure_std": zero + 20.0,
    }


def points(time, count=400):
    """A ring of points around the tunnel of the quick scene, one of them taken out."""
    angle, radius = np.linspace(0, 2 * np.pi, count, endpoint=False), 3.4 + 4.0 * np.linspace(0, 1, count)
    data = {name: np.full(count, 1.0) for name, _, _ in POINT_VARIABLES}
    data["x"], data["y"] = radius * np.sin(angle), -23.3 + radius * np.cos(angle)
    data["stress_yy"], data["pore_pressure"] = 9e3 * data["y"], -9.81e3 * data["y"]
    data["deviatoric_strain"] = 0.1 * time * np.exp(3.4 - radius)
    data["displacement_x"], data["displacement_y"] = -0.2 * time * np.exp(3.4 - radius), np.zeros(count)
    data["volume"], data["soil"] = np.full(count, 0.1), np.zeros(count, np.int8)
    data["removed"] = np.arange(count) == 7
    return data


def record(time, n_tunnels=1, snapshot=False):
    """One record."""
    return Record(
        time=time,
        dt=1e-4,
        dt_limit="acoustic",
        steps=int(time * 1e4),
        lining=[lining(time) for _ in range(n_tunnels)],
        inflow_mass=300.0 * time,
        flow_zone_area=5.0 * time,
        disturbed_area=40.0 * time,
        grain_mass=5e6,
        suspended_fraction=0.01 * time,
        tip_fraction=0.01 * time,
        kinetic_energy=10.0 * time,
        max_velocity=time,
        balances={name: 1e-6 * k for k, name in enumerate(BALANCES)} | {"contact_error": 1e-14},
        errors={name: 1e-6 * k for k, name in enumerate(ERRORS)},
        clamp_counts={name: k for k, name in enumerate(CLAMPS)},
        point_steps=int(time * 1e8),
        cpu_seconds=time,
        points=points(time) if snapshot else None,
    )


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
    writer = datasets.RunWriter(path, root_attributes(scene), scene, TwoTriangles())
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
