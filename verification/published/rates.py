"""How fast material comes through a gap by theories of their own: orifice, dry hopper, seepage to a sink."""

import numpy as np

#: Contraction of a jet behind a sharp-edged slot, pi/(pi + 2) (Kirchhoff 1869).
CONTRACTION = np.pi / (np.pi + 2)
#: Of dry grains out of a long slot, mass per length C rho sqrt(g) b^1.5, grains small beside b (Nedderman 1992, after
#: Beverloo, Leniger & van de Velde 1961).
SLOT = 1.03


def independent_rates(scene) -> dict[str, float]:
    """Rates through the gate of a scene as if it were something simpler [kg/m/s].

    scene : coupling.Scene.

    Returns: heavy liquid: grains of a saturated ground without strength under its own weight, out of an orifice; water:
    water out of the same orifice;  dry hopper: grains of dry sand out of a silo with this slot in its floor; seepage:
    water that seeps through ground at rest, see `verification.sensitivity.inflow.seepage`.
    """
    from verification.sensitivity.inflow import seepage

    gate, soil = scene.gate, scene.soils[0]
    tunnel = scene.tunnels[gate.tunnel]
    depth = tunnel.axis_depth - tunnel.outer_radius * np.cos(np.radians(gate.angle))
    grains = (1 - soil.porosity) * soil.grain_density
    discharge = CONTRACTION * gate.width * np.sqrt(2 * scene.gravity * depth)
    return {
        "heavy liquid": float(grains * discharge),
        "water": float(scene.water.density * discharge),
        "dry hopper": float(SLOT * grains * np.sqrt(scene.gravity) * gate.width**1.5),
        "seepage": float(seepage(scene, soil.hydraulic_conductivity)),
    }
