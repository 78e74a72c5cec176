"""The ring as it is built: geometry, segments, joints, concrete and the ground around it (validated input)."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from structure.bolts import Bolts
from structure.inputs import Input, InputError, OneOrSeveral
from structure.joint_rules import PER_JOINT, check_joints
from structure.plausibility import RING, Usual, joints_in_radians
from structure.springs import Ground

#: One number for all joints, or one for each.
NotNegative = OneOrSeveral[Annotated[float, Field(ge=0)]]
Positive = OneOrSeveral[Annotated[float, Field(gt=0)]]


class Neighbour(Input):
    """Rings to both sides of a ring, built alike but turned, and the circumferential joints that couple them.

    A plane model of a tunnel whose rings alternate: this ring, the other, this one again. Both bear the same pressures;
    at every angle springs between their centre lines resist that they part. Source: the double-ring beam-spring model
    of ITA WG2 (2000), Guidelines for the design of shield tunnel lining.

    Parameters
    ----------
    rotation : float
        By how much the other rings are turned, clockwise [degree].
    ring_width : float
        Of every ring along the tunnel [m].
    radial_stiffness, tangential_stiffness : float
        Of one circumferential joint, by metre of its length around the ring [N/m per metre].
    """

    rotation: float = Field(gt=-360, lt=360)
    ring_width: float = Field(gt=0)
    radial_stiffness: float = Field(ge=0)
    tangential_stiffness: float = Field(ge=0)


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
    joint_rotational_stiffness : float or tuple of float
        [N m/rad] per metre of tunnel. This and the four that follow: one number for all joints, or one for each, in
        the order of `joint_angles`, as for a key segment.
    joint_normal_stiffness, joint_shear_stiffness : float or tuple of float
        [N/m] per metre of tunnel, that is N/m2: the whole joint, not per area of its face. Spread over the face it is
        k_n/t, so that the face alone would give the rotational stiffness k_n t^2/12.
    joint_contact_only : bool
        Whether the normal spring only presses; a joint with a gap then carries no axial force.
    joint_contact_height : float or tuple of float, optional
        Height h of the contact zone in the joint [m], at most the thickness. Given, the joint rotates with
        `joint_rotational_stiffness` only while all of h is compressed (|M| up to N h/6) and gapes beyond, |M| staying
        below N h/2 (:func:`structure.joint_laws.contact_moment`). A block of concrete as deep as high has
        k_theta = E h^2/12 (Janssen).
    joint_friction_coefficient : float or tuple of float, optional
        mu [-]. Given, the joint slides where |Q| would exceed mu N; the slip stays, so records are taken in time order.
    joint_contact : {"section", "face"}
        "section": the three springs of a joint act on the mean movement of its faces, limited as above. "face": normal
        and shear springs are spread over the contact height (all of the thickness where it is left out), and each
        point of the face only presses, and slides by friction of its own. The rotational stiffness then is
        k_n h^2/12 and may be left out.
    joint_inclinations : tuple of float
        By how much the outer end of every joint leans clockwise from the radius [degree], as beside a key that is
        pushed in along the radius. Opening, dislocation, N and Q of a joint are square to and along its face; the
        places of the faces stay radial. Empty: all radial.
    joint_bolts : Bolts or tuple of Bolts, optional
        Of all joints, or of each.
    neighbour : Neighbour, optional
        Rings beside this one, staggered; without them the ring stands alone.
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
    joint_rotational_stiffness: NotNegative = 0.0
    joint_normal_stiffness: NotNegative = 0.0
    joint_shear_stiffness: NotNegative = 0.0
    joint_contact_only: bool = False
    joint_contact_height: Positive | None = None
    joint_friction_coefficient: NotNegative | None = None
    joint_contact: Literal["section", "face"] = "section"
    joint_inclinations: tuple[float, ...] = ()
    joint_bolts: OneOrSeveral[Bolts] | None = None
    neighbour: Neighbour | None = None
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
        check_joints(self)
        if self.neighbour is not None and not self.joint_angles:
            raise ValueError("neighbour: must be left out of a ring without joints, got one; all rings are alike")
        if self.support != "free" and self.ground is not None:
            raise ValueError(f"support must be 'free' where there is ground, got {self.support!r}; remove one of them")
        return self

    def unusual(self) -> dict[str, str]:
        """As of every input, and joint angles in radians."""
        radians = joints_in_radians(self.joint_angles)
        return super().unusual() | ({"joint_angles": radians} if radians else {})

    def per_joint(self, name: str) -> np.ndarray:
        """Of every joint, (n_joints,) float64, what "joint_normal_stiffness", say, states for all or for each."""
        return np.broadcast_to(np.asarray(getattr(self, name), dtype=float), len(self.joint_angles))

    @property
    def joint_springs(self) -> np.ndarray:
        """Stiffness against opening [N/m], dislocation [N/m] and rotation [N m/rad] of every joint, (n_joints, 3)."""
        normal, shear, turning = map(
            self.per_joint, ("joint_normal_stiffness", "joint_shear_stiffness", "joint_rotational_stiffness")
        )
        return np.stack([normal, shear, self.face_turning if self.joint_contact == "face" else turning], axis=1)

    @property
    def face_turning(self) -> np.ndarray:
        """Stiffness k_n h^2/12 by which springs spread over its faces turn every joint, (n_joints,) [N m/rad]."""
        return self.per_joint("joint_normal_stiffness") * self.contact_heights**2 / 12

    @property
    def contact_heights(self) -> np.ndarray:
        """Height over which the faces of every joint touch, (n_joints,) float64 [m]."""
        if self.joint_contact_height is None:
            return np.full(len(self.joint_angles), self.thickness)
        return self.per_joint("joint_contact_height")

    @property
    def beside(self) -> Ring:
        """The ring beside this one, whose neighbour this one is."""
        if self.neighbour is None:
            raise ValueError("ring: must have a neighbour, got none; give one, or take the ring itself")
        turned = (np.array(self.joint_angles) + self.neighbour.rotation) % 360
        order = np.argsort(turned)
        values = {name: getattr(self, name) for name in PER_JOINT}
        own = {name: tuple(each[k] for k in order) for name, each in values.items() if isinstance(each, tuple) and each}
        back = self.neighbour.model_copy(update={"rotation": -self.neighbour.rotation})
        return self.model_copy(update={"joint_angles": tuple(turned[order]), "neighbour": back, **own})

    @property
    def tilts(self) -> np.ndarray:
        """By how much the outer end of every joint leans clockwise, (n_joints,) float64 [rad]."""
        return np.radians(self.joint_inclinations or np.zeros(len(self.joint_angles)))

    @property
    def bolts(self) -> tuple[Bolts, ...]:
        """Those of every joint; none where there are no bolts."""
        given = self.joint_bolts
        return () if given is None else given if isinstance(given, tuple) else (given,) * len(self.joint_angles)

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


def alone(ring: Ring) -> Ring:
    """A ring without its neighbour."""
    return ring.model_copy(update={"neighbour": None})
