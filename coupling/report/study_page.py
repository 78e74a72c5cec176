"""What the page about a study shows, collected from its definition, its dataset and its cases' folders."""

import os
from pathlib import Path

from coupling.datasets.group import read_group_at_once
from coupling.files.folder import LOG_FILE, REPORT_FILE
from coupling.refused import Refused
from coupling.report.packing import evenly, packed
from coupling.report.study_numbers import NOT_RUN, balances, case_numbers, case_warnings, last_record, run_facts
from coupling.report.study_series import (
    MOST_CASES,
    MOST_RECORDS,
    budget,
    case_series,
    ring_extremes_over_mass,
    slider_stops,
)
from coupling.scenes.facts import facts
from coupling.studies.case import RUN_FOLDER
from coupling.studies.collect import stored_cases, unreadable
from coupling.studies.design import Range, StudyError, value_text
from coupling.studies.execute import case_file
from structure.lining import at_whole_degrees
from structure.models import model_name

SCRIPTS = (
    "unpack.js", "charts.js", "tables.js", "slider.js", "study_data.js", "study_charts.js", "study_tables.js",
    "study_player.js",
)  # fmt: skip
MOST_VALUES_NAMED = 6  # of a fact that differs between the cases


def collect(folder, beside, model=None):
    """Everything that the page shows.

    Parameters
    ----------
    folder : path
        Of the study.
    beside : path
        Folder of the page: links are relative to it.
    model : str, optional
        Lining model whose numbers lead; left out: the study's first.

    Returns
    -------
    dict
        name, attributes; design, facts: rows of (what, text); cases: list of dicts of number, label, parameters,
        status, message, numbers, balances, warnings, cpu_seconds, wall_seconds, run (path), report, log (links or
        None), drawn; notes; player: what the script draws, JSON, its `cases` empty where none is finished.

    Raises
    ------
    coupling.studies.design.StudyError
        The definition, a scene of it, or what a case left cannot be read.
    """
    plan, found, failures = stored_cases(folder)
    done = [case for case in found if case_file(Path(folder), case).is_file()]
    models = [model_name(backend) for backend in plan.backends]
    if model is not None:
        if model not in models:
            raise Refused(f"--model: must be one of the study, got {model!r}; there are {', '.join(models) or 'none'}")
        models.insert(0, models.pop(models.index(model)))
    rows, whole, extremes = [], {}, {}
    for case in found:
        one, file = None, case_file(Path(folder), case)
        if case in done:
            one = whole[case.index] = _loaded(file, models)
            extremes[case.index] = ring_extremes_over_mass(one)
        rows.append(_row(case, one, extremes.get(case.index), failures.get(case.key), file.parent, Path(beside)))
    drawn = [case for case in done if last_record(whole[case.index]) is not None]
    chosen = [drawn[k] for k in evenly(len(drawn), MOST_CASES)] if drawn else []
    for row in rows:
        row["drawn"] = row["number"] in {case.index for case in chosen}
    kept = evenly(plan.records, MOST_RECORDS)
    shown = {case.index: whole[case.index].isel(progress=kept) for case in chosen}
    extremes = {k: [{key: v[kept] for key, v in model.items()} for model in extremes[k]] for k in shown}
    # of a case with a ring, if there is one
    widest = max(shown.values(), key=lambda one: one.sizes.get("model", 0), default=None)
    step, records = (1, kept) if widest is None else budget(widest, len(chosen))
    return {
        "name": plan.name,
        "attributes": next(iter(whole.values())).attrs if whole else {},
        "design": _design(plan, found, done, sum(row["status"] == "failed" for row in rows)),
        "facts": _shared_facts(found),
        "cases": rows,
        "notes": _thinned(plan.records, step, len(records), len(chosen), len(drawn)),
        "player": _player(widest, shown, extremes, chosen, rows, step, records),
    }


def _player(dataset, whole, extremes, chosen, rows, step, records):
    if not chosen:
        return {"cases": []}
    labels = {row["number"]: row["label"] for row in rows}
    return {
        "stops": packed(slider_stops([whole[case.index] for case in chosen], records)),
        "records": records.tolist(),
        "theta": dataset["theta"].values[::step].tolist(),
        "models": [str(name) for name in dataset["model"].values] if "model" in dataset.dims else [],
        "cases": [
            {
                "number": case.index,
                "label": labels[case.index],
                "gate": None if case.scene.gate is None else case.scene.gate.angle,
                **case_series(whole[case.index], extremes[case.index], step, records),
            }
            for case in chosen
        ],
    }


