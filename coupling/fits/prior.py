"""What is known of parameters before measuring, bounds or distributions, and which runs explore them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, field_validator, model_validator

from coupling.scenes.layers import read_toml_file
from coupling.studies.design import Range, Study, of_parameter, plan_of
from mpm.scene import Part

#: Standard deviations from its middle within which a normal prior is taken: 99.7 % of it.
REACH = 3.0
#: Keys with the unit of their parameter.
IN_UNIT = ("low", "high", "mean", "deviation", "median")


class Prior(Part):
    """Distribution of a parameter; one of three pairs of keys.

    Parameters
    ----------
    low, high : float
        Uniform between these, evenly in the value or, with `scale` = "log", in its logarithm.
    mean, deviation : float
        Normal, by its mean and standard deviation; taken within three of these, and within `low` and `high` if given.
    median, factor : float
        Lognormal: two thirds of it lie between median/factor and median*factor; taken within the cube of the factor,
        and within `low` and `high` if given.
    """

    low: float | None = None
    high: float | None = None
    scale: Literal["linear", "log"] = "linear"
    mean: float | None = None
    deviation: float | None = Field(default=None, gt=0)
    median: float | None = Field(default=None, gt=0)
    factor: float | None = Field(default=None, gt=1)

    @model_validator(mode="after")
    def _check(self) -> Prior:
        pairs = (("mean", "deviation"), ("median", "factor"))
        for one, other in (*pairs, *(pair[::-1] for pair in pairs)):
            if getattr(self, one) is not None and getattr(self, other) is None:
                raise ValueError(f"{other}: must be given where {one} is, got none; state both")
        normal, lognormal = self.mean is not None, self.median is not None
        if normal and lognormal:
            raise ValueError("mean and median: one may be given, got both; mean is of a normal prior, median of a "
                             "lognormal one")  # fmt: skip
        if not (normal or lognormal) and (self.low is None or self.high is None):
            raise ValueError("low and high, mean and deviation, or median and factor: a pair must be given, got none; "
                             "{low = .., high = ..} is uniform")  # fmt: skip
        if (normal or lognormal) and self.scale == "log":
            raise ValueError("scale: belongs to low and high alone, got 'log'; give median and factor for a lognormal")
        if self.logarithmic and self.low is not None and self.low <= 0:
            raise ValueError(f"low: must be above 0 where the logarithm counts, got {self.low:g}; raise it")
        low, high = self._ends()
        if not low < high:
            raise ValueError(f"low: must be below high, got {self._value(low):g} and {self._value(high):g}; swap them")
        return self

    @property
    def logarithmic(self) -> bool:
        """Whether evenly is by the logarithm."""
        return self.scale == "log" or self.median is not None

    @property
    def range(self) -> Range:
        """Where the runs are, evenly."""
        low, high = map(self._value, self._ends())
        return Range(low=low, high=high, scale="log" if self.logarithmic else "linear")

    def quantile(self, share: ArrayLike) -> NDArray[np.float64]:
        """Values below which shares from 0 to 1 of the distribution lie."""
        return np.exp(self._quantile(share)) if self.logarithmic else self._quantile(share)

    def place(self, value: ArrayLike) -> NDArray[np.float64]:
        """Where values lie on the range, from 0 to 1, evenly in the value or its logarithm."""
        low, high = self._ends()
        return (np.log(value) - low) / (high - low) if self.logarithmic else (np.asarray(value) - low) / (high - low)

    def _value(self, number):
        return math.exp(number) if self.logarithmic else number

    def _normal(self):
        """Middle and deviation of a normal distribution, of the value or its logarithm; None where it is uniform."""
        if self.median is not None:
            return math.log(self.median), math.log(self.factor)
        return None if self.mean is None else (self.mean, self.deviation)

    def _ends(self):
        """Ends, of the value or its logarithm."""
        given = [None if end is None else math.log(end) if self.logarithmic else end for end in (self.low, self.high)]
        normal = self._normal()
        if normal is None:
            return tuple(given)
        ends = normal[0] - REACH * normal[1], normal[0] + REACH * normal[1]
        return (ends[0] if given[0] is None else max(ends[0], given[0]),
                ends[1] if given[1] is None else min(ends[1], given[1]))  # fmt: skip

    def _quantile(self, share):
        (low, high), normal = self._ends(), self._normal()
        if normal is None:
            return low + np.asarray(share) * (high - low)
        from scipy.stats import truncnorm

        middle, deviation = normal
        return truncnorm.ppf(share, (low - middle) / deviation, (high - middle) / deviation, middle, deviation)


class FitPlan(Part):
    """What is fitted, and by how many runs.

    Parameters
    ----------
    parameters : dict
        Dotted name of a scene's key, as "gate.angle" or "soils.0.k0", to its :class:`Prior`.
    fixed : dict
        Dotted names to values that all runs take instead of the scene's.
    samples : int
        Number of runs; a power of two for "sobol". 96 were enough for three parameters, 64 were not (fit-coverage).
    design : {"sobol", "latin-hypercube"}
        How the runs fill the space of the parameters.
    seed : int
        Of runs and draws: equal seeds give equal results.
    backends : tuple of str
        Lining models that answer every run; the first one is compared and predicted.
    records : int
        Number of states, from the opening of the gate on, at which is predicted.
    draws : int
        Number of draws from the posterior distribution.
    """

    parameters: dict[str, Prior] = Field(min_length=1, max_length=12)
    fixed: dict[str, Any] = Field(default_factory=dict)
    samples: int = Field(default=128, ge=8, le=2000)
    design: Literal["sobol", "latin-hypercube"] = "sobol"
    seed: int = Field(default=0, ge=0)
    backends: tuple[str, ...] = ("beam-spring",)
    records: int = Field(default=41, ge=2, le=1000)
    draws: int = Field(default=2048, ge=256, le=100_000)

    @field_validator("parameters", mode="before")
    @classmethod
    def _read_parameters(cls, parameters):
        """Numbers in SI; mistakes under the parameter's name."""
        if not isinstance(parameters, dict):
            return parameters
        return {name: prior if isinstance(prior, Prior) else _prior(name, prior) for name, prior in parameters.items()}

    def study(self, scene: str | Path) -> Study:
        """The runs as a study of a scene.

        Raises StudyError: samples or keys that a study does not take.
        """
        data = self.model_dump(include={"fixed", "samples", "design", "seed", "backends", "records"})
        ranges = {name: prior.range for name, prior in self.parameters.items()}
        return plan_of(
            Study, {**data, "name": "ensemble", "scene": str(scene), "parameters": ranges}, "fit", "see above"
        )


