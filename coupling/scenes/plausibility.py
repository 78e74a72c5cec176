"""Numbers that are possible but of another order of magnitude than any soil, water or lining: usually a wrong unit."""

from __future__ import annotations

import math
import warnings
from typing import TYPE_CHECKING, Any

from coupling.scenes.layers import entry_at
from coupling.scenes.rings import gate_tunnel
from structure.inputs import GushingWarning
from structure.plausibility import (
    DENSITY,
    GROUND,
    LENGTH,
    LIMITS,
    PERCENT,
    PRESSURE,
    RADIANS,
    RING,
    SEGMENT,
    is_number,
    joints_in_radians,
    unusual,
)  # fmt: skip

if TYPE_CHECKING:
    from coupling.scenes.scene import Scene

#: Table and key to (lowest, highest, unit, other units that people use with their factors). Zero always passes: it
#: leaves a property out. The ranges are those of handbooks, widened until soft clay, rock and small models fit in.
USUAL = {
    "soils": {
        "youngs_modulus": (2e5, 2e10, "Pa", PRESSURE),
        "cohesion": (100, 5e6, "Pa", PRESSURE),
        "tensile_strength": (100, 5e6, "Pa", PRESSURE),
        "friction_angle": (5, 50, "degrees", RADIANS),
        "dilatancy_angle": (0.7, 30, "degrees", RADIANS),
        "porosity": (0.15, 0.8, "as a fraction", PERCENT),
        "loose_porosity": (0.2, 0.9, "as a fraction", PERCENT),
        "grain_density": (1500, 4000, "kg/m3", DENSITY),
        "hydraulic_conductivity": (1e-12, 0.1, "m/s", {"m/day": 1 / 86400, "mm/s": 1e-3}),
        "k0": (0.1, 4, "as a ratio", PERCENT),
    },
    "water": {
        "table_depth": (0.01, 500, "m", LENGTH),
        "density": (900, 1300, "kg/m3", DENSITY),
        "bulk_modulus": (5e6, 5e9, "Pa", PRESSURE),
    },
    "tunnels": {
        "cover": (0.3, 500, "m", LENGTH),
        "outer_diameter": (0.5, 25, "m", LENGTH),
        "inner_diameter": (0.5, 25, "m", LENGTH),
        "friction_coefficient": (0.02, 1.2, "as a ratio", PERCENT),
    },
    "gate": {"width": (0.005, 3, "m", LENGTH)},
    "discretisation": {
        "element_size": (0.005, 50, "m", LENGTH),
        "element_size_lining": (0.005, 50, "m", LENGTH),
        "element_size_interior": (0.005, 50, "m", LENGTH),
    },
    "ring": RING,
    "ring.ground": GROUND,
    "limits": LIMITS,
    "limits.segment": SEGMENT,
}
#: Least ground between a tunnel and the held edges of the box, in diameters; analyses of practice leave twice as much.
LEAST_BESIDE, LEAST_BELOW = 1.5, 1.0


def warnings_of(scene: Scene) -> list[str]:
    """What a user should look at again before a run: one sentence a number, empty where all is usual."""
    data = scene.model_dump(exclude_none=True)
    told = [f"{shown(path)} {hint}" for path, hint in hints(data).items() if not _follows(path, data)]
    told += _other_rings(scene)
    stop, output = scene.stop, scene.output
    if stop.time is not None and output.interval >= stop.time:
        told.append(
            f"output.interval {output.interval:g} s is not below stop.time {stop.time:g} s: only the first and the "
            f"last state are recorded; write e.g. {stop.time / 100:g}"
        )
    return told + _narrow_box(scene)


def warn_in_python(message: str) -> None:
    """Tell a user of Python what the command line prints: a :class:`structure.GushingWarning`."""
    warnings.warn(message, GushingWarning, stacklevel=3)


