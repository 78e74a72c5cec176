"""The page about a run as HTML: what can be read without a script, and the places that the script draws into."""

from html import escape

from coupling.report.frame import figure, header, provenance, rows_of_facts, shown
from coupling.runs.progress_line import duration
from structure.response import FORCES, PRESSURES, SHOWN

VERDICTS = {True: "as expected", False: "look at this", None: "–", "poor": "poor: look at this"}
MODEL_QUESTION = "Lining models side by side"
RING_CHARTS = tuple(
    (name, SHOWN[name].name[0].upper() + SHOWN[name].name[1:], SHOWN[name].unit) for name in (*PRESSURES, *FORCES)
)


def parts(data):
    """Title and parts of the page for :func:`coupling.report.frame.document`.

    data : dict from :func:`coupling.report.run_page.collect`;  returns str, dict.
    """
    attributes, summary, player = data["attributes"], data["summary"], data["player"]
    title = f"Gushing into a tunnel: {attributes.get('scene_name', 'run')}"
    status = summary["status"]
    sections = (_numbers(data["numbers"], summary), _player(player), _quality(data), _scene(data))
    return title, {
        "skip": ("player", "To the player"),
        "header": header(title, _lead(summary), (status, status), data["warnings"], data["notes"]),
        "main": "\n".join(sections),
        "footer": provenance(attributes, f"run of {attributes.get('created', 'unknown time')}"),
    }


def _lead(summary):
    wall = summary.get("wall_seconds")
    cost = "" if wall is None else f", computed in {duration(wall)}"
    return f"{shown(summary['inflow_mass'])} kg of grains per metre in {shown(summary['time'])} s{cost}."


def _numbers(groups, summary):
    cost = [("wall time", summary.get("wall_seconds"), "s"), ("processor time", summary.get("cpu_seconds"), "s"),
            ("simulated time", summary["time"], "s"), ("time steps", summary["steps"], ""),
            ("mean time step", 1e6 * summary["mean_dt"], "µs"),
            ("point updates per processor second", summary["point_steps_per_cpu_second"] / 1e6, "million")]  # fmt: skip
    cards = "".join(
        f"<div><dt>{name}</dt><dd>{shown(value, unit)}</dd></div>" for name, value, unit in cost if value is not None
    )
    tables = "".join(_number_table(k, title, numbers) for k, (title, numbers) in enumerate(groups.items()))
    return f"""<section aria-labelledby="numbers">
<h2 id="numbers">Key numbers</h2>
<dl class="cards">{cards}</dl>
<div class="grid groups">{tables}</div>
<p class="fine">The estimates come from this run alone: how much neighbouring records scatter, and how far another
lining model is from the first, which is no error of either. The error of mesh and time step is not among them; a finer
run shows it.</p>
</section>"""


def _number_table(k, title, numbers):
    shared, with_start = {n.basis for n in numbers}, any(n.initial is not None for n in numbers)
    word = "difference" if all(n.is_difference for n in numbers) else "error"
    basis = shared.pop() if len(shared) == 1 else ""
    told = basis if word == "difference" else f"error: {basis}"
    caption = f"<caption>{escape(told[:1].upper() + told[1:])}.</caption>" if basis else ""
    rows = "".join(_number_row(n, with_start, not caption) for n in numbers)
    start = '<th scope="col">start</th>' if with_start else ""
    return f"""<section><h3 id="numbers-{k}">{escape(title)}</h3>
<div class="scroll" role="region" aria-labelledby="numbers-{k}" tabindex="0"><table class="numbers">{caption}
<thead><tr><th scope="col">quantity</th>{start}<th scope="col">end</th><th scope="col">{word}</th></tr></thead>
<tbody>{rows}</tbody></table></div></section>"""


def _number_row(n, with_start, with_basis):
    def value(number):
        return shown(None if number is None else number * n.scale)

    basis = f"<small>{escape(n.basis)}</small>" if n.basis and with_basis else ""
    # an error is known to two digits at best
    sign = "" if n.is_difference else "± "
    error = "–" if n.error is None else f"{sign}{shown(float(f'{n.error * n.scale:.2g}'))}"
    return (
        f'<tr data-key="{n.key}"><th scope="row">{escape(n.label)} <span class="unit">[{escape(n.unit)}]</span>{basis}'
        f"</th>{f'<td>{value(n.initial)}</td>' if with_start else ''}"
        f'<td class="final">{value(n.final)}</td><td class="error">{error}</td></tr>'
    )


