"""The ring of a tunnel: what of it follows from the ground, and those of the tunnels that [ring] does not describe."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from coupling.refused import SceneError
from structure.inputs import mistakes
from structure.ring import Ring

if TYPE_CHECKING:
    from coupling.scenes.scene import Scene
    from mpm.scene import Scene as MpmScene


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

    Raises
    ------
    SceneError
        No ring, or joints that the other diameters do not take.
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


def ground_at_axis(scene: MpmScene, depth: float) -> dict[str, float]:
    """Soil parameters and effective stresses [Pa] at `depth` [m], for the soil springs of the ring.

    Vertical: :meth:`mpm.Scene.vertical_stress`; horizontal: the K0 of
    :meth:`mpm.scene.Soil.lateral_pressure_coefficient` times that.
    """
    vertical = scene.vertical_stress(depth)
    here = [soil for soil in scene.soils if soil.top_depth < depth or soil is scene.soils[0]][-1]
    return {
        "youngs_modulus": here.youngs_modulus,
        "poissons_ratio": here.poissons_ratio,
        "cohesion": here.cohesion,
        "friction_angle": here.friction_angle,
        "vertical_stress": vertical,
        "horizontal_stress": here.lateral_pressure_coefficient(vertical) * vertical,
    }
