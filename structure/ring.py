"""The ring as it is built: geometry, segments, joints, concrete and the ground around it (validated input)."""

from __future__ import annotations

import math
from typing import ClassVar, Literal

from pydantic import Field, model_validator

from structure.inputs import Input, InputError
from structure.plausibility import GROUND, RING, Usual, joints_in_radians


class Ground(Input):
    """Soil around the ring, as the soil springs see it.

    Parameters
    ----------
    youngs_modulus : float
        [Pa]. Decides the initial spring stiffness, Eq. (8).
    poissons_ratio : float
        [-], 0 to below 0.5.
    cohesion : float
        Effective cohesion [Pa].
    friction_angle : float
        [degree].
    vertical_stress, horizontal_stress : float
        Effective stresses at the depth of the axis [Pa], compression positive. Decide the limit pressures.
    limit_pressure_normal, limit_pressure_tangential : float, optional
        Limit of the springs' reaction [Pa]; given, they replace the formula
        (:func:`structure.springs.limit_pressures`).
    tangential_springs : bool
        Whether the soil resists sliding with a third of the normal stiffness.
    slip_at : {"outer_face", "centre_line"}
        Where the tangential springs take hold. "outer_face": where the soil is; a rotating section slips there too,
        and the reaction brings a couple. "centre_line": at the beam nodes, as load-structure programs usually do.
    law : {"hyperbolic", "linear"}
        Reaction over displacement: Eq. (7), or its initial tangent without a limit.
    two_way : bool
        Whether normal springs also pull. Off by default: a two-way spring pulls a shrinking ring outward.
    """

    usual: ClassVar[Usual] = GROUND

    youngs_modulus: float = Field(gt=0)
    poissons_ratio: float = Field(ge=0, lt=0.5)
    cohesion: float = Field(ge=0)
    friction_angle: float = Field(ge=0, lt=90)
    vertical_stress: float = Field(ge=0)
    horizontal_stress: float = Field(ge=0)
    limit_pressure_normal: float | None = Field(default=None, ge=0)
    limit_pressure_tangential: float | None = Field(default=None, ge=0)
    tangential_springs: bool = True
    slip_at: Literal["outer_face", "centre_line"] = "outer_face"
    law: Literal["hyperbolic", "linear"] = "hyperbolic"
    two_way: bool = False


