"""The page that sets our numbers beside the published ones: blocks that are computed, in a text that is written."""

from __future__ import annotations

import re
from datetime import UTC, datetime
from importlib import resources
from pathlib import Path

import numpy as np

from verification.published.bands import Verdict, judged
from verification.published.evidence import COMPARED, RunEvidence, at_rest, provenance
from verification.published.statements import measured_case, measured_twin, published_numbers, statements
from verification.published.unknowns import finished, moved_by, moved_by_rings, told

#: Pictures that the page shows; all others are drawn beside them.
SHOWN = ("bands", "06", "09", "10", "11", "13", "15", "23")
#: What of a changed run is told: key of a statement, head of the column.
COLUMNS = {"rate": "inflow kg/m/s", "soil gate": "soil at gate", "water gate": "water at gate", "crown": "crown %",
           "invert": "invert %", "Q": "Q %", "M+": "M+ %", "M-": "M- %", "N": "N %", "influence_soil": "soil D",
           "influence_water": "water D", "arch": "arch D"}  # fmt: skip


def write_page(folder: str | Path, out: str | Path) -> dict:
    """Draw the figures of what `gush published` has finished, and write published.md.

    Parameters
    ----------
    folder : str or path
        With the studies of :func:`verification.published.runs.plans`; what is absent is left out and named.
    out : str or path
        Folder of published.md and its images/published/.

    Returns
    -------
    dict
        page: path; figures: number to path; answers: list of {statement, published, ours, low, high, agrees, rule};
        missing: list.

    Raises
    ------
    coupling.studies.design.StudyError
        Case 3 is not there.
    """
    from coupling.studies.collect import read_study
    from coupling.studies.design import StudyError
    from verification.published.draw import draw_bands, draw_case, draw_cases, draw_twin

    folder, out = Path(folder), Path(out)
    runs = {run.evidence.scene.name: run.evidence for run in finished(folder / "cases")}
    if "case-3" not in runs:
        raise StudyError(f"study '{folder / 'cases'}': case 3 must be finished; run gush published --out {folder}")
    case, twin = (_bonded(runs[name], folder) if name in runs else None for name in ("case-3", "twin-tunnels"))
    others = _by_scene(finished(folder / "meshes"), folder)
    verdicts, rows = judge_case(case, others.get("case-3", {}), finished(folder / "unknowns"))
    if twin is not None:
        verdicts |= judge_twin(twin, others.get("twin-tunnels", {}), finished(folder / "twin-unknowns"))
    study = read_study(folder / "cases").load()
    images = out / "images" / "published"
    figures = draw_bands(verdicts, images) | draw_case(case, images) | draw_cases(study, case.compared, images)
    if twin is not None:
        figures |= draw_twin(twin, images)
    missing = [f"case {k}" for k in range(1, 11) if f"case-{k}" not in runs] + ["twin tunnels"] * (twin is None)
    missing += [name for name in ("meshes", "unknowns", "twin-unknowns") if not finished(folder / name)]
    blocks = {
        "made": _made(case, missing),
        "count": _count(verdicts),
        **{group: _table(verdicts, statements(group)) for group in ("initial", "gushing", "twin")},
        "disagreements": _disagreements(verdicts),
        "unknowns": _changed(rows),
        "trends": _trends(study, case.compared),
        "cases": _cases(study, case.compared, runs),
        "meshes": _meshes(runs, others),
        "linings": _linings(study, folder),
        "rates": _rates(case, rows),
        "figures": [line for number in SHOWN if number in figures for line in _figure(number, figures[number], out)],
        "rules": [_text("rules.md")],
    }
    page = out / "published.md"
    page.write_text(_filled(_text("page.md"), blocks), encoding="utf-8")
    answers = [
        {"statement": v.statement.text, "published": v.statement.published, "ours": _ours(v), "low": v.low, "high": v.high,
         "agrees": v.agrees, "rule": v.statement.rule} for v in verdicts.values()
    ]  # fmt: skip
    shown = {number: str(path) for number, path in figures.items()}
    return {"page": str(page), "figures": shown, "answers": answers, "missing": missing}


def judge_case(case: RunEvidence, meshes: dict[float, RunEvidence], unknowns) -> tuple[dict[str, Verdict], list]:
    """Verdicts on case 3 by the keys of the statements, and what every changed run says: (words, found)."""
    found = measured_case(case)
    of_mesh = {1.0: found} | {size: measured_case(one) for size, one in meshes.items()}
    said = {id(run.evidence): measured_case(run.evidence) for run in unknowns}
    pairs = moved_by(unknowns, lambda evidence: said[id(evidence)]) | moved_by_rings(case, measured_case)
    rows = [(told(run.changes), said[id(run.evidence)]) for run in unknowns]
    return _verdicts(statements("initial", "gushing"), found, of_mesh, pairs), rows


