"""What a scene is, what is computed in it, what is left out, and why, in words."""

from typing import Any

from coupling.scenes.scene import Scene
from mpm.k0_procedure import bond_friction, lateral_pressure_range, yield_depth
from mpm.laws.soil import Soil
from mpm.scene import Scene as MpmScene


def features(scene: Scene, threads: int, why_alone: str = "one thread") -> list[dict[str, Any]]:
    """What is active in a scene, what is left out, and why: list of {feature, active, reason}.

    scene : coupling.Scene;  threads : int;  why_alone : str, the reason where it is one.
    """
    rows: list[dict[str, Any]] = []

    def part(name, active, reason):
        rows.append({"feature": name, "active": bool(active), "reason": reason})

    water, gate, numerics, output, ring = scene.water, scene.gate, scene.numerics, scene.output, scene.ring
    table = f"water table {water.table_depth:g} m below the surface" if water else "dry: no liquid is computed"
    part("pore water", water is not None, table)
    part("two velocities, of grains and water", scene.is_two_phase, _velocities(scene))
    plastic = [f"{soil.name} ({soil.model})" for soil in scene.soils if soil.model != "elastic"]
    part("plasticity of the soil", plastic, f"soils {', '.join(plastic)}" if plastic else "all soils are elastic")
    part("gate", gate is not None, f"{gate.width:g} m at {gate.angle:g} deg" if gate else "the scene has none")
    rough = [f"{t.friction_coefficient:g}" for t in scene.tunnels if t.friction_coefficient > 0]
    smooth = "coefficient 0: the wall takes the normal part only" if scene.tunnels else "no tunnel"
    part("friction on the lining", rough, f"coefficient {', '.join(rough)}" if rough else smooth)
    k0 = "; ".join(f"{soil.name}: {initial_k0_text(scene, soil)}" for soil in scene.soils)
    part("K0 of gravity loading", any(soil.k0 is None for soil in scene.soils), k0)
    part("slip along the lining before the gate opens", *_initial_slip(scene))
    inside = "sink: what leaves the channel is counted and removed"
    inside = "material falls, piles up, can choke the gate" if scene.interior == "resolved" else inside
    resolved = gate is not None and scene.interior == "resolved"
    part("tunnel interior", resolved, inside if gate is not None else "no gate: nothing can enter")
    share = numerics.pressure_filter
    what = f"{share:g} of what no node feels, a step" if share else "set to 0"
    part("pressure filter", share > 0 and water is not None, what)
    ahead = numerics.stress_damping
    part("stress damping", ahead > 0, f"stress runs ahead by {ahead:g} of a step" if ahead else "set to 0")
    part("motion of the lining", any(scene.lining_of(t) != "fixed" for t in scene.tunnels), _linings(scene))
    part("the half x < 0", not scene.is_half, _why_half(scene))
    interval = output.snapshot_interval
    kept = f"every {interval:g} s" if interval else "only the first and the last: no snapshot_interval"
    kept = kept if output.points else "pressures and history only: output.points = false"
    part("snapshots of the points", output.points, kept)
    part("several threads", threads > 1, f"{threads} threads" if threads > 1 else why_alone)
    answer = f"beam-spring, {len(ring.joint_angles)} joints{_springs(scene)}" if ring else "the scene has no [ring]"
    part("ring response", ring is not None, answer)
    told = scene.limits.in_words if scene.limits else "the scene has no [limits]"
    part("limits of the lining", scene.limits is not None, told)
    return rows


