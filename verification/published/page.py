"""The page that sets our numbers beside the published ones, statement by statement, with figures."""

from __future__ import annotations

from datetime import UTC, datetime
from importlib import resources
from pathlib import Path

import numpy as np

from verification.published.answers import gushing_answers, initial_answers, mirror_answers, twin_answers
from verification.published.evidence import evidence, mirror_difference
from verification.published.sources import at_study_inflow, case_runs, published_numbers, run_of_scene

CAPTIONS = {
    "06": "settlement troughs by inflow mass, twin tunnels",
    "07": "initial pressures against theory, twin tunnels",
    "09": "inflow mass and flow zone over time, with its stages",
    "10": "displacement, deviatoric strain, pore pressure, effective stress",
    "11": "soil stress and pore pressure along both axes through the gate",
    "12": "stress variation ratio",
    "13": "pressures on the lining",
    "14": "pressures over the initial ones",
    "15": "axial force, shear force, bending moment",
    "15-ring": "deformed ring",
    "16": "extreme forces over inflow mass",
    "17": "joint opening, dislocation, rotation over inflow mass",
    "19": "pressure ratios across cases",
    "20": "additional axial force across cases",
    "21": "additional moment across cases",
    "22": "deformation and displacement of the lining across cases",
    "23": "joint deformation across cases",
}


def write_page(folder: str | Path, out: str | Path) -> dict:
    """Draw the figures of what :func:`verification.published.run_all.run_all` has finished, and write study.md.

    Parameters
    ----------
    folder : str or path
        With the studies table-2, twin-and-mirror and sensitivity; what is absent is left out and named.
    out : str or path
        Folder of study.md and its images/.

    Returns
    -------
    dict
        page: path; figures: number to path; answers: list of {statement, published, ours, agrees, rule}; missing: list.

    Raises
    ------
    coupling.studies.design.StudyError
        Case 3 is not there.
    """
    from coupling.studies.collect import read_study
    from coupling.studies.design import StudyError
    from verification.published.draw import draw_case, draw_cases, draw_twin

    folder, out = Path(folder), Path(out)
    images = out / "images" / "study"
    runs = case_runs(folder / "table-2")
    run = run_of_scene(runs, "case-3")
    if run is None:
        raise StudyError(f"study '{folder / 'table-2'}': case 3 must be finished; run gush published --out {folder}")
    beside = _optional(case_runs, folder / "twin-and-mirror") or []
    twin_run, mirrored = run_of_scene(beside, "twin-tunnels"), run_of_scene(beside, "case-3", 270.0)
    case, study = evidence(run), read_study(folder / "table-2").load()
    twin = None if twin_run is None else evidence(twin_run)
    sections = {"Initial state": initial_answers(case), "During gushing": gushing_answers(case)}
    figures = draw_case(case, images)
    missing = [f"case {k + 1}" for k, one in enumerate(runs) if one is None]
    if twin is not None:
        sections["Twin tunnels"] = twin_answers(twin)
        figures |= draw_twin(twin, images)
    else:
        missing.append("twin tunnels")
    if mirrored is not None:
        from coupling.datasets import read_pressures

        difference = mirror_difference(
            case.of_gate, read_pressures(mirrored.folder), min(case.half, mirrored.last_mass)
        )
        sections["Mirror image"] = mirror_answers(difference)
    else:
        missing.append("case 3 mirrored")
    figures |= draw_cases(study, case.half, images)
    sensitivity = _optional(read_study, folder / "sensitivity")
    if sensitivity is None:
        missing.append("sensitivity")
    lines = [
        "# The published study, beside ours",
        "",
        f"Made by `gush published` on {datetime.now(UTC):%Y-%m-%d} {_provenance(run)}. Published: "
        f"{published_numbers()['source']}; angles from the crown, clockwise; per metre of tunnel. Statements are "
        f"made at {published_numbers()['gushing']['inflow_mass']:g} kg/m there and answered at {case.half:.0f} kg/m "
        "here.",
        "",
    ]
    if missing:
        lines += [f"Not finished, so left out: {', '.join(missing)}.", ""]
    lines += _verdict([answer for rows in sections.values() for answer in rows if answer.published != "(ours)"])
    for title, rows in sections.items():
        lines += [f"## {title}", "", "| statement | published | here | agrees | rule |", "|---|---|---|---|---|"]
        lines += [
            _row(answer.statement, answer.published, answer.ours, _word(answer.agrees), answer.rule) for answer in rows
        ]
        lines.append("")
    lines += [_belief(), ""]
    lines += _cases_table(study, runs, case.half, case.masses[-1])
    if sensitivity is not None:
        lines += sensitivity_section(sensitivity.load(), images)
    lines += ["## Figures", "", "Numbered as in the published study.", ""]
    for number, path in sorted(figures.items()):
        lines += [f"**Figure {number.lstrip('0')}**: {CAPTIONS[number]}.", "", f"![{CAPTIONS[number]}]"
                  f"({path.relative_to(out).as_posix()})", ""]  # fmt: skip
    page = out / "study.md"
    page.write_text("\n".join(lines), encoding="utf-8")
    answers = [answer._asdict() for rows in sections.values() for answer in rows]
    shown = {number: str(path) for number, path in figures.items()}
    return {"page": str(page), "figures": shown, "answers": answers, "missing": missing}


