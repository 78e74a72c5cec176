"""Ground and lining together: scenes, runs, datasets, figures and the command line.

Names load on first use, so that ``import coupling`` and ``gush --help`` stay fast.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from coupling.datasets import read_run
    from coupling.refused import SceneError
    from coupling.runs.run import run
    from coupling.scenes.layers import scene_names
    from coupling.scenes.scene import Scene, load_scene, make_scene
    from coupling.studies.collect import read_study
    from coupling.studies.execute import study
    from structure.inputs import GushingWarning

    __version__: str

_HOMES = {
    "GushingWarning": "structure.inputs",
    "Scene": "coupling.scenes.scene",
    "SceneError": "coupling.refused",
    "load_scene": "coupling.scenes.scene",
    "make_scene": "coupling.scenes.scene",
    "scene_names": "coupling.scenes.layers",
    "run": "coupling.runs.run",
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
