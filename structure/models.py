"""Lining models by name, so that a script or the command line swaps one for the other; open to a third party's own."""

from __future__ import annotations

import difflib
import runpy
from collections.abc import Iterable
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from structure.lining import LiningModel

#: Group of entry points under which an installed package announces its models: name = "module:Class".
ENTRY_POINTS = "gush.lining_models"

_BUILT_IN = {
    "beam-spring": "structure.beams.lining:BeamSpringLining",
    "continuum": "structure.continuum.lining:ContinuumLining",
}
_REGISTERED: dict[str, type[LiningModel]] = {}


def register_lining_model(name: str, model: type[LiningModel]) -> None:
    """Make a model known by name in this process; its constructor takes a :class:`structure.ring.Ring`.

    Raises
    ------
    ValueError
        The name is taken.
    """
    if name in lining_model_names() and _REGISTERED.get(name) is not model:
        raise ValueError(f"lining model {name!r}: the name is taken, choose another one")
    _REGISTERED[name] = model


def lining_model_names() -> list[str]:
    """Names of the built-in, installed and registered models."""
    return sorted({*_BUILT_IN, *_REGISTERED, *(entry.name for entry in _installed())})


def lining_model(name: str) -> type[LiningModel]:
    """The class of a lining model.

    Parameters
    ----------
    name : str
        One of :func:`lining_model_names`, or "FILE.py:CLASS", a class in a file of your own, which is run.

    Raises
    ------
    ValueError
        No such model, file or class.
    """
    if ".py:" in name:
        return _from_file(*name.rsplit(":", 1))
    if name in _REGISTERED:
        return _REGISTERED[name]
    if name in _BUILT_IN:
        return resolve_name(_BUILT_IN[name])
    for entry in _installed():
        if entry.name == name:
            return entry.load()
    near = difflib.get_close_matches(name, lining_model_names(), 1)
    hint = f"did you mean {near[0]!r}? " if near else ""
    raise ValueError(f"lining model {name!r}: unknown; {hint}known: {', '.join(lining_model_names())}")


def model_name(name: str) -> str:
    """Name under which a model's responses are kept: of "FILE.py:CLASS" the class."""
    return name.rpartition(":")[2]


def in_order(names: Iterable[str]) -> list[str]:
    """Names of models as they are shown: the built-in ones first, the one of a run leading, then by the alphabet."""
    return sorted(names, key=lambda name: (list(_BUILT_IN).index(name) if name in _BUILT_IN else len(_BUILT_IN), name))


def _installed():
    from importlib.metadata import entry_points

    return entry_points(group=ENTRY_POINTS)


def _from_file(file: str, class_name: str) -> type[LiningModel]:
    from structure.lining import LiningModel

    path = Path(file)
    if not path.is_file():
        raise ValueError(f"lining model '{file}:{class_name}': there is no file '{file}'; check the path")
    try:
        model = runpy.run_path(str(path)).get(class_name)
    except Exception as problem:
        raise ValueError(
            f"lining model '{file}:{class_name}': the file fails with {type(problem).__name__}: {problem}; correct it"
        ) from problem
    if not (isinstance(model, type) and issubclass(model, LiningModel)):
        raise ValueError(
            f"lining model '{file}:{class_name}': must be a class derived from structure.LiningModel, got {model!r}"
        )
    return model
