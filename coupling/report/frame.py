"""What every page has: its frame with style, script and data, numbers as people read them, figures, warnings."""

import json
from html import escape

MINUS = "\N{MINUS SIGN}"


def document(title, parts, data, style, script, mark):
    """The whole page.

    Parameters
    ----------
    title : str
    parts : dict
        HTML of "skip" (id and text of what the first link jumps to), "header", "main", "footer".
    data : dict
        What the script draws, JSON.
    style, script : str
        Put in as they are.
    mark : str
        Meta element that tells a report from other pages.

    Returns
    -------
    str
    """
    # "<" would let a text of the scene end the script element
    embedded = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    target, text = parts["skip"]
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
<a class="skip" href="#{target}">{text}</a>
{parts["header"]}
<main>
{parts["main"]}
</main>
<footer>{parts["footer"]}</footer>
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


def header(title, lead, status, warned, notes):
    """Title, what it came to, warnings, and what the page leaves out.

    title, lead : str;  status : one word of the status and what is written;  warned, notes : lists of str.
    """
    messages = "".join(f"<li>{escape(text)}</li>" for text in warned)
    left_out = "".join(f"<li>{escape(text)}</li>" for text in notes)
    warned_block = (
        f'<section class="warnings" aria-labelledby="warnings"><h2 id="warnings">Warnings</h2>'
        f"<ul>{messages}</ul></section>"
        if warned
        else '<p class="fine">No warnings.</p>'
    )
    kind, text = status
    return f"""<header>
<h1>{escape(title)}</h1>
<p class="lead">{escape(lead)}
<span class="status {escape(kind)}">{escape(text)}</span></p>
{warned_block}
{f'<ul class="notes">{left_out}</ul>' if notes else ""}
</header>"""


def figure(key, title, unit, kind, extra=""):
    """Place of a chart that the script draws: kind "svg" or "canvas", `extra` HTML above it."""
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


def scroll(label, table, tall=False):
    """A table that scrolls sideways where it is wider than the screen, and within itself where it is `tall`.

    label : id of its heading.
    """
    kind = "scroll tall" if tall else "scroll"
    return f'<div class="{kind}" role="region" aria-labelledby="{label}" tabindex="0">{table}</div>'


def rows_of_facts(facts):
    """Rows of (what, text)."""
    return "".join(f'<tr><th scope="row">{escape(a)}</th><td>{escape(b)}</td></tr>' for a, b in facts)


def provenance(attributes, made):
    """Program, revision and versions, and what was `made` when."""
    parts = [attributes.get("source", ""), f"revision {attributes['revision']}" if attributes.get("revision") else "",
             made, attributes.get("versions", "")]  # fmt: skip
    return escape(" · ".join(part for part in parts if part))