def facts(scene: Scene) -> list[tuple[str, str]]:
    """Numbers of a scene that an engineer asks for first: list of (what, value as text)."""
    rows: list[tuple[str, str]] = []

    def tell(what, value):
        rows.append((what, value))

    water, stop, mesh, ring = scene.water, scene.stop, scene.discretisation, scene.ring
    tell("box", f"{scene.box.width:g} m wide, {scene.box.depth:g} m deep")
    tell("water table", "dry ground" if water is None else f"{water.table_depth:g} m below the surface")
    if scene.is_undrained:
        tell("drainage", "none: water moves with the grains")
    if water is not None:
        tell("bulk modulus of the water", f"{water.bulk_modulus / 1e6:g} MPa")
    for soil in scene.soils:
        flow = ""
        if scene.is_two_phase and soil.hydraulic_conductivity is not None:
            flow = f", k {soil.hydraulic_conductivity:.3g} m/s"
        room = f"porosity {soil.porosity:g} (loose {soil.loose_porosity:g})"
        k0 = initial_k0_text(scene, soil)
        tell(f"soil '{soil.name}' from {soil.top_depth:g} m", f"{soil.model}, {soil.in_words}, {room}, {k0}{flow}")
    for k, tunnel in enumerate(scene.tunnels):
        across = f"outer diameter {tunnel.outer_diameter:g} m, inner {tunnel.inner_diameter:g} m"
        name = "tunnel" if len(scene.tunnels) == 1 else f"tunnel {k}"
        tell(name, f"cover {tunnel.cover:g} m, {across}, friction {tunnel.friction_coefficient:g}")
    if scene.gate is not None:
        tell("gate in the lining", f"{1e3 * scene.gate.width:g} mm wide, {scene.gate.angle:g}° from the crown")
    stops = [f"{stop.inflow_mass:g} kg/m of inflow"] if stop.inflow_mass is not None else []
    stops += [f"{stop.time:g} s"] if stop.time is not None else []
    tell("until", " or ".join(stops))
    tell("elements", f"{mesh.element_size:g} m, at the lining {mesh.element_size_lining:g} m")
    if ring is not None:
        thick = f"thickness {1e3 * ring.thickness:g} mm"
        tell("ring", f"{len(ring.joint_angles)} joints, {thick}, concrete E {ring.concrete_modulus / 1e9:g} GPa")
        if ring.joint_angles:
            normal, shear, turn = map(_from_to, ring.joint_springs.T / 1e6)
            tell("joints", f"rotation {turn} MN m/rad, normal {normal} MN/m, shear {shear} MN/m, a metre")
        if ring.bolts:
            stiffness = _from_to([bolts.stiffness / 1e6 for bolts in ring.bolts])
            tell("bolts", f"{stiffness} MN/m, a metre")
    if scene.limits is not None:
        tell("limits", scene.limits.in_words)
    return rows


def _from_to(values):
    low, high = min(values), max(values)
    return f"{low:g}" if low == high else f"{low:g} to {high:g}"


def initial_k0(scene: MpmScene) -> list[dict[str, Any]]:
    """The K0 that each soil begins with.

    Returns: soil: its name; lowest, highest: K0 within the layer [-]; source: "given", "gravity loading" or "yield
    surface", where gravity loading is brought to the strength of the soil; yield_depth: from where on [m], else None.
    """
    rows = []
    for soil in scene.soils:
        lowest, highest = lateral_pressure_range(scene, soil)
        depth = None if soil.k0 is not None else yield_depth(scene, soil, soil.elastic_k0)
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


def _initial_slip(s):
    """Whether the lining's friction does not bear the K0 stress of bonded ground, and why."""
    short = [(bond_friction(s, t), t.friction_coefficient) for t in s.tunnels]
    if not short:
        return False, "no tunnel"
    asked, given = max(short, key=lambda pair: pair[0] - pair[1])
    return asked > given, f"K0 asks for a coefficient of {asked:.2g}, the lining has {given:g}"


def _why_half(s):
    if s.is_half:
        return "the scene is its own mirror image: x >= 0 is computed, results are of the whole"
    return s.asymmetry or "symmetry = 'whole'; 'auto' would compute x >= 0 only"


def _springs(s):
    """What stands for the ground under a ring that answers pressures, where the lining has given way already."""
    kinds = {s.lining_of(tunnel) for tunnel in s.tunnels}
    if "jointed" in kinds:
        return "; a jointed lining moves in the ground: its forces are those that it has there"
    twice = "; soil springs count twice what an elastic lining gave way: see its own forces in /lining"
    return twice if "elastic" in kinds else ""


def _linings(s):
    """How the linings stand in the ground, in words."""
    kinds = [
        f"'elastic', {t.lining_modulus / 1e9:g} GPa, {t.lining_harmonics} harmonics"
        if s.lining_of(t) == "elastic"
        else f"'{s.lining_of(t)}'" + (f", {t.lining_model}" if s.lining_of(t) == "jointed" else "")
        for t in s.tunnels
    ] or [f"'{s.lining}'"]
    if len(set(kinds)) == 1:
        return f"lining = {kinds[0]}"
    return "; ".join(f"tunnel {k}: lining = {kind}" for k, kind in enumerate(kinds))
