"""Datasets of one run from which the statements of the published study are answered and its figures drawn."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from coupling import postprocess
from coupling.datasets import (
    cell_centres,
    cell_mean_weights,
    read_attributes,
    read_group,
    read_history,
    read_mesh,
    read_points,
    read_pressures,
    read_run,
)
from coupling.datasets.geometry import on_tunnel
from coupling.datasets.tree import responses_of

#: Inflow masses that the source looks at [kg/m]: 1000 is that of its comparisons, 2000 the end of its runs.
MASSES = (250.0, 500.0, 1000.0, 2000.0)
COMPARED, LAST = MASSES[2:]


@dataclass(frozen=True)
class RunEvidence:
    """A finished run: its scene and its folder; datasets are read when they are asked for.

    at_rest : xarray.Dataset or None
        Bonded initial pressures of all tunnels, see :func:`at_rest`; None: the run's own first record, slipped.
    """

    scene: object
    folder: Path
    at_rest: object = None

    @cached_property
    def pressures(self):
        """Of all tunnels, over time."""
        return read_pressures(self.folder)

    @cached_property
    def history(self):
        """Inflow and zones over time."""
        return read_history(self.folder)

    @cached_property
    def mesh(self):
        """The mesh."""
        return read_mesh(self.folder)

    @cached_property
    def responses(self):
        """Lining model to the stored response of the gate's tunnel, over time."""
        return responses_of(read_run(self.folder))

    @property
    def ring(self):
        """Response of the beam-spring ring, over time."""
        return self.responses["beam-spring"]

    @cached_property
    def added(self):
        """What the event has added to the beam-spring ring at :attr:`compared`."""
        return postprocess.additional_at_inflow(self.ring, self.compared)

    @property
    def reached(self) -> float:
        """Largest inflow mass of the run [kg/m]."""
        return float(self.history["inflow_mass"].max())

    @property
    def masses(self) -> tuple[float, ...]:
        """Those of :data:`MASSES` that the run reached, else its last inflow mass [kg/m]."""
        return tuple(mass for mass in MASSES if mass <= self.reached) or (self.reached,)

    @property
    def compared(self) -> float:
        """Inflow mass at which the run is compared: 1000 kg/m, or as far as it came."""
        return min(COMPARED, self.reached)

    @cached_property
    def points(self):
        """The first snapshot and those around every one of :attr:`masses`, with inflow_mass (time)."""
        return self._points_around((*self.masses, self.compared))

    @cached_property
    def fields(self):
        """Means of the elements at the snapshots of :attr:`points`, with inflow_mass (time)."""
        return postprocess.with_inflow(postprocess.element_fields(self.points, self.mesh), self.history)

    def _points_around(self, masses):
        points = postprocess.with_inflow(read_points(self.folder), self.history)
        mass = points["inflow_mass"].values
        after = np.minimum(np.searchsorted(mass, masses), len(mass) - 1)
        return points.isel(time=sorted({0, *after, *np.maximum(after - 1, 0)}))

    @cached_property
    def horizontal(self):
        """Profile through the gate, with inflow_mass (time)."""
        return postprocess.with_inflow(postprocess.profile(self.points, "horizontal"), self.history)

    @cached_property
    def vertical(self):
        """Profile through the gate, with inflow_mass (time)."""
        return postprocess.with_inflow(postprocess.profile(self.points, "vertical"), self.history)

    @cached_property
    def settlement(self):
        """Settlement of the surface (time, x) [m] at the snapshots of :attr:`points`, with inflow_mass (time)."""
        return self._settlement(self.points)

    def settled(self, mass: float) -> float:
        """Largest settlement of the surface at an inflow mass [m]."""
        return float(postprocess.at_inflow(self._settlement(self._points_around((mass,))), mass)["settlement"].max())

    def _settlement(self, points):
        # the layer must be thicker than the points' distance from the surface in the largest elements
        thick = max(1.0, 0.5 * self.scene.discretisation.element_size)
        settlement = postprocess.surface_settlement(points, spacing=thick, depth=thick).to_dataset()
        return postprocess.with_inflow(settlement, self.history)

    @cached_property
    def of_gate(self):
        """Pressures on the tunnel with the gate, over time, its first state the bonded one where that is known."""
        ours = on_tunnel(self.pressures)
        if self.at_rest is None:
            return ours
        first = on_tunnel(self.at_rest)
        ours = ours.copy(deep=True)
        for name in ("soil_pressure", "water_pressure", "soil_shear"):
            ours[name][{"time": 0}] = first[name].isel(time=0).values
        return ours

    def relieved(self, name: str) -> float:
        """Half of the sector around the gate, in one piece, with a pressure below half of the initial one [°]."""
        ratio = postprocess.pressure_ratio(self.of_gate, name, self.compared).values
        below = np.roll(ratio, -round(float(self.scene.gate.angle))) < 0.5
        return 0.5 * (int(np.argmin(below)) + int(np.argmin(below[::-1]))) if not below.all() else 180.0

    def states(self, ring=None):
        """Response of the beam-spring ring, or of another `ring`, at the initial state, 1000 and 2000 kg/m.

        (time), the number of the state; those that a run does not get to are not there.
        """
        import xarray as xr

        from coupling.responses.respond import respond

        ours = self.of_gate[["soil_pressure", "water_pressure", "soil_shear", "inflow_mass"]]
        parts = [ours.isel(time=0)]
        parts += [postprocess.at_inflow(ours, mass) for mass in (COMPARED, LAST) if mass <= self.reached]
        parts = [part.drop_vars(["time", "inflow_mass"]) for part in parts]
        pressures = xr.concat(parts, dim="time").assign_coords(time=("time", np.arange(len(parts)), {"units": "s"}))
        scene = self.scene if ring is None else self.scene.model_copy(update={"ring": ring})
        return respond(scene, pressures.assign_attrs(self.pressures.attrs))


