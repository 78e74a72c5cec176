"""The numbers of a scene that an engineer asks for first."""


def facts(s):
    """Numbers of a scene that an engineer asks for first: list of (what, value as text)."""
    from coupling.scenes.features import initial_k0_text

    rows = [("box", f"{s.box.width:g} m wide, {s.box.depth:g} m deep")]
    rows.append(("water table", "dry ground" if s.water is None else f"{s.water.table_depth:g} m below the surface"))
    if s.is_undrained:
        rows.append(("drainage", "none: water moves with the grains"))
    if s.water is not None:
        rows.append(("bulk modulus of the water", f"{s.water.bulk_modulus / 1e6:g} MPa"))
    for soil in s.soils:
        strength = ""
        if soil.model == "mohr-coulomb":
            strength = f", c' {soil.cohesion / 1e3:g} kPa, φ' {soil.friction_angle:g}°, ψ {soil.dilatancy_angle:g}°"
        known = s.is_two_phase and soil.hydraulic_conductivity is not None
        flow = "" if not known else f", k {soil.hydraulic_conductivity:.3g} m/s"
        rows.append((
            f"soil '{soil.name}' from {soil.top_depth:g} m",
            f"{soil.model}, E {soil.youngs_modulus / 1e6:g} MPa, ν {soil.poissons_ratio:g}{strength}, "
            f"porosity {soil.porosity:g} (loose {soil.loose_porosity:g}), {initial_k0_text(s, soil)}{flow}",
        ))  # fmt: skip
    for k, tunnel in enumerate(s.tunnels):
        name = "tunnel" if len(s.tunnels) == 1 else f"tunnel {k}"
        rows.append((
            name,
            f"cover {tunnel.cover:g} m, outer diameter {tunnel.outer_diameter:g} m, inner {tunnel.inner_diameter:g} m, "
            f"friction {tunnel.friction_coefficient:g}",
        ))  # fmt: skip
    if s.gate is not None:
        rows.append(("gate in the lining", f"{1e3 * s.gate.width:g} mm wide, {s.gate.angle:g}° from the crown"))
    stops = [f"{s.stop.inflow_mass:g} kg/m of inflow"] if s.stop.inflow_mass is not None else []
    stops += [f"{s.stop.time:g} s"] if s.stop.time is not None else []
    rows.append(("until", " or ".join(stops)))
    d = s.discretisation
    rows.append(("elements", f"{d.element_size:g} m, at the lining {d.element_size_lining:g} m"))
    if s.ring is not None:
        ring = s.ring
        rows.append((
            "ring",
            f"{len(ring.joint_angles)} joints, thickness {1e3 * ring.thickness:g} mm, concrete E "
            f"{ring.concrete_modulus / 1e9:g} GPa",
        ))  # fmt: skip
        if ring.joint_angles:
            rows.append((
                "joints",
                f"rotation {ring.joint_rotational_stiffness / 1e6:g} MN m/rad, normal "
                f"{ring.joint_normal_stiffness / 1e6:g} MN/m, shear {ring.joint_shear_stiffness / 1e6:g} MN/m, a metre",
            ))  # fmt: skip
    return rows
