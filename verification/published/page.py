"""The page that sets our numbers beside the published ones: blocks that are computed, in a text that is written."""

import re
from datetime import UTC, datetime
from functools import partial
from importlib import resources
from pathlib import Path

import numpy as np

from coupling import postprocess
from coupling.refused import SceneError
from verification.pages import table
from verification.published.bands import judged
from verification.published.draw import CAPTIONS, draw_bands, draw_case, draw_cases, draw_twin
from verification.published.evidence import RunEvidence, at_rest, provenance
from verification.published.linings import one_layer
from verification.published.rates import independent_rates
from verification.published.runs import SOURCE_MESH
from verification.published.statements import measured_case, measured_twin, published_numbers, statements
from verification.published.trends import trends
from verification.published.unknowns import finished, moved_by, moved_by_rings, told

#: What of a changed run is told: key of a statement, head of the column; of one that changes the lining, more.
COLUMNS = {"rate": "inflow kg/m/s", "soil gate": "soil at gate", "water gate": "water at gate",
           "soil relief": "soil halved ±°", "water relief": "water halved ±°", "crown": "crown %",
           "invert": "invert %", "Q": "Q %", "M+": "M+ %", "M-": "M- %", "N": "N %", "influence_soil": "soil D",
           "influence_water": "water D", "arch": "arch D"}  # fmt: skip
LININGS = {**{f"M{k}": f"M joint {k}" for k in range(1, 7)}, "M invert": "M invert", "Q": "Q %", "M+": "M+ %",
           "M-": "M- %", "crown": "crown %", "invert": "invert %", "rate": "inflow kg/m/s"}  # fmt: skip


def write_page(folder: str | Path, out: str | Path) -> dict:
    """Draw the figures of what `gush published` has finished, and write published.md.

    folder : with the studies of :func:`verification.published.runs.plans`; what is absent is left out and named;
    out : folder of published.md and its images/published/.

    Returns: page: path; figures: number to path; answers: list of {statement, published, ours, low, high, agrees,
    rule}; missing: list.

    Raises coupling.refused.SceneError: case 3 is not there.
    """
    folder, out = Path(folder), Path(out)
    runs = {run.evidence.scene.name: run.evidence for run in finished(folder / "cases")}
    if "case-3" not in runs:
        raise SceneError(f"study '{folder / 'cases'}': case 3 must be finished; run gush published --out {folder}")
    runs |= {name: _bonded(runs[name], folder) for name in ("case-3", "twin-tunnels") if name in runs}
    case, twin = runs["case-3"], runs.get("twin-tunnels")
    meshes = _by_mesh(finished(folder / "meshes"), runs, folder)
    verdicts, rows = judge_case(case, meshes.get("case-3", {}), finished(folder / "unknowns"))
    images = out / "images" / "published"
    if twin is not None:
        measure = partial(measured_twin, masses=twin.masses)
        changed = moved_by(finished(folder / "twin-unknowns"), measure)
        verdicts |= _verdicts(("twin",), meshes.get("twin-tunnels", {1.0: twin}), measure, changed, twin)
        figures = draw_twin(twin, images)
    else:
        figures = {}
    cases = {name: run for name, run in runs.items() if name != "twin-tunnels"}
    figures |= draw_bands(verdicts, images) | draw_case(case, images) | draw_cases(cases, images)
    missing = [f"case {k}" for k in range(1, 11) if f"case-{k}" not in runs] + ["twin tunnels"] * (twin is None)
    missing += [name for name in ("meshes", "unknowns", "twin-unknowns") if not finished(folder / name)]
    blocks = {
        "made": _made(case, missing),
        "count": _count(verdicts),
        **{group: _table(verdicts, statements(group)) for group in ("initial", "gushing", "twin")},
        "disagreements": _disagreements(verdicts),
        "unknowns": _changed(rows, COLUMNS),
        "trends": _markdown(
            ["statement", "ours", "agrees"], [(one.statement, one.ours, _word(one.agrees)) for one in trends(cases)]
        ),
        "cases": _cases(cases),
        "meshes": _meshes(meshes),
        "linings": _linings(case, rows),
        "rates": _rates(case, rows),
        "figures": [line for number in CAPTIONS if number in figures for line in _figure(number, figures[number], out)],
        "rules": [_text("rules.md")],
    }
    page = out / "published.md"
    page.write_text(_filled(_text("page.md"), blocks), encoding="utf-8")
    answers = [
        {"statement": v.statement.text, "published": v.statement.published, "ours": _ours(v), "low": v.low,
         "high": v.high, "agrees": v.agrees, "rule": v.statement.rule} for v in verdicts.values()
    ]  # fmt: skip
    shown = {number: str(path) for number, path in figures.items()}
    return {"page": str(page), "figures": shown, "answers": answers, "missing": missing}


