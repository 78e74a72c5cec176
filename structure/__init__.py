"""Rings of segments in the ground: from lining pressures to internal forces and joint deformations.

Names load on first use, so that ``import structure`` itself costs nothing.
"""

from importlib import import_module

_HOMES = {
    "Ring": "structure.ring",
    "Ground": "structure.ring",
    "GushingWarning": "structure.inputs",
    "InputError": "structure.inputs",
    "LiningModel": "structure.lining",
    "LiningFailure": "structure.lining",
    "additional": "structure.lining",
    "check": "structure.checks",
    "Limits": "structure.checks",
    "CapacityRule": "structure.checks",
    "SegmentSection": "structure.sections",
    "BeamSpringLining": "structure.beam_spring",
    "ContinuumLining": "structure.continuum",
    "Opening": "structure.continuum_mesh",
    "GasketGroove": "structure.continuum_mesh",
    "Bolts": "structure.continuum_bolts",
    "lining_model": "structure.models",
    "lining_model_names": "structure.models",
    "register_lining_model": "structure.models",
    "theoretical_pressures": "structure.theory",
}

__all__ = sorted(_HOMES)


def __getattr__(name):
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'structure' has no attribute {name!r}")


def __dir__():
    return sorted({*globals(), *_HOMES})
