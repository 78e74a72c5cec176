"""The page about a run in a real browser: its numbers are the datasets', one slider moves all, anybody can use it."""

import re

import numpy as np
import pytest
from browser import find_browser
from page_in_browser import CONTRAST, choose, number, show_frame, spoken, wider_than_the_screen, written_as

import coupling
from coupling import datasets
from coupling.files.provenance import root_attributes
from coupling.report import page, series
from verification.synthetic_run import record, write_run

pytestmark = pytest.mark.slow

pytestmark = pytest.mark.skipif(
    find_browser() is None, reason="no Chromium on this machine; Debian: apt-get install chromium-headless-shell"
)

# Name of every chart to what it shows, and the text of both tables.
STATE = """Object.fromEntries([...document.querySelectorAll('[data-chart]')].map(f => [f.dataset.chart,
  f.querySelector('canvas') ? f.querySelector('canvas').toDataURL() : f.querySelector('svg').innerHTML])
  .concat(['joint-table', 'model-table', 'now'].map(id => [id, document.getElementById(id).innerText])))"""
# Of an unrolled chart: [text, place] of the ticks of both axes, and the paths of its curves.
CURVES = """(svg => {
  const tick = (name, at) => [...svg.querySelectorAll(name)].map(t => [t.textContent, Number(t.getAttribute(at))]);
  const paths = [...svg.querySelectorAll('path.initial, path.line')].map(p => p.getAttribute('d'));
  return [tick('.x-tick', 'x'), tick('.y-tick', 'y'), paths];
})"""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return write_run(tmp_path_factory.mktemp("run") / "run.nc")


@pytest.fixture(scope="module")
def tree(run):
    return coupling.read_run(run)


@pytest.fixture(scope="module")
def report(run):
    return page.write_report(run)


def test_the_page_asks_for_nothing_but_itself(opened, report):
    assert opened.requests == [report.absolute().as_uri()]
    assert opened.evaluate("document.title") == "Gushing into a tunnel: quick"


def test_key_numbers_in_the_page_are_the_datasets(opened, tree):
    rows = opened.evaluate(
        "Object.fromEntries([...document.querySelectorAll('tr[data-key]')].map(r =>"
        " [r.dataset.key, [...r.querySelectorAll('td')].map(c => c.innerText)]))"
    )
    history, lining, response = tree["history"], tree["lining"], tree["structure/beam_spring"]
    assert number(rows["inflow_mass"][-2]) == written_as(float(history["inflow_mass"][-1]))
    for theta in (0, 180, 270):
        for name in ("soil_pressure", "water_pressure"):
            here = lining[name].sel(theta=theta) / 1e3
            start, end, error = rows[f"{name}_{theta}"]
            assert (number(start), number(end)) == (written_as(float(here[0])), written_as(float(here[-1])))
            assert number(error) > 0
    # the gap is at the right waist: nothing presses there once it is open
    assert rows["soil_pressure_90"][1:] == ["–", "–"]
    for name in ("axial_force", "shear_force", "bending_moment"):
        other = tree["structure/continuum"][name][-1]
        for extreme in ("max", "min"):
            start, end, error = rows[f"{name}_{extreme}"]
            first, last, beside = (
                getattr(v, extreme)().item() / 1e3 for v in (response[name][0], response[name][-1], other)
            )
            assert (number(start), number(end)) == (written_as(first), written_as(last))
            # shown with two digits
            assert number(error) == pytest.approx(abs(beside - last), rel=0.06, abs=1e-9)
    assert number(rows["convergence_vertical"][1]) == written_as(1e3 * float(response["convergence_vertical"][-1]))


def test_the_slider_moves_every_chart_and_both_tables(opened):
    seen = []
    for frame in (0, 2, 4):
        show_frame(opened, frame)
        seen.append(opened.evaluate(STATE))
    fixed = {"section", "mesh"}
    moving = set(seen[0]) - fixed
    assert {"fields", "inflow_mass", "zones", "soil_pressure", "water_pressure", "soil_shear", "axial_force",
            "shear_force", "bending_moment", "deformed", "convergence"} <= moving  # fmt: skip
    assert {name for name in moving if len({s[name] for s in seen}) < 3} == set()


