"""Rings of segments in the ground: from lining pressures to internal forces and joint deformations.

Names load on first use, so that ``import structure`` itself costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from structure.beams.lining import BeamSpringLining
    from structure.bolts import Bolts
    from structure.checks import check
    from structure.continuum.lining import ContinuumLining
    from structure.continuum.mesh import GasketGroove, Gate
    from structure.inputs import GushingWarning, InputError
    from structure.limits import CapacityRule, Limits
    from structure.lining import LiningFailure, LiningModel, additional
    from structure.models import lining_model, lining_model_names, register_lining_model
    from structure.passing import utilisations
    from structure.ring import Neighbour, Ring
    from structure.segment import SegmentSection
    from structure.springs import Ground
    from structure.theory import theoretical_pressures

    __version__: str

_MODULES = {
    "beams.lining": ["BeamSpringLining"],
    "bolts": ["Bolts"],
    "checks": ["check"],
    "continuum.lining": ["ContinuumLining"],
    "continuum.mesh": ["GasketGroove", "Gate"],
    "inputs": ["GushingWarning", "InputError"],
    "limits": ["CapacityRule", "Limits"],
    "lining": ["LiningFailure", "LiningModel", "additional"],
    "models": ["lining_model", "lining_model_names", "register_lining_model"],
    "passing": ["utilisations"],
    "ring": ["Neighbour", "Ring"],
    "segment": ["SegmentSection"],
    "springs": ["Ground"],
    "theory": ["theoretical_pressures"],
}
_HOMES = {name: f"structure.{module}" for module, names in _MODULES.items() for name in names}

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