def judge_twin(twin: RunEvidence, meshes: dict[float, RunEvidence], unknowns) -> dict[str, Verdict]:
    """Verdicts on the twin tunnels by the keys of the statements."""
    found = measured_twin(twin)
    of_mesh = {1.0: found} | {size: measured_twin(one) for size, one in meshes.items()}
    return _verdicts(statements("twin"), found, of_mesh, moved_by(unknowns, measured_twin))


def _verdicts(stated, found, of_mesh, pairs):
    return {
        key: judged(
            statement, found[key], {size: one[key] for size, one in of_mesh.items() if key in one},
            {name: [(a[key], b[key]) for a, b in changed if key in a and key in b] for name, changed in pairs.items()},
        )
        for key, statement in stated.items() if key in found
    }  # fmt: skip


def _bonded(run, folder):
    return RunEvidence(run.scene, run.folder, at_rest(run.scene, folder / "at-rest" / f"{run.scene.name}.nc"))


def _by_scene(runs, folder):
    """Runs on other meshes: name of the scene to size of the mesh over that of the scene to evidence."""
    from coupling.scenes.scene import load_scene

    found = {}
    for run in runs:
        scene = run.evidence.scene
        size = scene.mpm.discretisation.element_size / load_scene(scene.name).mpm.discretisation.element_size
        rest = at_rest(scene, folder / "at-rest" / f"{scene.name}-{size:.2g}.nc")
        found.setdefault(scene.name, {})[size] = RunEvidence(scene, run.evidence.folder, rest)
    return found


def _made(case, missing):
    d = case.scene.mpm.discretisation
    text = (
        f"Made by `gush published` on {datetime.now(UTC):%Y-%m-%d} from runs of {provenance(case.folder)}; elements of "
        f"{d.element_size:g} m, {d.element_size_lining:g} m at the lining, {d.elements_across_gate} across the gate. "
        f"Published: {published_numbers()['source']}; angles from the crown, clockwise; per metre of tunnel; at "
        f"{case.compared:.0f} kg/m unless said."
    )
    return [text + (f" Not finished, so left out: {', '.join(missing)}." if missing else "")]


def _count(verdicts):
    judged_ones = [one.agrees for one in verdicts.values() if one.agrees]
    yes, band = (judged_ones.count(word) for word in ("yes", "in the band"))
    return [f"**{yes + band} of {len(judged_ones)} statements agree**: {yes} as run, {band} in the band of what the source "
            f"does not state, {judged_ones.count('no')} do not."]  # fmt: skip


def _ours(verdict):
    value, more = verdict.statement.form.format(verdict.found.value), verdict.found.more
    return f"{more} ({value})" if more else value


def _table(verdicts, stated):
    lines = [_row("statement", "published", "ours", "mesh ±", "band", "agrees", "rule", "largest shares of the unknowns"),
             "|---" * 8 + "|"]  # fmt: skip
    for key in stated:
        if key not in verdicts:
            continue
        v = verdicts[key]
        form = _bare(v.statement.form)
        band = f"{form.format(v.low)} .. {form.format(v.high)}" if v.high > v.low else ""
        mesh = form.format(v.mesh).replace("+", "") if v.mesh else ""
        word = "**no**" if v.agrees == "no" else v.agrees
        lines.append(_row(v.statement.text, v.statement.published, _ours(v), mesh, band, word, v.statement.rule,
                          _shares(v, 3)))  # fmt: skip
    return lines


def _shares(verdict, most):
    form = _signed(verdict.statement.form)
    rows = [f"{name} {form.format(low)} .. {form.format(high)}" for name, (low, high) in verdict.shares.items()]
    return "; ".join(rows[:most])


def _bare(form):
    """A form without the words around its number."""
    return re.search(r"\{:[^}]*\}", form)[0]


def _signed(form):
    return _bare(form).replace("{:+", "{:").replace("{:", "{:+")


def _disagreements(verdicts):
    reasons, lines = published_numbers().get("reasons", {}), []
    for key, v in verdicts.items():
        if v.agrees == "no":
            lines.append(f"- **{v.statement.text}**: published {v.statement.published}, ours {_ours(v)}. "
                         + reasons.get(key, "Reason: unknown."))  # fmt: skip
    return lines or ["None."]


def _changed(rows):
    if not rows:
        return ["Not run."]
    lines = [_row("changed", *COLUMNS.values()), "|---" * (len(COLUMNS) + 1) + "|"]
    stated = statements("gushing")
    for words, found in rows:
        cells = [_bare(stated[key].form).format(found[key].value) if key in found else "not reached" for key in COLUMNS]
        lines.append(_row(words, *cells))
    return lines


