"""What a solver says about the state that it is in: sums, balances, pressures, zones. Nothing here changes it."""

import numpy as np

from mpm.half_model import with_mirrored_points
from mpm.points import mass_inside
from mpm.variables import LEDGER, MASS, POINT_VARIABLES, VLX, VLY, VSX, VSY, X0, Y0, N, P, X, Y

#: Acceleration of a grain at the gate over gravity: what presses 20 m below ground, over a gate's width of 0.2 m.
STEEPEST = 100.0


class Measures:
    """The part of :class:`mpm.Solver` that only reads its arrays."""

    @property
    def n_points(self):
        """Number of material points, those taken out included."""
        return len(self.points)

    def nodal_sums(self):
        """What the points were last mapped to at the nodes: (n_nodes, 13) float64, columns `B_` of variables."""
        rows, n = self.sums.sum(axis=0), len(self.mesh.nodes)
        np.add.at(rows, self.levels.node_of_row[n:], rows[n:])
        return rows[:n]

    def memory_bytes(self):
        """Bytes held in the arrays of the solver."""
        arrays = [a for held in vars(self).values() for a in (held if isinstance(held, tuple) else (held,))]
        arrays += self._spectrum.arrays if self._spectrum is not None else []
        return sum(a.nbytes for a in arrays if isinstance(a, np.ndarray))

    def points_by_name(self):
        """Copy of the state of all points, one array a variable, with volume, displacement and soil number."""
        data = {name: self.points[:, k].copy() for k, (name, _, _) in enumerate(POINT_VARIABLES)}
        data["displacement_x"] = data["x"] - data.pop("x_initial")
        data["displacement_y"] = data["y"] - data.pop("y_initial")
        data["volume"] = self._volumes()
        data["soil"] = self.soil_of_point.copy()
        data["removed"] = self.element_of_point < 0
        return with_mirrored_points(data) if self.scene.is_half else data

    def _volumes(self):
        rho = np.array([s.grain_density for s in self.scene.soils])[self.soil_of_point]
        return self.points[:, MASS] / (rho * (1 - self.points[:, N]))

    def inflow_mass(self, within=0.0):
        """Grains inside the gate's tunnel, those taken out included [kg/m].

        within : float
            Grains that may come within this time [s] count as well.
        """
        if self.scene.gate is None:
            return 0.0
        tunnel = self.scene.tunnels[self.scene.gate.tunnel]
        inside = mass_inside(
            self.points, self.element_of_point, float(tunnel.x), -float(tunnel.axis_depth), float(tunnel.inner_radius),
            within, STEEPEST * self.scene.gravity,
        )  # fmt: skip
        return self.copies * (inside + self.removed_mass)

    def sums_over_points(self):
        """Momentum (x, y) [N s] and kinetic energy [J] of grains and water, mass of the water [kg], per metre.

        Points taken out are left out. Water is counted with its compression, or with what is missing of it.
        """
        rows = self.points[self.element_of_point >= 0]
        mass = rows[:, MASS]
        # sums, no dot products: those of BLAS depend on its number of threads in the last bits
        momentum = np.array([np.sum(mass * rows[:, VSX]), np.sum(mass * rows[:, VSY])])
        kinetic = 0.5 * float(np.sum(mass * (rows[:, VSX] ** 2 + rows[:, VSY] ** 2)))
        water = 0.0
        if self.scene.water is not None:
            volume = self._volumes()[self.element_of_point >= 0]
            wet = self._water_density * rows[:, N] * volume
            momentum += np.array([np.sum(wet * rows[:, VLX]), np.sum(wet * rows[:, VLY])])
            kinetic += 0.5 * float(np.sum(wet * (rows[:, VLX] ** 2 + rows[:, VLY] ** 2)))
            water = float(wet.sum())
            if self._water_modulus > 0:
                water += float(np.sum(wet * rows[:, P])) / self._water_modulus
        return {"momentum": momentum, "kinetic": kinetic, "water": water}

    def balances(self):
        """How far the state of the points is from what was done to them, as a dict of floats.

        Returns
        -------
        dict
            momentum_error [-]: departure of the points' momentum from what the nodes received, over the impulse of
            gravity; water_mass_error [-]: change of the water's mass over the initial; work_gravity, work_stress,
            work_drag, kinetic_energy_change, transfer_loss [J/m]: energies since the start, the last what the way from
            points to nodes and back (PIC, MUSL) took; contact_error [-]: change of the momentum at the lining that the
            recorded reactions do not explain, over their sum; largest_courant [-]: time step over the critical one of
            the state it led to.

        With a sink momentum, energy and water leave with the points taken out, and count as errors.
        """
        ledger, now = dict(zip(LEDGER, self.ledger.sum(axis=0).tolist(), strict=True)), self.sums_over_points()
        received = np.array([ledger["momentum_x"], ledger["momentum_y"]])
        departure = np.abs(now["momentum"] - self.initial["momentum"] - received)
        if self.scene.is_half:
            departure = departure[1:]  # horizontal momentum comes from the mirror image, which takes as much
        departure = float(departure.max())
        weight = self.scene.gravity * (self.initial_grain_mass + self.initial["water"]) * self.time
        change = now["kinetic"] - self.initial["kinetic"]
        water = self.initial["water"]
        return {
            "momentum_error": departure / weight if weight > 0 else 0.0,
            "water_mass_error": now["water"] / water - 1 if water > 0 else 0.0,
            "work_gravity": self.copies * ledger["gravity"],
            "work_stress": self.copies * ledger["stress"],
            "work_drag": self.copies * ledger["drag"],
            "kinetic_energy_change": self.copies * change,
            "transfer_loss": self.copies * (ledger["kinetic"] - change),
            "contact_error": ledger["unexplained"] / ledger["reactions"] if ledger["reactions"] > 0 else 0.0,
            "largest_courant": self.largest_courant,
        }

    def measures(self):
        """Zones, balances and extremes of the state at hand, as a dict of floats."""
        moved = np.hypot(self.points[:, X] - self.points[:, X0], self.points[:, Y] - self.points[:, Y0])
        flow = moved > 0.05
        mass = self.points[:, MASS]
        speed2 = self.points[:, VSX] ** 2 + self.points[:, VSY] ** 2
        active = self.element_of_point >= 0
        return {
            "inflow_mass": self.inflow_mass(),
            "flow_zone_area": self.copies * float(np.sum(self.initial_volume[flow])),
            "disturbed_area": self.copies * float(np.sum(self.initial_volume[(moved > 0.01) & ~flow])),
            "grain_mass": self.copies * float(np.sum(mass)),
            "suspended_fraction": float(self.suspended) / max(self.n_active, 1),
            "kinetic_energy": self.copies * float(0.5 * np.sum((mass * speed2)[active])),
            "max_velocity": float(np.sqrt(speed2[active].max(initial=0.0))),
        }

    def lining_pressures(self, duration):
        """Mean pressures on every tunnel's lining since the impulses were last cleared [Pa].

        Parameters
        ----------
        duration : float
            Time over which impulses were summed [s]; 1.0 after `relax`.
        """
        result = []
        for part in self.lining:
            impulse = self.impulse[part.rows] * part.factors / duration
            bears = part.bears if self.gate_open else np.ones(len(part.arc), bool)
            arc = part.arc
            mean_s, mean_l, shear = (np.where(bears, impulse[:, k] / arc, 0.0) for k in range(3))
            spread = [
                np.where(bears, np.sqrt(np.maximum(impulse[:, k + 3] / arc**2 - mean**2, 0.0)), 0.0)
                for k, mean in ((0, mean_s), (1, mean_l))
            ]
            result.append(
                {
                    "theta": part.theta,
                    "arc": arc,
                    "soil_pressure": mean_s,
                    "water_pressure": mean_l,
                    "soil_shear": -shear,
                    "soil_pressure_std": spread[0],
                    "water_pressure_std": spread[1],
                }
            )
            if self.moving is not None:
                result[-1] |= self.moving.motion_at(len(result) - 1, part.theta)
        return result
