"""What is computed in a scene, what is left out, and why."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from coupling.scenes.scene import Scene
    from mpm.scene import Scene as MpmScene
    from mpm.scene import Soil


def features(scene: Scene, threads: int, why_alone: str = "one thread") -> list[dict[str, Any]]:
    """What is active in a scene, what is left out, and why: list of {feature, active, reason}.

    scene : coupling.Scene;  threads : int;  why_alone : str, the reason where it is one.
    """
    s, numerics = scene, scene.numerics
    plastic = [soil.name for soil in s.soils if soil.model == "mohr-coulomb"]
    resting = [f"{t.friction_coefficient:g}" for t in s.tunnels if t.friction_coefficient > 0]
    resolved = s.gate is not None and s.interior == "resolved"
    inside = "no gate: nothing can enter" if s.gate is None else "sink: what leaves the channel is counted and removed"
    if resolved:
        inside = "material falls, piles up, can choke the gate"
    snapshots = s.output.snapshot_interval
    points = f"every {snapshots:g} s" if snapshots else "only the first and the last: no snapshot_interval"
    table = (
        (
            "pore water",
            s.water is not None,
            f"water table {s.water.table_depth:g} m below the surface" if s.water else "dry: no liquid is computed",
        ),
        (
            "two velocities, of grains and water",
            s.is_two_phase,
            _velocities(s),
        ),
        (
            "Mohr-Coulomb return mapping",
            bool(plastic),
            f"soils {', '.join(plastic)}" if plastic else "all soils are elastic",
        ),
        ("gate", s.gate is not None, f"{s.gate.width:g} m at {s.gate.angle:g} deg" if s.gate else "the scene has none"),
        (
            "friction on the lining",
            bool(resting),
            f"coefficient {', '.join(resting)}" if resting else _frictionless(s),
        ),
        (
            "K0 of gravity loading",
            any(soil.k0 is None for soil in s.soils),
            "; ".join(f"{soil.name}: {initial_k0_text(s, soil)}" for soil in s.soils),
        ),
        ("slip along the lining before the gate opens", *_initial_slip(s)),
        ("tunnel interior", resolved, inside),
        (
            "pressure filter",
            numerics.pressure_filter > 0 and s.water is not None,
            f"{numerics.pressure_filter:g} of what no node feels, a step" if numerics.pressure_filter else "set to 0",
        ),
        (
            "stress damping",
            numerics.stress_damping > 0,
            f"stress runs ahead by {numerics.stress_damping:g} of a step" if numerics.stress_damping else "set to 0",
        ),
        ("motion of the lining", any(s.lining_of(t) != "fixed" for t in s.tunnels), _linings(s)),
        ("the half x < 0", not s.is_half, _why_half(s)),
        (
            "snapshots of the points",
            s.output.points,
            points if s.output.points else "pressures and history only: output.points = false",
        ),
        ("several threads", threads > 1, f"{threads} threads" if threads > 1 else why_alone),
        (
            "ring response",
            scene.ring is not None,
            f"beam-spring, {len(scene.ring.joint_angles)} joints" if scene.ring else "the scene has no [ring]",
        ),
    )
    return [{"feature": name, "active": bool(active), "reason": reason} for name, active, reason in table]


def initial_k0(scene: MpmScene) -> list[dict[str, Any]]:
    """The K0 that each soil begins with.

    Returns
    -------
    list of dict
        soil: its name; lowest, highest: K0 within the layer [-]; source: "given", "gravity loading" or "yield surface",
        where gravity loading is brought to the strength of the soil; yield_depth: from where on [m], else None.
    """
    rows = []
    for soil in scene.soils:
        lowest, highest = scene.lateral_pressure_range(soil)
        depth = None if soil.k0 is not None else scene.yield_depth(soil, soil.elastic_k0)
        source = "gravity loading" if highest == soil.elastic_k0 else "yield surface"
        source = "given" if soil.k0 is not None else source
        rows.append({"soil": soil.name, "lowest": lowest, "highest": highest, "source": source, "yield_depth": depth})
    return rows


def initial_k0_text(scene: MpmScene, soil: Soil) -> str:
    """The K0 of a soil and where it comes from, in words."""
    (row,) = (row for one, row in zip(scene.soils, initial_k0(scene), strict=True) if one is soil)
    if row["source"] == "given":
        return f"K0 {row['highest']:.4g}, given"
    if row["source"] == "gravity loading":
        return f"K0 {row['highest']:.4g} = nu/(1 - nu)"
    span = "" if row["lowest"] == row["highest"] else f"{row['lowest']:.4g} .. "
    begin = "" if row["yield_depth"] is None else f" from a depth of {row['yield_depth']:.3g} m"
    return (
        f"K0 {span}{row['highest']:.4g}, gravity loading, nu/(1 - nu) = {soil.elastic_k0:.4g} brought to the yield "
        f"surface{begin}"
    )


def _velocities(s):
    if s.is_undrained:
        return "drainage = 'undrained': water moves with the grains, no drag, no conductivity"
    return "also where they hardly differ: drag is implicit, no permeability limits the step" if s.water else "dry"


def _frictionless(s):
    return "coefficient 0: the wall takes the normal part only" if s.tunnels else "no tunnel"


def _initial_slip(s):
    """Whether the lining's friction does not bear the K0 stress of bonded ground, and why."""
    short = [(s.bond_friction(t), t.friction_coefficient) for t in s.tunnels]
    if not short:
        return False, "no tunnel"
    asked, given = max(short, key=lambda pair: pair[0] - pair[1])
    return asked > given, f"K0 asks for a coefficient of {asked:.2g}, the lining has {given:g}"


def _why_half(s):
    if s.is_half:
        return "the scene is its own mirror image: x >= 0 is computed, results are of the whole"
    return s.asymmetry or "symmetry = 'whole'; 'auto' would compute x >= 0 only"


def _linings(s):
    """How the linings stand in the ground, in words."""
    kinds = [
        f"'elastic', {t.lining_modulus / 1e9:g} GPa, {t.lining_harmonics} harmonics"
        if s.lining_of(t) == "elastic"
        else f"'{s.lining_of(t)}'"
        for t in s.tunnels
    ] or [f"'{s.lining}'"]
    if len(set(kinds)) == 1:
        return f"lining = {kinds[0]}"
    return "; ".join(f"tunnel {k}: lining = {kind}" for k, kind in enumerate(kinds))