def _trends(study, mass):
    from verification.published.trends import trends

    lines = [_row("statement", "ours", "agrees"), "|---|---|---|"]
    return lines + [_row(one.statement, one.ours, {True: "yes", False: "**no**"}[bool(one.agrees)])
                    for one in trends(study, mass)]  # fmt: skip


def _cases(study, mass, runs):
    """Largest forces of all cases, both lining models; else how far a case came."""
    from verification.published.case_figures import at_study_inflow

    now, lines = at_study_inflow(study, mass), [
        _row("case", "gate", "cover", "soil", "model", "N kN/m", "Q kN/m", "M kN m/m", "M least kN m/m", "time s"),
        "|---" * 10 + "|",
    ]  # fmt: skip
    for k, name in enumerate(study["scene"].values):
        about = [f"{study['gate_angle'].values[k]:g}°", f"{study['cover'].values[k]:g} m", str(study["soil"].values[k])]
        for model in study["model"].values if str(study["status"].values[k]) == "finished" else ():
            one, first = (data.isel(case=k).sel(model=model) for data in (now, study.isel(progress=0)))
            cells = []
            for variable, pick in (("axial_force", np.max), ("shear_force", lambda v: np.abs(v).max()),
                                   ("bending_moment", np.max), ("bending_moment", np.min)):  # fmt: skip
                before, after = (float(pick(state[variable].values)) / 1e3 for state in (first, one))
                cells.append(f"{after:.0f} ({before:.0f})" if np.isfinite(after) else f"({before:.0f})")
            reached = float(now["time"].isel(case=k))
            time = f"{reached:.2f}" if np.isfinite(reached) else f"ended at {runs[name].reached:.0f} kg/m"
            lines.append(_row(name, *about, model, *cells, time))
    return lines


def _meshes(runs, others):
    """Cases on several meshes: what must not depend on them."""
    from coupling import postprocess

    lines = [_row("scene", "mesh", "reached kg/m", "time to 500 kg/m s", "N", "Q", "M", "M least", "settlement mm"),
             "|---" * 9 + "|"]  # fmt: skip
    for name, sizes in others.items():
        for size, run in {1.0: runs[name], **sizes}.items() if name in runs else ():
            mass = min(run.compared, *(one.compared for one in sizes.values()), runs[name].compared)
            time = float(postprocess.at_inflow(run.history, min(500.0, mass))["time"])
            now = postprocess.at_inflow(run.responses["beam-spring"], mass)
            moment, shear = now["bending_moment"].values / 1e3, np.abs(now["shear_force"].values).max() / 1e3
            down = 1e3 * float(postprocess.at_inflow(run.settlement, mass)["settlement"].max())
            lines.append(_row(name, f"{size:.2g} times", f"{run.reached:.0f}", f"{time:.3f}",
                              f"{now['axial_force'].values.max() / 1e3:.0f}", f"{shear:.0f}", f"{moment.max():.0f}",
                              f"{moment.min():.0f}", f"{down:.1f}"))  # fmt: skip
    return lines


def _linings(study, folder):
    from verification.published.linings import lining_lines

    return lining_lines(study, folder)


def _rates(case, rows):
    from verification.published.rates import independent_rates

    theirs = published_numbers()["gushing"]
    published = next(row["published"] for row in theirs if row["key"] == "rate")
    found = [("published", float(published)), *independent_rates(case.scene.mpm).items()]
    found += [(f"ours, {words}", said["rate"].value) for words, said in rows if "rate" in said]
    lines = [_row("rate", "kg/m/s"), "|---|---|"]
    return lines + [_row(name, f"{value:.3g}") for name, value in sorted(found, key=lambda item: -item[1])]


def _figure(number, path, out):
    from verification.published.draw import CAPTIONS

    text = CAPTIONS[number]
    title = f"Figure {number.lstrip('0')}" if number[0].isdigit() else "Bands"
    return [f"**{title}**: {text}.", "", f"![{text}]({path.relative_to(out).as_posix()})", ""]


def _row(*cells):
    """A row of a table; bars inside its cells, as of |Q|, are escaped."""
    return "| " + " | ".join(re.sub(r"(?<!\\)\|", "\\|", cell) for cell in cells) + " |"


def _text(name):
    return (resources.files("verification") / "published" / name).read_text(encoding="utf-8").rstrip()


def _filled(text, blocks):
    """The text with lines `{{name}}` replaced by the lines of that block."""
    return re.sub(r"^\{\{(\S+)\}\}$", lambda found: "\n".join(blocks[found[1]]), text, flags=re.MULTILINE) + "\n"
