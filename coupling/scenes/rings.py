"""The ring of a tunnel and its limits: units, what follows from the ground, and rings beside [ring]."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from coupling.refused import SceneError
from mpm.quantities import quantity_in
from mpm.scene import Scene as MpmScene
from structure.inputs import Mistake, mistakes
from structure.limits import OWN, Limits
from structure.response import RESPONSE
from structure.ring import Ring

if TYPE_CHECKING:
    from coupling.scenes.scene import Scene

#: Dotted keys of [ring] and [limits] to the units of `structure`, so that they take strings with units as other tables
#: do. A ring is one metre of tunnel: what is per metre may leave that out.
UNITS = {
    f"{table}.{name}": unit
    for (table, unit), names in {
        ("ring", "m"): "outer_diameter inner_diameter joint_contact_height joint_bolts.offset "
        "joint_bolts.length joint_bolts.slack neighbour.ring_width",
        ("ring", "degree"): "joint_angles joint_inclinations neighbour.rotation ground.friction_angle",
        ("ring", "Pa"): "concrete_modulus ground.youngs_modulus ground.cohesion ground.vertical_stress "
        "ground.horizontal_stress ground.limit_pressure_normal ground.limit_pressure_tangential",
        ("ring", "N/m**3"): "concrete_unit_weight",
        ("ring", "N*m/rad/m"): "joint_rotational_stiffness",
        ("ring", "N/m/m"): "joint_normal_stiffness joint_shear_stiffness joint_bolts.stiffness "
        "neighbour.radial_stiffness neighbour.tangential_stiffness",
        ("ring", "N/m"): "joint_bolts.preload",
        ("limits", "N/m**3"): "stability.buoyant_unit_weight",
        ("limits", "m"): "gasket_opening gasket_offset joint_dislocation joint_contact_height crack_width "
        "stability.cover capacity.minimum_eccentricity segment.cover_outer segment.cover_inner "
        "segment.bar_diameter_outer segment.bar_diameter_inner segment.bar_spacing_outer segment.bar_spacing_inner",
    }.items()
    for name in names.split()
} | {f"limits.own.{name}": RESPONSE[name][1].replace(" ", "*") for name in OWN}


def in_si(data: dict[str, Any], table: str) -> tuple[dict[str, Any], list[Mistake]]:
    """A table of the structure, "ring" or "limits", with its quantities as numbers, and the mistakes among them."""
    numbers, wrong = dict(data), []
    for key, value in data.items():
        name = f"{table}.{key}"
        if isinstance(value, dict):
            numbers[key], more = in_si(value, name)
            wrong += more
        elif isinstance(value, list | tuple) and value and all(isinstance(entry, dict) for entry in value):
            found = [in_si(entry, name) for entry in value]
            numbers[key] = [entry for entry, _ in found]
            wrong += [mistake for _, more in found for mistake in more]
        elif name in UNITS:
            try:
                several = isinstance(value, list | tuple)
                numbers[key] = [number_of(name, entry) for entry in value] if several else number_of(name, value)
            except ValueError as problem:
                wrong.append((tuple(name.split(".")), str(problem)))
    return numbers, wrong


def number_of(name: str, value: Any) -> Any:
    """A value of the structure as a number in its unit; `name` as "ring.ground.cohesion".

    Raises ValueError: as :func:`mpm.quantities.quantity_in`.
    """
    unit = UNITS.get(name)
    if unit is None:
        return value
    try:
        return quantity_in(unit.removesuffix("/m"), value)
    except ValueError:
        return quantity_in(unit, value)


def gate_tunnel(scene: MpmScene) -> int:
    """Number of the tunnel with the gate, which [ring] describes; 0 without a gate."""
    return scene.gate.tunnel if scene.gate is not None else 0


def derived_ring(scene: MpmScene) -> dict[str, Any]:
    """Keys of ``[ring]`` that follow from the tunnel with the gate, else the first: diameters and `ground`."""
    if not scene.tunnels:
        return {}
    tunnel = scene.tunnels[gate_tunnel(scene)]
    return {
        "outer_diameter": tunnel.outer_diameter,
        "inner_diameter": tunnel.inner_diameter,
        "ground": ground_at_axis(scene, tunnel.axis_depth),
    }


def ring_of(scene: Scene, tunnel: int) -> Ring:
    """The ring of a tunnel: that of the scene for the tunnel with the gate (else the first), the same concrete and
    joints with the tunnel's own diameters and the ground at its own axis for any other.

    Raises SceneError: no ring, or joints that the other diameters do not take.
    """
    if scene.ring is None:
        raise SceneError(f"scene '{scene.name}': has no [ring]; add one to get internal forces")
    own = gate_tunnel(scene)
    if tunnel == own:
        return scene.ring
    there, home = scene.tunnels[tunnel], scene.tunnels[own]
    values = scene.ring.model_dump() | {"outer_diameter": there.outer_diameter, "inner_diameter": there.inner_diameter}
    if values["ground"] is not None and there.axis_depth != home.axis_depth:
        values["ground"] |= ground_at_axis(scene, there.axis_depth)
    try:
        return Ring.model_validate(values)
    except ValidationError as error:
        said = "; ".join(message for _, message in mistakes(error, Ring))
        raise SceneError(f"scene '{scene.name}', ring of tunnel {tunnel}: {said}") from None


def moved_by(scene: Scene, tunnel: int) -> str | None:
    """Lining model of the ring that has moved in the ground as the lining of a tunnel; None where none has."""
    if not scene.tunnels or scene.lining_of(scene.tunnels[tunnel]) != "jointed":
        return None
    return scene.tunnels[tunnel].lining_model


def limits_at(scene: Scene, tunnel: int, limits: Limits | None) -> Limits | None:
    """Limits of a tunnel's ring; what their stability leaves out is that of the scene there."""
    if limits is None or limits.stability is None or not scene.tunnels:
        return limits
    cover = scene.tunnels[tunnel].cover
    known = {"cover": cover, "buoyant_unit_weight": scene.vertical_stress(cover) / cover}
    rule = limits.stability
    rule = rule.model_copy(update={key: value for key, value in known.items() if getattr(rule, key) is None})
    return limits.model_copy(update={"stability": rule})


def ground_at_axis(scene: MpmScene, depth: float) -> dict[str, float]:
    """Soil parameters and effective stresses [Pa] at `depth` [m], for the soil springs of the ring.

    Vertical: :meth:`mpm.Scene.vertical_stress`; horizontal: the K0 of
    :meth:`mpm.laws.soil.Soil.lateral_pressure_coefficient` times that.
    """
    vertical = scene.vertical_stress(depth)
    here = [soil for soil in scene.soils if soil.top_depth < depth or soil is scene.soils[0]][-1]
    return {
        "youngs_modulus": here.youngs_modulus_at(vertical),
        "poissons_ratio": here.poissons_ratio,
        **dict(zip(("cohesion", "friction_angle"), here.strength, strict=True)),
        "vertical_stress": vertical,
        "horizontal_stress": here.lateral_pressure_coefficient(vertical) * vertical,
    }
