"""What of case 3 and of the twin tunnels the statements of the published study are answered from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling import postprocess
from coupling.datasets import RunFileError, read_history, read_mesh, read_points, read_pressures, read_response
from coupling.datasets.geometry import on_tunnel
from verification.published.sources import CaseRun


@dataclass(frozen=True)
class RunEvidence:
    """Datasets of one run, and the inflow masses at which it is looked at.

    scene : coupling.Scene;  masses : an eighth, a quarter, half and all of the last [kg/m], 250, 500, 1000 and 2000 of
    a published run;  pressures : of all tunnels;  responses : lining model to the response of the gate's tunnel;
    settlement : dataset of settlement (time, x) and inflow_mass;  horizontal, vertical : profiles through the gate;
    theory : theoretical initial pressures, one dataset a tunnel.
    """

    scene: object
    masses: tuple[float, ...]
    pressures: object
    history: object
    responses: dict
    points: object
    mesh: object
    settlement: object
    horizontal: object
    vertical: object
    theory: list

    @property
    def half(self) -> float:
        """Inflow mass at which states are compared: half of the last [kg/m]."""
        return self.masses[2]

    @property
    def of_gate(self):
        """Pressures on the tunnel with the gate."""
        return on_tunnel(self.pressures)


def evidence(run: CaseRun) -> RunEvidence:
    """Read a run and derive what the figures and statements need."""
    pressures, history = read_pressures(run.folder), read_history(run.folder)
    points, mesh = read_points(run.folder), read_mesh(run.folder)
    responses = {}
    for model in ("beam-spring", "continuum"):
        try:
            responses[model] = read_response(run.folder, model)
        except RunFileError:
            continue
    last = run.last_mass
    # the layer at the surface must be thicker than the points' distance from it in the largest elements
    thick = max(1.0, 0.5 * run.scene.discretisation.element_size)
    settlement = postprocess.surface_settlement(points, spacing=max(1.0, thick), depth=thick).to_dataset()
    return RunEvidence(
        run.scene,
        tuple(share * last for share in (0.125, 0.25, 0.5, 1.0)),
        pressures,
        history,
        responses,
        points,
        mesh,
        postprocess.with_inflow(settlement, history),
        *(
            postprocess.with_inflow(postprocess.profile(points, direction), history)
            for direction in ("horizontal", "vertical")
        ),
        [initial_theory(run.scene, tunnel) for tunnel in run.scene.tunnels],
    )


def initial_theory(scene, tunnel):
    """Soil and water pressure that theory expects on an undisturbed circle in the scene's ground.

    Returns
    -------
    xarray.Dataset
        soil_pressure sigma_v cos^2 + K0 sigma_v sin^2, water_pressure (theta) [Pa].
    """
    import xarray as xr

    from coupling.datasets import cell_centres
    from coupling.scenes.rings import ground_at_axis

    theta = cell_centres()
    angle = np.radians(theta)
    depth = tunnel.axis_depth - tunnel.outer_radius * np.cos(angle)
    there = [ground_at_axis(scene, float(d)) for d in depth]
    vertical = np.array([ground["vertical_stress"] for ground in there])
    horizontal = np.array([ground["horizontal_stress"] for ground in there])
    water = scene.water
    pressure = np.zeros_like(depth)
    if water is not None:
        pressure = water.density * scene.gravity * np.maximum(depth - water.table_depth, 0.0)
    return xr.Dataset(
        {
            "soil_pressure": ("theta", vertical * np.cos(angle) ** 2 + horizontal * np.sin(angle) ** 2),
            "water_pressure": ("theta", pressure),
        },
        coords={"theta": theta},
    )


def mirror_difference(pressures, mirrored, inflow_mass):
    """How far two runs, one the mirror image of the other, are from mirroring each other at an inflow mass.

    Parameters
    ----------
    pressures, mirrored : xarray.Dataset
        (time, theta) on 360 cells from 0 degrees, with inflow_mass (time).
    inflow_mass : float
        [kg/m]

    Returns
    -------
    dict
        soil_pressure, water_pressure: largest difference of means over 21 degrees, over the largest pressure [-];
        time: relative difference of the times at which the inflow mass was reached [-].
    """
    one, other = (postprocess.at_inflow(data, inflow_mass) for data in (pressures, mirrored))
    result = {}
    for name in ("soil_pressure", "water_pressure"):
        image = np.roll(other[name].values[::-1], 1)  # 0 stays where it is, 1 becomes 359
        difference = one[name].values - image
        means = np.mean([np.roll(difference, shift) for shift in range(-10, 11)], axis=0)
        result[name] = float(np.abs(means).max() / np.abs(one[name].values).max())
    result["time"] = float(other["time"]) / float(one["time"]) - 1
    return result
