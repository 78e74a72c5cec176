"""What a study is: a base scene, parameters by their dotted names, and which combinations of them are run."""

import itertools
import json
import math
import re
from pathlib import Path
from typing import Any, Literal, TypeVar

from pydantic import Field, ValidationError, field_validator, model_validator

from coupling.refused import SceneError
from coupling.scenes.layers import parse_toml, ready_names, text_of
from coupling.scenes.mistake_lines import line_of
from coupling.scenes.scene import number_in_unit
from coupling.studies.folder import STUDY_FILE
from mpm.scene import Part
from structure.inputs import mistakes

#: What stands for a whole table that a case leaves as the scene has it, and for a case that changes nothing.
AS_IT_IS = "as it is"


class StudyError(SceneError):
    """A study that cannot be run: where, rule, value, remedy."""


class Range(Part):
    """Values between `low` and `high`, spaced evenly or by their logarithm."""

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


class Study(Part):
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

    name: str = Field(min_length=1, max_length=60, pattern=r"^\w[\w.-]*$")
    scene: str = "quick"
    design: Literal["factorial", "list", "one-at-a-time", "latin-hypercube", "sobol"] = "factorial"
    parameters: dict[str, tuple[Any, ...] | Range] = Field(min_length=1)
    fixed: dict[str, Any] = Field(default_factory=dict)
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
                values = of_parameter(Range, name, values, ("low", "high"), "must be a list of values or a range; ")
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
        names, lists = list(self.parameters), self.parameters.values()
        if self.design in ("factorial", "list"):
            rows = itertools.product(*lists) if self.design == "factorial" else zip(*lists, strict=True)
            return [dict(zip(names, values, strict=True)) for values in rows]
        if self.design == "one-at-a-time":
            return [{}, *({name: value} for name, values in self.parameters.items() for value in values)]
        from scipy.stats import qmc

        sampler = qmc.Sobol if self.design == "sobol" else qmc.LatinHypercube
        shares = sampler(len(names), rng=self.seed).random(self.samples)
        return [
            {name: self.parameters[name].at(float(share)) for name, share in zip(names, row, strict=True)}
            for row in shares
        ]


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

    Raises StudyError: unknown name, unreadable file, or invalid values; every mistake found is named.
    """
    if isinstance(study, Study):
        return study
    if is_folder(study):
        return stored_study(study)
    origin = "study" if isinstance(study, dict) else f"study '{study}'"
    text = "" if isinstance(study, dict) else text_of("study", str(study), "studies", StudyError)
    return plan_of(Study, study if isinstance(study, dict) else text, origin, "`gush study table-2` is an example")


Plan = TypeVar("Plan", bound=Part)


def plan_of(model: type[Plan], source: str | dict, origin: str, example: str) -> Plan:
    """A plan from its TOML text or nested dictionary.

    Raises StudyError: every mistake found, with its line where there is a text; `example` is the remedy of those that
    have none.
    """
    text = source if isinstance(source, str) else ""
    try:
        return model.model_validate(parse_toml(text, origin) if isinstance(source, str) else source)
    except ValidationError as error:
        lines = []
        for where, message in mistakes(error, model):
            message = ": ".join([*[".".join(map(str, where))] * bool(where), message])
            if ";" not in message:
                message += f"; correct it, {example}"
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

    Raises StudyError: no study there, or its file is damaged.
    """
    try:
        return load_study(json.loads((Path(folder) / STUDY_FILE).read_text(encoding="utf-8")))
    except FileNotFoundError:
        raise StudyError(f"study folder '{folder}': must hold {STUDY_FILE}, got none; run gush study first") from None
    except ValueError as error:
        raise StudyError(f"study folder '{folder}': {STUDY_FILE} must be that of a study, got: {error}") from None


def study_names() -> list[str]:
    """Names of the built-in studies."""
    return ready_names("studies")


def of_parameter(model: type[Plan], name: str, table: dict[str, Any], keys: tuple[str, ...], rule: str = "") -> Plan:
    """What a table says of the parameter of a dotted name, the numbers under some keys in its unit.

    Raises ValueError: no quantity, or of another dimension; or every other mistake, behind `rule`.
    """
    try:
        numbers = {key: number_in_unit(name, value) if key in keys else value for key, value in table.items()}
    except ValueError as problem:
        raise ValueError(f"{name}: {problem}") from None
    try:
        return model.model_validate(numbers)
    except ValidationError as error:
        said = "; ".join(": ".join([*map(str, where), message]) for where, message in mistakes(error, model))
        raise ValueError(f"{name}: {rule}{said}") from None
