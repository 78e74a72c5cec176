"""Units of the numbers of a ring, so that [ring] takes strings with units as the other tables do."""

from typing import Any

from mpm.quantities import quantity_in

#: Key of [ring] to the unit of `structure.Ring`. A ring is one metre of tunnel: what is per metre may leave that out.
RING = {
    "outer_diameter": "m",
    "inner_diameter": "m",
    "concrete_modulus": "Pa",
    "concrete_unit_weight": "N/m**3",
    "joint_angles": "degree",
    "joint_rotational_stiffness": "N*m/rad/m",
    "joint_normal_stiffness": "N/m/m",
    "joint_shear_stiffness": "N/m/m",
    "joint_contact_height": "m",
}
#: The same of [ring.ground] and `structure.ring.Ground`.
GROUND = {
    "youngs_modulus": "Pa",
    "cohesion": "Pa",
    "friction_angle": "degree",
    "vertical_stress": "Pa",
    "horizontal_stress": "Pa",
    "limit_pressure_normal": "Pa",
    "limit_pressure_tangential": "Pa",
}


def ring_in_si(ring: dict[str, Any]) -> tuple[dict[str, Any], list[tuple[tuple[Any, ...], str]]]:
    """The table [ring] with its quantities as numbers, and the mistakes among them: location and message."""
    converted, mistakes = _converted(ring, RING, ("ring",))
    if isinstance(ring.get("ground"), dict):
        converted["ground"], more = _converted(ring["ground"], GROUND, ("ring", "ground"))
        mistakes += more
    return converted, mistakes


def _converted(table, units, location):
    numbers, mistakes = dict(table), []
    for name in units.keys() & table.keys():
        value, where = table[name], (*location, name)
        try:
            if isinstance(value, list | tuple):
                numbers[name] = [ring_number(where, entry) for entry in value]
            else:
                numbers[name] = ring_number(where, value)
        except ValueError as problem:
            mistakes.append((where, str(problem)))
    return numbers, mistakes


def ring_unit(location: tuple[str, ...]) -> str | None:
    """Unit of a key of [ring], None where it has none."""
    return (GROUND if "ground" in location else RING).get(location[-1] if len(location) > 1 else "")


def ring_number(location: tuple[str, ...], value: Any) -> Any:
    """A value of [ring] as a number in its unit; `location` as ("ring", "ground", "cohesion").

    Raises
    ------
    ValueError
        As :func:`mpm.quantities.quantity_in`.
    """
    unit = ring_unit(location)
    if unit is None:
        return value
    per_metre = unit.removesuffix("/m")
    if per_metre != unit:
        try:
            return quantity_in(per_metre, value)
        except ValueError:
            pass
    return quantity_in(unit, value)
