"""A ring of plane-strain concrete segments, joined by face springs, held by soil springs on its outer face."""

from __future__ import annotations

from typing import Literal

import numpy as np
import xarray as xr
from threadpoolctl import threadpool_limits

from structure.balance import borne, even_loads, without_unborne
from structure.continuum_bolts import Bolts, anchor_place, bolt_elongation, bolt_shares, check_bolts, near_anchors
from structure.continuum_equilibrium import SpringEquilibrium
from structure.continuum_face import spring_feelers, traction_operator
from structure.continuum_mesh import EDGE_MEAN, ContinuumMesh, GasketGroove, Gate
from structure.continuum_sections import section_displacements, section_forces
from structure.continuum_stiffness import Concrete, joint_operators, joint_stiffness, nodes_from_unknowns
from structure.equilibrium import NoEquilibrium
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

#: Name: (dimensions, units, long name) of the stress dataset.
STRESSES = {
    "stress_rr": ("Pa", "radial stress in the lining, tension positive"),
    "stress_tt": ("Pa", "hoop stress in the lining, tension positive"),
    "stress_rt": ("Pa", "shear stress in the lining, positive where it turns a radius clockwise outside"),
}
#: Units and long name of the one variable beyond the schema of all models.
BOLT_FORCE = {"units": "N/m", "long_name": "force in the bolts of a joint per metre of tunnel, tension positive"}


