"""What a study is: a base scene, parameters by their dotted names, and which combinations of them are run."""

from __future__ import annotations

import difflib
import hashlib
import itertools
import json
import math
import re
from dataclasses import dataclass
from functools import cache
from importlib import resources
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator, model_validator

from coupling.refused import SceneError
from coupling.scenes.layers import changed, nested, parse_toml, read_scene_data, read_toml_file
from coupling.scenes.lines import line_of
from coupling.scenes.scene import Scene, make_scene, number_in_unit
from structure.inputs import mistakes

#: Changes when stored cases can no longer be used.
FORMAT = "2"
STUDY_FILE = "study.json"
#: What stands for a whole table that a case leaves as the scene has it, and for a case that changes nothing.
AS_IT_IS = "as it is"


class StudyError(SceneError):
    """A study that cannot be run: where, rule, value, remedy."""


class Range(BaseModel):
    """Values between `low` and `high`, spaced evenly or by their logarithm."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    low: float
    high: float
    scale: Literal["linear", "log"] = "linear"

    @model_validator(mode="after")
    def _check(self):
        if not self.low < self.high:
            raise ValueError(f"low must be below high, got {self.low:g} and {self.high:g}; swap them")
        if self.scale == "log" and self.low <= 0:
            raise ValueError(f"low must be above 0 on a log scale, got {self.low:g}; use scale = 'linear'")
        return self

    def at(self, share: float) -> float:
        """Value at a share from 0 to 1 of the range."""
        if self.scale == "log":
            return math.exp(math.log(self.low) + share * math.log(self.high / self.low))
        return self.low + share * (self.high - self.low)


class Study(BaseModel):
    """A study.

    Parameters
    ----------
    name : str
    scene : str
        Built-in scene or TOML file that every case starts from; a parameter named "scene" replaces it.
    design : {"factorial", "list", "one-at-a-time", "latin-hypercube", "sobol"}
        "factorial": all combinations of the listed values. "list": the first values of all lists, then the second,
        and so on. "one-at-a-time": the scene as it is, then every listed value alone. The others sample ranges
        (scipy.stats.qmc).
    parameters : dict
        Dotted name of a scene's key, as "gate.angle" or "soils.0.porosity", to a list of values (factorial, list) or to
        a table with low, high and scale (samples). Strings with units are taken as in a scene.
    fixed : dict
        Dotted names to values that all cases take instead of the scene's.
    samples : int, optional
        Number of cases of a sampled design; a power of two for "sobol".
    seed : int
        Of the samples: equal seeds give equal cases.
    backends : tuple of str
        Lining models that answer every case.
    records : int
        Number of inflow masses, from 0 to the stop's, at which cases are compared.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    name: str = Field(min_length=1, max_length=60, pattern=r"^\w[\w.-]*$")
    scene: str = "quick"
    design: Literal["factorial", "list", "one-at-a-time", "latin-hypercube", "sobol"] = "factorial"
    parameters: dict[str, tuple[Any, ...] | Range] = Field(min_length=1)
    fixed: dict[str, Any] = {}
    samples: int | None = Field(default=None, ge=2, le=100_000)
    seed: int = 0
    backends: tuple[str, ...] = ("beam-spring",)
    records: int = Field(default=41, ge=2, le=10_000)

    @field_validator("parameters", mode="before")
    @classmethod
    def _read_parameters(cls, parameters):
        """Arrays as lists, ends of ranges in SI; a single value is refused with its remedy."""
        if not isinstance(parameters, dict):
            return parameters
        read = {}
        for name, values in parameters.items():
            values = values.tolist() if hasattr(values, "tolist") else values
            if isinstance(values, dict):
                values = _range(name, values)
            elif not isinstance(values, list | tuple | Range):
                raise ValueError(f"{name}: must be a list of values or a range, got {values!r}; write [{values!r}], or "
                                 "give it under fixed")  # fmt: skip
            read[name] = values
        return read

    @model_validator(mode="after")
    def _check(self):
        sampled = self.design in ("latin-hypercube", "sobol")
        for name, values in self.parameters.items():
            if sampled != isinstance(values, Range):
                wanted = "a table with low and high" if sampled else "a list of values"
                raise ValueError(f"parameters.{name}: must be {wanted} in a {self.design} design, got {values!r}")
            if not sampled and not values:
                raise ValueError(f"parameters.{name}: must have at least one value, got none; add one or leave it out")
        if sampled and self.samples is None:
            raise ValueError(f"samples: must be given for a {self.design} design, got none; 16 is a start")
        if not sampled and self.samples is not None:
            raise ValueError(f"samples: a {self.design} design has as many cases as its lists say; leave samples out")
        if self.design == "sobol" and self.samples & (self.samples - 1):
            raise ValueError(
                f"samples: must be a power of two in a sobol design, got {self.samples};"
                f" use {2 ** (self.samples.bit_length())}"
            )
        twice = sorted(set(self.fixed) & {*self.parameters, "scene"})
        if twice:
            raise ValueError(f"fixed.{twice[0]}: must not vary or be the scene, got {self.fixed[twice[0]]!r}; drop it")
        lengths = {len(values) for values in self.parameters.values()} if self.design == "list" else {1}
        if len(lengths) > 1:
            raise ValueError(f"parameters: lists must be equally long in a list design, got lengths {sorted(lengths)}")
        return self

    def combinations(self) -> list[dict[str, Any]]:
        """What every case changes in the scene, by dotted name: all parameters, or only one in "one-at-a-time"."""
        names = list(self.parameters)
        if self.design == "factorial":
            return [dict(zip(names, values, strict=True)) for values in itertools.product(*self.parameters.values())]
        if self.design == "list":
            return [dict(zip(names, values, strict=True)) for values in zip(*self.parameters.values(), strict=True)]
        if self.design == "one-at-a-time":
            return [{}, *({name: value} for name, values in self.parameters.items() for value in values)]
        from scipy.stats import qmc

        if self.design == "sobol":
            shares = qmc.Sobol(len(names), rng=self.seed).random(self.samples)
        else:
            shares = qmc.LatinHypercube(len(names), rng=self.seed).random(self.samples)
        return [
            {name: self.parameters[name].at(float(share)) for name, share in zip(names, row, strict=True)}
            for row in shares
        ]


