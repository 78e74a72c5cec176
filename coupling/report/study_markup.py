"""The page about a study as HTML: what can be read without a script, and the places that the script draws into."""

from html import escape

from coupling.postprocess.quality import ERRORS
from coupling.report.frame import figure, header, provenance, rows_of_facts, scroll, shown
from coupling.report.run_markup import RING_CHARTS
from coupling.runs.progress_line import duration
from coupling.studies.design import short_names, value_text
from structure.response import SHOWN

#: Of the run's key numbers those that stand in the table of cases, with their short headings.
COLUMNS = {
    "inflow_mass": "inflow mass",
    "time": "time to it",
    "flow_zone_area": "flow zone",
    "axial_force_max": "largest N",
    "shear_force_max": "largest Q",
    "shear_force_min": "smallest Q",
    "bending_moment_max": "largest M",
    "bending_moment_min": "smallest M",
    "joint_opening_max": SHOWN["joint_opening"].name,
    "convergence_vertical": SHOWN["convergence_vertical"].name,
}
PROGRESS_CHARTS = (
    ("inflow_over_time", "Inflow mass over time", "kg/m"),
    ("zone_over_time", "Flow zone over time", "m²"),
    ("zone_over_mass", "Flow zone over inflow mass", "m²"),
)
MASS_CHARTS = (
    ("axial_over_mass", "Largest and smallest N", SHOWN["axial_force"].unit),
    ("shear_over_mass", "Largest and smallest Q", SHOWN["shear_force"].unit),
    ("moment_over_mass", "Largest and smallest M", SHOWN["bending_moment"].unit),
    ("opening_over_mass", f"Largest {SHOWN['joint_opening'].name}", SHOWN["joint_opening"].unit),
    ("rotation_over_mass", f"Largest size of {SHOWN['joint_rotation'].name}", SHOWN["joint_rotation"].unit),
    ("convergence_over_mass", SHOWN["convergence_vertical"].name.capitalize(), SHOWN["convergence_vertical"].unit),
)


def parts(data):
    """Title and parts of the page for :func:`coupling.report.frame.document`.

    data : dict from :func:`coupling.report.study_page.collect`;  returns str, dict.
    """
    cases = data["cases"]
    title = f"Gushing into a tunnel: study {data['name']}"
    done = sum(case["status"] == "finished" for case in cases)
    warned = [f"Case {c['label']}: {text}" for c in cases for text in c["warnings"]]
    if len(warned) > 6:
        warned = [*warned[:5], f"{len(warned) - 5} more are named in the table of balances and warnings."]
    lost = [case for case in cases if case["status"] != "finished"]
    if lost:
        warned.insert(0, f"Without a result: {len(lost)} of {len(cases)} cases; the reasons stand below the design.")
    sections = [_design(data, lost), _results(cases)]
    if data["player"]["cases"]:
        sections.append(_player(data["player"]))
    sections.append(_trust(cases))
    attributes = data["attributes"]
    made = f"first case of {attributes['created']}" if "created" in attributes else ""
    return title, {
        "skip": ("player", "To the charts") if data["player"]["cases"] else ("results", "To the cases"),
        "header": header(title, _lead(data, done), _status(done, len(cases)), warned, data["notes"]),
        "main": "\n".join(section for section in sections if section),
        "footer": provenance(attributes, made),
    }


def _status(done, total):
    return ("finished" if done == total else "failed" if not done else "partly"), f"{done} of {total} finished"


def _lead(data, done):
    seconds = sum(case["cpu_seconds"] or 0.0 for case in data["cases"])
    varied = {name: None for case in data["cases"] for name in case["parameters"]}
    return f"{len(data['cases'])} cases over {', '.join(varied)}, computed in {duration(seconds)} of processor time."


