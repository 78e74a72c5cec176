"""A ring of beams, joint and soil springs, loaded on its outer face (load-structure model, Xie et al., Eq. 9)."""

from __future__ import annotations

import numpy as np
import xarray as xr

from structure.balance import borne, even_loads, without_unborne
from structure.beam_geometry import (
    RingMesh,
    displacements_at,
    element_matrices,
    forces_at,
    joint_matrices,
    self_weight,
    traction_operator,
)
from structure.equilibrium import NoEquilibrium, RingEquilibrium
from structure.lining import (
    SIDES,
    THETA,
    LiningFailure,
    LiningModel,
    check_pressures,
    response_dataset,
    ring_attributes,
)
from structure.ring import Ring, check_ring
from structure.springs import joint_spring


class BeamSpringLining(LiningModel):
    """Straight Timoshenko beams on the centre line, zero-thickness joints, soil springs on the outer face.

    Parameters
    ----------
    ring : Ring

    Notes
    -----
    Forces are taken at the middle of every element, where the chord is parallel to the circle, and are linear between
    the middles. Displacements on a joint are the mean of its two sides. Soil springs start unstressed at the undeformed
    ring: the pressures given are what the soil exerts there, and the springs add what the ring's displacement
    mobilises.
    """

    def __init__(self, ring: Ring):
        check_ring(ring)
        self.ring = ring
        self.mesh = RingMesh(ring)
        self._invert = int(np.argmin(np.abs((self.mesh.node_angle % (2 * np.pi)) - np.pi)))
        held = np.zeros(0, dtype=int) if ring.ground is not None else 3 * self._invert + np.arange(3)
        self._equilibrium = RingEquilibrium(ring, self.mesh, held)
        self._element_forces = element_matrices(ring, self.mesh)[0]
        self._forces_at = forces_at(self.mesh, np.radians(THETA))
        sides = [displacements_at(self.mesh, np.radians(THETA) + side) for side in SIDES]
        self._movement = tuple((one + other) / 2 for one, other in zip(*sides, strict=True))
        self._weight = self_weight(ring, self.mesh)
        self._joint_jumps = joint_matrices(ring)[0]
        fine = np.radians(np.arange(0, 360, 0.5))
        self._uplift, self._even = even_loads(fine, *traction_operator(ring, self.mesh, fine), self._resultant)

    def respond(self, pressures: xr.Dataset) -> xr.Dataset:
        ordered = check_pressures(pressures, self.ring)
        theta = np.radians(ordered["theta"].values.astype(float))
        times = ordered["time"].values
        shear = ordered["soil_shear"].values.astype(float)
        loads, balanced = self._loads(theta, ordered["soil_pressure"] + ordered["water_pressure"], shear)
        loads, unborne = without_unborne(
            self.ring, loads, self._resultant(loads), self._magnitude(loads), self._even, times
        )
        displacements, slips = self._displacements(loads, times)
        springs = np.stack([self._equilibrium.spring_forces(row)[0].ravel() for row in displacements])
        fields = {"balanced_uplift": balanced, "unborne_resultant": unborne}
        of_elements = self._internal_forces(displacements)
        fields |= {name: (self._forces_at @ values.T).T for name, values in of_elements.items()}
        fields |= self._joints(displacements, slips)
        fields |= self._balances(displacements, slips, loads, springs)
        fields["shear_moment_residual"] = self._shear_moment_residual(of_elements, theta, shear, springs)
        fields |= self._movements(displacements)
        return response_dataset(self.ring, ordered, fields, ring_attributes(self.ring, "beam-spring"))

    def _loads(self, theta, pressure, shear):
        """Nodal forces of pressures and weight at every time, and the uplift balanced among them."""
        by_pressure, by_shear = traction_operator(self.ring, self.mesh, theta)
        loads = (by_pressure @ pressure.values.T.astype(float) + by_shear @ shear.T).T + self._weight
        balanced = np.zeros(len(loads))
        if self.ring.balance_uplift:
            balanced = self._resultant(loads)[1]
            loads = loads - balanced[:, None] * self._uplift
        return loads, balanced

    def _resultant(self, forces: np.ndarray) -> np.ndarray:
        """Sums to the right and up, and clockwise couple about the axis over the radius, (3, ...) [N/m]."""
        nodal = forces.reshape(*forces.shape[:-1], -1, 3)
        sine, cosine = np.sin(self.mesh.node_angle), np.cos(self.mesh.node_angle)
        radial, tangential, couple = nodal[..., 0], nodal[..., 1], nodal[..., 2]
        return np.stack(
            [
                (radial * sine + tangential * cosine).sum(-1),
                (radial * cosine - tangential * sine).sum(-1),
                (tangential + couple / self.ring.centre_radius).sum(-1),
            ]
        )

    def _magnitude(self, forces: np.ndarray) -> np.ndarray:
        nodal = forces.reshape(*forces.shape[:-1], -1, 3)
        return np.hypot(nodal[..., 0], nodal[..., 1]).sum(-1)

    def _displacements(self, loads, times):
        """Displacements, and the slips of the joints from which each was reached, in the order of the records."""
        equilibrium = self._equilibrium
        remembers = equilibrium.joints.remembers
        displacements = np.zeros_like(loads)
        slips = np.zeros((len(loads), len(self.ring.joint_angles)))
        start, before, slip = np.zeros(loads.shape[1]), np.zeros(loads.shape[1]), equilibrium.unslipped
        for index, load in enumerate(loads):
            try:
                start, slip = equilibrium.follow(load, start, slip, before)
            except NoEquilibrium as problem:
                horizontal, vertical, _ = self._resultant(load)
                raise LiningFailure(
                    f"ring: no equilibrium at time {times[index]:g} s (loads sum to {horizontal:.4g} N/m to the right,"
                    f" {vertical:.4g} N/m up): {problem}",
                    float(times[index]),
                ) from problem
            displacements[index], slips[index], before = start, slip, load
            if remembers:
                slip = equilibrium.joint_forces(start, slip).slip
        return displacements, slips

    def _internal_forces(self, displacements):
        unknowns = displacements[:, self.mesh.element_unknowns()]
        axial, shear, first, second = np.einsum("eij,tej->ite", self._element_forces, unknowns)
        return {"axial_force": axial, "shear_force": shear, "bending_moment": (first + second) / 2}

    def _joints(self, displacements, slips):
        unknowns = displacements[:, self.mesh.joint_unknowns()]
        opening, dislocation, rotation = np.einsum("ij,tkj->itk", self._joint_jumps, unknowns)
        if self._equilibrium.joints.linear:
            spring = joint_spring(self.ring)
            stiffness = np.array([-spring.normal, spring.shear, spring.rotation])
            forces = np.einsum("i,ij,tkj->itk", stiffness, self._joint_jumps, unknowns)
        else:
            forces = self._equilibrium.joint_forces(displacements, slips)
        return {
            "joint_opening": opening,
            "joint_dislocation": dislocation,
            "joint_rotation": rotation,
            "joint_axial_force": forces[0],
            "joint_shear_force": forces[1],
            "joint_bending_moment": forces[2],
        }

    def _balances(self, displacements, slips, loads, springs):
        reactions = springs.copy()
        held = self._equilibrium.held
        if self._equilibrium.joints.linear:
            internal = (self._equilibrium.stiffness @ displacements.T).T
        else:
            internal = np.stack(list(map(self._equilibrium.internal_forces, displacements, slips)))
        reactions[:, held] += (internal - loads - springs)[:, held]
        load_sum, reaction_sum = self._resultant(loads), self._resultant(reactions)
        gap = np.abs(load_sum + reaction_sum).max(0)
        node_gap = np.abs(loads + reactions - internal).max(1)
        return {
            "load_sum_horizontal": load_sum[0],
            "load_sum_vertical": load_sum[1],
            "spring_sum_horizontal": reaction_sum[0],
            "spring_sum_vertical": reaction_sum[1],
            "equilibrium_residual": np.maximum(gap, node_gap) / np.maximum(self._magnitude(loads), 1e-300),
        }

    def _shear_moment_residual(self, fields, theta, shear, springs):
        """Largest |Q + dM/ds + couple| at the nodes, from the forces of the elements: checks results, not matrices.

        The couple per arc of the centre line is what the shear and the tangential soil springs on the outer face bring.
        """
        mesh, ring = self.mesh, self.ring
        order = np.argsort(mesh.mid_angle)
        span, angle = mesh.span[order], mesh.mid_angle[order] + mesh.span[order] / 2
        moment, force = fields["bending_moment"][:, order], fields["shear_force"][:, order]
        following = np.roll(np.arange(len(order)), -1)
        arc = ring.centre_radius * (span + span[following]) / 2
        weight = span / (span + span[following])
        mean_shear = weight * force + (1 - weight) * force[:, following]
        around = np.concatenate([theta - 2 * np.pi, theta, theta + 2 * np.pi])
        traction = np.stack([np.interp(angle % (2 * np.pi), around, np.tile(row, 3)) for row in shear])
        lever = ring.thickness / 2 * ring.outer_radius / ring.centre_radius
        couple_of_node = springs.reshape(len(springs), -1, 3)[:, :, 2]
        first, second = mesh.first[order], mesh.second[order]
        spring_couple = couple_of_node[:, second] + np.where(
            second == first[following], 0, couple_of_node[:, first[following]]
        )
        gap = mean_shear + (moment[:, following] - moment) / arc + lever * traction + spring_couple / arc
        if ring.support == "invert":
            # The clamp's own couple is concentrated there.
            gap[:, np.abs(angle % (2 * np.pi) - mesh.node_angle[self._invert] % (2 * np.pi)) < 1e-9] = 0
        return np.abs(gap).max(1)

    def _movements(self, displacements):
        """Displacements at the angles of the response, change of the diameters, settlement.

        A ring has no place of its own where nothing holds it: that mean movement is taken out.
        """
        mesh = self.mesh
        nodal = displacements.reshape(len(displacements), -1, 3)
        sine, cosine, share = np.sin(mesh.node_angle), np.cos(mesh.node_angle), mesh.node_span / (2 * np.pi)
        radial, tangential = nodal[..., 0], nodal[..., 1]
        right = ((radial * sine + tangential * cosine) * share).sum(1, keepdims=True)
        up = ((radial * cosine - tangential * sine) * share).sum(1, keepdims=True)
        sideways, _, turning = borne(self.ring)
        if not sideways:
            radial = radial - right * sine - up * cosine
            tangential = tangential - right * cosine + up * sine
            up = np.zeros_like(up)
        if not turning:
            tangential = tangential - (tangential * share).sum(1, keepdims=True)
        moved = np.zeros_like(nodal)
        moved[..., 0], moved[..., 1] = radial, tangential
        outward, along = ((part @ moved.reshape(displacements.shape).T).T for part in self._movement)
        crown, right_waist, invert, left_waist = outward[:, :: len(THETA) // 4].T
        return {
            "displacement_radial": outward,
            "displacement_tangential": along,
            "convergence_horizontal": -(right_waist + left_waist),
            "convergence_vertical": -(crown + invert),
            "settlement": -up[:, 0],
        }
