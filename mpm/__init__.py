"""Two-phase material point method: soil and water around a shield tunnel, and their pressure on its lining.

Names load on first use: importing the package alone stays fast.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mpm.laws.law import register_soil_law, soil_law_names
    from mpm.laws.soil import Soil
    from mpm.mesh import Mesh
    from mpm.mesh.build import build_mesh
    from mpm.scene import Scene
    from mpm.simulation import Record, Simulation, simulate
    from mpm.solver import RunFailed, Solver

    __version__: str

_HOMES = {
    "Mesh": "mpm.mesh",
    "Record": "mpm.simulation",
    "RunFailed": "mpm.solver",
    "Scene": "mpm.scene",
    "Simulation": "mpm.simulation",
    "Soil": "mpm.laws.soil",
    "Solver": "mpm.solver",
    "build_mesh": "mpm.mesh.build",
    "register_soil_law": "mpm.laws.law",
    "simulate": "mpm.simulation",
    "soil_law_names": "mpm.laws.law",
}

__all__ = [
    "Mesh", "Record", "RunFailed", "Scene", "Simulation", "Soil", "Solver", "build_mesh", "register_soil_law",
    "simulate", "soil_law_names",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("gushing")
    if name not in _HOMES:
        raise AttributeError(f"module 'mpm' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES, "__version__"})
