"""What every report page must do in a browser, and how tests read and move it."""

import pytest

# Least contrast of a text with what lies under it (WCAG 2), that element, and how many were looked at.
CONTRAST = """(() => {
  const parts = c => c.match(/[\\d.]+/g).map(Number);
  const linear = v => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
  const light = c => {
    const [r, g, b] = parts(c).map(v => linear(v / 255));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const under = e => {
    for (; e; e = e.parentElement) {
      const c = getComputedStyle(e).backgroundColor;
      if ((parts(c)[3] ?? 1) > 0) return c;
    }
    return 'rgb(255, 255, 255)';
  };
  const written = e => [...e.childNodes].some(n => n.nodeType === 3 && n.data.trim());
  const seen = [...document.querySelectorAll('body *')].filter(e => !e.closest('script, style, noscript'));
  const texts = seen.filter(written);
  const found = texts.map(e => {
    const s = getComputedStyle(e), a = light(e.closest('svg') ? s.fill : s.color), b = light(under(e));
    return [(Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05), e.outerHTML.slice(0, 80)];
  });
  return found.sort((p, q) => p[0] - q[0])[0].concat(found.length);
})()"""


# Name of every chart to what it shows, and the text of the tables and of the slider.
STATE = """(() => {
  for (const name of ['beforeprint', 'afterprint']) dispatchEvent(new Event(name)); // draws what is out of sight, too
  const charts = [...document.querySelectorAll('#player [data-chart]')].map(f => [f.dataset.chart,
    f.querySelector('canvas') ? f.querySelector('canvas').toDataURL() : f.querySelector('.chart svg').innerHTML]);
  const texts = ['joint-table', 'now-table', 'now'].filter(id => document.getElementById(id));
  return Object.fromEntries(charts.concat(texts.map(id => [id, document.getElementById(id).innerText])));
})()"""


def drawn(browser, chart, line):
    """What a chart was given to draw in a line: both coordinates."""
    browser.evaluate("for (const name of ['beforeprint', 'afterprint']) dispatchEvent(new Event(name))")
    points = browser.evaluate(
        f"echarts.getInstanceByDom(document.getElementById('{chart}')).getOption().series"
        f".find(s => s.id === '{line}').data.map(p => Array.from(p.value ?? p))"
    )
    return tuple(zip(*points, strict=True)) if points else ((), ())


def number(text):
    """What is written, as a number."""
    return float(text.replace("−", "-").replace("± ", ""))


def written_as(value):
    """Tolerance of a number shown with three digits."""
    return pytest.approx(value, rel=6e-3, abs=1e-9)


def choose(browser, select, value):
    """Choose an entry of a select element."""
    browser.evaluate(
        f"(() => {{ const s = document.getElementById('{select}'); s.value = '{value}';"
        " s.dispatchEvent(new Event('change')); })()"
    )


def show_frame(browser, frame):
    """Move the slider, as dragging does."""
    browser.evaluate(
        f"(() => {{ const s = document.getElementById('slider'); s.value = {frame};"
        " s.dispatchEvent(new Event('input', {bubbles: true})); })()"
    )


def wider_than_the_screen(browser, width):
    """Start of every element that reaches beyond a screen of that width, and of the page itself where it does."""
    browser.resize(width, 844)
    cut = browser.evaluate(
        "[...document.querySelectorAll('h1, h2, h3, p, figure, button, select, label, .bar, dl')].filter(e =>"
        " { const b = e.getBoundingClientRect(); return b.width && !e.classList.contains('skip') &&"
        " !e.closest('.scroll') && (b.left < 0 || b.right > innerWidth + 0.5); }).map(e => e.outerHTML.slice(0, 80))"
    )
    return cut if browser.evaluate("document.documentElement.scrollWidth") <= width else ["the page", *cut]


def spoken(browser):
    """What a screen reader is told.

    Returns
    -------
    int, list of str, list of str, list of int
        Elements that take the focus; roles of those without a name; names of pictures; levels of headings.
    """
    nodes = browser.send("Accessibility.getFullAXTree")["nodes"]
    focusable, unnamed = 0, []
    for node in nodes:
        properties = {p["name"]: p["value"].get("value") for p in node.get("properties", [])}
        if properties.get("focusable") and node["role"]["value"] not in ("RootWebArea", "generic"):
            focusable += 1
            if not node.get("name", {}).get("value"):
                unnamed.append(node["role"]["value"])
    pictures = [n["name"]["value"] for n in nodes if n.get("role", {}).get("value") in ("image", "img")]
    levels = browser.evaluate("[...document.querySelectorAll('h1, h2, h3')].map(h => Number(h.tagName[1]))")
    return focusable, unnamed, pictures, levels
