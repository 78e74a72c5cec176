"""Constitutive laws: pure functions of a stress and a strain increment."""
