"""What the page about a study shows, collected from its definition, its dataset and its cases' folders."""

import os
from pathlib import Path

from coupling.datasets import RunFileError, read_attributes
from coupling.files.folder import LOG_FILE, REPORT_FILE, RUN_FILE
from coupling.postprocess.extremes import RING_EXTREMES
from coupling.postprocess.quality import ERRORS
from coupling.refused import Refused
from coupling.report.charts import COLUMNS
from coupling.report.curves import MOST_IN_DETAIL, budget, entry, ring_series, rows_at, shape_of_ring, slider_stops
from coupling.report.numbers import Number, finite, ring_numbers, shown
from coupling.report.packing import evenly
from coupling.report.trust import balances, case_warnings, last_record
from coupling.responses.comparison import HEADS as DIFFERENCES
from coupling.responses.comparison import difference_cells
from coupling.runs.progress_line import duration
from coupling.scenes.features import facts
from coupling.studies.collect import read_case, stored_cases
from coupling.studies.design import Range, short_names, value_text
from coupling.studies.folder import RUN_FOLDER, case_file
from coupling.studies.limits import HEADS, governing_of_study, limit_rows, limits_of_case, limits_of_study
from structure.models import model_name

MOST_VALUES_NAMED = 6  # of a fact that differs between the cases
MOST_CASES, MOST_RECORDS, MOST_WARNINGS = 60, 121, 6
NOT_RUN = "not run yet; repeat `gush study`"
#: What the slider moves along: its place, several of them, their unit.
ALONG = {"inflow_mass": ("inflow mass", "inflow masses", "kg/m"), "time": ("time", "times", "s")}


def collect(folder, beside, model=None):
    """Everything that the page shows, names as `page.html` uses them.

    folder : path, of the study;  beside : path, folder of the page: links are relative to it;  model : str, optional,
    lining model whose numbers lead; left out: the study's first.

    Raises coupling.studies.design.StudyError: the definition, a scene of it, or what a case left cannot be read.
    """
    plan, found, failures = stored_cases(folder)
    models = [model_name(backend) for backend in plan.backends]
    if model is not None:
        if model not in models:
            raise Refused(f"--model: must be one of the study, got {model!r}; there are {', '.join(models) or 'none'}")
        models.insert(0, models.pop(models.index(model)))
    files = {case.index: case_file(Path(folder), case) for case in found}
    whole = {case.index: _loaded(files[case.index], models) for case in found if files[case.index].is_file()}
    answers = {number: ring_series(states) for number, states in whole.items()}
    rows = [_row(case, whole.get(case.index), answers.get(case.index), failures.get(case.key),
                 files[case.index].parent / RUN_FOLDER, Path(beside)) for case in found]  # fmt: skip
    done, lost = ([row for row in rows if (row["status"] == "finished") == good] for good in (True, False))
    drawn = [case for case in found if case.index in whole and last_record(whole[case.index]) is not None]
    chosen = [drawn[k] for k in evenly(len(drawn), MOST_CASES)] if drawn else []
    player, notes = _player(whole, answers, chosen, plan.records)
    attributes = next(iter(whole.values())).attrs if whole else {}
    if len(chosen) < len(drawn):
        notes.insert(0, f"Charts hold {len(chosen)} of {len(drawn)} finished cases, evenly chosen; tables hold all.")
    return {
        "title": f"Gushing into a tunnel: study {plan.name}",
        "lead": f"{len(rows)} cases over {', '.join({n: None for row in rows for n in row['parameters']})}, computed "
                f"in {duration(sum(row['cpu_seconds'] or 0.0 for row in done))} of processor time.",
        "status": ("finished" if not lost else "failed" if not done else "partly",
                   f"{len(done)} of {len(rows)} finished"),
        "notes": notes,
        "attributes": attributes,
        "made": f"first case of {attributes['created']}" if "created" in attributes else "",
        "design_title": "Design of the study",
        "design": _design(plan, found, len(done), sum(row["status"] == "failed" for row in lost)),
        "player": player,
        **_of_cases(found, rows, whole, models[0] if models else None),
    }  # fmt: skip


