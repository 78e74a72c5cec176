"""The ring of a tunnel as the page draws it: segments, the key, joints with their numbers, the gate; radius 100."""

from typing import Any

import numpy as np

from coupling.datasets.geometry import Gate, Tunnel

KEY = 0.75  # the key is the segment that is shorter than this share of any other
NUMBERS, ANGLES = 112.0, 76.0  # radii at which joints are numbered and their angles stand


def ring_drawing(tunnel: Tunnel, joints: list[float], gate: Gate | None) -> dict[str, Any]:
    """What the page needs to draw a ring, its y axis pointing down.

    joints : list of float, angles from the crown, clockwise, ascending [degree]; empty without joints;  gate : None
    where this tunnel has none.

    Returns: segments: list of {path, key}; joints: list of {number, angle, ends, label, text}; gate: {angle, half,
    outer, inner} or None; outer, inner [m].
    """
    inner = 100.0 * tunnel.inner / tunnel.outer
    ends = [(a, b + 360.0 * (b <= a)) for a, b in zip(joints, [*joints[1:], *joints[:1]], strict=True)]
    spans = [b - a for a, b in ends] or [360.0]
    key = _key(spans)
    whole = [(0.0, 180.0), (180.0, 360.0)]  # an arc cannot close on itself
    return {
        "outer": tunnel.outer,
        "inner": tunnel.inner,
        "segments": [{"path": _sector(a, b, inner), "key": k == key} for k, (a, b) in enumerate(ends or whole)],
        "joints": [
            {"number": k, "angle": angle, "ends": (_at(angle, 100.0), _at(angle, inner)),
             "label": _at(angle, NUMBERS), "text": _at(angle, ANGLES)}
            for k, angle in enumerate(joints, start=1)
        ],
        "gate": None if gate is None else {
            "angle": gate.angle, "half": 50.0 * (gate.width or 0.0) / tunnel.outer, "inner": inner,
            "label": _at(gate.angle, 128.0),
        },
    }  # fmt: skip


def _key(spans):
    """Number of the segment that is much shorter than the others, None without one."""
    order = np.argsort(spans)
    return int(order[0]) if len(spans) > 2 and spans[order[0]] < KEY * spans[order[1]] else None


def _at(angle, radius):
    turn = np.radians(angle)
    return round(float(radius * np.sin(turn)), 2), round(float(-radius * np.cos(turn)), 2)


def _sector(first, last, inner):
    """The path of a piece of the ring between two angles."""
    large = int(last - first > 180)
    (a, b), (c, d) = _at(first, 100.0), _at(last, 100.0)
    (e, f), (g, h) = _at(last, inner), _at(first, inner)
    back = f"A{inner:.2f} {inner:.2f} 0 {large} 0 {g} {h}"
    return f"M{a} {b}A100 100 0 {large} 1 {c} {d}L{e} {f}{back}Z"
