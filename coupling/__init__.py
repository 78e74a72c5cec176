"""Ground and lining together: scenes, runs, datasets, figures and the command line.

Names load on first use, so that ``import coupling`` and ``gush --help`` stay fast.
"""

import sys
from importlib import import_module
from types import ModuleType

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

__all__ = sorted(_HOMES)


def __getattr__(name):
    if name not in _HOMES:
        raise AttributeError(f"module 'coupling' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__():
    return sorted({*globals(), *_HOMES})


class _Package(ModuleType):
    """Keeps ``coupling.run`` the function: importing the module of that name would put the module in its place."""

    def __setattr__(self, name, value):
        if not (name in _HOMES and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package