def collect_runs(compared, beside):
    """Everything that the page about runs side by side shows: they are the cases.

    compared : coupling.studies.side_by_side.SideBySide, along the inflow mass, or along time: so moves the slider, too;
    beside : path, folder of the page.
    """
    whole = {case.index: shape_of_ring(states) for case, states in zip(compared.cases, compared.states, strict=True)}
    answers = {number: ring_series(states) for number, states in whole.items()}
    done = [_row(case, whole[case.index], answers[case.index], None, file.parent, Path(beside))
            for case, file in zip(compared.cases, compared.files, strict=True)]  # fmt: skip
    chosen = [compared.cases[k] for k in evenly(len(compared.cases), MOST_CASES)]
    records, along = whole[0].sizes["progress"], compared.along
    player, notes = _player(whole, answers, chosen, records, along)
    place, places, unit = ALONG[along]
    design = [(case.parameters["run"], str(file)) for case, file in zip(compared.cases, compared.files, strict=True)]
    last = f"{shown(float(whole[0][along][-1]))} {unit}"
    model = str(whole[0]["model"].values[0]) if "model" in whole[0].dims else None
    return {
        "title": f"Gushing into a tunnel: {len(done)} runs side by side",
        "lead": f"Compared at equal {place}, to {last}, which all of them reached.",
        "status": ("finished", f"{len(done)} runs"),
        "notes": notes,
        "attributes": whole[0].attrs,
        "made": f"first run of {whole[0].attrs.get('created', 'unknown time')}",
        "design_title": "What is compared",
        "design": [*design, ("compared at", f"{records} {places}")],
        "player": player,
        **_of_cases(compared.cases, done, whole, model, compared.rows),
    }


def _of_cases(found, rows, whole, model, differences=()):
    """What a page says of its cases, whether they are those of a study or runs side by side."""
    done, lost = ([row for row in rows if (row["status"] == "finished") == good] for good in (True, False))
    limits = limits_of_study({row["number"]: limits_of_case(whole[row["number"]], model) for row in done})
    return {
        "warnings": _warnings(rows, lost),
        "answer": _answer(done, limits, differences),
        "scene_of_cases": _shared_facts(found),
        "lost": lost,
        "done": done,
        "table": _table(done),
        "limits": _limits(done, limits, model),
        "trust": _trust(done),
    }


def _player(whole, answers, chosen, available, along="inflow_mass"):
    """What the script draws, and what of it is left out as sentences."""
    if not chosen:
        return {"entries": [], "fields": None, "mesh": None}, []
    states = {case.index: whole[case.index] for case in chosen}
    # of a case with a ring, if there is one
    widest = max(states.values(), key=lambda one: one.sizes.get("model", 0))
    detail = len(chosen) <= MOST_IN_DETAIL
    step, records = budget(widest, len(chosen), MOST_RECORDS, detail)
    stops, notes, (_, places, unit) = slider_stops(list(states.values()), records, along), [], ALONG[along]
    if step > 1:
        notes.append(f"Curves around the ring show every {step}. value; extremes are taken from all of them.")
    if len(records) < available:
        notes.append(f"Curves around the ring are shown at {len(records)} of {available} {places}.")
    entries = [{
        "number": case.index,
        "label": case.name,
        "gate": None if case.scene.gate is None else case.scene.gate.angle,
        "at": rows_at(states[case.index], records, stops, along).tolist(),
        **entry(states[case.index], answers[case.index], records, step, detail),
    } for case in chosen]  # fmt: skip
    told = [f"{shown(float(stop))} {unit}" for stop in stops]
    return {
        "stops": {"along": along, "values": stops, "told": told},
        "theta": widest["theta"].values[::step].tolist(),
        "entries": entries,
        "fields": None,
        "mesh": None,
    }, notes


def _warnings(rows, lost):
    warned = [f"Case {row['label']}: {text}" for row in rows for text in row["warnings"]]
    if len(warned) > MOST_WARNINGS:
        more = len(warned) - MOST_WARNINGS + 1
        warned = [*warned[: MOST_WARNINGS - 1], f"{more} more are named in the table of balances and warnings."]
    if lost:
        warned.insert(0, f"Without a result: {len(lost)} of {len(rows)} cases; the reasons stand below the design.")
    return warned


def _loaded(file, models):
    """The dataset of a case, in memory, with these lining models in their order."""
    dataset = read_case(file)
    same = "model" not in dataset.dims or tuple(dataset["model"].values) == tuple(models)
    return shape_of_ring(dataset if same else dataset.reindex(model=list(models)))


def _row(case, states, answers, failure, run, beside):
    """A case; `run`: folder of its run, `beside`: that of the page."""
    status = "finished" if states is not None else "not run" if failure is None else "failed"
    seconds = _wall_seconds(run)
    there = {name: run / name for name in ("", REPORT_FILE, LOG_FILE) if (run / name).exists()}
    return {
        "number": case.index,
        "label": case.name,
        "parameters": case.parameters,
        "status": status,
        "message": {"finished": "", "not run": NOT_RUN}.get(status, failure or "no reason was given"),
        "numbers": [] if states is None else _numbers(states, answers),
        "balances": {} if states is None else balances(states),
        "warnings": [] if states is None else case_warnings(states, case.scene),
        "cpu_seconds": None if states is None else float(states["cpu_seconds"]),
        "wall_seconds": seconds,
        "links": {name: Path(os.path.relpath(path, beside)).as_posix() for name, path in there.items()},
    }