def _design(data, lost):
    failed = ""
    if lost:
        rows = "".join(
            f'<tr data-lost="{case["number"]}"><th scope="row">{escape(case["label"])}</th>'
            f'<td>{escape(case["status"])}</td><td class="reason">{escape(case["message"])}</td>'
            f"<td>{_links(case)}</td></tr>"
            for case in lost
        )
        table = (
            '<table><thead><tr><th scope="col">case</th><th scope="col">status</th>'
            f'<th scope="col">reason</th><th scope="col">files</th></tr></thead><tbody>{rows}</tbody></table>'
        )
        failed = f'<h3 id="lost">Cases without a result</h3>{scroll("lost", table)}'
    design = f'<table class="facts"><tbody>{rows_of_facts(data["design"])}</tbody></table>'
    facts = f'<table class="facts"><tbody>{rows_of_facts(data["facts"])}</tbody></table>'
    return f"""<section aria-labelledby="design">
<h2 id="design">Design of the study</h2>
{scroll("design", design)}
<p class="about">Parameters carry their names in a scene file; numbers are SI, angles degrees, at the tunnel from the
crown, clockwise.</p>
<details><summary>The scene of the cases</summary>
<p class="about">Where cases differ their values stand beside each other.</p>{scroll("design", facts)}</details>
{failed}
</section>"""


def _results(cases):
    finished = [case for case in cases if case["status"] == "finished"]
    if not finished:
        return ""
    known = {n.key: n for case in finished for n in case["numbers"]}
    columns = [(key, name, known[key]) for key, name in COLUMNS.items() if key in known]
    parameters = list(dict.fromkeys(name for case in finished for name in case["parameters"]))
    heads = [_sortable("case"), *(_sortable(name) for name in short_names(parameters))]
    heads += [_sortable(name, number.unit) for _, name, number in columns]
    heads += [_sortable("processor time", "s"), _sortable("wall time", "s"), _sortable("warnings"),
              '<th scope="col">run</th>']  # fmt: skip
    rows = "".join(_result_row(case, parameters, columns) for case in finished)
    errors = any(n.error is not None for case in finished for n in case["numbers"])
    about = (
        "Second line: Δ, how far other lining models are from the first, which is no error of either"
        if errors
        else "No error estimate: one lining model, nothing to compare with"
    )
    table = f"<thead><tr>{''.join(heads)}</tr></thead><tbody>{rows}</tbody>"
    return f"""<section aria-labelledby="results">
<h2 id="results">Cases</h2>
<p class="about">At the last inflow mass that a case reached. {about}. A heading sorts.</p>
{scroll("results", f'<table class="numbers cases sortable" id="case-table">{table}</table>', tall=len(finished) > 15)}
<p class="fine">The error of mesh and time step is not among the estimates; a study over the mesh shows it. Inflow
masses are fixed, forces lie between the records around them.</p>
</section>"""


def _result_row(case, parameters, columns):
    numbers = {number.key: number for number in case["numbers"]}
    cells = [_cell(case["parameters"].get(name)) for name in parameters]
    for key, _, _ in columns:
        number = numbers.get(key)
        if number is None or number.final is None:
            cells.append(_cell(None))
            continue
        error = "" if number.error is None else f"Δ {shown(float(f'{number.error * number.scale:.2g}'))}"
        cells.append(_cell(number.final * number.scale, small=error, key=key))
    cells += [_cell(case["cpu_seconds"]), _cell(case["wall_seconds"]), _cell(len(case["warnings"]))]
    return (
        f'<tr data-case="{case["number"]}"><th scope="row" data-value="{case["number"]}">{escape(case["label"])}</th>'
        f"{''.join(cells)}<td>{_links(case)}</td></tr>"
    )


def _cell(value, small="", key="", form=shown):
    name = f' data-key="{key}"' if key else ""
    if isinstance(value, bool) or not isinstance(value, int | float):
        text = "–" if value is None else value_text(value)
        return f'<td{name} data-value="{escape(text) if value is not None else ""}">{escape(text)}</td>'
    below = f"<small>{escape(small)}</small>" if small else ""
    return f'<td{name} class="number" data-value="{value!r}">{escape(form(value))}{below}</td>'


def _sortable(name, unit=""):
    unit_text = f' <span class="unit">[{escape(unit)}]</span>' if unit else ""
    return (
        f'<th scope="col" aria-sort="none"><button type="button" class="sort">{escape(name)}{unit_text}</button></th>'
    )