@pytest.mark.parametrize("frame", [0, 3, 4])
def test_joint_and_model_tables_show_the_record_of_the_slider(opened, tree, frame):
    show_frame(opened, frame)
    rows = opened.evaluate(
        "[...document.querySelectorAll('#joint-table tbody tr')].map(r => [Number(r.dataset.joint), r.dataset.model,"
        " [...r.querySelectorAll('td.number')].slice(1)"
        ".map(c => [c.firstChild.data, c.querySelector('small').innerText])])"
    )
    factors = [1e-3, 1e-3, 1e-3, 1e3, 1e3, 1e3]
    assert len(rows) == 12
    for joint, model, cells in rows:
        response = tree[datasets.structure_group(model)]
        for (now, start), name, factor in zip(cells, series.JOINT_FIELDS, factors, strict=True):
            values = response[name].values[:, joint] * factor
            assert (number(now), number(start)) == (written_as(values[frame]), written_as(values[0])), name
    cells = opened.evaluate(
        "[...document.querySelector('[data-row=\"bending moment M, largest\"]').querySelectorAll('td')]"
        ".map(c => c.firstChild.data)"
    )
    beam, other = (
        tree[datasets.structure_group(m)]["bending_moment"][frame].max().item() / 1e3
        for m in ("beam-spring", "continuum")
    )
    assert [number(c) for c in cells] == [
        written_as(beam),
        written_as(other),
        pytest.approx(other - beam, rel=6e-3, abs=1e-4),
    ]


@pytest.mark.parametrize("frame", [0, 4])
def test_unrolled_curves_lie_where_their_axes_say(opened, tree, frame):
    choose(opened, "shape", "unrolled")
    show_frame(opened, frame)
    sources = {
        "soil_pressure": [tree["lining"]] * 2,
        "water_pressure": [tree["lining"]] * 2,
        **{
            name: [tree[datasets.structure_group(model)] for model in ("beam-spring", "beam-spring", "continuum")]
            for name in ("axial_force", "shear_force", "bending_moment")
        },
    }
    for name, expected in sources.items():
        drawn = opened.evaluate(f"{CURVES}(document.getElementById('{name}'))")
        x_axis, y_axis = (np.array([[number(text), at] for text, at in ticks]) for ticks in drawn[:2])
        for k, (path, dataset) in enumerate(zip(drawn[2], expected, strict=True)):
            xy = np.array(re.findall(r"[ML](-?[\d.]+) (-?[\d.]+)", path), float)
            theta = np.interp(xy[:, 0], x_axis[:, 1], x_axis[:, 0])
            # labels stand four units below their line
            slope, offset = np.polyfit(y_axis[:, 1] - 4, y_axis[:, 0], 1)
            values = dataset[name].values[0 if k == 0 else frame] / 1e3
            np.testing.assert_allclose(theta, dataset["theta"], atol=0.02)
            # coordinates have two decimals
            np.testing.assert_allclose(
                slope * xy[:, 1] + offset, values, atol=0.01 * abs(slope) + 1e-6 * np.abs(values).max()
            )


def test_keys_and_button_move_the_slider(opened):
    value = "Number(document.getElementById('slider').value)"
    assert opened.evaluate(value) == 4
    opened.evaluate("document.getElementById('slider').focus()")
    positions = []
    for key in ("Home", "ArrowRight", "ArrowRight", "End", "ArrowLeft"):
        opened.press(key)
        positions.append(opened.evaluate(value))
    assert positions == [0, 1, 2, 4, 3]
    spoken = opened.evaluate("document.getElementById('slider').getAttribute('aria-valuetext')")
    assert spoken == "0.75 s, 225 kg/m" == opened.evaluate("document.getElementById('now').innerText")
    opened.press("End")
    opened.press(" ")
    assert opened.evaluate("document.getElementById('play').getAttribute('aria-pressed')") == "true"
    opened.evaluate("new Promise(done => { const wait = () => document.getElementById('play').innerText === 'Play' ?"
                    " done() : setTimeout(wait, 20); wait(); })")  # fmt: skip
    assert opened.evaluate(value) == 4


