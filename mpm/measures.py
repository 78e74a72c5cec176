"""What a solver says about the state that it is in: sums, balances, pressures, zones. Nothing here changes it."""

import numpy as np

from mpm.fields import WHOLE_DEGREES, numbers
from mpm.mesh.half import with_mirrored_points
from mpm.points import mass_inside

#: Displacement beyond which a point belongs to the flow zone, and to the disturbed zone [m].
FLOWS, DISTURBED = 0.05, 0.01
#: What sums of a cell may be off by, over its area, and rotated stresses, over stress and shear modulus [-].
ROUNDING = 1e-9

#: Acceleration of a grain at the gate over gravity: what presses 20 m below ground, over a gate's width of 0.2 m.
STEEPEST = 100.0


class Measures:
    """The part of :class:`mpm.Solver` that only reads its arrays."""

    @property
    def n_points(self):
        """Number of material points, those taken out included."""
        return len(self.points)

    def nodal_sums(self):
        """What the points were last mapped to at the nodes: (n_nodes,) records of `mpm.fields.NODAL_SUM`."""
        rows, n = numbers(self.sums).sum(axis=0), len(self.mesh.nodes)
        np.add.at(rows, self.levels.node_of_row[n:], rows[n:])
        return rows[:n].view(self.sums.dtype)[:, 0]

    def memory_bytes(self):
        """Bytes held in the arrays of the solver."""
        arrays = [a for held in vars(self).values() for a in (held if isinstance(held, tuple) else (held,))]
        arrays += self._spectrum.arrays if self._spectrum is not None else []
        return sum(a.nbytes for a in arrays if isinstance(a, np.ndarray))

    def points_by_name(self):
        """Copy of the state of all points, one array a variable, with volume, displacement and soil number."""
        data = {name: self.points[name].copy() for name in self.points.dtype.names}
        data["displacement_x"] = data["x"] - data.pop("x_initial")
        data["displacement_y"] = data["y"] - data.pop("y_initial")
        data["volume"] = self._volumes()
        data["soil"] = self.soil_of_point.copy()
        data["removed"] = self.element_of_point < 0
        return with_mirrored_points(data) if self.scene.is_half else data

    def _volumes(self):
        rho = np.array([s.grain_density for s in self.scene.soils])[self.soil_of_point]
        return self.points["grain_mass"] / (rho * (1 - self.points["porosity"]))

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

        Points taken out count with what they left with. Water is counted with its compression, or with what is missing
        of it.
        """
        rows, wet = self.points, self._pore_water()
        mass = rows["grain_mass"]
        # sums, no dot products: those of BLAS depend on its number of threads in the last bits
        momentum = [
            np.sum(mass * rows[f"velocity_solid_{axis}"] + wet * rows[f"velocity_liquid_{axis}"]) for axis in "xy"
        ]
        return {
            "momentum": np.array(momentum),
            "kinetic": float(np.sum(self._kinetic_energies(wet))),
            "water": float(np.sum(self._held_water(wet))),
        }

    def _pore_water(self):
        """Water that fills the pores of every point at zero pressure [kg/m]; zero in a dry scene."""
        return self._water_density * self.points["porosity"] * self._volumes()

    def _held_water(self, wet):
        """The same with what its pressure has squeezed in, or without what is missing."""
        return wet * (1 + self.points["pore_pressure"] / self._water_modulus) if self._water_modulus > 0 else wet

    def _kinetic_energies(self, wet):
        return 0.5 * (self.points["grain_mass"] * self.speeds("solid") ** 2 + wet * self.speeds("liquid") ** 2)

    def speeds(self, phase):
        """Speed of a phase, "solid" or "liquid", of every point [m/s]."""
        return np.hypot(self.points[f"velocity_{phase}_x"], self.points[f"velocity_{phase}_y"])

    def _moved(self):
        """Displacement of every point [m]."""
        return np.hypot(*(self.points[axis] - self.points[f"{axis}_initial"] for axis in "xy"))

    def balances(self):
        """How far the state of the points is from what was done to them, as a dict of floats.

        Returns
        -------
        dict
            momentum_departure [N s/m]: what the points' momentum differs by from what the nodes received, the larger
            component; water_missing [kg/m]: water at the start, and what came through the sides, less that now;
            work_gravity, work_stress, work_drag, kinetic_energy_change, transfer_loss [J/m]: energies since the start,
            the last what the way from points to nodes and back (PIC, MUSL) took; contact_error [-]: change of the
            momentum at the lining that the recorded reactions do not explain, over their sum; largest_courant [-]: time
            step over the critical one of the state it led to; and the `flow_amounts` that these are compared with.
        """
        ledger = {name: float(self.ledger[name].sum()) for name in self.ledger.dtype.names}
        now = self.sums_over_points()
        received = np.array([ledger["momentum_x"], ledger["momentum_y"]])
        departure = np.abs(now["momentum"] - self.initial["momentum"] - received)
        if self.scene.is_half:
            departure = departure[1:]  # horizontal momentum comes from the mirror image, which takes as much
        change = now["kinetic"] - self.initial["kinetic"]
        return {
            "momentum_departure": self.copies * float(departure.max()),
            "water_missing": self.copies * (self.initial["water"] + ledger["recharge"] - now["water"]),
            "work_gravity": self.copies * ledger["gravity"],
            "work_stress": self.copies * ledger["stress"],
            "work_drag": self.copies * ledger["drag"],
            "kinetic_energy_change": self.copies * change,
            "transfer_loss": self.copies * (ledger["kinetic"] - change),
            "contact_error": ledger["unexplained"] / ledger["reactions"] if ledger["reactions"] > 0 else 0.0,
            "largest_courant": self.largest_courant,
            **self.flow_amounts(),
        }

    def flow_amounts(self):
        """What flows, and what of the material stands where there is no room, as a dict of floats.

        Returns
        -------
        dict
            flow_momentum [N s/m]: sum of the sizes of the momenta of grains and water, and flow_water [kg/m], of the
            points of the flow zone, those taken out included; moving_energy [J/m]: kinetic energy of all points, and
            what the fall from the gate gave those that came through, who lose it where they land; water_inflow
            [kg/m]: water that came through the outer face of the gate, that taken out included; material_volume,
            flow_volume [m2]: volume of all points in the mesh, and of those of the flow zone; overlap_volume,
            flow_overlap_volume [m2]: what the cells hold beyond their area, of all points and of those of the flow
            zone, which takes part in it by its share of the cell.
        """
        wet, volume, flows = self._pore_water(), self._volumes(), self._moved() > FLOWS
        held, element = self._held_water(wet), self.element_of_point
        momenta = self.points["grain_mass"] * self.speeds("solid") + wet * self.speeds("liquid")
        past = self._past_the_gate()
        inside, flows_inside = element >= 0, flows & (element >= 0)
        cell = element // 4
        area = self.geometry["area"].reshape(-1, 4).sum(axis=1)
        in_cell, flowing = (np.bincount(cell[k], volume[k], len(area)) for k in (inside, flows_inside))
        beyond = np.maximum(in_cell - area, 0.0)
        beyond[beyond < ROUNDING * area] = 0.0
        flow_beyond = beyond * np.divide(flowing, in_cell, out=np.zeros_like(area), where=in_cell > 0)
        amounts = {
            "flow_momentum": momenta[flows].sum(),
            "moving_energy": self._kinetic_energies(wet).sum() + self._energy_of_the_fall(past, wet),
            "flow_water": held[flows].sum(),
            "water_inflow": held[past].sum(),
            "material_volume": in_cell.sum(),
            "flow_volume": flowing.sum(),
            "overlap_volume": beyond.sum(),
            "flow_overlap_volume": flow_beyond.sum(),
        }
        return {name: self.copies * float(amount) for name, amount in amounts.items()}

    def _energy_of_the_fall(self, past, wet):
        """What gravity has done on grains and water below the gate, of points past it [J/m]."""
        if self.scene.gate is None:
            return 0.0
        tunnel = self.scene.tunnels[self.scene.gate.tunnel]
        gate = tunnel.outer_radius * np.cos(np.radians(self.scene.gate.angle)) - tunnel.axis_depth
        fall = np.maximum(gate - self.points["y"][past], 0.0)
        return np.sum((self.points["grain_mass"][past] + wet[past]) * fall) * self.scene.gravity

    def _past_the_gate(self):
        """Whether a point is inside the outer face of the gate's tunnel, or was taken out there."""
        if self.scene.gate is None:
            return np.zeros(self.n_points, bool)
        tunnel = self.scene.tunnels[self.scene.gate.tunnel]
        away = np.hypot(self.points["x"] - tunnel.x, self.points["y"] + tunnel.axis_depth)
        return (away < tunnel.outer_radius) | (self.element_of_point < 0)

    def tip_fraction(self):
        """Share of the points at the tip of the Mohr-Coulomb cone, or at the tensile strength that cuts it off [-].

        Their grains touch without being pressed together: they bear no more tension than the soil has strength.
        """
        soil, rows = self.soils[self.soil_of_point], self.points
        xx, yy, zz, xy = (rows[f"stress_{name}"] for name in ("xx", "yy", "zz", "xy"))
        centre, radius = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
        largest = np.maximum(centre + radius, zz)
        size = np.abs(centre) + radius + np.abs(zz)
        size += soil["shear"] if "shear" in soil.dtype.names else 0.0
        at_tip = (largest >= soil["tension"] - ROUNDING * size) & (rows["porosity"] < soil["loose_porosity"])
        at_tip &= np.isfinite(soil["tension"]) & (self.element_of_point >= 0)
        return float(np.count_nonzero(at_tip)) / max(self.n_active, 1)

    def measures(self):
        """Zones, balances and extremes of the state at hand, as a dict of floats."""
        moved = self._moved()
        flow = moved > FLOWS
        mass, speed = self.points["grain_mass"], self.speeds("solid")
        active = self.element_of_point >= 0
        return {
            "inflow_mass": self.inflow_mass(),
            "flow_zone_area": self.copies * float(np.sum(self.initial_volume[flow])),
            "disturbed_area": self.copies * float(np.sum(self.initial_volume[(moved > DISTURBED) & ~flow])),
            "grain_mass": self.copies * float(np.sum(mass)),
            "suspended_fraction": float(self.suspended) / max(self.n_active, 1),
            "tip_fraction": self.tip_fraction(),
            "kinetic_energy": self.copies * float(0.5 * np.sum((mass * speed**2)[active])),
            "max_velocity": float(speed[active].max(initial=0.0)),
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
            impulse = numbers(self.impulse)[part.rows] * part.factors / duration
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
                result[-1] |= self.moving.motion_at(len(result) - 1, WHOLE_DEGREES)
        return result
