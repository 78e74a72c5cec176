"""What a verification problem is, and the registry of all of them."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

#: Modules of this package that register problems when they are imported.
FAMILIES = (
    "columns", "waves", "motion", "conservation", "plasticity", "soil_laws", "flows", "earth_pressure", "cavities",
    "slots", "jointed_rings",
)  # fmt: skip

#: Numerical choices that a problem hands through to its scene, and the values that its ladder goes through.
NUMERICS = {
    "points": (1, 3, 12), "courant": (0.4, 0.8, 1.0), "pic_rate": (0.0, 1.0, 10.0, 100.0),
    "stress_damping": (0.0, 0.5, 1.0),
}  # fmt: skip
#: The same of pore water.
WET = {"pressure_filter": (0.0, 0.1, 0.4, 0.8)}

_REGISTRY: dict[str, Problem] = {}


@dataclass(frozen=True)
class Result:
    """One run of a problem.

    error : the problem's error norm [-], relative;  values : further measured numbers by name (SI);
    steps, points : of the run;  cpu_seconds : processor time of stepping [s].
    """

    error: float
    values: dict[str, float] = field(default_factory=dict)
    steps: int = 0
    points: int = 0
    cpu_seconds: float = 0.0

    @classmethod
    def of(cls, solver, seconds, error, **values):
        """Of a run of a solver that took so many processor seconds."""
        values = {name: float(value) for name, value in values.items()}
        return cls(float(error), values, int(solver.step_count), int(solver.n_points), seconds)


@dataclass(frozen=True)
class Problem:
    """A problem with a known answer.

    Parameters
    ----------
    name : str
        As `gush accuracy NAME` takes it.
    title : str
        One line.
    source : str
        Author, year, equation of the reference answer.
    norm : str
        What `Result.error` is.
    solve : callable
        solve(**settings) -> Result.
    fast : dict
        Settings of the test: a few seconds of processor time.
    ladder : dict
        Name of a setting to the values that `gush accuracy` goes through, one at a time, the others as in `fast`.
    limit : float
        Largest error of the fast setting.
    why : str
        The reason for that limit.
    """

    name: str
    title: str
    source: str
    norm: str
    solve: Callable[..., Result]
    fast: dict[str, Any]
    ladder: dict[str, tuple]
    limit: float
    why: str


def register(problem: Problem) -> Problem:
    """Add a problem to the registry; its name must be new."""
    if problem.name in _REGISTRY:
        raise ValueError(f"verification problem '{problem.name}' is registered twice; give one of them another name")
    _REGISTRY[problem.name] = problem
    return problem


def problems() -> dict[str, Problem]:
    """All problems by name, in the order of their families."""
    for family in FAMILIES:
        importlib.import_module(f"verification.problems.{family}")
    return dict(_REGISTRY)
