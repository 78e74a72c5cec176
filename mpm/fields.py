"""The one table of what points, nodes, elements and contacts carry, with unit and sign.

It makes the arrays (one record of named float64 an entry), the names that kernels read (``point.pore_pressure``) and
the variables of the output. Effective stress is tension positive, pore pressure compression positive; total stress =
effective stress - pore pressure * identity. All masses and forces are per metre of tunnel.
"""

from typing import NamedTuple

import numpy as np

#: Angles around a lining at which its motion and its forces are given [degree].
WHOLE_DEGREES = np.arange(360.0)


class Field(NamedTuple):
    """One number that is carried."""

    name: str
    unit: str
    meaning: str


#: A material point: two cache lines, so that a point costs two memory accesses whatever is read of it. The history of
#: a scene's soil laws (`mpm.laws`) comes before it: numba takes a record that another one begins with for the same.
POINT = (
    Field("x", "m", "horizontal position"),
    Field("y", "m", "vertical position, upward, ground surface at 0"),
    Field("velocity_solid_x", "m/s", "velocity of the grains"),
    Field("velocity_solid_y", "m/s", "velocity of the grains"),
    Field("velocity_liquid_x", "m/s", "velocity of the pore water"),
    Field("velocity_liquid_y", "m/s", "velocity of the pore water"),
    Field("pore_pressure", "Pa", "compression positive; negative: missing volume of water, carries nothing"),
    Field("porosity", "1", "volume of voids over total volume"),
    Field("stress_xx", "Pa", "effective stress, tension positive"),
    Field("stress_yy", "Pa", "effective stress, tension positive"),
    Field("stress_zz", "Pa", "effective stress out of plane, tension positive"),
    Field("stress_xy", "Pa", "effective shear stress"),
    Field("grain_mass", "kg/m", "mass of grains per metre of tunnel, constant"),
    Field("deviatoric_strain", "1", "accumulated equivalent deviatoric strain, sqrt(2/3 e:e)"),
    Field("x_initial", "m", "horizontal position at the start"),
    Field("y_initial", "m", "vertical position at the start"),
)

#: What elements add to one of their nodes, and the mass that a node's row holds.
NODAL_SUM = (
    Field("mass_solid", "kg/m", "grains"),
    Field("mass_liquid", "kg/m", "water as if it filled the whole volume"),
    Field("mass_pore_liquid", "kg/m", "water in the pores"),
    Field("drag", "kg/m/s", "force between the phases over their relative velocity"),
    Field("momentum_solid_x", "kg/s", "of the grains; of grains and water where they move together"),
    Field("momentum_solid_y", "kg/s", ""),
    Field("momentum_liquid_x", "kg/s", "of the water as if it filled the whole volume"),
    Field("momentum_liquid_y", "kg/s", ""),
    Field("force_x", "N/m", "of total stress, on the mixture"),
    Field("force_y", "N/m", ""),
    Field("force_liquid_x", "N/m", "of pore pressure, on the water as if it filled the whole volume"),
    Field("force_liquid_y", "N/m", ""),
)

#: Momenta that points bring to a node after they have moved (MUSL).
NODAL_MOMENTUM = (
    Field("solid_x", "kg/s", "of the grains; of grains and water where they move together"),
    Field("solid_y", "kg/s", ""),
    Field("liquid_x", "kg/s", "of the water as if it filled the whole volume"),
    Field("liquid_y", "kg/s", ""),
)

#: A row of a node: velocities at the end of its step, what they changed by in it, masses.
NODE = (
    Field("velocity_solid_x", "m/s", "of the grains; of grains and water where they move together"),
    Field("velocity_solid_y", "m/s", ""),
    Field("velocity_liquid_x", "m/s", "of the water"),
    Field("velocity_liquid_y", "m/s", ""),
    Field("change_solid_x", "m/s", "increment over the step; of a tied row over its whole step"),
    Field("change_solid_y", "m/s", ""),
    Field("change_liquid_x", "m/s", ""),
    Field("change_liquid_y", "m/s", ""),
    Field("mass_solid", "kg/m", "that moves with the first velocity"),
    Field("mass_liquid", "kg/m", "that moves with the second"),
)

#: Means over the step of a row that is tied to a finer one: of the grains' velocity, and of the remapped velocities.
TIED_MEAN = (
    Field("solid_x", "m/s", "with which points move"),
    Field("solid_y", "m/s", ""),
    Field("remapped_solid_x", "m/s", "that strain the grains"),
    Field("remapped_solid_y", "m/s", ""),
    Field("remapped_liquid_x", "m/s", "that strain the water"),
    Field("remapped_liquid_y", "m/s", ""),
)