def at_rest(scene, file: str | Path):
    """Pressures on all linings in the bonded initial state, computed once and kept in a file.

    Returns xarray.Dataset: soil_pressure, water_pressure, soil_shear (time, [tunnel,] theta) [Pa], one time.
    """
    import xarray as xr

    import mpm
    from coupling.datasets import write_dataset
    from coupling.files.replace import replaced

    file = Path(file)
    if not file.is_file():
        ground = scene.model_copy(update={"initial_contact": "bonded", "lining": "fixed"})
        solver = mpm.Solver(ground, mpm.build_mesh(ground))
        solver.relax()
        theta, parts = cell_centres(), []
        for lining in solver.lining_pressures(1.0):
            weights = cell_mean_weights(lining["theta"])
            parts.append(xr.Dataset({
                name: (("time", "theta"), (weights @ lining[name])[None], {"units": "Pa"})
                for name in ("soil_pressure", "water_pressure", "soil_shear")
            }))  # fmt: skip
        found = parts[0] if len(parts) == 1 else xr.concat(parts, dim="tunnel").transpose("time", "tunnel", "theta")
        found = found.assign_coords(time=("time", [0.0], {"units": "s"}), theta=("theta", theta, {"units": "degree"}))
        file.parent.mkdir(parents=True, exist_ok=True)
        with replaced(file) as beside:
            write_dataset(beside, found.assign_attrs(gate_tunnel=scene.gate.tunnel))
    return read_group(file, None)


def initial_theory(scene, tunnel):
    """Soil and water pressure that theory expects on an undisturbed circle in the scene's ground.

    Returns xarray.Dataset: soil_pressure sigma_v cos^2 + K0 sigma_v sin^2, water_pressure (theta) [Pa].
    """
    import xarray as xr

    from mpm.k0_procedure import initial_stress

    theta = cell_centres()
    angle = np.radians(theta)
    depth = tunnel.axis_depth - tunnel.outer_radius * np.cos(angle)
    vertical, water = initial_stress(scene, depth)
    k0 = scene.soils[0].lateral_pressure_coefficient(vertical)
    soil = vertical * (np.cos(angle) ** 2 + k0 * np.sin(angle) ** 2)
    return xr.Dataset({"soil_pressure": ("theta", soil), "water_pressure": ("theta", water)}, coords={"theta": theta})


def provenance(folder: str | Path) -> str:
    """Revision and machine that a run was made with."""
    attributes = read_attributes(folder)
    return f"revision {attributes['revision'] or 'unknown'} on {attributes['processor']}"
