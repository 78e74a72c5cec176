"""The variants of `quick` and `case-3` whose inflow is compared: numerical choices, and properties of the ground."""

from verification.sensitivity.variants import meshes

AS_IT_IS = "as the scene has it"
#: Coarser than the scene: in the tables, and in no error bar.
COARSER = ("half the elements across the gate", "3 points an element everywhere")
ACROSS = {"half the elements across the gate": 0.5, "twice the elements across the gate": 2.0}
POINTS = {
    "12 points an element everywhere": {"discretisation.points_per_element": 12},
    "3 points an element everywhere": {"discretisation.points_per_element_gate": 3},
}
FREE = {
    "pressure_filter 0 (off)": {"numerics.pressure_filter": 0.0},
    "pressure_filter 0.8": {"numerics.pressure_filter": 0.8},
    "stress_damping 0 (off)": {"numerics.stress_damping": 0.0},
    "stress_damping 1": {"numerics.stress_damping": 1.0},
    "pic_rate 0 (pure FLIP)": {"numerics.pic_rate": 0.0},
    "pic_rate 10 /s": {"numerics.pic_rate": 10.0},
    "courant 0.4": {"numerics.courant": 0.4},
    "slipping corners of the gate": {"gate.corners": "slipping"},
    "sink instead of the interior": {"interior": "sink"},
}


def sizes(scene, *factors):
    """Meshes of which all lengths change."""
    return {f"all elements {factor:g} times as large": meshes(scene, factor) for factor in factors}


def numerics(scene, factors):
    """What must not move the answers, from the scene as it is."""
    across = {what: meshes(scene, 1.0, factor) for what, factor in ACROSS.items()}
    return {AS_IT_IS: {}} | sizes(scene, *factors) | across | POINTS | FREE


def of_quick(scene):
    """Numerical choices of the coarse scene, its meshes among them."""
    k0 = scene.soils[0].elastic_k0
    return numerics(scene, (2.0, 1.4, 0.7)) | {
        "elements half as large but across the gate": meshes(scene, 0.5, 1.0),
        "pressure_filter 0.1": {"numerics.pressure_filter": 0.1},
        "stress_damping 0.5": {"numerics.stress_damping": 0.5},
        "pic_rate 100 /s": {"numerics.pic_rate": 100.0},
        "one time step for all elements": {"numerics.local_time_stepping": False},
        "K0 changed by a thousandth": {"soils.0.k0": k0 * 1.001},
        "conductivity changed by a thousandth": {"soils.0.hydraulic_conductivity": 1.001e-4},
    }


def of_case_3(scene):
    """Numerical choices of case 3; the stiffness of the water is no choice of ours, the source states it."""
    return numerics(scene, (2.0, 1.4, 0.7, 0.5)) | {
        "25 points an element before the gate": {"discretisation.points_per_element_gate": 25},
        "water four times as stiff": {"water.bulk_modulus": 3.2e8},
    }


#: What must move the answers.
PHYSICS = {
    **{f"conductivity {k:g} m/s": {"soils.0.hydraulic_conductivity": k} for k in (1e-6, 1e-5, 1e-3, 1e-2, 1e-1)},
    "water as stiff as it is, 2.2 GPa": {"water.bulk_modulus": 2.2e9},
    **{f"dilatancy {psi:g} degrees": {"soils.0.dilatancy_angle": psi} for psi in (2.0, 5.0)},
    **{f"friction {phi:g} degrees": {"soils.0.friction_angle": phi} for phi in (23.0, 30.0)},
    **{f"K0 {k0:g}": {"soils.0.k0": k0} for k0 in (0.577, 0.8)},
    **{f"loose porosity {n:.2f}": {"soils.0.loose_porosity": n} for n in (0.50, 0.60)},
}