#: A triangle: gradients of the shape functions of corners 1 and 2, its corner 0, area and smallest altitude.
GEOMETRY = (
    Field("dn1_dx", "1/m", ""),
    Field("dn1_dy", "1/m", ""),
    Field("dn2_dx", "1/m", ""),
    Field("dn2_dy", "1/m", ""),
    Field("x", "m", "of corner 0"),
    Field("y", "m", "of corner 0"),
    Field("area", "m2", ""),
    Field("altitude", "m", "the smallest"),
)

#: What an element holds, as of the end of the last step.
CONTENT = (
    Field("volume", "m2", "of its points"),
    Field("pressure", "N", "pore pressure of its points times their volume"),
    Field("x", "m3", "position of its points times their volume"),
    Field("y", "m3", ""),
    Field("fill", "1", "share of its area that its stress counts with (`mpm.step.cells`)"),
)

#: A node of a lining: the wall's normal, into the material, friction, whether the wall is there.
CONTACT = (
    Field("normal_x", "1", "into the material"),
    Field("normal_y", "1", ""),
    Field("friction", "1", "Coulomb coefficient"),
    Field("active", "1", "1 where the wall is there, 0 in an opening"),
)

#: A node on a side of the box that water passes; zeros elsewhere.
SIDE = (
    Field("area_x", "m2", "of the side, positive where x leads into the ground"),
    Field("area_y", "m2", ""),
    Field("push_x", "N/m", "of the pressure beyond on water as if it filled the whole volume"),
    Field("push_y", "N/m", ""),
)

#: Bits of what holds a node: grains and water, but water where the side is open.
FIXED_X, FIXED_Y, MIRROR_X, OPEN_X, OPEN_Y = 1, 2, 4, 8, 16

#: Reactions on the material at a node of a lining, times the time step, added up; and dt times their squares.
REACTION = (
    Field("soil", "N s/m", "normal, of the grains"),
    Field("water", "N s/m", "normal, of the water"),
    Field("shear", "N s/m", "tangential, along (normal_y, -normal_x)"),
    Field("soil_squared", "N2 s/m2", ""),
    Field("water_squared", "N2 s/m2", ""),
)

#: What stress, pressure, porosity and place of a point may be held at; each is counted and reported with the run.
CLAMPS = {
    "tension": "tip of the Mohr-Coulomb cone",
    "suspended": "grains apart",
    "cavitated": "pores not full",
    "porosity_floor": "densest porosity",
    "porosity_ceiling": "loosest porosity",
    "returned_to_mesh": "put back onto a wall",
}

#: Least and largest porosity that a point may have.
POROSITY_FLOOR, POROSITY_CEILING = 0.05, 0.90

#: What the nodes add up over all steps, to compare with the state of the points.
LEDGER = (
    Field("momentum_x", "N s/m", "change of the momentum"),
    Field("momentum_y", "N s/m", ""),
    Field("kinetic", "J/m", "change of the kinetic energy of grains and water"),
    Field("gravity", "J/m", "work of gravity"),
    Field("drag", "J/m", "work of the drag between grains and water"),
    Field("stress", "J/m", "work of the stresses"),
    Field("recharge", "kg/m", "water that came in through the sides of the box"),
    Field("unexplained", "N s/m", "change of momentum at the lining that no recorded reaction explains"),
    Field("reactions", "N s/m", "the reactions that it is compared with"),
)


def record(fields, kind=np.float64):
    """Record type of fields, or of names: one number of a kind each."""
    return np.dtype([(getattr(field, "name", field), kind) for field in fields])


def numbers(records):
    """The numbers of an array of records as a view with one more axis: (.., n_fields) float64."""
    return records.view(np.float64).reshape(*records.shape, -1)


def block(records, first, last):
    """View of the fields of an array of records from one to another: (.., n_names) float64, to read and to write."""
    names = records.dtype.names
    return numbers(records)[..., names.index(first) : names.index(last) + 1]


def values(records, names):
    """Copy of some fields of an array of records, one after the other: (.., n_names) float64.

    names : iterable of str
    """
    return np.stack([records[name] for name in names], axis=-1)


POINT_RECORD, NODE_RECORD, SUM_RECORD = record(POINT), record(NODE), record(NODAL_SUM)
MOMENTUM_RECORD, TIED_RECORD, GEOMETRY_RECORD = record(NODAL_MOMENTUM), record(TIED_MEAN), record(GEOMETRY)
CONTENT_RECORD, CONTACT_RECORD, REACTION_RECORD = record(CONTENT), record(CONTACT), record(REACTION)
SIDE_RECORD, CLAMP_RECORD, LEDGER_RECORD = record(SIDE), record(CLAMPS, np.int64), record(LEDGER)
