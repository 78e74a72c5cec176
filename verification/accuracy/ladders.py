"""Ladders of settings over verification problems: error against processor time."""

import math
from collections.abc import Callable, Iterable
from dataclasses import asdict

from mpm.scene import Numerics
from verification.accuracy.orders import excess_over_front, observed_order, pareto_front
from verification.problems.problem import Problem, Result

#: Settings that count something: their mesh size or time step is one over the value.
COUNTS = ("cells", "sectors", "around", "steps", "increments", "points")
#: Settings that are a mesh size or a time step.
SIZES = ("size", "courant")
#: All numerical choices, K_w among them, which is a property too; what else a ladder changes poses another problem.
NUMERICAL = {*COUNTS, *SIZES, *Numerics.model_fields, "damping", "outer", "bulk_modulus"}
#: Errors at or below this are round-off: nothing can be gained there.
ROUND_OFF = 1e-12


def measure(problem: Problem, only_fast: bool = False, progress: Callable[[str], None] | None = None) -> list[dict]:
    """Run a problem with its fast setting, then with every value of every ladder, all else as in the fast one.

    The fast setting runs twice and the second counts: compiling is no cost of a method.

    Returns: problem, setting ("default" for the fast setting), value, error [-], cpu_seconds [s], steps, points, values
    (further numbers, SI). A run that fails has error NaN and `failure`, its message.
    """
    tell = progress if progress is not None else lambda line: None
    problem.solve(**problem.fast)
    rows = [_row(problem, "default", None, {})]
    tell(_line(rows[-1]))
    for setting, values in {} if only_fast else problem.ladder.items():
        for value in values:
            if value == problem.fast.get(setting):
                rows.append(rows[0] | {"setting": setting, "value": value})
                continue
            rows.append(_row(problem, setting, value, {setting: value}))
            tell(_line(rows[-1]))
    return rows


def _row(problem, setting, value, changes):
    row = {"problem": problem.name, "setting": setting, "value": value}
    try:
        result, failure = problem.solve(**(problem.fast | changes)), ""
    except (ArithmeticError, RuntimeError) as error:
        result, failure = Result(math.nan, cpu_seconds=math.nan), str(error)
    return row | asdict(result) | {"failure": failure}


def _line(row):
    what = row["problem"] if row["value"] is None else f"{row['problem']}, {row['setting']} = {row['value']}"
    return f"{what}: " + (row["failure"] or f"error {row['error']:.3g}, {row['cpu_seconds']:.2f} s CPU")


def assess(rows: Iterable[dict]) -> dict:
    """Orders of the ladders of one problem, its Pareto front, and where the default lies.

    Returns: orders : setting that is a mesh size, a time step or a count to the observed order;  front : (n_rows,)
    bool, among numerical choices only: another friction angle is another problem, not a cheaper method;  excess : error
    of the default over the best error of what costs no more, 1 where it is round-off.
    """
    rows = list(rows)
    chosen = NUMERICAL | {"default"}
    known = [k for k, row in enumerate(rows) if math.isfinite(row["error"]) and row["setting"] in chosen]
    costs, errors = ([rows[k][key] for k in known] for key in ("cpu_seconds", "error"))
    front = [False] * len(rows)
    for k, best in zip(known, pareto_front(costs, errors), strict=True):
        front[k] = bool(best)
    orders = {}
    for setting in dict.fromkeys(row["setting"] for row in rows if row["value"] is not None):
        if setting not in (*COUNTS, *SIZES):
            continue
        mine = [row for row in rows if row["setting"] == setting and row["error"] > ROUND_OFF]
        sizes = [(1 / n if setting in COUNTS else n) if n > 0 else math.nan for n in (row["value"] for row in mine)]
        orders[setting] = observed_order(sizes, [row["error"] for row in mine])
    first = next((k for k, i in enumerate(known) if rows[i]["setting"] == "default"), None)
    excess = math.nan if first is None else excess_over_front(costs, errors, first)
    if first is not None and errors[first] <= ROUND_OFF:
        excess = 1.0
    return {"orders": orders, "front": front, "excess": excess}


def dataset(rows: Iterable[dict]):
    """All runs of all problems as a dataset over `run`.

    Returns xarray.Dataset: problem, setting, value (as text), error [-], cpu_seconds [s], steps, points, on_front
    (run).
    """
    import numpy as np
    import xarray as xr

    rows = list(rows)
    front = []
    for name in dict.fromkeys(row["problem"] for row in rows):
        front += assess(row for row in rows if row["problem"] == name)["front"]
    columns = {
        "error": ("1", "error in the norm of the problem"), "cpu_seconds": ("s", "processor time of stepping"),
        "steps": ("1", "time steps"), "points": ("1", "material points"), "problem": ("1", "verification problem"),
        "setting": ("1", "what was changed; 'default': nothing"),
    }  # fmt: skip
    data = {
        name: ("run", np.array([row[name] for row in rows]), {"units": units, "long_name": text})
        for name, (units, text) in columns.items()
    }
    values = np.array(["" if row["value"] is None else str(row["value"]) for row in rows])
    data |= {
        "on_front": ("run", np.array(front, np.int8), {"units": "1"}),
        "setting_value": ("run", values, {"units": "1", "long_name": "its value"}),
    }
    return xr.Dataset(data).set_coords(["problem", "setting", "setting_value"])
