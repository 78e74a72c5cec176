"""Whether the ground holds the tunnel down against its uplift, and bears it: checks of the tunnel as a whole."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from structure.ring import Ring

if TYPE_CHECKING:
    import xarray as xr

    from structure.limits import StabilityRule

#: [m/s2]
GRAVITY = 9.81


def resultants(pressures: xr.Dataset, outer_radius: float) -> dict[str, np.ndarray]:
    """What the pressures on a lining come to, (n_times,) each.

    pressures : complete around the ring, as of :func:`structure.pressures.check_pressures`.

    Returns
    -------
    water_uplift : upward resultant of the water pressure [N/m].
    soil_support : mean vertical stress that soil pressure and shear exert upward on the lower half, over the outer
    diameter [Pa].
    """
    theta = np.radians(np.arange(0.25, 360, 0.5))
    at = np.radians(pressures["theta"].values.astype(float))

    def around(name):
        rows = pressures[name].transpose("time", "theta").values
        return np.stack([np.interp(theta, at, row, period=2 * np.pi) for row in rows])

    arc, lower = outer_radius * np.radians(0.5), np.cos(theta) < 0
    upward = -np.cos(theta) * around("soil_pressure") - np.sin(theta) * around("soil_shear")
    return {
        "water_uplift": -(around("water_pressure") * np.cos(theta)).sum(axis=1) * arc,
        "soil_support": upward[:, lower].sum(axis=1) * arc / (2 * outer_radius),
    }


def bearing_resistance(cohesion: float, friction_angle: float, overburden: float, weight: float) -> float:
    """Bearing resistance of the ground below a long level strip [Pa].

    q = c N_c + q' N_q + gamma' B N_gamma/2, with N_q = exp(pi tan(phi)) tan^2(45 + phi/2), N_c = (N_q - 1)/tan(phi),
    5.14 for phi = 0, and N_gamma = 2 (N_q - 1) tan(phi). Source: EN 1997-1:2004, Annex D.

    Parameters
    ----------
    cohesion : float
        [Pa]
    friction_angle : float
        [degree]
    overburden : float
        q', effective, beside the strip [Pa].
    weight : float
        gamma' B [Pa].
    """
    slope = math.tan(math.radians(friction_angle))
    of_overburden = math.exp(math.pi * slope) * math.tan(math.radians(45 + friction_angle / 2)) ** 2
    of_cohesion = (of_overburden - 1) / slope if slope > 0 else math.pi + 2
    return cohesion * of_cohesion + overburden * of_overburden + weight * (of_overburden - 1) * slope


def stability_checks(response: xr.Dataset, rule: StabilityRule, ring: Ring) -> dict[str, Any]:
    """Flotation and bearing as utilisations (time).

    Flotation, EN 1997-1, 2.4.7.4 (UPL): the uplift of the water over the weights of the ring and of the ground above
    it, as wide as the tunnel, less what flowed in; friction beside it is left out. Bearing: the mean vertical soil
    stress under the lower half over the resistance of the ground at the invert below a strip as wide as the tunnel.

    Raises
    ------
    ValueError
        The response has no water_uplift or soil_support: that of an earlier version; or no scene gave what the rule
        leaves out.
    """
    missing = [name for name in ("water_uplift", "soil_support") if name not in response]
    if missing:
        raise ValueError(f"check: stability needs {' and '.join(missing)} in the response, got none; respond again")
    if left_out := [key for key in ("cover", "buoyant_unit_weight") if getattr(rule, key) is None]:
        raise ValueError(f"check: stability.{left_out[0]} must be given where no scene has it, got none; state it")
    width = ring.outer_diameter
    of_ring = ring.concrete_unit_weight * math.pi * (ring.outer_radius**2 - (ring.inner_diameter / 2) ** 2)
    above = rule.buoyant_unit_weight * (width * (rule.cover + width / 2) - math.pi * width**2 / 8)
    lost = GRAVITY * response["inflow_mass"] if "inflow_mass" in response.variables else 0.0
    held = rule.weight_factor * np.maximum(of_ring + above - lost, 1e-300)
    uplift = rule.uplift_factor * np.maximum(response["water_uplift"], 0.0)
    ground, weight = ring.ground, rule.buoyant_unit_weight
    resisted = bearing_resistance(
        ground.cohesion, ground.friction_angle, weight * (rule.cover + width), weight * width
    )  # fmt: skip
    pressed = rule.bearing_factor * np.maximum(response["soil_support"], 0.0)
    about = {
        "flotation_utilisation": (uplift / held, "uplift of the water over what holds the tunnel down"),
        "ground_bearing_utilisation": (pressed / resisted, "soil stress below the tunnel over the bearing resistance"),
    }
    return {name: share.assign_attrs(units="1", long_name=words) for name, (share, words) in about.items()}