def _narrow_box(scene):
    """Tunnels so close to the edges of the box that these hold the ground around them, as sentences."""
    told, box = [], scene.box
    for k, tunnel in enumerate(scene.tunnels):
        diameter = tunnel.outer_diameter
        beside = box.width / 2 - abs(tunnel.x) - tunnel.outer_radius
        below = box.depth - tunnel.axis_depth - tunnel.outer_radius
        for key, space, least, grown in (
            ("width", beside, LEAST_BESIDE * diameter, 2 * (abs(tunnel.x) + tunnel.outer_radius)),
            ("depth", below, LEAST_BELOW * diameter, tunnel.axis_depth + tunnel.outer_radius),
        ):
            if space < least:
                where = "beside" if key == "width" else "below"
                wide = grown + (2 if key == "width" else 1) * least
                told.append(
                    f"box.{key} leaves {space:.3g} m {where} tunnel {k} of {diameter:g} m: its edge, which is held, "
                    f"takes part in what happens at the tunnel; leave {least / diameter:g} diameters, "
                    f"write {math.ceil(wide)} m or more"
                )
    return told


def _other_rings(scene):
    """Where a ring is taken for a tunnel of other diameters than those of [ring]."""
    ring, own = scene.ring, gate_tunnel(scene)
    return [
        f"tunnels[{k}] is not as wide as tunnel {own}, which [ring] describes: its ring is taken with the concrete and "
        "joints of [ring] and its own diameters; leave its forces aside if it is built otherwise"
        for k, tunnel in enumerate(scene.tunnels)
        if ring is not None and k != own
        and (tunnel.outer_diameter, tunnel.inner_diameter) != (ring.outer_diameter, ring.inner_diameter)
    ]  # fmt: skip


def hints(data: dict[str, Any]) -> dict[tuple[Any, ...], str]:
    """Unusual numbers of a scene's nested dictionary, validated or not.

    Returns: path of the key to what to think of.
    """
    found = {}
    for name, usual in USUAL.items():
        table = entry_at(data, name.split("."))
        tables = enumerate(table) if isinstance(table, list | tuple) else [(None, table)]
        for index, entry in tables:
            path = (*name.split("."), *(() if index is None else (index,)))
            for key, (low, high, unit, others) in usual.items():
                value = entry.get(key) if isinstance(entry, dict) else None
                several = isinstance(value, list | tuple)
                for k, number in enumerate(value if several else (value,)):
                    hint = unusual(number, low, high, unit, others)
                    if hint:
                        found[(*path, key, k) if several else (*path, key)] = hint
    found |= _angles_in_radians(data)
    return found


def shown(path: tuple[Any, ...]) -> str:
    """A path as people write it: soils[0].porosity."""
    text = ""
    for part in path:
        name = part if part != "" else '""'
        text += f"[{part}]" if isinstance(part, int) else f"{'.' * bool(text)}{name}"
    return text


def _angles_in_radians(data):
    """The gate or all joints within a few degrees of the crown, at simple fractions of pi."""
    found = {}
    gate, ring = data.get("gate"), data.get("ring")
    angle = gate.get("angle") if isinstance(gate, dict) else None
    if is_number(angle) and 0 < angle <= 2 * math.pi + 1e-3:
        steps = angle / (math.pi / 12)
        if abs(steps - round(steps)) < 0.005 and abs(2 * angle - round(2 * angle)) > 1e-9:
            found["gate", "angle"] = (
                f"is a simple fraction of pi, got {angle:g} degrees; if radians were meant, write "
                f"{math.degrees(angle):.4g}"
            )
    joints = joints_in_radians(ring.get("joint_angles")) if isinstance(ring, dict) else ""
    if joints:
        found["ring", "joint_angles"] = joints
    return found


def _follows(path, data):
    """Whether a number of the ring only repeats one of tunnel or soil, where it is told of."""
    if path[0] != "ring":
        return False
    others = data.get("tunnels", ()) if path[1] != "ground" else data.get("soils", ())
    return any(entry.get(path[-1]) == entry_at(data, path) for entry in others)
