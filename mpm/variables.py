"""The one table of what a material point carries, with its unit and sign, and of what a node carries.

A point is one row of 16 float64 (two cache lines), so that a point reached through an index
costs two memory accesses whatever is read of it; what `advance_points` writes is in the first.
Effective stress is tension positive, pore pressure compression positive; total stress =
effective stress - pore pressure * identity.
"""

POINT_VARIABLES = (
    # name, unit, meaning
    ("x", "m", "horizontal position"),
    ("y", "m", "vertical position, upward, ground surface at 0"),
    ("velocity_solid_x", "m/s", "velocity of the grains"),
    ("velocity_solid_y", "m/s", "velocity of the grains"),
    ("velocity_liquid_x", "m/s", "velocity of the pore water"),
    ("velocity_liquid_y", "m/s", "velocity of the pore water"),
    ("pore_pressure", "Pa", "compression positive; negative: missing volume of water, carries nothing"),
    ("porosity", "1", "volume of voids over total volume"),
    ("stress_xx", "Pa", "effective stress, tension positive"),
    ("stress_yy", "Pa", "effective stress, tension positive"),
    ("stress_zz", "Pa", "effective stress out of plane, tension positive"),
    ("stress_xy", "Pa", "effective shear stress"),
    ("grain_mass", "kg/m", "mass of grains per metre of tunnel, constant"),
    ("deviatoric_strain", "1", "accumulated equivalent deviatoric strain, sqrt(2/3 e:e)"),
    ("x_initial", "m", "horizontal position at the start"),
    ("y_initial", "m", "vertical position at the start"),
)
(X, Y, VSX, VSY, VLX, VLY, P, N, SXX, SYY, SZZ, SXY, MASS, EQ, X0, Y0) = range(len(POINT_VARIABLES))
POINT_WIDTH = len(POINT_VARIABLES)

# Element-to-node buffer: what an element adds to one of its nodes.
(B_MS, B_ML, B_MN, B_D, B_PSX, B_PSY, B_PLX, B_PLY, B_FX, B_FY, B_FLX, B_FLY) = range(12)
BUFFER_WIDTH = 12

# Node row: end-of-step velocities, their increments, masses.
(V_SX, V_SY, V_LX, V_LY, V_DSX, V_DSY, V_DLX, V_DLY, V_MS, V_ML) = range(10)
NODE_WIDTH = 10
NODAL_MOMENTA = 4  # what `advance_points` sums at a node

# Element row: volume of its points, and times it their pore pressure and position; the share of its area that its
# stress counts with (`mpm.transfer.fill_of_cell`), as of the end of the last step.
(E_VOLUME, E_PRESSURE, E_X, E_Y, E_FILL) = range(5)
ELEMENT_CONTENTS = 5

# Soil parameters, one row a soil.
(
    S_MODEL, S_LAMBDA, S_G, S_K, S_C_COS, S_SIN, S_SIN_DIL, S_APEX, S_TENSION, S_LOOSE, S_DRAG, S_RHO_S,
    S_RELAX,
) = range(13)  # fmt: skip
SOIL_WIDTH = 13
MODEL_ELASTIC, MODEL_MOHR_COULOMB = 0, 1

#: What stress, pressure, porosity and place of a point may be held at; each is counted and reported with the run.
CLAMPS = {
    "tension": "tip of the Mohr-Coulomb cone",
    "suspended": "grains apart",
    "cavitated": "pores not full",
    "porosity_floor": "densest porosity",
    "porosity_ceiling": "loosest porosity",
    "returned_to_mesh": "put back onto a wall",
}
(C_TENSION, C_SUSPENDED, C_CAVITATED, C_FLOOR, C_CEILING, C_RETURNED) = range(len(CLAMPS))
POROSITY_FLOOR = 0.05
POROSITY_CEILING = 0.90

# What the nodes add up over all steps, per metre of tunnel: change of the momentum (x, y) [N s], change of the kinetic
# energy of grains and water [J], work of gravity, drag and stresses on them [J], part of the momentum's change at the
# lining that no recorded reaction explains, and the reactions it is compared with [N s].
LEDGER = ("momentum_x", "momentum_y", "kinetic", "gravity", "drag", "stress", "unexplained", "reactions")
