"""What all lining models of finite elements share: loads, equilibrium, balances, movements and the response.

A model makes matrices of its ring once (:class:`structure.nodal_forces.RingParts`), says how forces and displacements
are read from its unknowns (:class:`Readings`) and what tractions on its outer face do; the rest is here.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy import sparse
from threadpoolctl import threadpool_limits

from structure.balance import borne, even_loads, without_unborne
from structure.lining import THETA, LiningFailure, LiningModel, origin, response_dataset
from structure.newton import NoEquilibrium, RingEquilibrium
from structure.nodal_forces import RingForces, RingParts
from structure.pressures import check_pressures
from structure.response import BOLT_FORCE, FORCES, RESPONSE, described
from structure.ring import Ring
from structure.staggered import coupling_springs, paired

#: Both sides of an angle [rad]: at a joint the mean of the two is given.
SIDES = (-1e-9, 1e-9)
#: Matrices are so small that threads only wait for each other: on a busy machine two cost 200 times one's time.
one_thread = threadpool_limits.wrap(limits=1, user_api="blas")


class Readings(NamedTuple):
    """How a response is read from n unknowns, at the angles :data:`structure.lining.THETA`.

    forces : N, Q and M, (n_theta, n) sparse each.
    movement : radial and tangential displacement, (n_theta, n) sparse each.
    quarters : (4, n) sparse, radial displacement at crown, right waist, invert and left waist.
    spring_angle : (n_springs/2,) float64, where the soil springs are [rad].
    lined : (n_theta,) float64, share of the tunnel's length that is lined; where there is no lining, forces and
        displacements are NaN.
    near_force : (n_theta,) bool, next to forces that are concentrated: there Q is no slope of M.
    weight_offset : distance of the weight from the centre line, outward [m].
    bolt_shares : N, Q and M, (n_theta, n_joints) each, from the pull of bolts that are no part of the segments.
    """

    forces: tuple[sparse.csr_array, sparse.csr_array, sparse.csr_array]
    movement: tuple[sparse.csr_array, sparse.csr_array]
    quarters: sparse.csr_array
    spring_angle: np.ndarray
    lined: np.ndarray = np.ones(len(THETA))
    near_force: np.ndarray = np.zeros(len(THETA), dtype=bool)
    weight_offset: float = 0.0
    bolt_shares: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None


class States(NamedTuple):
    """Equilibrium at every time: loads on the unknowns, displacements (n_times, n), slips of the joints, or of
    points of their faces, before (n_times, law.count), reactions of the soil springs (n_times, n_springs); balanced
    uplift, unborne share (n_times,).
    """

    loads: np.ndarray
    displacements: np.ndarray
    slips: np.ndarray
    reactions: np.ndarray
    balanced: np.ndarray
    unborne: np.ndarray


class DiscreteLining(LiningModel):
    """A lining model of finite elements, in equilibrium with its loads by Newton's method.

    Parameters
    ----------
    ring : Ring
    parts : RingParts
    readings : Readings
    beside : DiscreteLining, optional
        The ring beside, alone, where the ring has a neighbour: both are solved as one.

    Notes
    -----
    Soil springs start unstressed at the undeformed ring: the pressures given are what the soil exerts there, and the
    springs add what the ring's displacement mobilises.
    """

    def __init__(self, ring: Ring, parts: RingParts, readings: Readings, beside: DiscreteLining | None = None):
        self.ring, self.parts, self.readings, self.beside = ring, parts, readings, beside
        self._forces = self._equilibrium = RingEquilibrium(ring, parts if beside is None else self._with(beside))
        if beside is not None:
            self._forces = RingForces(ring, parts)
        fine = np.radians(np.arange(0, 360, 0.5))
        self._uplift, self._even = even_loads(fine, *self._all_tractions(fine), self._equilibrium.parts.rigid)

    def _with(self, beside):
        """This ring and the one beside it, coupled."""
        pairs = zip(self.readings.movement, beside.readings.movement, strict=True)
        apart = sparse.vstack([sparse.hstack([own, -other]) for own, other in pairs]).tocsr()
        lined = self.readings.lined * beside.readings.lined
        springs = coupling_springs(self.ring.neighbour, self.ring.centre_radius, lined)
        return paired(self.parts, beside.parts, apart, np.concatenate(springs), self.ring.support == "invert")

    def _all_tractions(self, theta):
        own = self.tractions(theta)
        if self.beside is None:
            return own
        pairs = zip(own, self.beside.tractions(theta), strict=True)
        return tuple(sparse.vstack(pair).tocsr() for pair in pairs)

    @abstractmethod
    def tractions(self, theta: np.ndarray) -> tuple[sparse.csr_array, sparse.csr_array]:
        """Loads of a pressure and of a clockwise shear on the outer face, (n, n_theta) per Pa, from angles [rad]."""

    @property
    def iterations(self) -> list[int]:
        """Newton's iterations at every time of the last response."""
        return self._equilibrium.iterations

    @property
    def residuals(self) -> list[float]:
        """Largest out-of-balance force of every iteration at the last time [N/m]."""
        return self._equilibrium.residuals

    @one_thread
    def respond(self, pressures: xr.Dataset) -> xr.Dataset:
        checked = check_pressures(pressures, self.ring)
        both = self._solve_all(checked)
        states = self._own(both)
        fields = {"balanced_uplift": states.balanced, "unborne_resultant": states.unborne}
        fields |= {name: self._where_lined(force) for name, force in self._section_forces(states.displacements)}
        fields |= self.joint_fields(states.displacements, states.slips)
        if "joint_bolt_force" in fields:
            fields["joint_bolt_force"] = ("time", "joint"), fields["joint_bolt_force"], BOLT_FORCE
        fields |= self._balances(both)
        fields["shear_moment_residual"] = self._shear_moment_residual(fields, states, checked)
        fields |= self._movements(states.displacements)
        if self.beside is not None:
            fields |= self._of_the_neighbour(both.displacements)
        return response_dataset(self.ring, checked, fields, self.name, self.details())

    def _section_forces(self, displacements):
        forces = [(part @ displacements.T).T for part in self.readings.forces]
        if self.readings.bolt_shares is not None:
            pull, _ = self._forces.bolt_forces(displacements)
            forces = [force + pull @ share.T for force, share in zip(forces, self.readings.bolt_shares, strict=True)]
        return zip(FORCES, forces, strict=True)

    def _of_the_neighbour(self, displacements):
        """Forces in the ring beside, and those that one circumferential joint passes on."""
        size, neighbour = len(self.parts.arm), self.ring.neighbour
        own, other = displacements[:, :size], displacements[:, size:]
        fields = {}
        for name, force in self.beside._section_forces(other):
            _, units, long_name = RESPONSE[name]
            fields[f"neighbour_{name}"] = force, units, f"{long_name}, of the ring beside"
        stiffnesses = neighbour.radial_stiffness, neighbour.tangential_stiffness
        rows = zip(
            ("radial", "tangential"), stiffnesses, self.readings.movement, self.beside.readings.movement, strict=True
        )
        for way, stiffness, here, there in rows:
            passed = stiffness * ((here @ own.T).T - (there @ other.T).T)
            about = f"{way} force on the ring beside per metre of a circumferential joint"
            fields[f"circumferential_{way}_force"] = passed, "N/m", about
        return described(("time", "theta"), fields)

    @one_thread
    def contact_field(self, pressures: xr.Dataset) -> xr.Dataset:
        """What the faces of the joints exert on each other where ``ring.joint_contact`` is "face".

        Parameters
        ----------
        pressures : xarray.Dataset
            As for `respond`.

        Returns
        -------
        xarray.Dataset
            contact_pressure, contact_shear [Pa] and contact_gap [m] (time, contact_point), and of every point its joint
            and its place outward from the centre line, `lever` [m].
        """
        if self.ring.joint_contact != "face":
            raise ValueError("contact_field: joint_contact of the ring must be 'face', got 'section'; set it")
        checked, points = check_pressures(pressures, self.ring), self.parts.law.points
        states = self.solve(checked)
        forces = self._forces.joint_forces(states.displacements, states.slips)
        gap = self._forces.moved(states.displacements)[..., 0]
        fields = {
            "contact_pressure": (forces.axial / points.length, "Pa", "pressure between the faces of a joint"),
            "contact_shear": (forces.shear / points.length, "Pa", "shear between the faces of a joint, as of Q"),
            "contact_gap": (gap, "m", "gap between the faces of a joint, overlap of the springs negative"),
        }
        places = {
            "joint": (points.joint + 1, "1", "joint number, clockwise from the crown"),
            "lever": (points.lever, "m", "distance outward from the centre line"),
        }
        return xr.Dataset(
            described(("time", "contact_point"), fields),
            described("contact_point", places) | {"time": checked["time"]},
            {"title": f"contact in the joints: {self.name} model"} | origin(self.ring, self.name) | self.details(),
        )

    def details(self) -> dict[str, str | float]:
        """Attributes of a response that only this model has."""
        return {}

    def loads(self, checked: xr.Dataset) -> np.ndarray:
        """Loads on the unknowns of checked pressures and of the concrete's weight, (n_times, n)."""
        by_pressure, by_shear = self._all_tractions(np.radians(checked["theta"].values.astype(float)))
        pressure = (checked["soil_pressure"] + checked["water_pressure"]).values.astype(float)
        shear = checked["soil_shear"].values.astype(float)
        return (by_pressure @ pressure.T + by_shear @ shear.T).T + self._equilibrium.parts.weight

    def solve(self, checked: xr.Dataset) -> States:
        """Equilibrium with checked pressures, one time after the other; raises as :meth:`respond` does."""
        return self._own(self._solve_all(checked))

    def _own(self, states):
        """States of this ring alone."""
        if self.beside is None:
            return states
        size, count, springs = len(self.parts.arm), self.parts.law.count, len(self.parts.area) // 2
        return States(
            states.loads[:, :size], states.displacements[:, :size], states.slips[:, :count],
            np.hstack([half[:, :springs] for half in np.split(states.reactions, 2, axis=1)]),
            states.balanced / 2, states.unborne,
        )  # fmt: skip

    def _solve_all(self, checked):
        """States of this ring and of the one beside it."""
        times, loads, rigid = checked["time"].values, self.loads(checked), self._equilibrium.parts.rigid
        balanced = np.zeros(len(loads))
        if self.ring.balance_uplift:
            balanced = loads @ rigid[1]
            loads = loads - balanced[:, None] * self._uplift
        magnitude = self._equilibrium.sizes(loads).sum(axis=1)
        loads, unborne = without_unborne(self.ring, loads, rigid @ loads.T, magnitude, self._even, times)
        found, equilibrium = [], self._equilibrium
        equilibrium.iterations.clear()
        moved, before, slip = np.zeros(loads.shape[1]), np.zeros(loads.shape[1]), equilibrium.unslipped
        for time, load in zip(times, loads, strict=True):
            try:
                moved, slip = equilibrium.follow(load, moved, slip, before)
            except NoEquilibrium as problem:
                right, up, _ = rigid @ load
                raise LiningFailure(
                    f"ring: no equilibrium at time {time:g} s (loads sum to {right:.4g} N/m to the right,"
                    f" {up:.4g} N/m up): {problem}",
                    float(time),
                ) from problem
            found.append((moved, slip, equilibrium.reactions(moved)[0]))
            before = load
            if equilibrium.joints.remembers:
                slip = equilibrium.joint_forces(moved, slip).slip
        return States(loads, *(np.stack(kind) for kind in zip(*found, strict=True)), balanced, unborne)

    def _where_lined(self, values):
        values[:, self.readings.lined == 0] = np.nan
        return values

    def joint_fields(self, displacements: np.ndarray, slips: np.ndarray) -> dict[str, np.ndarray]:
        """Movements of and forces in the joints, (n_times, n_joints) each; of the bolts where there are any.

        displacements, slips : as of :class:`States`.
        """
        equilibrium, parts = self._forces, self.parts
        opening, dislocation, rotation = np.moveaxis(equilibrium.jumps(displacements), -1, 0)
        forces = equilibrium.joint_forces(displacements, slips)
        if self.ring.joint_contact == "section":
            axial, shear, moment = forces.axial, forces.shear, forces.moment
        else:
            points = parts.law.points
            of_joint = sparse.coo_array((np.ones(len(points.joint)), (np.arange(len(points.joint)), points.joint)))
            axial, shear, moment = (
                each @ of_joint for each in (forces.axial, forces.shear, -forces.axial * points.lever)
            )
        fields = {}
        if self.ring.bolts:
            pull, _ = equilibrium.bolt_forces(displacements)
            fields["joint_bolt_force"] = pull
            axial = axial - pull
            moment = moment + np.array([bolts.offset for bolts in self.ring.bolts]) * pull
        return fields | {
            "joint_opening": opening,
            "joint_dislocation": dislocation,
            "joint_rotation": rotation,
            "joint_axial_force": axial,
            "joint_shear_force": shear,
            "joint_bending_moment": moment,
        }

    def _balances(self, states):
        equilibrium, loads = self._equilibrium, states.loads
        rigid, held = equilibrium.parts.rigid / (1 if self.beside is None else 2), equilibrium.parts.held
        pairs = zip(states.displacements, states.slips, strict=True)
        internal = np.stack([equilibrium.internal_forces(*pair)[0] for pair in pairs])
        reactions = equilibrium.spring_forces(states.reactions)
        reactions[:, held] += (internal - loads - reactions)[:, held]
        load_sum, reaction_sum = rigid @ loads.T, rigid @ reactions.T
        gap = np.maximum(np.abs(load_sum + reaction_sum).max(0), np.abs(loads + reactions - internal).max(1))
        return {
            "load_sum_horizontal": load_sum[0],
            "load_sum_vertical": load_sum[1],
            "spring_sum_horizontal": reaction_sum[0],
            "spring_sum_vertical": reaction_sum[1],
            "equilibrium_residual": gap / np.maximum(equilibrium.sizes(loads).sum(axis=1), 1e-300),
        }

    def _shear_moment_residual(self, fields, states, checked):
        """Largest |Q + dM/ds + couple| between neighbouring angles, from the reported forces.

        The couple per arc of the centre line is what shear and tangential soil springs on the outer face bring, and
        the weight where its centre lies outside the centre line.
        """
        ring, read, span = self.ring, self.readings, 2 * np.pi / len(THETA)
        middle = np.radians(THETA) + span / 2
        force, moment = fields["shear_force"], fields["bending_moment"]
        slope = (np.roll(moment, -1, axis=1) - moment) / (ring.centre_radius * span)
        sources = [(np.radians(checked["theta"].values.astype(float)), checked["soil_shear"].values)]
        if ring.ground is not None and ring.ground.slip_at == "outer_face":
            angle, same = np.unique(np.round(read.spring_angle % (2 * np.pi), 9), return_inverse=True)
            slipping = np.split(states.reactions, 2, axis=1)[1]
            # Both sides of a joint at its place, half each.
            sources.append((angle, [-np.bincount(same, row) / np.bincount(same) for row in slipping]))
        traction = sum(
            np.stack([np.interp(middle, angle, row, period=2 * np.pi) for row in rows]) for angle, rows in sources
        )
        couple = ring.thickness / 2 * ring.outer_radius / ring.centre_radius * traction
        couple *= (read.lined + np.roll(read.lined, -1)) / 2
        couple += ring.concrete_unit_weight * ring.thickness * read.weight_offset * np.sin(middle)
        gap = np.abs((force + np.roll(force, -1, axis=1)) / 2 + slope + couple)
        gap[:, read.near_force] = 0
        if ring.support == "invert":
            gap[:, np.abs(middle - np.pi) < 2 * span] = 0
        return np.nanmax(gap, axis=1)

    def _movements(self, displacements):
        """Displacements at the angles of the response, change of the diameters, settlement.

        A ring has no place of its own where nothing holds it: that mean movement is taken out.
        """
        rigid, mean = self.parts.rigid, self.parts.mean
        moved = displacements @ mean[:2].T
        sideways, _, turning = borne(self.ring)
        if not sideways:
            displacements = displacements - moved @ rigid[:2]
            moved = np.zeros_like(moved)
        if not turning:
            displacements = displacements - np.outer(displacements @ mean[2], rigid[2])
        outward, along = ((part @ displacements.T).T for part in self.readings.movement)
        crown, right_waist, invert, left_waist = self.readings.quarters @ displacements.T
        return {
            "displacement_radial": self._where_lined(outward),
            "displacement_tangential": self._where_lined(along),
            "convergence_horizontal": -(right_waist + left_waist),
            "convergence_vertical": -(crown + invert),
            "settlement": -moved[:, 1],
        }