def values_of(plan: FitPlan, shares: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values (p, d) of parameters by the shares of their priors below them."""
    columns = zip(plan.parameters.values(), shares.T, strict=True)
    return np.column_stack([prior.quantile(column) for prior, column in columns])


def places_of(plan: FitPlan, shares: NDArray[np.float64]) -> NDArray[np.float64]:
    """Places (p, d) from 0 to 1 over the parameters' ranges, by the shares of their priors below them."""
    columns = zip(plan.parameters.values(), values_of(plan, shares).T, strict=True)
    return np.column_stack([prior.place(column) for prior, column in columns])


def read_plan(source: str | Path | dict[str, Any] | FitPlan) -> FitPlan:
    """A plan from its TOML file or nested dictionary, or as it is.

    Raises StudyError: unreadable, or invalid values; every mistake with its line.
    """
    if isinstance(source, FitPlan):
        return source
    who = "priors" if isinstance(source, dict) else f"priors '{source}'"
    text = source if isinstance(source, dict) else read_toml_file(Path(source), who)
    return plan_of(FitPlan, text, who, 'write it like "gate.angle" = {low = 60.0, high = 120.0}')


def _prior(name, table):
    if not isinstance(table, dict):
        raise ValueError(
            f"{name}: must be a table of bounds or of a distribution, got {table!r}; {{low = .., high = ..}}"
        )
    return of_parameter(Prior, name, table, IN_UNIT)