def _player(player):
    parts, lining, models = [], player["lining"], player["models"]
    if player["fields"]:
        scalars = player["fields"]["fields"].items()
        options = "".join(f'<option value="{key}">{escape(scalar["label"])}</option>' for key, scalar in scalars)
        tools = (
            f'<div class="tools"><label>Field <select id="field">{options}</select></label>'
            '<label>View <select id="field-view"><option value="tunnel">around the tunnel</option>'
            '<option value="gate">at the gate</option></select></label></div>'
        )
        parts.append(figure("fields", "Ground around the tunnel", "", "canvas", tools))
    parts.append(figure("inflow_mass", "Inflow mass", "kg/m", "svg"))
    parts.append(figure("zones", "Flow zone and disturbed zone", "m²", "svg"))
    if lining:
        parts += [figure(key, title, unit, "svg") for key, title, unit in RING_CHARTS[:3]]
    if models:
        parts += [figure(key, title, unit, "svg") for key, title, unit in RING_CHARTS[3:]]
        parts.append(figure("deformed", "Deformed ring", "", "svg"))
        parts.append(figure("convergence", "Convergence and settlement", "mm", "svg"))
    tables = ""
    if any(model["joints"] for model in models):
        tables += (
            '<section aria-labelledby="joints"><h3 id="joints">Joints</h3><div class="scroll" role="region" '
            'aria-labelledby="joints" tabindex="0"><table id="joint-table"></table></div></section>'
        )
    if models:
        tables += (
            f'<section aria-labelledby="models"><h3 id="models">{MODEL_QUESTION}</h3><div class="scroll" role="region" '
            'aria-labelledby="models" tabindex="0"><table id="model-table"></table></div></section>'
        )
    tunnels = len(lining["tunnels"]) if lining else 0
    pick = "".join(f'<option value="{k}">{k}</option>' for k in range(tunnels))
    tunnel = f'<label>Pressures and ring of tunnel <select id="tunnel">{pick}</select></label>' if tunnels > 1 else ""
    return f"""<section id="player" aria-labelledby="player-title" tabindex="-1">
<h2 id="player-title">Player over time</h2>
<noscript><p class="warnings">The player needs JavaScript; numbers, balances and scene do not.</p></noscript>
<p class="fine">One slider moves every chart. Keys: arrows step, Home and End jump, Page Up and Page Down leap,
space plays.</p>
<div class="bar">
<button id="play" type="button" aria-pressed="false">Play</button>
<label class="slider"><span class="hidden">Time</span><input id="slider" type="range" min="0" step="1"></label>
<output id="now" for="slider"></output>
</div>
<div class="tools"><label>Ring charts <select id="shape"><option value="polar">around the ring</option>
<option value="unrolled">unrolled over the angle</option></select></label>{tunnel}</div>
<div class="grid">{"".join(parts)}</div>
{tables}
</section>"""


def _quality(data):
    rows = "".join(
        f'<tr class="{"bad" if good in (False, "poor") else ""}"><th scope="row">{escape(what)}</th>'
        f"<td>{escape(value)}</td>"
        f"<td>{VERDICTS.get(good, good)}</td></tr>"
        for what, value, good in data["quality"]
    )
    return f"""<section aria-labelledby="quality">
<h2 id="quality">Balances and limits</h2>
<div class="scroll" role="region" aria-labelledby="quality" tabindex="0"><table>
<thead><tr><th scope="col">what</th><th scope="col">how much</th><th scope="col">verdict</th></tr></thead>
<tbody>{rows}</tbody></table></div>
<details><summary>Everything that was recorded over time</summary><div class="grid small" id="history"></div></details>
</section>"""


def _scene(data):
    parts = "".join(
        f'<tr class="{"on" if row["active"] else "off"}"><th scope="row">{escape(row["feature"])}</th>'
        f"<td>{'computed' if row['active'] else 'left out'}</td><td>{escape(row['reason'])}</td></tr>"
        for row in data["left_out"]
    )
    mesh = data["player"]["mesh"]
    mesh_text, mesh_figure = "", ""
    if mesh:
        mesh_text = (
            f"{mesh['elements']} triangles, {mesh['nodes']} nodes; flattest triangle "
            f"{shown(1e3 * mesh['min_altitude'])} mm, smallest angle {mesh['min_angle']:.0f}°."
        )
        tools = (
            '<div class="tools"><label>View <select id="mesh-view"><option value="tunnel">around the tunnel</option>'
            '<option value="gate">at the gate</option><option value="box">whole box</option></select></label></div>'
        )
        mesh_figure = figure("mesh", "Mesh", "", "canvas", tools)
    return f"""<section aria-labelledby="scene">
<h2 id="scene">Scene and mesh</h2>
<div class="grid wide">{figure("section", "Section through the ground", "", "svg")}{mesh_figure}</div>
<p id="mesh-facts">{mesh_text}</p>
<div class="scroll" role="region" aria-labelledby="scene" tabindex="0">
<table class="facts"><tbody>{rows_of_facts(data["facts"])}</tbody></table></div>
<h3 id="parts">What was computed and what was left out</h3>
<div class="scroll" role="region" aria-labelledby="parts" tabindex="0"><table>
<thead><tr><th scope="col">part</th><th scope="col"></th><th scope="col">why</th></tr></thead>
<tbody>{parts}</tbody></table></div>
<details><summary>The complete scene, as the program reads it</summary>
<pre tabindex="0">{escape(str(data["attributes"].get("scene", "")))}</pre></details>
</section>"""