def _links(case):
    if case["run"] is None:
        return "–"
    parts = []
    if case["report"]:
        parts.append(f'<a href="{escape(case["report"])}">report</a>')
    if case["status"] != "finished" and case["log"]:
        parts.append(f'<a href="{escape(case["log"])}">log</a>')
    parts.append(f"<code>{escape(case['run'])}</code>")
    return " ".join(parts)


def _player(player):
    models = "".join(f'<option value="{k}">{escape(name)}</option>' for k, name in enumerate(player["models"]))
    model = f'<label>Lining model <select id="model">{models}</select></label>' if len(player["models"]) > 1 else ""
    progress = "".join(figure(key, title, unit, "svg") for key, title, unit in PROGRESS_CHARTS)
    around = "".join(
        figure(key, title, unit, "svg") for key, title, unit in RING_CHARTS[: 6 if player["models"] else 3]
    )
    over_mass = "".join(figure(key, title, unit, "svg") for key, title, unit in MASS_CHARTS) if models else ""
    forces = (
        f'<section aria-labelledby="extremes"><h3 id="extremes">Extremes over inflow mass</h3>'
        f'<div class="grid three">{over_mass}</div></section>'
        if models
        else ""
    )
    table = '<table class="numbers sortable" id="now-table"></table>'
    return f"""<section id="player" aria-labelledby="player-title" tabindex="-1">
<h2 id="player-title">Cases side by side</h2>
<noscript><p class="warnings">The charts need JavaScript; the tables do not.</p></noscript>
<p class="fine">One slider, the inflow mass, moves every chart of every case. Keys: arrows step, Home and End jump,
Page Up and Page Down leap, space plays.</p>
<div class="bar">
<button id="play" type="button" aria-pressed="false">Play</button>
<label class="slider"><span class="hidden">Inflow mass</span><input id="slider" type="range" min="0" step="1"></label>
<output id="now" for="slider"></output>
</div>
<fieldset id="choice"><legend>Cases shown</legend>
<div class="tools"><button type="button" id="all">All</button><button type="button" id="none">None</button></div>
<div id="cases"></div></fieldset>
<div class="tools"><label>Ring charts <select id="shape"><option value="polar">around the ring</option>
<option value="unrolled">unrolled over the angle</option></select></label>
<label>Show <select id="against"><option value="value">values</option>
<option value="change">change since the gate opened</option></select></label>{model}</div>
<section aria-labelledby="around"><h3 id="around">Around the lining at this inflow mass</h3>
<div class="grid three">{around}</div></section>
<section aria-labelledby="progress"><h3 id="progress">Progress of the gushing</h3>
<p class="about">Lines join the inflow masses at which cases are compared; dots are at the slider's inflow mass.</p>
<div class="grid three">{progress}</div></section>
{forces}
<h3 id="now-title">Cases at this inflow mass</h3>
<p class="about">Values of the inflow mass nearest to the slider; below each value its change since the gate opened.</p>
{scroll("now-title", table)}
</section>"""


def _trust(cases):
    finished = [case for case in cases if case["status"] == "finished"]
    if not finished:
        return ""
    names = [name for name in ERRORS if any(name in case["balances"] for case in finished)]
    heads = "".join(
        [_sortable("case"), *(_sortable(ERRORS[name].label) for name in names), '<th scope="col">warnings</th>']
    )
    rows = ""
    for case in finished:
        cells = "".join(_cell(case["balances"].get(name), form=ERRORS[name].form.format) for name in names)
        told = "".join(f"<li>{escape(text)}</li>" for text in case["warnings"])
        rows += (
            f'<tr data-trust="{case["number"]}"><th scope="row" data-value="{case["number"]}">'
            f"{escape(case['label'])}</th>{cells}<td>{f'<ul>{told}</ul>' if told else 'none'}</td></tr>"
        )
    table = f"<thead><tr>{heads}</tr></thead><tbody>{rows}</tbody>"
    return f"""<section aria-labelledby="trust">
<h2 id="trust">Balances and warnings</h2>
<p class="about">Largest errors of a case by its own account: water, momentum, energy, overlap over those of what flows;
grain mass over the initial; unbalanced force of the ring over its loads. A poor one is among the warnings.</p>
{scroll("trust", f'<table class="numbers cases sortable">{table}</table>', tall=len(finished) > 15)}
</section>"""
