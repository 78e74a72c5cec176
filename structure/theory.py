"""What theory says of a lining beside its models: the pressures before it leaks, and the moment of a curved section.

Signs as in :mod:`structure.response`. The closed forms that rings are checked against are in
`verification.problems.exact_rings`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from structure.response import COORDINATES, described

if TYPE_CHECKING:
    import xarray as xr

    from structure.ring import Ring


def theoretical_pressures(
    *,
    outer_diameter: float,
    cover: float,
    buoyant_unit_weight: float,
    coefficient_at_rest: float,
    water_unit_weight: float = 9810.0,
    water_table_depth: float = 0.0,
    unit_weight_above_water: float | None = None,
    shear: bool = True,
    theta: np.ndarray | None = None,
) -> xr.Dataset:
    """Geostatic and hydrostatic pressures on an undisturbed circle, as a pressures dataset of one time.

    Effective stresses s_v from the overburden and s_h = K0 s_v meet the circle with the normal s_v cos^2 + s_h sin^2
    and the shear (s_v - s_h) sin cos.

    Parameters
    ----------
    outer_diameter, cover : float
        [m]; cover from the surface to the crown.
    buoyant_unit_weight, water_unit_weight : float
        [N/m3].
    coefficient_at_rest : float
        K0 [-]; nu/(1 - nu) for an elastic ground under its own weight.
    water_table_depth : float
        [m] below the surface, 0 to the cover.
    unit_weight_above_water : float, optional
        [N/m3], needed where the water table is below the surface.
    shear : bool
        False: a frictionless lining, no tangential traction.
    theta : (n,) float64, optional
        [degree]; every degree if left out.

    Returns
    -------
    xarray.Dataset
        soil_pressure, water_pressure, soil_shear (time, theta) [Pa].

    Examples
    --------
    >>> loads = theoretical_pressures(
    ...     outer_diameter=6.6, cover=20.0, buoyant_unit_weight=8.9e3, coefficient_at_rest=0.577
    ... )
    >>> [round(loads.soil_pressure.sel(theta=angle).item() / 1e3) for angle in (0, 90, 180)]
    [178, 120, 237]
    """
    import xarray as xr

    _refuse_water_table(cover, water_table_depth, unit_weight_above_water)
    theta = np.arange(0.0, 360.0, 1.0) if theta is None else np.asarray(theta, dtype=float)
    angle = np.radians(theta)
    depth_below_table = cover + outer_diameter / 2 * (1 - np.cos(angle)) - water_table_depth
    above_table = 0.0 if unit_weight_above_water is None else unit_weight_above_water * water_table_depth
    vertical = above_table + buoyant_unit_weight * depth_below_table
    horizontal = coefficient_at_rest * vertical
    fields = {
        "soil_pressure": (
            vertical * np.cos(angle) ** 2 + horizontal * np.sin(angle) ** 2,
            "effective soil pressure on the lining",
        ),
        "water_pressure": (water_unit_weight * depth_below_table, "water pressure on the lining"),
        "soil_shear": (
            (vertical - horizontal) * np.sin(angle) * np.cos(angle) * float(shear),
            "soil shear on the lining, clockwise positive",
        ),
    }
    return xr.Dataset(
        described(("time", "theta"), {name: (values[None], "Pa", about) for name, (values, about) in fields.items()}),
        described("time", {"time": ([0.0], *COORDINATES["time"])})
        | described("theta", {"theta": (theta, *COORDINATES["theta"])}),
        attrs={"title": "theoretical pressures: overburden with K0, hydrostatic water"},
    )


def _refuse_water_table(cover, water_table_depth, unit_weight_above_water):
    if not 0 <= water_table_depth <= cover:
        raise ValueError(
            f"theoretical_pressures: water_table_depth must lie in [0, cover = {cover:g}] m, got {water_table_depth:g};"
            " a table below the crown or above the ground is beyond this formula"
        )
    if water_table_depth > 0 and unit_weight_above_water is None:
        raise ValueError(
            "theoretical_pressures: unit_weight_above_water is needed for a water table below the surface, got none"
        )


def curved_section_moment(axial_force: np.ndarray, ring: Ring) -> np.ndarray:
    """Moment [N m/m] by which a thick ring exceeds one of straight beams: N t^2/(12 R), less what joints release.

    The inner fibres of a curved section are shorter, so thrust on the centre line turns it as a moment -N t^2/(12 R)
    would. In a closed ring those rotations, and those of joints of stiffness k, must add up to zero, which takes a
    uniform moment of N t^2/(12 R)/(1 + sum(1/k) EI/(2 pi R)). Exact for a uniform N in a thin ring (Winkler's curved
    beam, first order).
    """
    radius, turning = ring.centre_radius, ring.joint_springs[:, 2]
    offset = axial_force * ring.thickness**2 / (12 * radius)
    if np.any(turning == 0):
        return 0 * offset
    return offset / (1 + np.sum(1 / turning) * ring.bending_stiffness / (2 * np.pi * radius))