@dataclass(frozen=True)
class Case:
    """One scene of a study: its parameters, and a key that is the same whenever the same would be computed.

    parameters : every parameter of the study, as the scene takes it (SI);  changes : those that the design sets in this
    case.
    """

    index: int
    parameters: dict[str, Any]
    changes: dict[str, Any]
    scene: Scene
    key: str

    @property
    def name(self) -> str:
        """What the case changes, in a few words."""
        names = short_names(self.changes)
        return ", ".join(f"{n} {value_text(v)}" for n, v in zip(names, self.changes.values(), strict=True)) or AS_IT_IS


def short_names(parameters) -> list[str]:
    """Names of parameters without their table, where they stay different."""
    short = [name.rpartition(".")[2] for name in parameters]
    return short if len(set(short)) == len(short) else list(parameters)


def value_text(value: Any) -> str:
    """A parameter's value as text."""
    if value is None:
        return "none"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def load_study(study: str | Path | dict | Study) -> Study:
    """A study from a built-in name, a TOML file, the folder of one that ran, a nested dictionary, or as it is.

    Raises
    ------
    StudyError
        Unknown name, unreadable file, or invalid values; every mistake found is named.
    """
    if isinstance(study, Study):
        return study
    if is_folder(study):
        return stored_study(study)
    origin = "study" if isinstance(study, dict) else f"study '{study}'"
    text = "" if isinstance(study, dict) else _read(str(study))
    data = study if isinstance(study, dict) else parse_toml(text, origin)
    try:
        return Study.model_validate(data)
    except ValidationError as error:
        lines = []
        for where, message in mistakes(error, Study):
            message = ": ".join([*[".".join(map(str, where))] * bool(where), message])
            if ";" not in message:
                message += "; correct it, `gush study table-2` is an example"
            number = _line(text, where or re.findall(r"\w+", message)[:1])
            lines.append(f"line {number}: {message}" if number else message)
        raise StudyError("\n  ".join([f"{origin} has {len(lines)} mistake{'s' * (len(lines) > 1)}:", *lines])) from None


def _line(text, location):
    """Line of the study's text that says most of a location, None where none does."""
    location = tuple(location)
    found = (line_of(text, location[:k]) for k in range(len(location), 0, -1)) if text else ()
    return next((number for number in found if number is not None), None)


def is_folder(study: object) -> bool:
    """Whether a study is given by the folder of one that ran; names of built-in ones come first."""
    return isinstance(study, str | Path) and Path(study).is_dir() and str(study) not in study_names()


def stored_study(folder: str | Path) -> Study:
    """The definition of a study that ran earlier, from its folder.

    Raises
    ------
    StudyError
        No study there, or its file is damaged.
    """
    try:
        return load_study(json.loads((Path(folder) / STUDY_FILE).read_text(encoding="utf-8")))
    except FileNotFoundError:
        raise StudyError(f"study folder '{folder}': must hold {STUDY_FILE}, got none; run gush study first") from None
    except ValueError as error:
        raise StudyError(f"study folder '{folder}': {STUDY_FILE} must be that of a study, got: {error}") from None


