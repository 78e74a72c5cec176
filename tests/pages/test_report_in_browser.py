"""The page about a run in a real browser: its numbers are the datasets', one slider moves all, anybody can use it."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from browser import find_browser
from page_in_browser import (
    CONTRAST,
    STATE,
    choose,
    drawn,
    number,
    show_frame,
    spoken,
    wider_than_the_screen,
    written_as,
)  # fmt: skip
from typer.testing import CliRunner

import coupling
from coupling import datasets
from coupling.cli import app
from coupling.files.provenance import root_attributes
from coupling.report import page
from coupling.report.curves import JOINTS
from structure.response import FORCES, PRESSURES
from verification.synthetic_run import record, write_run

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_browser() is None, reason="no Chromium; Debian: apt-get install chromium-headless-shell"),
]


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
    assert {"ground", "inflow_mass", "flow_zone", "disturbed_zone", *PRESSURES, *FORCES, "deformation",
            "convergence_vertical", "settlement", "joint-table", "now-table"} <= set(seen[0])  # fmt: skip
    assert {name for name in seen[0] if len({s[name] for s in seen}) < 3} == set()


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
        for (now, change), name, factor in zip(cells, JOINTS, factors, strict=True):
            values = response[name].values[:, joint] * factor
            assert number(now) == written_as(values[frame]), name
            # f4 in the page: 6e-8 of the values themselves
            assert number(change.replace("+", "")) == pytest.approx(
                values[frame] - values[0], rel=6e-3, abs=2e-7 * abs(values[frame])
            )
    cells = opened.evaluate(
        "(k => [...document.querySelectorAll('#now-table tbody tr')].map(r => r.cells[k].firstChild.data))"
        "([...document.querySelectorAll('#now-table thead th')].findIndex(h => h.innerText.startsWith('largest M')))"
    )
    beam, other = (
        tree[datasets.structure_group(m)]["bending_moment"][frame].max().item() / 1e3
        for m in ("beam-spring", "continuum")
    )
    apart = pytest.approx(other - beam, rel=6e-3, abs=1e-4)
    assert [number(c) for c in cells] == [written_as(beam), written_as(other), apart]


@pytest.mark.parametrize(("frame", "shape"), [(0, "polar"), (4, "polar"), (4, "unrolled")])
def test_drawn_curves_are_the_datasets(opened, tree, frame, shape):
    choose(opened, "shape", shape)
    show_frame(opened, frame)
    models = [tree[datasets.structure_group(model)] for model in ("beam-spring", "continuum")]
    sources = {"soil_pressure": [tree["lining"]], "water_pressure": [tree["lining"]], "axial_force": models,
               "shear_force": models, "bending_moment": models}  # fmt: skip
    for name, groups in sources.items():
        for line, group, k in [("start", groups[0], 0), *((f"line{k}", g, frame) for k, g in enumerate(groups))]:
            angle, value = drawn(opened, name, line)[:: -1 if shape == "polar" else 1]
            np.testing.assert_array_equal(angle, [*group["theta"].values, 360])
            expected = group[name].values[k] / 1e3
            level = np.ptp(group[name].values) / 1e3 / 65534
            np.testing.assert_allclose(value, [*expected, expected[0]], atol=1.01 * level)


def test_a_click_on_a_chart_moves_the_slider_and_the_mouse_reads_the_ground(opened):
    opened.evaluate("for (const name of ['beforeprint', 'afterprint']) dispatchEvent(new Event(name))")
    place = opened.evaluate(
        "(() => { const e = document.getElementById('inflow_mass'); e.scrollIntoView({block: 'center'});"
        " const b = e.getBoundingClientRect(), [x, y] = echarts.getInstanceByDom(e)"
        ".convertToPixel({gridIndex: 0}, [0.5, 100]); return [b.left + x, b.top + y]; })()"
    )
    for kind in ("mousePressed", "mouseReleased"):
        opened.send("Input.dispatchMouseEvent", type=kind, x=place[0], y=place[1], button="left", clickCount=1)
    assert opened.evaluate("document.getElementById('now').innerText") == "0.5 s, 150 kg/m"
    assert drawn(opened, "inflow_mass", "cursor") == ((0.5, 0.5), (0, 300))
    assert drawn(opened, "inflow_mass", "dots") == ((0.5,), (150,))
    start = "echarts.getInstanceByDom(document.getElementById('inflow_mass')).getOption().dataZoom[0].start"
    for modifiers, moved in ((0, False), (8, True)):  # the wheel alone scrolls the page, with Shift it looks closer
        opened.send("Input.dispatchMouseEvent", type="mouseWheel", x=place[0], y=place[1], deltaX=0, deltaY=-200,
                    modifiers=modifiers)  # fmt: skip
        assert (opened.evaluate(start) > 0) is moved
    choose(opened, "field", "pore_pressure")
    place = opened.evaluate(
        "(() => { const e = document.getElementById('ground'); e.scrollIntoView({block: 'center'});"
        " const b = e.getBoundingClientRect(), [x, y] = echarts.getInstanceByDom(e)"
        ".convertToPixel({gridIndex: 0}, [-6.4, -23.3]); return [b.left + x, b.top + y]; })()"
    )
    opened.send("Input.dispatchMouseEvent", type="mouseMoved", x=place[0], y=place[1])
    told = opened.evaluate("document.getElementById('pointed').innerText")
    # the synthetic points stand on a spiral, -9.81 kPa for each metre of height
    assert number(told.split("m: ")[1].removesuffix(" kPa")) == pytest.approx(9.81 * 23.3, rel=0.03)


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


def test_a_link_holds_the_place_of_the_slider(opened):
    show_frame(opened, 3)
    opened.evaluate("new Promise(done => setTimeout(done, 500))")
    assert opened.evaluate("location.hash") == "#time=0.75"
    opened.evaluate("location.hash = '#time=0.26'")  # the nearest record
    opened.evaluate("new Promise(done => setTimeout(done, 500))")
    assert opened.evaluate("document.getElementById('now').innerText") == "0.25 s, 75 kg/m"
    show_frame(opened, 4)


def test_ring_is_drawn_with_its_joints_in_numbers(opened):
    numbers = opened.evaluate("[...document.querySelectorAll('.drawing .number')].map(e => e.textContent)")
    assert numbers == ["1", "2", "3", "4", "5", "6"]
    assert opened.evaluate("document.querySelectorAll('.drawing .key').length") == 1
    assert len(drawn(opened, "bending_moment", "numbers")[0]) == 6  # draws what is out of sight, too
    chart = "echarts.getInstanceByDom(document.getElementById('bending_moment'))"
    marks = f"{chart}.getOption().series.find(s => s.id === 'numbers').data"
    assert opened.evaluate(f"{marks}.map(p => p.label.formatter)") == numbers


def test_on_paper_controls_are_gone_and_four_pages_are_enough(opened, tmp_path):
    opened.send("Emulation.setEmulatedMedia", media="print")
    shown = "getComputedStyle(document.getElementById('{}')).display"
    assert opened.evaluate(shown.format("play")) == "none" != opened.evaluate(shown.format("now"))
    opened.send("Emulation.setEmulatedMedia", media="")
    opened.print_to(tmp_path / "page.pdf")
    assert 1 <= pages_of(tmp_path / "page.pdf") <= 4


def pages_of(pdf):
    return len(re.findall(rb"/Type\s*/Page\b", pdf.read_bytes()))


def test_report_with_pdf_prints_the_page_and_nothing_of_others(run, tmp_path, monkeypatch):
    asked = ["report", str(run), "--out", str(tmp_path / "page.html"), "--pdf", "--json", "-"]
    printed = CliRunner().invoke(app, asked)
    assert printed.exit_code == 0, printed.output
    pdf = Path(json.loads(printed.stdout)["pdf"])
    assert pdf == tmp_path / "page.pdf" and pages_of(pdf) <= 4
    pdf.write_bytes(b"%PDF-1.4 of somebody else")
    refused = CliRunner().invoke(app, asked)
    assert refused.exit_code == 2 and "is no report" in refused.output
    monkeypatch.setenv("PATH", "")
    refused = CliRunner().invoke(app, asked)
    assert refused.exit_code == 2 and "apt-get install chromium-headless-shell" in refused.output.replace("\n", " ")


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
    assert browser.evaluate("document.querySelectorAll('#player .chart svg').length") == 7
    twin = coupling.load_scene("twin-tunnels")
    writer = datasets.RunWriter(tmp_path / "twin.nc", root_attributes(twin), twin)
    for time in (0.0, 1.0):
        made = record(time, n_tunnels=len(twin.tunnels))
        for k, part in enumerate(made.lining):
            part["soil_pressure"] = part["soil_pressure"] * (1 + k)
        writer.append(made)
    writer.close("finished")
    browser.open(page.write_report(tmp_path / "twin.nc", tmp_path / "twin.html"))
    assert browser.evaluate("[...document.querySelectorAll('.case')].map(e => e.innerText)") == ["tunnel 0", "tunnel 1"]
    browser.evaluate("document.getElementById('all').click()")
    first, second = (drawn(browser, "soil_pressure", f"line{k}")[0] for k in (0, 1))
    np.testing.assert_allclose(np.array(second) / first, 2.0, rtol=1e-3)
    assert browser.evaluate("document.querySelectorAll('.ring-picture').length") == 2
    assert browser.complaints == []
