"""Laws of soils by name, open to a third party's own, and their functions compiled for a scene."""

import difflib
import hashlib
import runpy
from collections.abc import Iterable
from functools import cache
from importlib import import_module
from pathlib import Path
from types import FunctionType
from typing import Any

from pydantic_core import PydanticCustomError, ValidationError

from mpm.laws.soil import Soil


class UnknownLaw(ValueError):
    """A soil law that is not there, or a file that gives none."""


#: Group of entry points under which an installed package announces its laws: name = "module:Class".
ENTRY_POINTS = "gush.soil_laws"
#: Modules beside the laws in this folder.
_NO_LAWS = ("__init__", "law", "soil", "stress")
#: What the kernels read of every soil, beside the constants of its law.
COMMON = ("law", "grain_density", "loose_porosity", "drag", "tension")
_REGISTERED: dict[str, type[Soil]] = {}


def register_soil_law(name: str, law: type[Soil]) -> None:
    """Make a law known by name in this process: ``model = name`` of a soil then asks for its parameters.

    A class that is defined once more, as when a cell of a notebook is run again, takes the place of its former self.

    Raises
    ------
    ValueError
        The name is taken by another class.
    """
    former = _REGISTERED.get(name)
    again = former is not None and (former.__module__, former.__qualname__) == (law.__module__, law.__qualname__)
    if name in soil_law_names() and not again:
        raise ValueError(f"soil law {name!r}: the name is taken, choose another one")
    _REGISTERED[name] = law


def soil_law_names() -> list[str]:
    """Names of the built-in, installed and registered laws."""
    return sorted({*_built_in(), *_REGISTERED, *(entry.name for entry in _installed())})


def soil_law(name: str) -> type[Soil]:
    """The class of a law: one of :func:`soil_law_names`, or "FILE.py:CLASS", a class in a file, which is run.

    Raises
    ------
    UnknownLaw
        No such law, file or class.
    """
    if name in _REGISTERED:
        return _REGISTERED[name]
    if ".py:" in name:
        return _from_file(name)
    if name in _built_in():
        module = import_module(f"mpm.laws.{name.replace('-', '_')}")
        return next(law for law in vars(module).values() if _is_law(law) and law.__module__ == module.__name__)
    for entry in _installed():
        if entry.name == name:
            return entry.load()
    near = difflib.get_close_matches(name.lower(), soil_law_names(), 1)
    remedy = f"did you mean {near[0]!r}?" if near else "choose one of these, or 'FILE.py:CLASS', your own"
    raise UnknownLaw(f"must be one of {', '.join(map(repr, soil_law_names()))}, got {name!r}; {remedy}")


def built_in_laws() -> tuple[type[Soil], ...]:
    """Classes of the laws of this folder, that of most scenes first."""
    return tuple(soil_law(name) for name in sorted(_built_in(), key=lambda name: (name != "mohr-coulomb", name)))


def soil_of_its_law(given: Any, validate: Any) -> Soil:
    """Validator of an entry of `soils`: by the class of the law that its `model` names.

    Raises
    ------
    ValidationError
        Of that class, or for a law that is not known.
    """
    if isinstance(given, Soil):
        return type(given).model_validate(given)
    model = given.get("model") if isinstance(given, dict) else None
    if not isinstance(model, str):
        return soil_law("mohr-coulomb").model_validate(given)
    try:
        return soil_law(model).model_validate(given)
    except UnknownLaw as unknown:
        wrong = {"type": PydanticCustomError("value_error", str(unknown)), "loc": ("model",), "input": model}
        raise ValidationError.from_exception_data("Soil", [wrong]) from unknown


