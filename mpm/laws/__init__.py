"""Constitutive laws of soils: one file each, with parameters, history, stress update and stiffness."""