def judge_case(case: RunEvidence, meshes: dict[float, RunEvidence], unknowns):
    """Verdicts on case 3 by the keys of the statements, and what every changed run says: list of (words, found)."""
    said = {id(run.evidence): measured_case(run.evidence) for run in unknowns}
    changed = moved_by(unknowns, lambda evidence: said[id(evidence)]) | moved_by_rings(case, measured_case)
    rows = [(told(run.changes), said[id(run.evidence)]) for run in unknowns]
    return _verdicts(("initial", "gushing"), meshes or {1.0: case}, measured_case, changed, case), rows


def _verdicts(groups, meshes, measure, changed, own):
    found = measure(own)
    of_mesh = {size: found if run is own else measure(run) for size, run in meshes.items()}
    return {
        key: judged(
            statement, found[key], {size: one[key] for size, one in of_mesh.items() if key in one},
            {name: [(a[key], b[key]) for a, b in pairs if key in a and key in b] for name, pairs in changed.items()},
        )
        for key, statement in statements(*groups).items() if key in found and np.isfinite(found[key].value)
    }  # fmt: skip


def _bonded(run, folder, mark=""):
    return RunEvidence(run.scene, run.folder, at_rest(run.scene, folder / "at-rest" / f"{run.scene.name}{mark}.nc"))


def _by_mesh(others, runs, folder):
    """Name of a scene with several meshes to size of the mesh over the scene's to evidence, that of `runs` among it."""
    from coupling.scenes.scene import load_scene

    def size(scene):
        return scene.discretisation.element_size / load_scene(scene.name).discretisation.element_size

    found = {}
    for run in (case.evidence for case in others):
        name = run.scene.name
        if name in runs:
            sizes = found.setdefault(name, {size(runs[name].scene): runs[name]})
            bonded = name in ("case-3", "twin-tunnels")
            sizes[size(run.scene)] = _bonded(run, folder, f"-{size(run.scene):.2g}") if bonded else run
    return found


def _made(case, missing):
    from coupling.scenes.scene import load_scene

    mesh, source = case.scene.discretisation, published_numbers()["source"]
    look = "" if mesh == load_scene("case-3").discretisation else " --quick"
    text = (
        f"Made by `gush published{look}` on {datetime.now(UTC):%Y-%m-%d} from runs of {provenance(case.folder)}; case "
        f"3 on elements of {mesh.element_size:g} m, {mesh.element_size_lining:g} m at the lining, "
        f"{mesh.elements_across_gate} across the gate. Published: {source}; angles from the crown, clockwise; per "
        f"metre of tunnel; at {case.compared:.0f} kg/m unless said."
    )
    return [text + (f" Not finished, so left out: {', '.join(missing)}." if missing else "")]


def _count(verdicts):
    words = [one.agrees for one in verdicts.values() if one.agrees]
    yes, band = (words.count(word) for word in ("yes", "in the band"))
    text = f"**{yes + band} of {len(words)} statements agree**: {yes} as run, {band} in the band of what the source"
    return [f"{text} does not state; {words.count('no')} do not."]


def _ours(verdict):
    value, more = verdict.statement.form.format(verdict.found.value), verdict.found.more
    return f"{more} ({value})" if more else value


def _table(verdicts, stated):
    rows = []
    for v in (verdicts[key] for key in stated if key in verdicts):
        form = _bare(v.statement.form)
        band = f"{form.format(v.low)} .. {form.format(v.high)}" if v.high > v.low else ""
        mesh = form.format(v.mesh).replace("+", "") if v.mesh else ""
        signed = form.replace("{:+", "{:").replace("{:", "{:+")
        shares = [f"{name} {signed.format(low)} .. {signed.format(high)}" for name, (low, high) in v.shares.items()]
        word = v.agrees if v.agrees != "no" else _word(False)
        rows.append((v.statement.text, v.statement.published, _ours(v), mesh, band, word, v.statement.rule,
                     "; ".join(shares[:3])))  # fmt: skip
    return _markdown(["statement", "published", "ours", "mesh ±", "band", "agrees", "rule", "largest shares"], rows)


def _bare(form):
    """A form without the words around its number."""
    return re.search(r"\{:[^}]*\}", form)[0]


def _disagreements(verdicts):
    reasons = published_numbers()["reasons"]
    wrong = {key: v for key, v in verdicts.items() if v.agrees == "no"}
    lines = [f"- **{v.statement.text}**: published {v.statement.published}, ours {_ours(v)}. "
             + reasons.get(key, "Reason: unknown.") for key, v in wrong.items()]  # fmt: skip
    return lines or ["None."]