def _wall_seconds(run):
    """What the file of a case's run says; None without a readable one."""
    try:
        stored = read_attributes(run) if (run / RUN_FILE).is_file() else {}
    except RunFileError:
        return None
    return float(stored["wall_seconds"]) if "wall_seconds" in stored else None


def _numbers(states, answers):
    """Key numbers of a case at the last inflow mass that it reached."""
    end = last_record(states)
    if end is None:
        return []
    own = [Number(key, name, unit, factor, None, finite(states[key].values[end]), None, "")
           for key, name, unit, factor, _ in COLUMNS if key in ("inflow_mass", "time", "flow_zone_area")
           and key in states.variables]  # fmt: skip
    return own + ring_numbers(list(states["model"].values) if "model" in states.dims else [], answers)


def _table(done):
    """Headings (name, unit) and rows of cells of the table of cases."""
    known = {number.key for row in done for number in row["numbers"]}
    left = ("joint_dislocation_max", "convergence_horizontal", "joint_rotation_max")
    columns = [column for column in COLUMNS if column[0] in known and column[0] not in left]
    parameters = list(dict.fromkeys(name for row in done for name in row["parameters"]))
    heads = [(name, "") for name in short_names(parameters)] + [(name, unit) for _, name, unit, _, _ in columns]
    rows = []
    for row in done:
        numbers = {number.key: number for number in row["numbers"]}
        cells = [{"value": row["parameters"].get(name)} for name in parameters]
        cells += [{"key": key, "number": numbers.get(key)} for key, *_ in columns]
        rows.append((row, [*cells, *({"value": row[name]} for name in ("cpu_seconds", "wall_seconds")),
                           {"value": len(row["warnings"])}]))  # fmt: skip
    return {"heads": [*heads, ("processor time", "s"), ("wall time", "s"), ("warnings", "")], "rows": rows}


def _answer(done, limits, differences=()):
    """What the page begins with: the governing check of all cases, and between what their key numbers lie."""
    names = {row["number"]: row["label"] for row in done}
    facts = [("Governing check", governing_of_study(limits, names))]
    heads, span = ("quantity", "smallest", "case", "largest", "case"), [] if differences else _span(done)
    tables = [("Smallest and largest of the cases", heads, span)]
    runs = list(dict.fromkeys(row["run"] for row in differences))
    for run in runs:
        cells = [difference_cells(row) for row in differences if row["run"] == run]
        tables.append((f"{run} less {done[0]['parameters']['run']}: largest differences", DIFFERENCES, cells))
    return {"rings": [], "facts": facts, "tables": [table for table in tables if table[2]]}


def _span(done):
    """Rows of the smallest and the largest of every key number, with their cases."""
    rows = []
    for key in ("inflow_mass", "time", "flow_zone_area", *RING_EXTREMES):
        found = [(number.final * number.scale, row["label"], number) for row in done for number in row["numbers"]
                 if number.key == key and number.final is not None]  # fmt: skip
        if len(found) > 1:
            (least, of_least, number), (most, of_most, _) = (pick(found, key=lambda one: one[0]) for pick in (min, max))
            rows.append((f"{number.label} [{number.unit}]", shown(least), of_least, shown(most), of_most))
    return rows


def _limits(done, found, model):
    """The worst case and the share of cases beyond every limit as a table; no rows without limits."""
    rows = limit_rows(found, {row["number"]: row["label"] for row in done})
    beyond = [one["beyond"] > 0 for one in found.values()]
    about = f"Utilisations of {model} over all records of a case, 1 is the limit."
    return {"heads": HEADS, "rows": list(zip(rows, beyond, strict=True)), "about": about}


def _trust(done):
    """Names of the balances that any case has, and for each case their texts."""
    names = [name for name in ERRORS if any(name in row["balances"] for row in done)]
    cells = lambda row: [(row["balances"].get(n), ERRORS[n].form) for n in names]  # noqa: E731
    return {"heads": [ERRORS[name].label for name in names], "rows": [(row, cells(row)) for row in done]}


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
    rows.append(("cases", f"{len(found)}; {done} finished, {failed} failed, {len(found) - done - failed} not run"))
    return rows


def _shared_facts(found):
    """The scene of all cases; where cases differ their values beside each other."""
    rows = {}
    for case in found:
        for what, text in facts(case.scene):
            rows.setdefault(what, []).append(text)
    told = []
    for what, texts in rows.items():
        different = list(dict.fromkeys(texts))
        everywhere = len(texts) == len(found)
        if len(different) == 1:
            told.append((what, different[0] if everywhere else f"{different[0]} (in {len(texts)} cases)"))
        elif len(different) <= MOST_VALUES_NAMED:
            told.append((what, " | ".join(different)))
        else:
            told.append((what, f"{len(different)} different ones, the first: {different[0]}"))
    return told