class Ring(Input):
    """A ring of segments, one metre of tunnel.

    Parameters
    ----------
    outer_diameter, inner_diameter : float
        [m].
    concrete_modulus : float
        Young's modulus [Pa]; the ring uses the plane strain modulus E/(1 - nu^2).
    concrete_poissons_ratio : float
        [-].
    concrete_unit_weight : float
        [N/m3]; 0 leaves self-weight out.
    joint_angles : tuple of float
        Longitudinal joints [degree] from the crown, clockwise. Empty: a homogeneous ring.
    joint_rotational_stiffness : float
        [N m/rad] per metre of tunnel.
    joint_normal_stiffness, joint_shear_stiffness : float
        [N/m] per metre of tunnel, that is N/m2: the whole joint, not per area of its face. Spread over the face it is
        k_n/t, so that the face alone would give the rotational stiffness k_n t^2/12.
    joint_contact_only : bool
        Whether the normal spring only presses; a joint with a gap then carries no axial force.
    joint_contact_height : float, optional
        Height h of the contact zone in the joint [m], at most the thickness. Given, the joint rotates with
        `joint_rotational_stiffness` only while all of h is compressed (|M| up to N h/6) and gapes beyond, |M| staying
        below N h/2 (:func:`structure.joint_laws.contact_moment`). A block of concrete as deep as high has
        k_theta = E h^2/12 (Janssen).
    joint_friction_coefficient : float, optional
        mu [-]. Given, the joint slides where |Q| would exceed mu N; the slip stays, so records are taken in time order.
    ground : Ground or None
        None: no soil springs; then loads and weight must balance, or `support` must carry the difference.
    balance_uplift : bool
        A lining held fixed while its pressures are taken carries their vertical resultant (buoyancy less weight).
        True: that resultant is balanced at every time by a radial soil pressure a cos(theta) on the outer face, as
        much more at the crown as less at the invert. False: soil springs (or the support) carry it.
    support : {"free", "invert"}
        "invert": the ring is clamped at the node next to its invert, as in a test stand. "free": only the ground
        holds it.
    n_elements : int
        Straight beam elements around the ring.
    section : {"timoshenko", "euler-bernoulli"}
        With or without shear deformation.
    """

    usual: ClassVar[Usual] = RING

    outer_diameter: float = Field(gt=0)
    inner_diameter: float = Field(gt=0)
    concrete_modulus: float = Field(gt=0)
    concrete_poissons_ratio: float = Field(ge=0, lt=0.5)
    concrete_unit_weight: float = Field(ge=0)
    joint_angles: tuple[float, ...] = ()
    joint_rotational_stiffness: float = Field(default=0.0, ge=0)
    joint_normal_stiffness: float = Field(default=0.0, ge=0)
    joint_shear_stiffness: float = Field(default=0.0, ge=0)
    joint_contact_only: bool = False
    joint_contact_height: float | None = Field(default=None, gt=0)
    joint_friction_coefficient: float | None = Field(default=None, ge=0)
    ground: Ground | None = None
    balance_uplift: bool = False
    support: Literal["free", "invert"] = "free"
    n_elements: int = Field(default=360, ge=24, le=20000)
    section: Literal["timoshenko", "euler-bernoulli"] = "timoshenko"

    @model_validator(mode="after")
    def _check(self) -> Ring:
        if self.inner_diameter >= self.outer_diameter:
            raise ValueError(
                f"inner_diameter must be below outer_diameter {self.outer_diameter:g} m, got {self.inner_diameter:g} m;"
                " swap them if they were exchanged"
            )
        for angle in self.joint_angles:
            if not 0 <= angle < 360:
                raise ValueError(f"joint_angles must lie in [0, 360) degrees, got {angle:g}; add or subtract 360")
        smallest = 2 * 360 / self.n_elements
        if list(self.joint_angles) != sorted(self.joint_angles) or min(self.segment_angles) < smallest:
            raise ValueError(
                f"joint_angles must increase by at least two elements ({smallest:g} degrees), got {self.joint_angles};"
                " sort them, or raise n_elements"
            )
        stiffnesses = {"joint_rotational_stiffness", "joint_normal_stiffness", "joint_shear_stiffness"}
        missing = sorted(stiffnesses - self.model_fields_set)
        if self.joint_angles and missing:
            raise ValueError(f"joints need {', '.join(missing)}, got none; state them, 0 for a free hinge")
        self._check_joint_laws()
        if self.support == "invert" and self.ground is not None:
            raise ValueError("support must be 'free' where there is ground, got 'invert'; remove one of the two")
        return self

    def unusual(self) -> dict[str, str]:
        """As of every input, and joint angles in radians."""
        radians = joints_in_radians(self.joint_angles)
        return super().unusual() | ({"joint_angles": radians} if radians else {})

    def _check_joint_laws(self):
        height = self.joint_contact_height
        if height is not None and height > self.thickness * (1 + 1e-9):
            raise ValueError(
                f"joint_contact_height must not exceed the thickness {self.thickness:g} m, got {height:g} m; give the"
                " height over which the segments touch"
            )
        needs = {"joint_contact_height": ("joint_rotational_stiffness", "joint_normal_stiffness")}
        needs["joint_friction_coefficient"] = ("joint_shear_stiffness", "joint_normal_stiffness")
        for name, stiffnesses in needs.items():
            for stiffness in stiffnesses if getattr(self, name) is not None and self.joint_angles else ():
                if getattr(self, stiffness) == 0:
                    raise ValueError(
                        f"{stiffness} must be above 0 where {name} is given, got 0; this law limits the force of that"
                        f" spring by the axial force in the joint: leave {name} out"
                    )

    @property
    def thickness(self) -> float:
        """Segment thickness [m]."""
        return (self.outer_diameter - self.inner_diameter) / 2

    @property
    def outer_radius(self) -> float:
        """Radius of the outer face, where soil and water act [m]."""
        return self.outer_diameter / 2

    @property
    def centre_radius(self) -> float:
        """Radius of the centre line, where the beams lie [m]."""
        return (self.outer_diameter + self.inner_diameter) / 4

    @property
    def segment_angles(self) -> tuple[float, ...]:
        """Angle from each joint to the next, clockwise [degree]; 360 where there are no joints."""
        angles = self.joint_angles
        if not angles:
            return (360.0,)
        return tuple(b - a for a, b in zip(angles, (*angles[1:], angles[0] + 360.0), strict=True))

    @property
    def plane_strain_modulus(self) -> float:
        """E/(1 - nu^2) [Pa]: a tunnel cannot widen along its axis."""
        return self.concrete_modulus / (1 - self.concrete_poissons_ratio**2)

    @property
    def axial_stiffness(self) -> float:
        """EA per metre of tunnel [N/m]."""
        return self.plane_strain_modulus * self.thickness

    @property
    def bending_stiffness(self) -> float:
        """EI per metre of tunnel [N m2/m]."""
        return self.plane_strain_modulus * self.thickness**3 / 12

    @property
    def shear_stiffness(self) -> float:
        """G A_s per metre of tunnel [N/m], rectangular section (5/6); infinite for Euler-Bernoulli."""
        if self.section == "euler-bernoulli":
            return math.inf
        return 5 / 6 * self.concrete_modulus / (2 * (1 + self.concrete_poissons_ratio)) * self.thickness


def check_ring(ring: object) -> None:
    """Refuse what is no ring.

    Raises
    ------
    InputError
    """
    if not isinstance(ring, Ring):
        hint = "give its .ring" if hasattr(ring, "ring") else "make one: structure.Ring(outer_diameter=.., ..)"
        raise InputError(f"ring: must be a structure.Ring, got a {type(ring).__name__}; {hint}")