class ContinuumLining(LiningModel):
    """Quadratic plane-strain elements, joints and soil springs with the stiffnesses of the same ring of beams.

    Parameters
    ----------
    ring : Ring
        Its ``n_elements`` means nothing here. The concrete always deforms in shear, so section="euler-bernoulli" is
        refused.
    columns : int
        Elements around the ring.
    layers : int
        Elements across the thickness.
    joint : {"zero_thickness", "equivalent_strip"}
        "zero_thickness": two faces with normal and shear springs per area, and one term that brings the rotational
        stiffness of the joint: all three stiffnesses are those of the ring. "equivalent_strip": a column of soft
        material, which can match rotation and shear only; its normal stiffness is 12 k_theta/t^2.
    strip_width : float
        Of the equivalent strip [m].
    gate : Gate or tuple of float, optional
        Angle [degree], width [m] and cut share of the open gate. In a slot (cut = 1, the default) there is no lining;
        N, Q, M and displacements there are NaN.
    groove : GasketGroove or tuple of float, optional
        Cover, height and depth [m] of the gasket's groove in both faces of every joint. The segments touch above and
        below it; the three stiffnesses of the joint stay those of the ring, the concrete beside it gets softer.
    bolts : Bolts or tuple of float, optional
        Offset, length [m] and stiffness [N/m per m] of bolts across every joint, besides its own springs. N, Q and M of
        sections and joints contain what the bolts carry; the response has ``joint_bolt_force``. They are elastic and
        two-way.

    Notes
    -----
    A soil spring per column, normal and tangential, feels the mean displacement of the column's outer edge and answers
    with a uniform traction on it; so no point load spoils the stresses. ``iterations`` holds Newton's iterations for
    every time of the last response.
    """

    def __init__(
        self,
        ring: Ring,
        *,
        columns: int = 360,
        layers: int = 2,
        joint: Literal["zero_thickness", "equivalent_strip"] = "zero_thickness",
        strip_width: float = 0.02,
        gate: Gate | tuple[float, float] | None = None,
        groove: GasketGroove | tuple[float, float, float] | None = None,
        bolts: Bolts | tuple[float, float, float] | None = None,
    ):
        gate = None if gate is None else Gate(*gate)
        groove = None if groove is None else GasketGroove(*groove)
        bolts = None if bolts is None else Bolts(*bolts)
        check_ring(ring)
        _refuse_unsupported(ring)
        _refuse_options(ring, columns, layers, joint, strip_width, gate)
        if groove is not None:
            _check_groove(ring, joint, groove)
        if bolts is not None:
            check_bolts(ring, bolts)
        self.ring, self.joint, self.gate, self.groove, self.bolts = ring, joint, gate, groove, bolts
        width = strip_width if joint == "equivalent_strip" else 0.0
        # A strip's faces stand apart, so its anchors meet no line offset from them.
        anchor = anchor_place(ring, bolts)[0] if bolts is not None and width == 0 else None
        self.mesh = ContinuumMesh(ring, columns, layers, width, gate, groove, anchor)
        self._theta = np.radians(THETA)
        self._sides = [(self._theta + side) % (2 * np.pi) for side in SIDES]
        self._solid = np.all([self.mesh.locate(side)[0] >= 0 for side in self._sides], axis=0)
        concrete = Concrete(ring, self.mesh, width)
        #: Node displacements from the unknowns solved for; jumps across joints are unknowns themselves.
        self._to_nodes = nodes_from_unknowns(self.mesh)
        #: 0 for jumps: what works on a face beyond a joint is contained in the force on the unknowns before it.
        self._whole = np.asarray(self._to_nodes.sum(axis=1) == 1, dtype=float)
        stiffness = (self._to_nodes.T @ concrete.stiffness() @ self._to_nodes).tocsr()
        if width == 0 and len(self.mesh.joint_before):
            # On its own: added before, it would swallow digits of the concrete.
            stiffness = (stiffness + self._to_nodes.T @ joint_stiffness(ring, self.mesh) @ self._to_nodes).tocsr()
        self._stress = concrete.stresses()
        self._weight = concrete.body_force()
        self._joints = [part @ self._to_nodes for part in joint_operators(ring, self.mesh)]
        self._forces = section_forces(self.mesh, self._stress, ring.centre_radius, self._theta)
        self._strip_forces = section_forces(self.mesh, self._stress, ring.centre_radius, np.radians(ring.joint_angles))
        movements = [section_displacements(self.mesh, side) for side in self._sides]
        self._movement = [(one + other) / 2 for one, other in zip(*movements, strict=True)]
        self._quarters = self._quarter_sides()
        self._share = self._node_share()
        feel, area = spring_feelers(ring, self.mesh)
        levels = np.arange(2 * self.mesh.n_levels)
        place = (2 * self.mesh.n_levels * self.mesh.neighbour_place()[:, None] + levels).ravel()
        self._elongation = None if bolts is None else (bolt_elongation(ring, self.mesh, bolts) @ self._to_nodes).tocsr()
        self._equilibrium = SpringEquilibrium(
            ring,
            stiffness,
            feel @ self._to_nodes,
            area,
            place,
            self._held(),
            self._elongation,
            0.0 if bolts is None else bolts.stiffness,
        )
        fine = np.radians(np.arange(0, 360, 0.5))
        self._uplift, self._even = even_loads(fine, *traction_operator(ring, self.mesh, fine), self._resultant)

    @property
    def iterations(self) -> list[int]:
        """Newton's iterations at every time of the last response."""
        return self._equilibrium.iterations

    @property
    def residuals(self) -> list[float]:
        """Largest out-of-balance force of every iteration at the last time [N/m]."""
        return self._equilibrium.residuals

    def respond(self, pressures: xr.Dataset) -> xr.Dataset:
        ordered = check_pressures(pressures, self.ring)
        unknowns, loads, fields = self._solve(ordered)
        displacements = (self._to_nodes @ unknowns.T).T
        fields |= self._internal_forces(unknowns, displacements)
        fields |= self._joint_fields(unknowns)
        fields |= self._balances(unknowns, loads)
        fields["shear_moment_residual"] = self._shear_moment_residual(fields, ordered, unknowns)
        fields |= self._movements(displacements)
        response = response_dataset(self.ring, ordered, fields, self._attributes())
        if self.bolts is not None:
            response["joint_bolt_force"] = ("time", "joint"), self._bolt_force(unknowns), BOLT_FORCE
        return response

    def stress_field(self, pressures: xr.Dataset) -> xr.Dataset:
        """Stresses in the concrete at two by two points of every element.

        Parameters
        ----------
        pressures : xarray.Dataset
            As for `respond`; select the times that matter, every one brings all points.

        Returns
        -------
        xarray.Dataset
            stress_rr, stress_tt, stress_rt (time, point) [Pa]; x to the right, y up from the axis [m], theta [degree],
            radius [m] and element (point).
        """
        ordered = check_pressures(pressures, self.ring)
        displacements = (self._to_nodes @ self._solve(ordered)[0].T).T
        stress = self._stress
        values = (stress.radial, stress.hoop, stress.shear)
        fields = {
            name: (("time", "point"), (part @ displacements.T).T, {"units": units, "long_name": long_name})
            for (name, (units, long_name)), part in zip(STRESSES.items(), values, strict=True)
        }
        sine, cosine = np.sin(stress.angle), np.cos(stress.angle)
        element = np.repeat(np.arange(len(stress.angle) // 4), 4)
        places = {
            "x": (stress.radius * sine, "m", "distance to the right of the axis"),
            "y": (stress.radius * cosine, "m", "height above the axis"),
            "theta": (np.degrees(stress.angle), "degree", "angle from the crown, clockwise"),
            "radius": (stress.radius, "m", "distance from the axis"),
            "element": (element, "1", "number of the element"),
        }
        coordinates = {
            name: ("point", values, {"units": units, "long_name": long_name})
            for name, (values, units, long_name) in places.items()
        }
        coordinates["time"] = ("time", ordered["time"].values, dict(ordered["time"].attrs))
        attributes = {"title": "stresses in the lining: continuum model"} | self._attributes()
        return xr.Dataset(fields, coords=coordinates, attrs=attributes)

    def _held(self):
        """Unknowns held at zero: the whole section next to the invert, or three that stop a free ring from drifting."""
        mesh = self.mesh
        if self.ring.ground is not None:
            return np.zeros(0, dtype=int)
        distance = np.abs(mesh.angle % (2 * np.pi) - np.pi)
        # The unknowns behind a joint are jumps: holding them would close the joint, not hold the ring.
        distance[mesh.joint_after] = np.inf
        line = int(np.argmin(distance))
        first = 2 * line * mesh.n_levels
        whole = first + np.arange(2 * mesh.n_levels)
        return whole if self.ring.support == "invert" else whole[[1, -2, -1]]

    def _solve(self, ordered):
        """Unknowns and the loads on them (n_times, n_unknowns), and the fields of what was balanced."""
        theta, times = np.radians(ordered["theta"].values.astype(float)), ordered["time"].values
        by_pressure, by_shear = traction_operator(self.ring, self.mesh, theta)
        pressure = (ordered["soil_pressure"] + ordered["water_pressure"]).values.astype(float)
        loads = (by_pressure @ pressure.T + by_shear @ ordered["soil_shear"].values.astype(float).T).T + self._weight
        balanced = np.zeros(len(loads))
        if self.ring.balance_uplift:
            balanced = self._resultant(loads)[1]
            loads = loads - balanced[:, None] * self._uplift
        magnitude = np.array([_magnitude(row) for row in loads])
        loads, unborne = without_unborne(self.ring, loads, self._resultant(loads), magnitude, self._even, times)
        loads = (self._to_nodes.T @ loads.T).T
        unknowns = np.zeros_like(loads)
        self._equilibrium.iterations.clear()
        start = np.zeros(loads.shape[1])
        # Factors are so small that threads only wait for each other: on a busy machine two cost 200 times one's time.
        with threadpool_limits(limits=1, user_api="blas"):
            for index, load in enumerate(loads):
                unknowns[index] = start = self._solve_one(load, start, float(times[index]))
        return unknowns, loads, {"balanced_uplift": balanced, "unborne_resultant": unborne}

    def _solve_one(self, load, start, time):
        try:
            return self._equilibrium.solve(load, start)
        except NoEquilibrium as problem:
            horizontal, vertical, _ = self._resultant(load * self._whole)
            raise LiningFailure(
                f"ring: no equilibrium at time {time:g} s (loads sum to {horizontal:.4g} N/m to the right,"
                f" {vertical:.4g} N/m up): {problem}",
                time,
            ) from problem

    def _resultant(self, forces: np.ndarray) -> np.ndarray:
        """Sums to the right and up, and clockwise couple about the axis over the centre-line radius, (3, ...) [N/m]."""
        sine, cosine = np.sin(self.mesh.node_angle), np.cos(self.mesh.node_angle)
        radial, tangential = forces[..., 0::2], forces[..., 1::2]
        lever = self.mesh.node_radius / self.ring.centre_radius
        return np.stack([radial @ sine + tangential @ cosine, radial @ cosine - tangential @ sine, tangential @ lever])

    def _internal_forces(self, unknowns, displacements):
        names = ("axial_force", "shear_force", "bending_moment")
        forces = [(part @ displacements.T).T for part in self._forces]
        if self.bolts is not None:
            pull = self._bolt_force(unknowns)
            shares = bolt_shares(self.ring, self.bolts, self._theta)
            forces = [force + pull @ share.T for force, share in zip(forces, shares, strict=True)]
        return dict(zip(names, map(self._where_solid, forces), strict=True))

    def _bolt_force(self, unknowns):
        return self.bolts.stiffness * (self._elongation @ unknowns.T).T

    def _where_solid(self, values):
        values[:, ~self._solid] = np.nan
        return values

    def _joint_fields(self, unknowns):
        opening, dislocation, rotation = ((part @ unknowns.T).T for part in self._joints)
        spring = joint_spring(self.ring)
        forces = [-spring.normal * opening, spring.shear * dislocation, spring.rotation * rotation]
        if self.joint == "equivalent_strip":
            forces = [(part @ unknowns.T).T for part in self._strip_forces]
        if self.bolts is not None:
            pull = self._bolt_force(unknowns)
            forces[0], forces[2] = forces[0] - pull, forces[2] + self.bolts.offset * pull
        names = ("joint_axial_force", "joint_shear_force", "joint_bending_moment")
        return {
            "joint_opening": opening,
            "joint_dislocation": dislocation,
            "joint_rotation": rotation,
            **dict(zip(names, forces, strict=True)),
        }

    def _balances(self, unknowns, loads):
        held = self._equilibrium.held
        springs = np.stack([self._equilibrium.spring_forces(row)[0] for row in unknowns])
        internal = (self._equilibrium.stiffness @ unknowns.T).T
        reactions = springs.copy()
        reactions[:, held] += (internal - loads - springs)[:, held]
        load_sum, reaction_sum = self._resultant(loads * self._whole), self._resultant(reactions * self._whole)
        gap = np.abs(load_sum + reaction_sum).max(0)
        node_gap = np.abs(loads + reactions - internal).max(1)
        magnitude = np.array([_magnitude(row) for row in loads * self._whole])
        return {
            "load_sum_horizontal": load_sum[0],
            "load_sum_vertical": load_sum[1],
            "spring_sum_horizontal": reaction_sum[0],
            "spring_sum_vertical": reaction_sum[1],
            "equilibrium_residual": np.maximum(gap, node_gap) / np.maximum(magnitude, 1e-300),
        }

    def _shear_moment_residual(self, fields, ordered, unknowns):
        """Largest |Q + dM/ds + couple| between neighbouring angles, from the reported forces.

        The couple per arc of the centre line is what shear and tangential soil springs on the outer face bring, and
        the weight, whose centre lies outside the centre line.
        """
        ring, theta, span = self.ring, self._theta, 2 * np.pi / len(THETA)
        following = np.roll(np.arange(len(theta)), -1)
        middle = theta + span / 2
        shear, moment = fields["shear_force"], fields["bending_moment"]
        mean_shear = (shear + shear[:, following]) / 2
        samples = np.radians(ordered["theta"].values.astype(float))
        around = np.concatenate([samples - 2 * np.pi, samples, samples + 2 * np.pi])
        traction = np.stack([np.interp(middle, around, np.tile(row, 3)) for row in ordered["soil_shear"].values])
        column = self.mesh.locate(middle)[0]
        share = self.mesh.column_share[column]
        traction = traction * share
        if ring.ground is not None and ring.ground.slip_at == "outer_face":
            slip = np.stack([self._equilibrium.reactions(row)[0] for row in unknowns])
            traction = traction - share * slip[:, len(self.mesh.column_lines) :][:, column]
        lever = ring.thickness / 2 * ring.outer_radius / ring.centre_radius
        eccentric = ring.concrete_unit_weight * ring.thickness**3 / 12 / ring.centre_radius * np.sin(middle)
        arc = ring.centre_radius * span
        gap = np.abs(mean_shear + (moment[:, following] - moment) / arc + lever * traction + eccentric)
        if ring.support == "invert":
            # The clamp's own reaction is concentrated there, on both sides of its line.
            gap[:, np.abs(middle % (2 * np.pi) - np.pi) < 2 * span] = 0
        if self.bolts is not None:
            gap[:, near_anchors(ring, self.bolts, middle, 3 * span)] = 0
        return np.nanmax(gap, axis=1)

    def _node_share(self):
        """Share of every node in the mean over the ring, (n_nodes,)."""
        mesh = self.mesh
        angles = mesh.column_angles()
        share = np.zeros((mesh.n_lines, mesh.n_levels))
        span = angles[:, 2] - angles[:, 0]
        np.add.at(share, mesh.column_lines, span[:, None, None] * EDGE_MEAN[:, None] * mesh.level_mean)
        return share.ravel() / span.sum()

    def _quarter_sides(self):
        """Radial displacement at crown, right, invert, left: mean of both sides of a joint or of the gate."""
        sides = []
        for quarter in np.arange(4) * np.pi / 2:
            off = 1e-6
            if self.gate is not None and self.gate.cut == 1:
                distance = abs((quarter - np.radians(self.gate.angle) + np.pi) % (2 * np.pi) - np.pi)
                half = self.gate.width / 2 / self.ring.centre_radius
                off = half + distance if distance < half else off
            sides.append(section_displacements(self.mesh, np.array([quarter - off, quarter + off]) % (2 * np.pi))[0])
        return sides

    def _movements(self, displacements):
        """Displacements at the angles of the response, change of the diameters, settlement.

        A ring has no place of its own where nothing holds it: that mean movement is taken out.
        """
        sine, cosine = np.sin(self.mesh.node_angle), np.cos(self.mesh.node_angle)
        radial, tangential = displacements[:, 0::2], displacements[:, 1::2]
        right = (radial * sine + tangential * cosine) @ self._share
        up = (radial * cosine - tangential * sine) @ self._share
        sideways, _, turning = borne(self.ring)
        if not sideways:
            radial = radial - np.outer(right, sine) - np.outer(up, cosine)
            tangential = tangential - np.outer(right, cosine) + np.outer(up, sine)
            up = np.zeros_like(up)
        if not turning:
            turn = tangential @ self._share / self.ring.centre_radius
            tangential = tangential - np.outer(turn, self.mesh.node_radius)
        displacements = np.stack([radial, tangential], axis=2).reshape(displacements.shape)
        crown, right_waist, invert, left_waist = ((side @ displacements.T).mean(0) for side in self._quarters)
        return {
            "displacement_radial": self._where_solid((self._movement[0] @ displacements.T).T),
            "displacement_tangential": self._where_solid((self._movement[1] @ displacements.T).T),
            "convergence_horizontal": -(right_waist + left_waist),
            "convergence_vertical": -(crown + invert),
            "settlement": -up,
        }

    def _attributes(self):
        attributes = ring_attributes(self.ring, "continuum") | {
            "mesh": f"{len(self.mesh.column_lines)} columns, {self.mesh.layers} layers of 9-node quadrilaterals",
            "joint_model": self.joint,
        }
        if self.gate is not None:
            attributes |= {"gate_angle": float(self.gate.angle), "gate_width": float(self.gate.width)}
            attributes["gate_cut"] = float(self.gate.cut)
        for name, detail in (("groove", self.groove), ("bolts", self.bolts)):
            if detail is not None:
                attributes[name] = ", ".join(f"{part} {value:g}" for part, value in detail._asdict().items())
        return attributes


def _magnitude(forces: np.ndarray) -> float:
    return float(np.hypot(forces[0::2], forces[1::2]).sum())


def _refuse_unsupported(ring: Ring):
    """Refuse options of the ring that this model does not know, rather than leave them out silently."""
    known = {
        "section": ("timoshenko", "always deforms in shear"),
        "joint_contact_only": (False, "has linear joints only"),
        "joint_contact_height": (None, "has linear joints only"),
        "joint_friction_coefficient": (None, "has linear joints only"),
    }
    for name, (value, reason) in known.items():
        given = getattr(ring, name)
        if given != value:
            raise ValueError(
                f"ring: {name} must be {value!r} for the continuum model, which {reason}, got {given!r};"
                f" set {name}={value!r}, or use BeamSpringLining"
            )


def _refuse_options(ring, columns, layers, joint, strip_width, gate):
    if joint not in ("zero_thickness", "equivalent_strip"):
        raise ValueError(f"joint must be 'zero_thickness' or 'equivalent_strip', got {joint!r}; choose one")
    if not 12 <= columns <= 20000:
        raise ValueError(f"columns must lie in 12 to 20000, got {columns}; 360 is one per degree")
    if not 1 <= layers <= 20:
        raise ValueError(f"layers must lie in 1 to 20, got {layers}; 2 is enough for section forces")
    if joint == "equivalent_strip" and not 0 < strip_width < ring.thickness:
        raise ValueError(
            f"strip_width must be above 0 and below the thickness {ring.thickness:g} m, got {strip_width:g} m;"
            " 0.02 is a usual gap"
        )
    if gate is not None and not 0 < gate.cut <= 1:
        raise ValueError(
            f"gate: cut must be above 0 and at most 1, the share of the tunnel's length that is open, got"
            f" {gate.cut:g}; 1 is a slot through the ring"
        )
    if gate is not None and not 0 < gate.width < ring.inner_diameter / 4:
        raise ValueError(
            f"gate: width must be above 0 and below a quarter of the inner diameter"
            f" ({ring.inner_diameter / 4:g} m), got {gate.width:g} m; that of the built-in scenes is 0.2 m wide"
        )


def _check_groove(ring: Ring, joint: str, groove: GasketGroove):
    if not ring.joint_angles:
        raise ValueError("groove: the ring must have joints, got none; leave groove out, or give joint_angles")
    if joint != "zero_thickness":
        raise ValueError(f"groove: joint must be 'zero_thickness', got {joint!r}; a strip has no faces to cut into")
    if min(groove) <= 0 or groove.cover + groove.height >= ring.thickness:
        raise ValueError(
            f"groove: cover, height and depth must be above 0, cover + height below the thickness {ring.thickness:g} m,"
            f" got {groove.cover:g}, {groove.height:g}, {groove.depth:g} m; cover counts from the outer face"
        )
    room = np.radians(min(ring.segment_angles)) * ring.centre_radius
    if groove.depth >= room / 4:
        raise ValueError(
            f"groove: depth must be below a quarter of the shortest segment ({room / 4:.3g} m), got {groove.depth:g} m;"
            " it counts into the segment"
        )
