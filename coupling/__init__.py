"""Ground and lining together: scenes, runs, datasets, figures and the command line.

Names load on first use, so that ``import coupling`` and ``gush --help`` stay fast.
"""

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from coupling.datasets import read_run
    from coupling.run import run
    from coupling.scene import Scene, SceneError, load_scene, make_scene, scene_names
    from coupling.studies.collect import read_study
    from coupling.studies.execute import study
    from structure.inputs import GushingWarning

    __version__: str

_HOMES = {
    "GushingWarning": "structure.inputs",
    "Scene": "coupling.scene",
    "SceneError": "coupling.scene",
    "load_scene": "coupling.scene",
    "make_scene": "coupling.scene",
    "scene_names": "coupling.scene",
    "run": "coupling.run",
    "read_run": "coupling.datasets",
    "study": "coupling.studies.execute",
    "read_study": "coupling.studies.collect",
}

__all__ = [
    "GushingWarning",
    "Scene",
    "SceneError",
    "load_scene",
    "make_scene",
    "read_run",
    "read_study",
    "run",
    "scene_names",
    "study",
]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("gushing")
    if name not in _HOMES:
        raise AttributeError(f"module 'coupling' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES, "__version__"})


class _Package(ModuleType):
    """Keeps ``coupling.run`` the function: importing the module of that name would put the module in its place."""

    def __setattr__(self, name: str, value: Any) -> None:
        if not (name in _HOMES and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package
