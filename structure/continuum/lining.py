"""A ring of plane-strain concrete segments, joined by face springs, held by soil springs on its outer face."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import xarray as xr
from scipy import sparse

from structure.banded import folded
from structure.bolts import bolt_law
from structure.continuum.bolts import anchor_places, bolt_elongation, bolt_shares, check_anchors, near_anchors
from structure.continuum.concrete import Concrete
from structure.continuum.face import spring_feelers, traction_operator
from structure.continuum.joints import face_points, joint_jumps, nodes_from_unknowns, uneven_stiffness
from structure.continuum.mesh import EDGE_MEAN, ContinuumMesh, GasketGroove, Gate
from structure.continuum.sections import section_displacements, section_forces
from structure.discrete import SIDES, DiscreteLining, Readings, one_thread
from structure.joint_laws import FaceLaw, JointLaw
from structure.lining import THETA, origin
from structure.nodal_forces import RingParts, tilted, whole_movements
from structure.pressures import check_pressures
from structure.response import FORCES, described
from structure.ring import Ring, alone, check_ring

#: Of the stress dataset, name: (which stress, its sign).
STRESSES = {
    "stress_rr": ("radial", "tension positive"),
    "stress_tt": ("hoop", "tension positive"),
    "stress_rt": ("shear", "positive where it turns a radius clockwise outside"),
}


class ContinuumLining(DiscreteLining):
    """Quadratic plane-strain elements, joints and soil springs with the stiffnesses of the same ring of beams.

    Parameters
    ----------
    ring : Ring
        Its ``n_elements`` means nothing here. Bolts join their anchors inside the concrete; N, Q and M of sections and
        joints contain what they carry. The concrete always deforms in shear, so section="euler-bernoulli" is
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

    Notes
    -----
    A soil spring per column, normal and tangential, feels the mean displacement of the column's outer edge and answers
    with a uniform traction on it; so no point load spoils the stresses. ``iterations`` holds Newton's iterations for
    every time of the last response.
    """

    name = "continuum"

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
    ):
        gate = None if gate is None else Gate(*gate)
        groove = None if groove is None else GasketGroove(*groove)
        check_ring(ring)
        _refuse_unsupported(ring, joint)
        _refuse_options(ring, columns, layers, joint, strip_width, gate)
        if groove is not None:
            _check_groove(ring, joint, groove)
        if ring.bolts:
            check_anchors(ring)
        self.joint, self.gate, self.groove = joint, gate, groove
        self._width = width = strip_width if joint == "equivalent_strip" else 0.0
        # A strip's faces stand apart, so its anchors meet no line offset from them.
        anchors = tuple(np.unique(anchor_places(ring)[0])) if ring.bolts and width == 0 else ()
        self.mesh = ContinuumMesh(ring, columns, layers, width, gate, groove, anchors)
        self._concrete = Concrete(ring, self.mesh, width)
        self._stress = self._concrete.stresses()
        #: Node displacements from the unknowns solved for; jumps across joints are unknowns themselves.
        self._to_nodes = nodes_from_unknowns(self.mesh)
        parts = self._parts(ring)
        beside = None
        if ring.neighbour is not None:  # the gate is open in this ring
            beside = ContinuumLining(
                alone(ring.beside), columns=columns, layers=layers, joint=joint, strip_width=strip_width, groove=groove
            )
        super().__init__(ring, parts, self._readings(ring, parts), beside)
        if joint == "equivalent_strip":
            at_joints = section_forces(self.mesh, self._stress, ring.centre_radius, np.radians(ring.joint_angles))
            self._strip_forces = [part @ self._to_nodes for part in at_joints]

    def tractions(self, theta: np.ndarray) -> tuple[sparse.csr_array, sparse.csr_array]:
        return tuple((self._to_nodes.T @ part).tocsr() for part in traction_operator(self.ring, self.mesh, theta))

    @one_thread
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
        displacements = (self._to_nodes @ self.solve(ordered).displacements.T).T
        stress = self._stress
        fields = {
            name: ((getattr(stress, kind) @ displacements.T).T, "Pa", f"{kind} stress in the lining, {sign}")
            for name, (kind, sign) in STRESSES.items()
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
        return xr.Dataset(
            described(("time", "point"), fields),
            described("point", places) | {"time": ("time", ordered["time"].values, dict(ordered["time"].attrs))},
            {"title": "stresses in the lining: continuum model"} | origin(self.ring, self.name) | self.details(),
        )

    def _parts(self, ring):
        mesh, concrete, to_nodes = self.mesh, self._concrete, self._to_nodes
        jumps = tilted(_without_zeros(joint_jumps(ring, mesh) @ to_nodes), ring.tilts)
        stiffness = (to_nodes.T @ concrete.stiffness() @ to_nodes).tocsr()
        if self._width == 0 and len(mesh.joint_before) > 0 and ring.joint_contact == "section":
            stiffness = stiffness + (to_nodes.T @ uneven_stiffness(ring, mesh) @ to_nodes).tocsr()
        size, first = len(mesh.node_angle), 2 * mesh.n_levels
        nodes = 2 * np.arange(size)[:, None] + np.arange(2)
        whole = whole_movements(2 * size, nodes, mesh.node_angle, 1.0)
        rigid = whole_movements(2 * size, nodes, mesh.node_angle, mesh.node_radius / ring.centre_radius)
        #: Unknowns that are displacements, not jumps: what works on a face beyond a joint is contained in the force on
        #: the unknowns before it.
        own = np.asarray(to_nodes.sum(axis=1) == 1)
        feel, area = spring_feelers(ring, mesh)
        return RingParts(
            segments=stiffness,
            jumps=jumps,
            feel=(feel @ to_nodes).tocsr(),
            area=area,
            weight=to_nodes.T @ concrete.body_force(),
            mass=(to_nodes.T @ sparse.diags_array(np.repeat(concrete.nodal_areas(), 2)) @ to_nodes).tocsr(),
            place=(first * folded(mesh.n_lines)[:, None] + np.arange(first)).ravel(),
            held=self._held(ring),
            nodes=nodes[own[::2]],
            node_angle=mesh.node_angle[own[::2]],
            rigid=rigid * own,
            mean=(whole * np.repeat(self._node_share(), 2)) @ to_nodes,
            arm=np.ones(2 * size),
            **self._joints(ring, jumps),
        )

    def _joints(self, ring, jumps) -> dict[str, Any]:
        """Laws of joints and bolts, with what they take of the unknowns."""
        mesh, to_nodes = self.mesh, self._to_nodes
        # Strips are part of the concrete.
        law, moves = JointLaw(ring, resists=self._width == 0), jumps
        if ring.joint_contact == "face":
            points, faces = face_points(ring, mesh)
            law, moves = FaceLaw(ring, points), tilted(_without_zeros(faces @ to_nodes), ring.tilts[points.joint])
        bolts = (bolt_elongation(ring, mesh) @ to_nodes).tocsr() if ring.bolts else jumps[:0]
        bolted = bool(ring.bolts)
        return {"law": law, "moves": moves, "bolts": bolts, "bolt_law": bolt_law(ring), "bolts_reach": bolted}

    def _held(self, ring):
        """Unknowns held at zero: the whole section next to the invert, or three that stop a free ring from drifting."""
        mesh = self.mesh
        if ring.ground is not None:
            return np.zeros(0, dtype=int)
        distance = np.abs(mesh.angle % (2 * np.pi) - np.pi)
        # The unknowns behind a joint are jumps: holding them would close the joint, not hold the ring.
        distance[mesh.joint_after] = np.inf
        whole = 2 * int(np.argmin(distance)) * mesh.n_levels + np.arange(2 * mesh.n_levels)
        return whole if ring.support == "invert" else whole[[1, -2, -1]]

    def _node_share(self):
        """Share of every node in the mean over the ring, (n_nodes,)."""
        mesh = self.mesh
        angles = mesh.column_angles()
        share = np.zeros((mesh.n_lines, mesh.n_levels))
        span = angles[:, 2] - angles[:, 0]
        np.add.at(share, mesh.column_lines, span[:, None, None] * EDGE_MEAN[:, None] * mesh.level_mean)
        return share.ravel() / span.sum()

    def _readings(self, ring, parts):
        mesh, to_nodes, theta = self.mesh, self._to_nodes, np.radians(THETA)
        forces = [part @ to_nodes for part in section_forces(mesh, self._stress, ring.centre_radius, theta)]
        sides = [(theta + side) % (2 * np.pi) for side in SIDES]
        columns = [mesh.locate(side)[0] for side in sides]
        moved = [section_displacements(mesh, side, ring.centre_radius) for side in sides]
        return Readings(
            forces=tuple(forces),
            movement=tuple((one + other) / 2 @ to_nodes for one, other in zip(*moved, strict=True)),
            quarters=self._quarters(ring) @ to_nodes,
            spring_angle=mesh.column_angles()[:, 1],
            lined=np.min([np.where(at < 0, 0.0, mesh.column_share[at]) for at in columns], axis=0),
            near_force=near_anchors(ring, theta) if ring.bolts else np.zeros(len(theta), dtype=bool),
            weight_offset=ring.thickness**2 / 12 / ring.centre_radius,
            bolt_shares=bolt_shares(ring, theta) if ring.bolts else None,
        )

    def _quarters(self, ring):
        """Radial displacement at crown, right, invert, left: mean of both sides of a joint or of the gate."""
        quarters = np.arange(4) * np.pi / 2
        off = np.full(4, 1e-6)
        if self.gate is not None and self.gate.cut == 1:
            distance = np.abs((quarters - np.radians(self.gate.angle) + np.pi) % (2 * np.pi) - np.pi)
            half = self.gate.width / 2 / ring.centre_radius
            off = np.where(distance < half, half + distance, off)
        places = [(quarters + side) % (2 * np.pi) for side in (-off, off)]
        sides = [section_displacements(self.mesh, place, ring.centre_radius)[0] for place in places]
        return (sides[0] + sides[1]) / 2

    def joint_fields(self, displacements: np.ndarray, slips: np.ndarray) -> dict[str, np.ndarray]:
        fields = super().joint_fields(displacements, slips)
        if self.joint == "equivalent_strip":
            for name, part in zip(FORCES, self._strip_forces, strict=True):
                fields[f"joint_{name}"] = (part @ displacements.T).T
        return fields

    def details(self) -> dict[str, str | float]:
        attributes = {
            "mesh": f"{len(self.mesh.column_lines)} columns, {self.mesh.layers} layers of 9-node quadrilaterals",
            "joint_model": self.joint,
        }
        if self.gate is not None:
            attributes |= {"gate_angle": float(self.gate.angle), "gate_width": float(self.gate.width)}
            attributes["gate_cut"] = float(self.gate.cut)
        if self.groove is not None:
            attributes["groove"] = ", ".join(f"{part} {value:g}" for part, value in self.groove._asdict().items())
        return attributes


def _without_zeros(rows):
    rows = rows.tocsr()
    rows.eliminate_zeros()
    return rows


def _refuse_unsupported(ring: Ring, joint: str):
    """Refuse options of the ring that this model does not know, rather than leave them out silently."""
    known: dict[str, tuple[Any, str]] = {"section": ("timoshenko", "always deforms in shear")}
    if joint == "equivalent_strip":
        linear = "whose strips are linear; take zero-thickness joints"
        known |= dict.fromkeys(("joint_contact_height", "joint_friction_coefficient"), (None, linear))
        known |= {
            "joint_contact_only": (False, linear),
            "joint_contact": ("section", linear),
            "joint_inclinations": ((), linear),
        }
        for name in ("joint_rotational_stiffness", "joint_shear_stiffness"):
            if isinstance(getattr(ring, name), tuple):
                raise ValueError(
                    f"ring: {name} must be one for all joints where they are strips, got one for each; take"
                    " zero-thickness joints"
                )
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