def study_names() -> list[str]:
    """Names of the built-in studies."""
    files = resources.files("coupling") / "studies" / "ready"
    return sorted(entry.name.removesuffix(".toml") for entry in files.iterdir() if entry.name.endswith(".toml"))


def cases(study: Study) -> list[Case]:
    """All cases of a study, validated before any of them runs.

    Raises
    ------
    StudyError
        A parameter that the scene does not have, or values that it refuses; the case is named.
    """
    found: dict[str, Case] = {}
    for number, changes in enumerate(study.combinations()):
        base = changes.get("scene", study.scene)
        try:
            data = read_scene_data(base)
            for name, value in {**study.fixed, **changes}.items():
                if name != "scene":
                    data = changed(data, nested(name, value))
            scene = make_scene(data, f"case {number}")
        except SceneError as problem:
            shown = ", ".join(f"{name} = {value}" for name, value in changes.items())
            raise StudyError(f"study '{study.name}', case {number} ({shown}): {problem}") from None
        values = {name: base if name == "scene" else _value_in(scene, name) for name in study.parameters}
        known = {name: changes.get(name, AS_IT_IS) if isinstance(v, dict) else v for name, v in values.items()}
        key = _key(scene, study)
        # what a scene is already is no case more
        found.setdefault(key, Case(len(found), known, {name: known[name] for name in changes}, scene, key))
    return list(found.values())


def _range(name, table):
    ends = {key: _in_unit(name, value) if key in ("low", "high") else value for key, value in table.items()}
    try:
        return Range.model_validate(ends)
    except ValidationError as error:
        said = "; ".join(": ".join([*map(str, where), message]) for where, message in mistakes(error, Range))
        raise ValueError(f"{name}: must be a list of values or a range; {said}") from None


def _in_unit(name, value):
    try:
        return number_in_unit(name, value)
    except ValueError as problem:
        raise ValueError(f"{name}: {problem}") from None


def check_backends(study: Study):
    """Refuse lining models that are not there before anything runs; a study that ran is read without them.

    Raises
    ------
    StudyError
        An unknown model, or the same one twice.
    """
    from structure.models import lining_model, lining_model_names, model_name

    try:
        for backend in study.backends:
            if backend not in lining_model_names():
                lining_model(backend)  # says why not, or finds the class in a file
    except ValueError as problem:
        raise StudyError(f"study '{study.name}': backends: {problem}") from None
    names = [model_name(backend) for backend in study.backends]
    if len(set(names)) < len(names):
        raise StudyError(f"study '{study.name}': backends: must differ, got {', '.join(names)}; name each once")


def _value_in(scene, name):
    """Value of a complete scene at a dotted name, a K0 that is left out as it is used; None where it has none."""
    value = scene.model_dump()
    for soil, table in zip(scene.soils, value["soils"], strict=True):
        lowest, highest = scene.lateral_pressure_range(soil)
        table["k0"] = highest if lowest == highest else None
    for part in name.split("."):
        try:
            value = value[int(part)] if isinstance(value, list | tuple) else value[part]
        except (KeyError, TypeError, ValueError, IndexError):
            return None
    return value


@cache
def _code() -> str:
    """Hash of the sources that decide a result: `mpm`, `structure`, and what turns a run into a case."""
    total = hashlib.sha256(FORMAT.encode())
    for package in (
        "mpm",
        "structure",
        "coupling.studies.case",
        "coupling.runs",
        "coupling.responses",
        "coupling.datasets",
    ):
        origin = Path(find_spec(package).origin)
        for file in sorted(origin.parent.rglob("*.py")) if origin.name == "__init__.py" else [origin]:
            total.update(file.read_bytes())
    return total.hexdigest()


def _key(scene: Scene, study: Study) -> str:
    models = [_source_of(backend) for backend in study.backends]
    text = "\n".join([_code(), scene.source, ",".join(models), str(study.records)])
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _source_of(backend):
    """What decides the answers of a lining model besides the sources of this program."""
    file = Path(backend.rpartition(":")[0])
    return backend + file.read_text(encoding="utf-8") if ".py:" in backend and file.is_file() else backend


def _read(name: str) -> str:
    try:
        if name in study_names():
            text = (resources.files("coupling") / "studies" / "ready" / f"{name}.toml").read_text(encoding="utf-8")
        elif Path(name).exists():
            text = read_toml_file(Path(name), f"study {name!r}")
        else:
            raise FileNotFoundError
    except FileNotFoundError:
        near = difflib.get_close_matches(name, study_names(), 1)
        hint = f"did you mean {near[0]!r}? " if near else ""
        raise StudyError(
            f"study {name!r}: must be a built-in study or a file, got neither; {hint}built-in:"
            f" {', '.join(study_names())}"
        ) from None
    return text
