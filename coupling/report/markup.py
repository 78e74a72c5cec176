"""The page as HTML: what can be read without a script, and the places that the script draws into."""

import json
from html import escape

MINUS = "\N{MINUS SIGN}"
VERDICTS = {True: "as expected", False: "look at this", None: "–"}
MODEL_QUESTION = "Lining models side by side"
RING_CHARTS = (
    ("soil_pressure", "Effective soil pressure", "kPa"),
    ("water_pressure", "Water pressure", "kPa"),
    ("soil_shear", "Shear of the soil on the lining", "kPa"),
    ("axial_force", "Axial force N", "kN/m"),
    ("shear_force", "Shear force Q", "kN/m"),
    ("bending_moment", "Bending moment M", "kN m/m"),
)


def document(data, style, script, mark):
    """The whole page.

    Parameters
    ----------
    data : dict
        From :func:`coupling.report.page.collect`.
    style, script : str
        Put in as they are.
    mark : str
        Meta element that tells a report from other pages.

    Returns
    -------
    str
    """
    attributes, player = data["attributes"], data["player"]
    title = f"Gushing into a tunnel: {attributes.get('scene_name', 'run')}"
    # "<" would let a text of the scene end the script element
    embedded = json.dumps(player, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    return f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
{mark}
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'; \
script-src 'unsafe-inline'; img-src data:">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{escape(title)}</title>
<style>
{style}</style>
</head>
<body>
<a class="skip" href="#player">To the player</a>
{_header(title, data)}
<main>
{_numbers(data["numbers"], data["summary"])}
{_player(player)}
{_quality(data)}
{_scene(data)}
</main>
<footer>{_provenance(attributes)}</footer>
<script type="application/json" id="data">{embedded}</script>
<script>
"use strict";
(() => {{
{script}
}})();
</script>
</body>
</html>
"""


def shown(value, unit=""):
    """A number as people read it: three significant digits, whole from 100 on, a true minus sign (as in unpack.js)."""
    if value is None:
        return "–"
    if value != 0 and (abs(value) >= 1e6 or abs(value) < 1e-4):
        mantissa, power = f"{value:.2e}".split("e")
        text = f"{mantissa}e{int(power)}"
    elif abs(value) >= 100:
        text = f"{value:.0f}"
    else:
        text = f"{float(f'{value:.3g}')!r}".removesuffix(".0")
    return f"{text.replace('-', MINUS)} {unit}".strip()


def _header(title, data):
    summary, warned = data["summary"], data["warnings"]
    status = summary["status"]
    messages = "".join(f"<li>{escape(text)}</li>" for text in warned)
    notes = "".join(f"<li>{escape(text)}</li>" for text in data["notes"])
    warned_block = (
        f'<section class="warnings" aria-labelledby="warnings"><h2 id="warnings">Warnings</h2>'
        f"<ul>{messages}</ul></section>"
        if warned
        else '<p class="fine">No warnings.</p>'
    )
    return f"""<header>
<h1>{escape(title)}</h1>
<p class="lead">{escape(_lead(summary))}
<span class="status {escape(status)}">{escape(status)}</span></p>
{warned_block}
{f'<ul class="notes">{notes}</ul>' if notes else ""}
</header>"""


def _lead(summary):
    wall = summary.get("wall_seconds")
    cost = "" if wall is None else f", computed in {_duration(wall)}"
    return f"{shown(summary['inflow_mass'])} kg of grains per metre in {shown(summary['time'])} s{cost}."


def _duration(seconds):
    return f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.0f} min" if seconds < 7200 else (
        f"{seconds / 3600:.1f} h"
    )  # fmt: skip


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
<p class="fine">The estimates come from this run alone: what it conserves, how much neighbouring records scatter,
another lining model. The error of mesh and time step is not among them; a finer run shows it.</p>
</section>"""


def _number_table(k, title, numbers):
    shared, with_start = {n.basis for n in numbers}, any(n.initial is not None for n in numbers)
    caption = f"<caption>Error: {escape(shared.pop())}.</caption>" if len(shared) == 1 else ""
    rows = "".join(_number_row(n, with_start, not caption) for n in numbers)
    start = '<th scope="col">start</th>' if with_start else ""
    return f"""<section><h3 id="numbers-{k}">{escape(title)}</h3>
<div class="scroll" role="region" aria-labelledby="numbers-{k}" tabindex="0"><table class="numbers">{caption}
<thead><tr><th scope="col">quantity</th>{start}<th scope="col">end</th><th scope="col">error</th></tr></thead>
<tbody>{rows}</tbody></table></div></section>"""


def _number_row(n, with_start, with_basis):
    def value(number):
        return shown(None if number is None else number * n.scale)

    basis = f"<small>{escape(n.basis)}</small>" if n.basis and with_basis else ""
    # an error is known to two digits at best
    error = "–" if n.error is None else f"± {shown(float(f'{n.error * n.scale:.2g}'))}"
    return (
        f'<tr data-key="{n.key}"><th scope="row">{escape(n.label)} <span class="unit">[{escape(n.unit)}]</span>{basis}'
        f"</th>{f'<td>{value(n.initial)}</td>' if with_start else ''}"
        f'<td class="final">{value(n.final)}</td><td class="error">{error}</td></tr>'
    )


def _figure(key, title, unit, kind, extra=""):
    unit_text = f' <span class="unit">[{escape(unit)}]</span>' if unit else ""
    place = (
        f'<canvas id="{key}" width="900" height="900" role="img" aria-label="{escape(title)}"></canvas>'
        if kind == "canvas"
        else f'<svg id="{key}" role="img" aria-label="{escape(title)}"></svg>'
    )
    return (
        f'<figure data-chart="{key}"><h3>{escape(title)}{unit_text}</h3>{extra}{place}'
        f'<figcaption id="{key}-text"></figcaption></figure>'
    )


def _player(player):
    parts, lining, models = [], player["lining"], player["models"]
    if player["fields"]:
        scalars = player["fields"]["fields"].items()
        options = "".join(f'<option value="{key}">{escape(scalar["label"])}</option>' for key, scalar in scalars)
        tools = (
            f'<div class="tools"><label>Field <select id="field">{options}</select></label>'
            '<label>View <select id="field-view"><option value="tunnel">around the tunnel</option>'
            '<option value="gate">at the gap</option></select></label></div>'
        )
        parts.append(_figure("fields", "Ground around the tunnel", "", "canvas", tools))
    parts.append(_figure("inflow_mass", "Inflow mass", "kg/m", "svg"))
    parts.append(_figure("zones", "Flow zone and disturbed zone", "m²", "svg"))
    if lining:
        parts += [_figure(key, title, unit, "svg") for key, title, unit in RING_CHARTS[:3]]
    if models:
        parts += [_figure(key, title, unit, "svg") for key, title, unit in RING_CHARTS[3:]]
        parts.append(_figure("deformed", "Deformed ring", "", "svg"))
        parts.append(_figure("convergence", "Convergence and settlement", "mm", "svg"))
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
    tunnel = f'<label>Pressures of tunnel <select id="tunnel">{pick}</select></label>' if tunnels > 1 else ""
    return f"""<section id="player" aria-labelledby="player-title" tabindex="-1">
<h2 id="player-title">Player over time</h2>
<noscript><p class="warnings">The player needs JavaScript; numbers, balances and scene do not.</p></noscript>
<p class="fine">One slider moves every chart. Keys: arrows step, Home and End jump, Page Up and Page Down leap,
space plays.</p>
<div class="bar">
<button id="play" type="button" aria-pressed="false">Play</button>
<label class="slider"><span class="hidden">Time</span><input id="time" type="range" min="0" step="1"></label>
<output id="now" for="time"></output>
</div>
<div class="tools"><label>Ring charts <select id="shape"><option value="polar">around the ring</option>
<option value="unrolled">unrolled over the angle</option></select></label>{tunnel}</div>
<div class="grid">{"".join(parts)}</div>
{tables}
</section>"""


def _quality(data):
    rows = "".join(
        f'<tr class="{"bad" if good is False else ""}"><th scope="row">{escape(what)}</th><td>{escape(value)}</td>'
        f"<td>{VERDICTS[good]}</td></tr>"
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
    facts = "".join(f'<tr><th scope="row">{escape(a)}</th><td>{escape(b)}</td></tr>' for a, b in data["facts"])
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
            '<option value="gate">at the gap</option><option value="box">whole box</option></select></label></div>'
        )
        mesh_figure = _figure("mesh", "Mesh", "", "canvas", tools)
    return f"""<section aria-labelledby="scene">
<h2 id="scene">Scene and mesh</h2>
<div class="grid wide">{_figure("section", "Section through the ground", "", "svg")}{mesh_figure}</div>
<p id="mesh-facts">{mesh_text}</p>
<div class="scroll" role="region" aria-labelledby="scene" tabindex="0">
<table class="facts"><tbody>{facts}</tbody></table></div>
<h3 id="parts">What was computed and what was left out</h3>
<div class="scroll" role="region" aria-labelledby="parts" tabindex="0"><table>
<thead><tr><th scope="col">part</th><th scope="col"></th><th scope="col">why</th></tr></thead>
<tbody>{parts}</tbody></table></div>
<details><summary>The complete scene, as the program reads it</summary>
<pre tabindex="0">{escape(str(data["attributes"].get("scene", "")))}</pre></details>
</section>"""


def _provenance(attributes):
    parts = [attributes.get("source", ""), f"revision {attributes['revision']}" if attributes.get("revision") else "",
             f"run of {attributes.get('created', 'unknown time')}", attributes.get("versions", "")]  # fmt: skip
    return escape(" · ".join(part for part in parts if part))
