"""The soil around a ring and the law of its springs: reaction over displacement, with its limit and tangent."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field

from structure.inputs import Input
from structure.plausibility import GROUND, Usual

if TYPE_CHECKING:
    from structure.ring import Ring

#: Ratio of tangential to normal stiffness, stated with Eq. (8) by Xie et al.
TANGENTIAL_TO_NORMAL = 1 / 3


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


class SoilSpring(NamedTuple):
    """One soil spring law per area of the outer face.

    stiffness : initial stiffness eta_0 [Pa/m];  limit : p_lim [Pa], inf for a linear law;
    pulls : whether the reaction also exists at negative displacement.
    """

    stiffness: float
    limit: float
    pulls: bool


def limit_pressures(ground: Ground) -> tuple[float, float]:
    """Limit reaction of the soil, normal and tangential to the lining [Pa].

    p_n = 2 c cos(phi)/(1 - sin(phi)) + (1 + sin(phi))/(1 - sin(phi)) ds,  ds = (s_h + s_v)/2 nu/(1 - nu);
    p_t = c + (s_h + s_v)/2 tan(phi).

    Source: Do et al. (2014), hyperstatic reaction method, *as usually quoted*. The primary source could not be opened
    to check it, so limits measured or agreed for a site belong into ``Ground.limit_pressure_normal`` and
    ``Ground.limit_pressure_tangential``, which win. The quoted p_t is its second term alone, that of sand; soil shears
    along the lining at Coulomb's c + sigma tan(phi), and undrained clay (phi = 0) holds on to it by cohesion only.

    Examples
    --------
    >>> ground = Ground(youngs_modulus=4e7, poissons_ratio=0.3, cohesion=0.0, friction_angle=30.0,
    ...                 vertical_stress=2e5, horizontal_stress=1e5)
    >>> [round(limit / 1e3, 1) for limit in limit_pressures(ground)]
    [192.9, 86.6]
    """
    sin_phi = math.sin(math.radians(ground.friction_angle))
    cos_phi = math.cos(math.radians(ground.friction_angle))
    mean_stress = (ground.horizontal_stress + ground.vertical_stress) / 2
    confinement = mean_stress * ground.poissons_ratio / (1 - ground.poissons_ratio)
    normal = (2 * ground.cohesion * cos_phi + (1 + sin_phi) * confinement) / (1 - sin_phi)
    tangential = ground.cohesion + mean_stress * sin_phi / cos_phi
    if ground.limit_pressure_normal is not None:
        normal = ground.limit_pressure_normal
    if ground.limit_pressure_tangential is not None:
        tangential = ground.limit_pressure_tangential
    return normal, tangential


def soil_springs(ring: Ring) -> tuple[SoilSpring, SoilSpring]:
    """Normal and tangential soil spring of a ring with ground.

    Initial stiffness eta_0 = 4/(1 + nu) E/D with the outer diameter D. Source: Xie et al., Eq. (8).
    """
    ground = ring.ground
    if ground is None:
        raise ValueError("ring: soil springs need a ground, got None; give ring.ground")
    normal_limit, tangential_limit = limit_pressures(ground)
    if ground.law == "linear":
        normal_limit = tangential_limit = math.inf
    stiffness = 4 / (1 + ground.poissons_ratio) * ground.youngs_modulus / ring.outer_diameter
    share = TANGENTIAL_TO_NORMAL if ground.tangential_springs else 0.0
    return (
        SoilSpring(stiffness, normal_limit, ground.two_way),
        SoilSpring(share * stiffness, tangential_limit, True),
    )


def soil_reaction(displacement: np.ndarray, spring: SoilSpring) -> tuple[np.ndarray, np.ndarray]:
    """Reaction of the soil and its derivative. The reaction never falls with d, so that Newton cannot cycle.

    p = eta_0 d p_lim/(p_lim + eta_0 d), odd in d where the spring pulls, else zero for d < 0.

    Parameters
    ----------
    displacement : (n,) float64
        d [m], positive into the soil (normal) or clockwise (tangential).
    spring : SoilSpring

    Returns
    -------
    reaction : (n,) float64
        [Pa], against the displacement.
    tangent : (n,) float64
        dp/dd [Pa/m]; at d = 0 the initial stiffness.

    Source: Xie et al., Eq. (7).

    >>> spring = SoilSpring(stiffness=2e7, limit=1e5, pulls=False)
    >>> reaction, tangent = soil_reaction(np.array([-0.001, 0.0, 0.005]), spring)
    >>> reaction.tolist()
    [0.0, 0.0, 50000.0]
    """
    stiffness, limit, pulls = spring
    if limit == 0 or stiffness == 0:
        zero = np.zeros_like(displacement)
        return zero, zero
    ratio = stiffness * np.abs(displacement) / limit
    reaction = stiffness * displacement / (1 + ratio)
    tangent = stiffness / (1 + ratio) ** 2
    if not pulls:
        open_gap = displacement < 0
        reaction, tangent = np.where(open_gap, 0.0, reaction), np.where(open_gap, 0.0, tangent)
    return reaction, tangent