def sensitivity_section(study, images: Path) -> list[str]:
    """Table and figure of a one-at-a-time study: inflow rate and response at equal inflow mass.

    Parameters
    ----------
    study : xarray.Dataset
        Dataset of the study `sensitivity`; its first case is the scene as it is.
    images : path
        Folder for the figure.
    """
    from coupling.figures import RESOLUTION
    from verification.published.sensitivity_figure import changes, sensitivity_figure

    table = changes(study)
    if not table["rows"]:
        return []
    images.mkdir(parents=True, exist_ok=True)
    sensitivity_figure(table).savefig(images / "sensitivity.png", dpi=RESOLUTION)
    names = list(table["units"])
    head = [f"{name} [{unit}]" for name, unit in table["units"].items()]
    lines = [
        "## Sensitivity",
        "",
        f"Coarse case 3 at {table['inflow_mass']:.0f} kg/m, one change at a time; the first row is the scene as it is.",
        "",
        _row("change", *head),
        "|---|" + "---|" * len(head),
    ]
    for row in table["rows"]:
        cells = [f"{row[name]:.4g}" if np.isfinite(row[name]) else "not reached" for name in names]
        lines.append(_row(row["change"], *cells))
    lines += ["", "![sensitivity](images/study/sensitivity.png)", ""]
    return lines


def _cases_table(study, runs, *masses):
    """Largest forces of all cases at some inflow masses, both lining models; else how far a case came."""
    lines = ["## Cases", ""]
    for mass in masses:
        now = at_study_inflow(study, mass)
        lines += [f"At {mass:.0f} kg/m, in brackets initially:", "",
                  "| case | gate | cover | soil | model | N kN/m | Q kN/m | M kN m/m | M least kN m/m | time s |",
                  "|---|---|---|---|---|---|---|---|---|---|"]  # fmt: skip
        for k, name in enumerate(study["scene"].values):
            about = f"{study['gate_angle'].values[k]:g}° | {study['cover'].values[k]:g} m | {study['soil'].values[k]}"
            if str(study["status"].values[k]) != "finished":
                lines.append(f"| {name} | {about} | {study['message'].values[k] or 'not run'} |||||||")
                continue
            for model in study["model"].values:
                one, first = (data.isel(case=k).sel(model=model) for data in (now, study.isel(progress=0)))
                cells = []
                for variable, pick in (("axial_force", np.max), ("shear_force", _largest), ("bending_moment", np.max),
                                       ("bending_moment", np.min)):  # fmt: skip
                    before, after = (float(pick(state[variable].values)) / 1e3 for state in (first, one))
                    cells.append(f"{after:.0f} ({before:.0f})" if np.isfinite(after) else f"not reached ({before:.0f})")
                time = f"{float(now['time'].isel(case=k)):.3g}"
                if runs[k] is not None and runs[k].last_mass < mass:
                    time = f"ended at {runs[k].last_mass:.0f} kg/m"
                lines.append(f"| {name} | {about} | {model} | {' | '.join(cells)} | {time} |")
        lines.append("")
    return lines


def _belief():
    """What we make of the differences, in words."""
    return (resources.files("verification") / "published" / "belief.md").read_text(encoding="utf-8").rstrip()


def _verdict(answers):
    judged = [answer for answer in answers if answer.agrees is not None]
    wrong = [answer.statement for answer in judged if not answer.agrees]
    text = f"{len(judged) - len(wrong)} of {len(judged)} statements agree by their rule."
    return [text + (" Not: " + "; ".join(wrong) + "." if wrong else ""), ""]


def _row(*cells):
    """A row of a table; bars inside its cells, as of |Q|, are escaped."""
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _largest(values):
    return np.abs(values).max()


def _word(agrees):
    return {True: "yes", False: "**no**", None: ""}[None if agrees is None else bool(agrees)]


def _provenance(run):
    from coupling.datasets import read_attributes

    attributes, d = read_attributes(run.folder), run.scene.discretisation
    return (
        f"from runs of revision {attributes['revision'] or 'unknown'} on {attributes['processor']}; elements of "
        f"{d.element_size:g} m, {d.element_size_lining:g} m at the lining, {d.elements_across_gate} across the gate"
    )


def _optional(read, folder):
    from coupling.studies.design import StudyError

    try:
        return read(folder)
    except StudyError:
        return None