def soil_table(scene: Any) -> Any:
    """Numbers of the soils that the kernels read: (n_soils,) records of the constants of their laws and `COMMON`."""
    import numpy as np  # reading a scene needs none

    rows = []
    for soil in scene.soils:
        drag = scene.gravity / soil.hydraulic_conductivity if scene.is_two_phase else 0.0
        law = float(laws_of(scene).index(type(soil)))
        common = (law, soil.grain_density, soil.loose_porosity, drag, np.inf)
        rows.append(dict(zip(COMMON, common, strict=True)) | soil.constants)
    # what all have comes last: no table may begin with another one's fields (`mpm.fields.POINT`)
    names = dict.fromkeys([name for soil in scene.soils for name in soil.constants if name not in COMMON] + [*COMMON])
    return np.array([tuple(row.get(name, np.nan) for name in names) for row in rows], [(name, float) for name in names])


def laws_of(scene: Any) -> tuple[type[Soil], ...]:
    """Classes of the laws of a scene's soils."""
    return tuple(dict.fromkeys(type(soil) for soil in scene.soils))


def history_of(scene: Any) -> tuple[tuple[str, str, str], ...]:
    """Name, unit and meaning of the numbers that points carry for the laws of a scene's soils."""
    return tuple(dict.fromkeys(entry for soil in scene.soils for entry in soil.history))


@cache
def stress_kernel(laws: tuple[type[Soil], ...]) -> Any:
    """Kernel `new_stress` of the soils of some laws, which takes and gives what :class:`mpm.laws.soil.Soil` says."""
    return _of_any(laws, "new_stress")


@cache
def moduli_kernel(laws: tuple[type[Soil], ...]) -> Any:
    """Kernel `moduli` of the soils of some laws."""
    return _of_any(laws, "moduli")


def _of_any(laws: tuple[type[Soil], ...], name: str, number: int = 0) -> Any:
    """The function `name` of the first of some laws for soils of that number, of the others for the rest."""
    from mpm.machine.compile import kernel_part

    law = laws[0]
    first = compiled(*law.helpers, getattr(law, name))[-1]
    if len(laws) == 1:
        return first
    others, own = _of_any(laws[1:], name, number + 1), float(number)

    if name == "moduli":

        @kernel_part
        def moduli(point, soil):
            return first(point, soil) if soil.law == own else others(point, soil)

        return moduli

    @kernel_part
    def new_stress(stress, strain, point, soil, dt):
        if soil.law == own:
            return first(stress, strain, point, soil, dt)
        return others(stress, strain, point, soil, dt)

    return new_stress


def compiled(*functions: Any) -> list[Any]:
    """Kernels of plain functions of numbers and records, of which each may call those before it by their names."""
    from mpm.machine.compile import kernel_part

    known: dict[str, Any] = {}
    digest = hashlib.sha256()
    for function in functions:
        code = function.__code__
        own = FunctionType(code, {**function.__globals__, **known}, function.__name__, function.__defaults__)
        # kernels are kept between processes by name: another text, another name (`mpm.machine.kernel_cache`)
        digest.update(repr((code.co_code, code.co_consts, code.co_names)).encode())
        own.__qualname__, own.__module__ = f"{function.__qualname__}_{digest.hexdigest()[:8]}", function.__module__
        known[function.__name__] = kernel_part(own)
    return list(known.values())


@cache
def _built_in() -> tuple[str, ...]:
    names: Iterable[str] = (path.stem for path in sorted(Path(__file__).parent.glob("*.py")))
    return tuple(name.replace("_", "-") for name in names if name not in _NO_LAWS)


@cache
def _installed() -> Any:
    from importlib.metadata import entry_points

    return entry_points(group=ENTRY_POINTS)


def _is_law(value: Any) -> bool:
    return isinstance(value, type) and issubclass(value, Soil)


@cache
def _from_file(name: str) -> type[Soil]:
    file, _, class_name = name.rpartition(":")
    if not Path(file).is_file():
        raise UnknownLaw(f"must be a law, got {name!r}: there is no file '{file}'; check the path")
    try:
        law = runpy.run_path(file).get(class_name)
    except Exception as problem:
        raise UnknownLaw(
            f"must be a law, got {name!r}: the file fails with {type(problem).__name__}: {problem}; correct it"
        ) from problem
    if not _is_law(law):
        raise UnknownLaw(f"must be a class derived from mpm.Soil, got {law!r} of {name!r}; correct the name")
    return law
