"""Two-phase material point method: soil and water around a shield tunnel, and their pressure on its lining.

Names load on first use: importing the package alone stays fast.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mpm.mesh import Mesh
    from mpm.meshing import build_mesh
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
    "Solver": "mpm.solver",
    "build_mesh": "mpm.meshing",
    "simulate": "mpm.simulation",
}

__all__ = [
    "Mesh", "Record", "RunFailed", "Scene", "Simulation", "Solver", "build_mesh", "simulate",
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
