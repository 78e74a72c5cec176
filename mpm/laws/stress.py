"""Stress and strain of a point in plane strain, as the laws take and give them."""

from typing import NamedTuple


class Stress(NamedTuple):
    """Effective stress, tension positive [Pa]."""

    xx: float
    yy: float
    zz: float
    xy: float


class Strain(NamedTuple):
    """Strain increments of a step, expansion positive [-]."""

    xx: float
    yy: float
    xy: float  # of the tensor: half the engineering shear strain
    spin: float
    expansion: float  # xx + yy
    expansion_liquid: float  # of the pore water
    shrunk: float  # 1 / (1 + expansion)
    equivalent: float  # deviatoric, sqrt(2/3 e:e); 0 while the initial state settles: strain counts from then on


def elastic_trial(stress, strain, lame, shear):
    """Stress after an elastic strain: lame, shear [Pa] are Lame's first constant and the shear modulus."""
    volumetric = lame * strain.expansion
    return Stress(
        stress.xx + volumetric + 2.0 * shear * strain.xx,
        stress.yy + volumetric + 2.0 * shear * strain.yy,
        stress.zz + volumetric,
        stress.xy + 2.0 * shear * strain.xy,
    )
