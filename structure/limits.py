"""Limits that the user states of a lining: segments, joints, deformation, or any quantity of a response."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import ClassVar, Literal

from pydantic import Field, ValidationError, field_validator, model_validator

from structure.inputs import Input, InputError, mistakes, refusal
from structure.plausibility import LIMITS, Usual
from structure.response import RESPONSE, SHOWN
from structure.ring import Ring
from structure.segment import SegmentSection

#: What a limit of the user's own may name: quantities of a response that people are shown.
OWN = tuple(name for name in RESPONSE if name in SHOWN and name != "joint_dislocation")
#: What is checked, name: what it is, for figures and tables.
UTILISATIONS = {
    "section_utilisation": "axial force and moment in the segments",
    "shear_utilisation": "shear force in the segments",
    "crack_utilisation": "crack width of the segments",
    "bearing_utilisation": "bearing of the joints",
    "gasket_utilisation": "joint opening at the gasket",
    "joint_dislocation_utilisation": "joint dislocation",
    "convergence_utilisation": "convergence",
    "flotation_utilisation": "flotation of the tunnel",
    "ground_bearing_utilisation": "bearing of the ground below the tunnel",
    **{f"{name}_utilisation": f"own limit of the {SHOWN[name].name}" for name in OWN},
}
#: Variables that checks add to a response; they are no states of the ring.
CHECK_VARIABLES = (
    "design_axial_force", "design_bending_moment", "design_shear_force", "capacity_axial_force",
    "capacity_bending_moment", "shear_resistance", "bearing_resistance", "crack_width", "gasket_opening",
    "convergence_per_mille", *UTILISATIONS, "largest_utilisation",
)  # fmt: skip


class CapacityRule(Input):
    """How internal forces are set against what segments and joints carry; every value is the user's.

    Parameters
    ----------
    axial_force_factor, moment_factor : float
        Partial factors of actions: N_Ed over the computed N, M_Ed and V_Ed over the computed M and Q [-].
    minimum_eccentricity : float
        Least |M_Ed|/N_Ed of segments in compression [m]: EN 1992-1-1, 6.1(4) asks for max(h/30, 20 mm); 0 for none.
    utilisation : {"radial", "constant_axial_force"}
        "radial": how far N_Ed and M_Ed are on their way to the diagram when they grow in proportion.
        "constant_axial_force": |M_Ed| over the moment carried at the same N_Ed; infinite beyond the largest N.
    shear : bool
        Whether shear is checked, of segments without shear reinforcement: EN 1992-1-1, 6.2.2.
    """

    axial_force_factor: float = Field(gt=0)
    moment_factor: float = Field(gt=0)
    minimum_eccentricity: float = Field(ge=0)
    utilisation: Literal["radial", "constant_axial_force"]
    shear: bool


class StabilityRule(Input):
    """How the tunnel is set against the ground that holds it down and bears it; factors are the user's.

    Parameters
    ----------
    cover : float, optional
        Ground above the crown [m]; left out, that of the tunnel in the scene.
    buoyant_unit_weight : float, optional
        Of that ground in water [N/m3]; left out, its mean in the scene, vertical effective stress over depth.
    uplift_factor, weight_factor : float
        Partial factors of the water's uplift and of what holds the tunnel down [-]: 1.0 and 0.9 are recommended in
        EN 1997-1, Table A.15.
    bearing_factor : float
        Of the bearing resistance of the ground [-]: 1.4 in EN 1997-1, Table A.5, set R2.
    """

    cover: float | None = Field(default=None, gt=0)
    buoyant_unit_weight: float | None = Field(default=None, gt=0)
    uplift_factor: float = Field(gt=0)
    weight_factor: float = Field(gt=0)
    bearing_factor: float = Field(gt=0)


class Limits(Input):
    """Limits of a lining; those left out are not checked, none has a default value.

    Parameters
    ----------
    segment : SegmentSection, optional
        Concrete and bars of the segments, by class and code; with `capacity` or `crack_width`.
    capacity : CapacityRule, optional
        How the forces are set against it; with `segment`.
    joint_contact_height : float, optional
        Height of the zone over which the segments touch in a joint [m], whose bearing is checked; with `capacity`.
    crack_width : float, optional
        Largest w_k [m] under the computed forces, EN 1992-1-1, 7.3.1; with `segment` and `crack_duration`.
    crack_duration : {"short-term", "long-term"}, optional
        Of the load that opens the cracks.
    gasket_opening : float, optional
        Largest opening of a joint at its gasket [m].
    gasket_offset : float, optional
        Place of the gasket, from the centre line outward [m], negative on the inside; needed with `gasket_opening`.
    joint_dislocation : float, optional
        Largest step between the segments of a joint [m].
    convergence_per_mille : float, optional
        Largest change of the horizontal or vertical diameter over the outer diameter [per mille].
    stability : StabilityRule, optional
        Flotation of the tunnel and bearing of the ground below it.
    own : dict
        Limits of your own: a quantity of :data:`structure.response.RESPONSE` to its largest size, in its unit there.
    """

    usual: ClassVar[Usual] = LIMITS

    segment: SegmentSection | None = None
    capacity: CapacityRule | None = None
    joint_contact_height: float | None = Field(default=None, gt=0)
    crack_width: float | None = Field(default=None, gt=0)
    crack_duration: Literal["short-term", "long-term"] | None = None
    gasket_opening: float | None = Field(default=None, gt=0)
    gasket_offset: float | None = None
    joint_dislocation: float | None = Field(default=None, gt=0)
    convergence_per_mille: float | None = Field(default=None, gt=0)
    stability: StabilityRule | None = None
    own: dict[str, float] = Field(default_factory=dict)

    @field_validator("own")
    @classmethod
    def _known_quantities(cls, own: dict[str, float]) -> dict[str, float]:
        for name, limit in own.items():
            if name not in OWN:
                raise ValueError(f"must name quantities of a response, got {name!r}; there are {', '.join(OWN)}")
            if limit <= 0:
                raise ValueError(f"{name} must be greater than 0, got {limit:g}; it is a largest size")
        return own

    @model_validator(mode="after")
    def _check(self) -> Limits:
        pairs = (
            ("gasket_opening", "gasket_offset"), ("gasket_offset", "gasket_opening"), ("capacity", "segment"),
            ("joint_contact_height", "capacity"), ("crack_width", "segment"), ("crack_width", "crack_duration"),
            ("crack_duration", "crack_width"),
        )  # fmt: skip
        for given, needed in pairs:
            if getattr(self, given) is not None and getattr(self, needed) is None:
                raise ValueError(f"{needed} must be given where {given} is, got none; state both or neither")
        if self.segment is not None and self.capacity is None and self.crack_width is None:
            raise ValueError("capacity or crack_width must be given where segment is, got none; state what is checked")
        if not self.model_dump(exclude_none=True, exclude_defaults=True):
            raise ValueError("limits must hold at least one limit, got none; state what is to be checked")
        return self

    @property
    def in_words(self) -> str:
        """What is checked, in one line."""
        segment, capacity = self.segment, self.capacity
        lengths = {"gasket": self.gasket_opening, "dislocation": self.joint_dislocation, "cracks": self.crack_width}
        told = [] if segment is None else [f"{segment.concrete} and {segment.steel} after {segment.code}"]
        told += [] if capacity is None else ["M-N", *["shear"] * capacity.shear]
        told += [] if self.joint_contact_height is None else ["bearing of joints"]
        told += [f"{name} {1e3 * limit:g} mm" for name, limit in lengths.items() if limit is not None]
        told += [] if self.stability is None else ["flotation and bearing"]
        told += [] if self.convergence_per_mille is None else [f"convergence {self.convergence_per_mille:g} per mille"]
        for name, limit in self.own.items():
            told.append(f"{SHOWN[name].short} {SHOWN[name].scale * limit:g} {SHOWN[name].unit}")
        return ", ".join(told)

    def check_ring(self, ring: Ring) -> None:
        """Refuse limits that a ring cannot be held against. Raises ValueError."""
        if self.segment is not None:
            self.segment.check_thickness(ring.thickness)
        if self.stability is not None and ring.ground is None:
            raise ValueError("stability must be left out of a ring without ground, got one; give the ring its ground")
        keys = ("gasket_opening", "joint_dislocation", "joint_contact_height")
        joints = [name for name in keys if getattr(self, name) is not None]
        joints += [name for name in self.own if name.startswith("joint_")]
        if joints and not ring.joint_angles:
            raise ValueError(
                f"{joints[0]} must be left out of a ring without joints, got a limit; or give joint_angles"
            )
        if self.gasket_offset is not None and abs(self.gasket_offset) > ring.thickness / 2:
            raise ValueError(
                f"gasket_offset must be at most half the thickness {ring.thickness:g} m, got {self.gasket_offset:g} m;"
                " it counts from the centre line"
            )
        height, touching = self.joint_contact_height, ring.joint_contact_height
        if height is None:
            return
        largest, one_for_all = ring.contact_heights.min(), isinstance(touching, float)
        if height > largest or (one_for_all and height != touching):
            least = "be at most the thickness" if touching is None else "be at most the least of the ring,"
            rule = "be the joint_contact_height of the ring," if one_for_all else least
            raise ValueError(
                f"joint_contact_height must {rule} {largest:g} m, got {height:g} m; correct one of the two"
            )

    @classmethod
    def from_toml(cls, path: str | Path) -> Limits:
        """Limits from a TOML file with the keys above, tables ``[segment]``, ``[capacity]``, ``[own]``; SI units.

        Raises
        ------
        structure.InputError
            No TOML, or no limits: every mistake with key, rule, value and remedy.
        OSError
            Not readable.
        """
        who = f"limits '{path}'"
        try:
            data = tomllib.loads(Path(path).read_text(encoding="utf-8-sig"))
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as problem:
            raise InputError(f"{who}: must be valid TOML, got: {problem}; correct it there") from None
        try:
            return cls.model_validate(data)
        except ValidationError as error:
            raise InputError(refusal(who, mistakes(error, cls))) from None