@pytest.mark.parametrize("width", [360, 390, 1366, 1920])
def test_nothing_is_wider_than_the_screen(opened, width):
    assert wider_than_the_screen(opened, width) == []


def test_everything_that_takes_the_focus_has_a_name(opened):
    focusable, unnamed, pictures, levels = spoken(opened)
    assert focusable >= 8 and unnamed == []
    assert len(pictures) >= 12 and all(len(name) > 8 for name in pictures)
    assert opened.evaluate("document.documentElement.lang") == "en"
    assert levels[0] == 1 and levels.count(1) == 1 and max(np.diff(levels)) <= 1


def test_text_stands_out_from_its_background(opened):
    worst = opened.evaluate(CONTRAST)
    # WCAG 2 AA for text of any size
    assert worst[0] >= 4.5 and worst[2] > 200, worst


def test_on_paper_controls_are_gone_and_everything_is_unfolded(opened, tmp_path):
    opened.send("Emulation.setEmulatedMedia", media="print")
    shown = "getComputedStyle(document.getElementById('{}')).display"
    assert opened.evaluate(shown.format("play")) == "none" != opened.evaluate(shown.format("now"))
    opened.send("Emulation.setEmulatedMedia", media="")
    opened.evaluate("addEventListener('beforeprint', () => { window.unfolded ="
                    " [...document.querySelectorAll('details')].every(d => d.open); })")  # fmt: skip
    opened.print_to(tmp_path / "page.pdf")
    assert (tmp_path / "page.pdf").read_bytes().startswith(b"%PDF")
    assert opened.evaluate("window.unfolded") is True
    assert opened.evaluate("[...document.querySelectorAll('details')].some(d => d.open)") is False


def test_names_in_a_scene_are_text_and_nothing_else(browser, quick_scene, tmp_path):
    # a scene refuses such names, but a file may hold anything
    name = "</script><script>document.title = 'mine'</script><b>&amp;"
    path = write_run(tmp_path / "run.nc", quick_scene, times=(0.0, 1.0))
    datasets.write_attributes(path, scene_name=name, status_message=name)
    browser.complaints.clear()
    browser.open(page.write_report(path))
    assert browser.evaluate("document.querySelector('h1').innerText") == f"Gushing into a tunnel: {name}"
    assert browser.evaluate("document.title") == f"Gushing into a tunnel: {name}"
    assert browser.complaints == []


def test_runs_without_ring_or_with_one_record_or_two_tunnels_have_a_page(browser, tmp_path):
    browser.complaints.clear()
    one = write_run(tmp_path / "one.nc", times=(0.0,), models=(), status="running")
    browser.open(page.write_report(one, tmp_path / "one.html"))
    assert "'interrupted'" in browser.evaluate("document.querySelector('.warnings').innerText")
    assert browser.evaluate("document.querySelectorAll('#player [data-chart] > svg').length") == 5
    twin = coupling.load_scene("twin-tunnels")
    writer = datasets.RunWriter(tmp_path / "twin.nc", root_attributes(twin), twin)
    for time in (0.0, 1.0):
        made = record(time, n_tunnels=len(twin.tunnels))
        for k, part in enumerate(made.lining):
            part["soil_pressure"] = part["soil_pressure"] * (1 + k)
        writer.append(made)
    writer.close("finished")
    browser.open(page.write_report(tmp_path / "twin.nc", tmp_path / "twin.html"))
    curve = "document.querySelector('#soil_pressure path.line').getAttribute('d')"
    curves = []
    for tunnel in ("0", "1"):
        choose(browser, "tunnel", tunnel)
        curves.append(browser.evaluate(curve))
    assert curves[0] != curves[1]
    assert browser.complaints == []