def _loaded(file, models):
    """The dataset of a case, in memory, with these lining models in their order."""
    try:
        dataset = at_whole_degrees(read_group_at_once(file), "theta_ring")
        same = "model" not in dataset.dims or tuple(dataset["model"].values) == tuple(models)
        return dataset if same else dataset.reindex(model=list(models))
    except (OSError, RuntimeError, ValueError, KeyError, AttributeError) as error:
        raise StudyError(unreadable(file, error)) from None


def _row(case, dataset, extremes, failure, folder, beside):
    run = folder / RUN_FOLDER
    stored = run_facts(run)
    if dataset is not None:
        status, message = "finished", ""
    elif failure is None:
        status, message = "not run", NOT_RUN
    else:
        status, message = "failed", failure or "no reason was given"
    return {
        "number": case.index,
        "label": case.name,
        "parameters": case.parameters,
        "status": status,
        "message": message,
        "numbers": [] if dataset is None else case_numbers(dataset, extremes),
        "balances": {} if dataset is None else balances(dataset),
        "warnings": [] if dataset is None else case_warnings(dataset, case.scene),
        "cpu_seconds": None if dataset is None else float(dataset["cpu_seconds"]),
        "wall_seconds": float(stored["wall_seconds"]) if "wall_seconds" in stored else None,
        "run": _relative(run, beside) if run.is_dir() else None,
        "report": _relative(run / REPORT_FILE, beside) if (run / REPORT_FILE).is_file() else None,
        "log": _relative(run / LOG_FILE, beside) if (run / LOG_FILE).is_file() else None,
    }


def _relative(path, beside):
    return Path(os.path.relpath(path, beside)).as_posix()


def _design(plan, found, done, failed):
    kinds = {
        "factorial": "all combinations of the values", "list": "the first values of all lists, then the second, ..",
        "one-at-a-time": "the scene as it is, then every value alone", "latin-hypercube": "latin hypercube samples",
        "sobol": "Sobol samples",
    }  # fmt: skip
    rows = [("scene", plan.scene), ("design", kinds[plan.design])]
    if plan.samples:
        rows.append(("samples", f"{plan.samples}, seed {plan.seed}"))
    for name, values in plan.parameters.items():
        if isinstance(values, Range):
            scale = ", logarithmic" if values.scale == "log" else ""
            rows.append((name, f"from {values.low:g} to {values.high:g}{scale}"))
        else:
            rows.append((name, ", ".join(value_text(value) for value in values)))
    rows += [(f"{name} (all cases)", value_text(value)) for name, value in plan.fixed.items()]
    rows.append(("lining models", ", ".join(plan.backends)))
    rows.append(("compared at", f"{plan.records} inflow masses of every case"))
    rows.append(
        ("cases", f"{len(found)}; {len(done)} finished, {failed} failed, {len(found) - len(done) - failed} not run")
    )
    return rows


def _shared_facts(found):
    """The scene of all cases; where cases differ their values beside each other."""
    rows = {}
    for case in found:
        for what, text in facts(case.scene):
            rows.setdefault(what, []).append(text)
    shown = []
    for what, texts in rows.items():
        different = list(dict.fromkeys(texts))
        everywhere = len(texts) == len(found)
        if len(different) == 1:
            shown.append((what, different[0] if everywhere else f"{different[0]} (in {len(texts)} cases)"))
        elif len(different) <= MOST_VALUES_NAMED:
            shown.append((what, " | ".join(different)))
        else:
            shown.append((what, f"{len(different)} different ones, the first: {different[0]}"))
    return shown


def _thinned(whole, step, records, chosen, drawn):
    told = []
    if chosen < drawn:
        told.append(f"Charts hold {chosen} of {drawn} finished cases, evenly chosen; the tables hold them all.")
    if step > 1:
        told.append(f"Curves around the ring show every {step}. value; extremes are taken from all of them.")
    if drawn and records < whole:
        told.append(f"Curves around the ring are shown at {records} of {whole} inflow masses.")
    return told