def _changed(rows, columns):
    """What changed runs say: one row a run, one column a statement."""
    stated = statements("initial", "gushing")
    forms = {key: _bare(stated[key].form) if key in stated else "{:.0f}" for key in columns}
    lines = [
        (words, *(form.format(found[key].value) if key in found else "not reached" for key, form in forms.items()))
        for words, found in rows
    ]
    return _markdown(["changed", *columns.values()], lines)


def _linings(case, rows):
    tunnel, size = case.scene.tunnels[case.scene.gate.tunnel], SOURCE_MESH["element_size"]
    stiff = one_layer(size, tunnel.outer_radius, tunnel.inner_radius, tunnel.lining_poissons_ratio)
    moving = [row for row in rows[1:] if row[0].startswith("lining")]
    thick = tunnel.outer_radius - tunnel.inner_radius
    text = f"One layer of linear triangles of {size:g} m through {thick:.2f} m resists the second harmonic"
    text += f" **{stiff:.1f} times** as much as the ring does (plane strain, against quadratic triangles)."
    return [text, "", *_changed(rows[:1] + moving, LININGS)]


def _rates(case, rows):
    published = next(row["published"] for row in published_numbers()["gushing"] if row["key"] == "rate")
    found = [("published", float(published)), *independent_rates(case.scene).items()]
    found += [(f"ours, {words}", said["rate"].value) for words, said in rows if "rate" in said]
    found.sort(key=lambda item: -item[1])
    return _markdown(["rate", "kg/m/s"], [(name, f"{value:.3g}") for name, value in found])


def _extremes(response, mass):
    """Largest N, Q, M and least M of a response at an inflow mass, None: initially [kN, kN m]."""
    state = response.isel(time=0) if mass is None else postprocess.at_inflow(response, mass)
    axial, shear, moment = (state[f"{name}"].values / 1e3 for name in ("axial_force", "shear_force", "bending_moment"))
    return np.array([axial.max(), np.abs(shear).max(), moment.max(), moment.min()])


def _cases(cases):
    """Largest forces of all cases at 1000 kg/m, or where they ended, in brackets initially, by both lining models."""
    rows = []
    for name, run in cases.items():
        scene = run.scene
        about = [name, f"{scene.gate.angle:g}°", f"{scene.tunnels[0].cover:g} m", scene.soils[0].name]
        time = float(postprocess.at_inflow(run.history, run.compared)["time"])
        for model, response in run.responses.items():
            pairs = zip(_extremes(response, run.compared), _extremes(response, None), strict=True)
            cells = [f"{after:.0f} ({before:.0f})" for after, before in pairs]
            rows.append((*about, model, *cells, f"{run.compared:.0f} kg/m, {time:.2f} s"))
    head = ["case", "gate", "cover", "soil", "model", "N kN/m", "Q kN/m", "M kN m/m", "M least kN m/m", "at"]
    return _markdown(head, rows)


def _meshes(meshes):
    """Cases on several meshes: what must not depend on them, at the largest inflow mass that all reached."""
    rows = []
    for name, sizes in meshes.items():
        mass = min(run.compared for run in sizes.values())
        for size, run in sorted(sizes.items()):
            time = float(postprocess.at_inflow(run.history, mass)["time"])
            down = 1e3 * run.settled(mass)
            cells = [f"{value:.0f}" for value in _extremes(run.responses["beam-spring"], mass)]
            rows.append((name, f"{size:.2g} times", f"{mass:.0f}", f"{time:.3f}", *cells, f"{down:.1f}"))
    return _markdown(["scene", "mesh", "at kg/m", "time s", "N", "Q", "M", "M least", "settlement mm"], rows)


def _figure(number, path, out):
    title = f"Figure {number.lstrip('0')}" if number[0].isdigit() else "Bands"
    text = CAPTIONS[number]
    return [f"**{title}**: {text}.", "", f"![{text}]({path.relative_to(out).as_posix()})", ""]


def _markdown(head, rows):
    """Lines of a table; bars inside its cells, as of |Q|, are escaped."""
    if not rows:
        return ["Not run."]
    head, *rows = [[re.sub(r"(?<!\\)\|", "\\|", cell) for cell in row] for row in (head, *rows)]
    return table(head, rows)


def _word(agrees):
    return "yes" if agrees else "**no**"


def _text(name):
    return (resources.files("verification") / "published" / name).read_text(encoding="utf-8").rstrip()


def _filled(text, blocks):
    """The text with lines `{{name}}` replaced by the lines of that block."""
    return re.sub(r"^\{\{(\S+)\}\}$", lambda found: "\n".join(blocks[found[1]]), text, flags=re.MULTILINE) + "\n"
