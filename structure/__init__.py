"""Rings of segments in the ground: from lining pressures to internal forces and joint deformations.

Names load on first use, so that ``import structure`` itself costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from structure.beams.lining import BeamSpringLining
    from structure.checks import check
    from structure.continuum.lining import ContinuumLining
    from structure.continuum.mesh import GasketGroove, Gate
    from structure.inputs import GushingWarning, InputError
    from structure.limits import CapacityRule, Limits
    from structure.lining import LiningFailure, LiningModel, additional
    from structure.models import lining_model, lining_model_names, register_lining_model
    from structure.passing import utilisations
    from structure.ring import Bolts, Ground, Neighbour, Ring
    from structure.segment import SegmentSection
    from structure.theory import theoretical_pressures

    __version__: str

_HOMES = {
    "Ring": "structure.ring",
    "Ground": "structure.ring",
    "Neighbour": "structure.ring",
    "GushingWarning": "structure.inputs",
    "InputError": "structure.inputs",
    "LiningModel": "structure.lining",
    "LiningFailure": "structure.lining",
    "additional": "structure.lining",
    "check": "structure.checks",
    "Limits": "structure.limits",
    "CapacityRule": "structure.limits",
    "utilisations": "structure.passing",
    "SegmentSection": "structure.segment",
    "BeamSpringLining": "structure.beams.lining",
    "ContinuumLining": "structure.continuum.lining",
    "Gate": "structure.continuum.mesh",
    "GasketGroove": "structure.continuum.mesh",
    "Bolts": "structure.ring",
    "lining_model": "structure.models",
    "lining_model_names": "structure.models",
    "register_lining_model": "structure.models",
    "theoretical_pressures": "structure.theory",
}

__all__ = [
    "BeamSpringLining",
    "Bolts",
    "CapacityRule",
    "ContinuumLining",
    "GasketGroove",
    "Ground",
    "GushingWarning",
    "InputError",
    "Limits",
    "LiningFailure",
    "LiningModel",
    "Gate",
    "Neighbour",
    "Ring",
    "SegmentSection",
    "additional",
    "check",
    "lining_model",
    "lining_model_names",
    "register_lining_model",
    "theoretical_pressures",
    "utilisations",
]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("gushing")
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'structure' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES, "__version__"})
