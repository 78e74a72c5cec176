"""The page that sets our numbers beside the published ones: numbers that are computed, in a text that is written."""

import re
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

import numpy as np

from coupling import postprocess
from coupling.refused import SceneError
from verification.pages import TEMPLATES, table_text
from verification.published.bands import judged
from verification.published.draw import CAPTIONS, OF_CASE, OF_CASES, OF_TWIN, draw, draw_bands
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
        figures = draw(OF_TWIN, twin, images)
    else:
        figures = {}
    cases = {name: run for name, run in runs.items() if name != "twin-tunnels"}
    figures |= draw_bands(verdicts, images) | draw(OF_CASE, case, images) | draw(OF_CASES, cases, images)
    missing = [f"case {k}" for k in range(1, 11) if f"case-{k}" not in runs] + ["twin tunnels"] * (twin is None)
    missing += [name for name in ("meshes", "unknowns", "twin-unknowns") if not finished(folder / name)]
    shown = {number: path.relative_to(out).as_posix() for number, path in figures.items()}
    text = TEMPLATES.get_template("published.md").render(
        **_about(case, rows), verdicts=verdicts, missing=missing, captions=CAPTIONS, figures=shown, columns=COLUMNS,
        linings=LININGS, stated=partial(_stated, verdicts), changed=_changed, rows=rows, cases=list(_cases(cases)),
        meshes=list(_meshes(meshes)), trends=[(one.statement, one.ours, _word(one.agrees)) for one in trends(cases)],
    )  # fmt: skip
    page = out / "published.md"
    page.write_text(text, encoding="utf-8")
    answers = [
        {"statement": v.statement.text, "published": v.statement.published, "ours": v.ours, "low": v.low,
         "high": v.high, "agrees": v.agrees, "rule": v.statement.rule} for v in verdicts.values()
    ]  # fmt: skip
    files = {number: str(path) for number, path in figures.items()}
    return {"page": str(page), "figures": files, "answers": answers, "missing": missing}


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


def _about(case, rows):
    """What the page says of case 3 besides its statements: source, meshes, rates, and the source's own lining."""
    from coupling.scenes.scene import load_scene

    numbers, tunnel = published_numbers(), case.scene.tunnels[case.scene.gate.tunnel]
    size, radii = SOURCE_MESH["element_size"], (tunnel.outer_radius, tunnel.inner_radius)
    published = next(row["published"] for row in numbers["gushing"] if row["key"] == "rate")
    rates = [("published", float(published)), *independent_rates(case.scene).items()]
    rates += [(f"ours, {words}", said["rate"].value) for words, said in rows if "rate" in said]
    return {
        "case": case, "mesh": case.scene.discretisation, "own_mesh": load_scene("case-3").discretisation,
        "source": numbers["source"], "reasons": numbers["reasons"], "provenance": provenance(case.folder),
        "date": f"{datetime.now(UTC):%Y-%m-%d}",
        "rates": [(name, f"{value:.3g}") for name, value in sorted(rates, key=lambda item: -item[1])],
        "layer": {"size": size, "thickness": radii[0] - radii[1],
                  "stiffness": one_layer(size, *radii, tunnel.lining_poissons_ratio)},
        "moving": rows[:1] + [row for row in rows[1:] if row[0].startswith("lining")],
    }  # fmt: skip


def _stated(verdicts, group):
    """Table of the statements of a group."""
    rows = []
    for v in (verdicts[key] for key in statements(group) if key in verdicts):
        form = _bare(v.statement.form)
        band = f"{form.format(v.low)} .. {form.format(v.high)}" if v.high > v.low else ""
        mesh = form.format(v.mesh).replace("+", "") if v.mesh else ""
        signed = form.replace("{:+", "{:").replace("{:", "{:+")
        shares = [f"{name} {signed.format(low)} .. {signed.format(high)}" for name, (low, high) in v.shares.items()]
        word = v.agrees if v.agrees != "no" else _word(False)
        rows.append((v.statement.text, v.statement.published, v.ours, mesh, band, word, v.statement.rule,
                     "; ".join(shares[:3])))  # fmt: skip
    head = ("statement", "published", "ours", "mesh ±", "band", "agrees", "rule", "largest shares")
    return table_text(head, rows)


def _bare(form):
    """A form without the words around its number."""
    return re.search(r"\{:[^}]*\}", form)[0]


def _changed(rows, columns):
    """What changed runs say: one row a run, one column a statement."""
    stated = statements("initial", "gushing")
    forms = {key: _bare(stated[key].form) if key in stated else "{:.0f}" for key in columns}
    lines = [
        (words, *(form.format(found[key].value) if key in found else "not reached" for key, form in forms.items()))
        for words, found in rows
    ]
    return table_text(["changed", *columns.values()], lines)


def _extremes(response, mass):
    """Largest N, Q, M and least M of a response at an inflow mass, None: initially [kN, kN m]."""
    state = response.isel(time=0) if mass is None else postprocess.at_inflow(response, mass)
    axial, shear, moment = (state[f"{name}"].values / 1e3 for name in ("axial_force", "shear_force", "bending_moment"))
    return np.array([axial.max(), np.abs(shear).max(), moment.max(), moment.min()])


def _cases(cases):
    """Largest forces of all cases at 1000 kg/m, or where they ended, in brackets initially, by both lining models."""
    for name, run in cases.items():
        scene = run.scene
        about = [name, f"{scene.gate.angle:g}°", f"{scene.tunnels[0].cover:g} m", scene.soils[0].name]
        time = float(postprocess.at_inflow(run.history, run.compared)["time"])
        for model, response in run.responses.items():
            pairs = zip(_extremes(response, run.compared), _extremes(response, None), strict=True)
            cells = [f"{after:.0f} ({before:.0f})" for after, before in pairs]
            yield (*about, model, *cells, f"{run.compared:.0f} kg/m, {time:.2f} s")


def _meshes(meshes):
    """Cases on several meshes: what must not depend on them, at the largest inflow mass that all reached."""
    for name, sizes in meshes.items():
        mass = min(run.compared for run in sizes.values())
        for size, run in sorted(sizes.items()):
            time = float(postprocess.at_inflow(run.history, mass)["time"])
            down = 1e3 * run.settled(mass)
            cells = [f"{value:.0f}" for value in _extremes(run.ring, mass)]
            yield name, f"{size:.2g} times", f"{mass:.0f}", f"{time:.3f}", *cells, f"{down:.1f}"


def _word(agrees):
    return "yes" if agrees else "**no**"
