"""The page about a run shows the datasets' numbers, all charts follow one slider, and nothing leaves the page."""

import json
import re

import numpy as np
import pytest
import xarray as xr
from browser import Browser, find_browser
from synthetic_run import make_quick_scene, points, record
from test_figures import TwoTriangles
from typer.testing import CliRunner

import coupling
from coupling import datasets
from coupling.cli import app
from coupling.provenance import root_attributes
from coupling.report import fields, numbers, page, series
from coupling.report.packing import evenly, unpacked
from coupling.run import respond

TIMES = (0.0, 0.25, 0.5, 0.75, 1.0)
needs_browser = pytest.mark.skipif(
    find_browser() is None, reason="no Chromium on this machine; Debian: apt-get install chromium-headless-shell"
)


def moving_record(time):
    """A record in which every quantity of the lining and of the points changes with time."""
    made = record(time, snapshot=True)
    for part in made.lining:
        part["water_pressure"] = part["water_pressure"] + 20e3 * time * np.cos(np.radians(part["theta"]))
        part["soil_shear"] = part["soil_shear"] * (1 + 0.2 * time)
    return made


def write_run(path, scene=None, times=TIMES, models=("beam-spring", "continuum"), status="finished", name=None):
    """File of a synthetic run; the second model is a ring of another theory of bending."""
    scene = make_quick_scene() if scene is None else scene
    attributes = root_attributes(scene) | ({} if name is None else {"scene_name": name})
    writer = datasets.RunWriter(path, attributes, scene.mpm, TwoTriangles())
    for time in times:
        writer.append(moving_record(time))
    writer.close(status, wall_seconds=12.0, cpu_seconds=11.0)
    pressures = datasets.read_pressures(path)
    theories = {"beam-spring": "timoshenko", "continuum": "euler-bernoulli"}
    for model in models:
        ring = scene.ring.model_copy(update={"section": theories[model]})
        response = respond(scene.model_copy(update={"ring": ring}), pressures)
        datasets.write_response(path, response, model)
    return path


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return write_run(tmp_path_factory.mktemp("run") / "run.nc")


@pytest.fixture(scope="module")
def tree(run):
    return coupling.read_run(run)


@pytest.fixture(scope="module")
def browser():
    with Browser(find_browser()) as opened:
        yield opened


@pytest.fixture(scope="module")
def report(run):
    return page.write_report(run)


@pytest.fixture
def opened(report, browser):
    """The browser with the page of the run, fresh."""
    browser.complaints.clear()
    browser.requests.clear()
    browser.resize(1366, 768)
    browser.open(report)
    yield browser
    assert browser.complaints == []


def number(text):
    """What is written, as a number."""
    return float(text.replace("−", "-").replace("± ", ""))


def written_as(value):
    """Tolerance of a number shown with three digits."""
    return pytest.approx(value, rel=6e-3, abs=1e-9)


def show_frame(browser, frame):
    browser.evaluate(
        f"(() => {{ const s = document.getElementById('time'); s.value = {frame};"
        " s.dispatchEvent(new Event('input', {bubbles: true})); })()"
    )


# -- the numbers ------------------------------------------------------------------------------------


def test_scatter_leaves_a_trend_out_and_finds_the_noise():
    noise = np.random.default_rng(1).normal(scale=3.0, size=2000)
    # of 400 records; standard deviation of the estimate 3 / sqrt(800) times about 1.2
    assert numbers.scatter(noise + 50.0 * np.arange(2000), 0.0) == pytest.approx(3.0, abs=0.4)
    assert numbers.scatter(2.0 * np.arange(20), 4.0) == pytest.approx(4.0)
    assert numbers.scatter(np.arange(4.0), 1.0) is None


def test_inflow_rate_of_a_straight_line_has_no_error():
    time = np.linspace(0, 2, 41)
    history = xr.Dataset({"inflow_mass": ("time", 300 * np.maximum(time - 0.5, 0))}, coords={"time": time})
    rate, error = numbers.inflow_rate(history)
    assert rate == pytest.approx(300.0) and error < 1e-9
    assert numbers.inflow_rate(history.isel(time=slice(0, 12))) is None


def test_quality_of_triangles():
    x, y = np.array([0.0, 1.0, 0.5, 1.0]), np.array([0.0, 0.0, np.sqrt(0.75), 1.0])
    altitude, angle = fields.triangle_quality(x, y, np.array([[0, 1, 2], [0, 1, 3]]))
    np.testing.assert_allclose(altitude, [np.sqrt(0.75), np.sqrt(0.5)])
    np.testing.assert_allclose(angle, [60.0, 45.0])


def test_initial_theory_is_given_only_where_it_holds(quick_scene):
    theta = np.array([0.0, 90.0])
    theory = numbers.initial_theory(quick_scene, theta)
    vertical = (1 - 0.45) * (2650 - 1000) * 9.81 * np.array([20.0, 23.3])
    np.testing.assert_allclose(theory["soil_pressure"][0], [vertical[0], 0.577 * vertical[1]])
    np.testing.assert_allclose(theory["water_pressure"][0], 9810.0 * np.array([20.0, 23.3]))
    assert numbers.initial_theory(coupling.load_scene("twin-tunnels"), theta) is None


def test_warnings_name_what_is_missing_or_off(run, tree, tmp_path):
    good = page.collect(run)
    assert [text for text in good["warnings"] if "records" not in text and "revision" not in text] == [
        text for text in good["warnings"] if text.startswith("Outside")
    ]
    # the synthetic pressures are no K0 state, which must be said
    assert any("against theory" in text for text in good["warnings"])
    short = write_run(tmp_path / "run.nc", times=(0.0, 0.5), models=(), status="interrupted")
    told = " ".join(page.collect(short)["warnings"])
    assert "'interrupted'" in told and "No lining model" in told and "Only 2 records" in told
    datasets.write_response(short, tree["structure/beam-spring"].to_dataset().isel(time=[0]))
    assert "beam-spring holds 1 of 2 records" in " ".join(page.collect(short)["warnings"])


# -- what is put into the page ----------------------------------------------------------------------


def test_evenly_chosen_records_hold_the_ends():
    np.testing.assert_array_equal(evenly(5, 9), np.arange(5))
    chosen = evenly(1000, 7)
    assert len(chosen) == 7 and chosen[0] == 0 and chosen[-1] == 999 and np.ptp(np.diff(chosen)) <= 1


def test_embedded_series_are_the_datasets_values(run, tree):
    player = page.collect(run)["player"]
    lining, tunnel = tree["lining"], player["lining"]["tunnels"][0]
    for name in series.PRESSURES:
        np.testing.assert_array_equal(unpacked(tunnel[name]), lining[name].values.astype("f4"))
    for model in player["models"]:
        response = tree[f"structure/{model['name']}"]
        for name, entry in {**model["fields"], **model["joints"], **model["series"]}.items():
            np.testing.assert_array_equal(unpacked(entry), response[name].values.astype("f4"))


def test_a_response_that_stops_early_is_missing_afterwards(tree):
    response = tree["structure/beam-spring"].to_dataset().isel(time=slice(0, 2))
    shown = unpacked(series.model_series("beam-spring", response, np.array(TIMES))["fields"]["axial_force"])
    np.testing.assert_array_equal(shown[:2], response["axial_force"].values.astype("f4"))
    assert np.isnan(shown[2:]).all()


def test_embedded_fields_are_within_half_a_step_of_the_points(tree):
    stored = tree["points"].to_dataset()
    packed = fields.field_snapshots(stored)
    view = packed["view"]
    for k, snapshot in enumerate(packed["snapshots"]):
        shot = stored.isel(time=k)
        near = (np.abs(shot["x"] - view["x"]) < view["half"]) & (np.abs(shot["y"] - view["y"]) < view["half"])
        shot = shot.isel(point=np.flatnonzero(near))
        step = 2 * view["half"] / 65535
        x = view["x"] - view["half"] + step * unpacked(snapshot["x"]).astype(float)
        order = np.argsort(x, kind="stable")
        np.testing.assert_allclose(x[order], np.sort(shot["x"].values), atol=0.5 * step + 1e-5)
        scale = packed["fields"]["pore_pressure"]
        width = (scale["high"] - scale["low"]) / 255
        shown = scale["low"] + width * np.sort(unpacked(snapshot["pore_pressure"])).astype(float)
        expected = np.minimum(np.sort(np.maximum(shot["pore_pressure"].values / 1e3, 0)), scale["high"])
        np.testing.assert_allclose(shown, expected, atol=0.5 * width + 1e-3)
        scale = packed["fields"]["displacement"]
        assert scale["log"] and (scale["low"], scale["high"]) == (1.0, 1000.0)
        size = np.clip(1e3 * np.hypot(shot["displacement_x"], shot["displacement_y"]), 1.0, 1000.0)
        shown = 10 ** (3 / 255 * np.sort(unpacked(snapshot["displacement"])).astype(float))
        # half of 255 steps over three decades
        np.testing.assert_allclose(shown, np.sort(size), rtol=10 ** (1.5 / 255) - 1 + 1e-6)


def test_the_page_of_a_long_run_stays_under_ten_megabytes(tree, tmp_path):
    records, theta = 5000, np.arange(360.0)
    time = np.linspace(0, 100, records)
    zero = np.zeros((records, 360), "f4")
    pressures = {name: (("time", "theta"), zero) for name in datasets.PRESSURES}
    progress = {name: ("time", np.linspace(0, 1, records)) for name in datasets.PROGRESS}
    geometry = tree["lining"].attrs
    lining = xr.Dataset({**pressures, **progress}, coords={"time": time, "theta": theta}, attrs=geometry)
    history = xr.Dataset({name: ("time", np.ones(records)) for name in datasets.HISTORY}, coords={"time": time})
    response = tree["structure/beam-spring"].to_dataset().isel(time=np.zeros(records, int)).assign_coords(time=time)
    shot = {name: np.tile(values, 250) for name, values in points(1.0).items() if name != "removed"}
    many = xr.Dataset({name: (("time", "point"), np.stack([values] * 30)) for name, values in shot.items()},
                      coords={"time": np.linspace(0, 100, 30)}, attrs=geometry)  # fmt: skip
    nodes = np.random.default_rng(2).uniform(size=(2, 200_000))
    mesh = xr.Dataset({"x": ("node", nodes[0]), "y": ("node", nodes[1]), "region": ("element", np.zeros(400_000, "i1")),
                       "element_nodes": (("element", "corner"), np.arange(1_200_000).reshape(-1, 3) % 200_000)},
                      attrs=geometry)  # fmt: skip
    models = {f"/structure/{name}": response for name in ("beam-spring", "continuum", "third")}
    long = xr.DataTree.from_dict({"/lining": lining, "/history": history, "/points": many, "/mesh": mesh, **models})
    frames = series.choose_frames(long)
    player = page._player(long, None, frames, fields.field_snapshots(many))
    size = len(json.dumps(player))
    # the rest of a page, style, script and text, is below 0.2 MB
    assert 2e6 < size < 9.8e6
    assert frames[-1] == records - 1 and len(frames) > 20


def test_only_an_earlier_report_is_replaced(run, tmp_path):
    path = page.write_report(run, tmp_path)
    assert path == tmp_path / "report.html" and page.is_report(path)
    assert page.write_report(run, path) == path
    (tmp_path / "mine.html").write_text("<p>mine</p>")
    for out, message in ((tmp_path / "mine.html", "is no report"), (tmp_path / "no" / "a.html", "does not exist")):
        refused = CliRunner().invoke(app, ["report", str(run), "--out", str(out)])
        assert refused.exit_code == 2 and message in refused.output
    assert (tmp_path / "mine.html").read_text() == "<p>mine</p>"
    done = CliRunner().invoke(app, ["report", str(run), "--out", str(path), "--json", "-"])
    assert done.exit_code == 0 and json.loads(done.output)["bytes"] == path.stat().st_size < 10e6


def test_a_file_without_a_record_is_refused(tmp_path):
    empty = write_run(tmp_path / "run.nc", times=(), models=())
    for path, message in ((empty, "no complete record yet"), (tmp_path / "none", "no such file")):
        refused = CliRunner().invoke(app, ["report", str(path)])
        assert refused.exit_code == 2 and message in refused.output


# -- the page in a browser --------------------------------------------------------------------------


@needs_browser
def test_the_page_asks_for_nothing_but_itself(opened, report):
    assert opened.requests == [report.absolute().as_uri()]
    assert opened.evaluate("document.title") == "Gushing into a tunnel: quick"


@needs_browser
def test_key_numbers_in_the_page_are_the_datasets(opened, tree):
    rows = opened.evaluate(
        "Object.fromEntries([...document.querySelectorAll('tr[data-key]')].map(r =>"
        " [r.dataset.key, [...r.querySelectorAll('td')].map(c => c.innerText)]))"
    )
    history, lining, response = tree["history"], tree["lining"], tree["structure/beam-spring"]
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
            first, last, beside = (getattr(v, extreme)().item() / 1e3 for v in (response[name][0], response[name][-1], other))
            assert (number(start), number(end)) == (written_as(first), written_as(last))
            # shown with two digits
            assert number(error) == pytest.approx(abs(beside - last), rel=0.06, abs=1e-9)
    assert number(rows["convergence_vertical"][1]) == written_as(1e3 * float(response["convergence_vertical"][-1]))


@needs_browser
def test_the_slider_moves_every_chart_and_both_tables(opened):
    state = (
        "Object.fromEntries([...document.querySelectorAll('[data-chart]')].map(f => [f.dataset.chart,"
        " (f.querySelector('canvas') ? f.querySelector('canvas').toDataURL() : f.querySelector('svg').innerHTML)])"
        ".concat(['joint-table', 'model-table', 'now'].map(id => [id, document.getElementById(id).innerText])))"
    )
    seen = []
    for frame in (0, 2, 4):
        show_frame(opened, frame)
        seen.append(opened.evaluate(state))
    fixed = {"section", "mesh"}
    moving = set(seen[0]) - fixed
    assert {"fields", "inflow_mass", "zones", "soil_pressure", "water_pressure", "soil_shear", "axial_force",
            "shear_force", "bending_moment", "deformed", "convergence"} <= moving  # fmt: skip
    assert {name for name in moving if len({s[name] for s in seen}) < 3} == set()


@needs_browser
@pytest.mark.parametrize("frame", [0, 3, 4])
def test_joint_and_model_tables_show_the_record_of_the_slider(opened, tree, frame):
    show_frame(opened, frame)
    rows = opened.evaluate(
        "[...document.querySelectorAll('#joint-table tbody tr')].map(r => [Number(r.dataset.joint), r.dataset.model,"
        " [...r.querySelectorAll('td.number')].slice(1).map(c => [c.firstChild.data, c.querySelector('small').innerText])])"
    )
    factors = [1e-3, 1e-3, 1e-3, 1e3, 1e3, 1e3]
    assert len(rows) == 12
    for joint, model, cells in rows:
        response = tree[f"structure/{model}"]
        for (now, start), name, factor in zip(cells, series.JOINT_FIELDS, factors, strict=True):
            values = response[name].values[:, joint] * factor
            assert (number(now), number(start)) == (written_as(values[frame]), written_as(values[0])), name
    cells = opened.evaluate(
        "[...document.querySelector('[data-row=\"bending moment M, largest\"]').querySelectorAll('td')]"
        ".map(c => c.firstChild.data)"
    )
    beam, other = (tree[f"structure/{m}"]["bending_moment"][frame].max().item() / 1e3 for m in ("beam-spring", "continuum"))
    assert [number(c) for c in cells] == [written_as(beam), written_as(other), pytest.approx(other - beam, rel=6e-3, abs=1e-4)]


@needs_browser
@pytest.mark.parametrize("frame", [0, 4])
def test_unrolled_curves_lie_where_their_axes_say(opened, tree, frame):
    opened.evaluate(
        "(() => { const s = document.getElementById('shape'); s.value = 'unrolled';"
        " s.dispatchEvent(new Event('change')); })()"
    )
    show_frame(opened, frame)
    sources = {
        "soil_pressure": [tree["lining"]] * 2,
        "water_pressure": [tree["lining"]] * 2,
        **{
            name: [tree[f"structure/{model}"] for model in ("beam-spring", "beam-spring", "continuum")]
            for name in ("axial_force", "shear_force", "bending_moment")
        },
    }
    for name, expected in sources.items():
        drawn = opened.evaluate(
            f"(() => {{ const s = document.getElementById('{name}'); const tick = c => [...s.querySelectorAll(c)].map(t =>"
            " [t.textContent, Number(t.getAttribute(c === '.y-tick' ? 'y' : 'x'))]);"
            " return [tick('.x-tick'), tick('.y-tick'), [...s.querySelectorAll('path.initial, path.line')]"
            ".map(p => p.getAttribute('d'))]; })()"
        )
        x_axis, y_axis = (np.array([[number(text), at] for text, at in ticks]) for ticks in drawn[:2])
        for k, (path, dataset) in enumerate(zip(drawn[2], expected, strict=True)):
            xy = np.array(re.findall(r"[ML](-?[\d.]+) (-?[\d.]+)", path), float)
            theta = np.interp(xy[:, 0], x_axis[:, 1], x_axis[:, 0])
            # labels stand four units below their line
            slope, offset = np.polyfit(y_axis[:, 1] - 4, y_axis[:, 0], 1)
            values = dataset[name].values[0 if k == 0 else frame] / 1e3
            np.testing.assert_allclose(theta, dataset["theta"], atol=0.02)
            # coordinates have two decimals
            np.testing.assert_allclose(slope * xy[:, 1] + offset, values, atol=0.01 * abs(slope) + 1e-6 * np.abs(values).max())


@needs_browser
def test_keys_and_button_move_the_slider(opened):
    value = "Number(document.getElementById('time').value)"
    assert opened.evaluate(value) == 4
    opened.evaluate("document.getElementById('time').focus()")
    positions = []
    for key in ("Home", "ArrowRight", "ArrowRight", "End", "ArrowLeft"):
        opened.press(key)
        positions.append(opened.evaluate(value))
    assert positions == [0, 1, 2, 4, 3]
    spoken = opened.evaluate("document.getElementById('time').getAttribute('aria-valuetext')")
    assert spoken == "0.75 s, 225 kg/m" == opened.evaluate("document.getElementById('now').innerText")
    opened.press("End")
    opened.press(" ")
    assert opened.evaluate("document.getElementById('play').getAttribute('aria-pressed')") == "true"
    opened.evaluate("new Promise(done => { const wait = () => document.getElementById('play').innerText === 'Play' ?"
                    " done() : setTimeout(wait, 20); wait(); })")  # fmt: skip
    assert opened.evaluate(value) == 4


@needs_browser
@pytest.mark.parametrize("width", [360, 390, 1366, 1920])
def test_nothing_is_wider_than_the_screen(opened, width):
    opened.resize(width, 844)
    assert opened.evaluate("document.documentElement.scrollWidth") <= width
    cut = opened.evaluate(
        "[...document.querySelectorAll('h1, h2, h3, p, figure, button, select, .bar, dl')].filter(e =>"
        " { const b = e.getBoundingClientRect(); return b.width && !e.classList.contains('skip') &&"
        " (b.left < 0 || b.right > innerWidth + 0.5); }).map(e => e.outerHTML.slice(0, 80))"
    )
    assert cut == []


@needs_browser
def test_everything_that_takes_the_focus_has_a_name(opened):
    nodes = opened.send("Accessibility.getFullAXTree")["nodes"]
    focusable, unnamed = 0, []
    for node in nodes:
        properties = {p["name"]: p["value"].get("value") for p in node.get("properties", [])}
        if properties.get("focusable") and node["role"]["value"] not in ("RootWebArea", "generic"):
            focusable += 1
            if not node.get("name", {}).get("value"):
                unnamed.append(node["role"]["value"])
    pictures = [n["name"]["value"] for n in nodes if n.get("role", {}).get("value") in ("image", "img")]
    assert focusable >= 8 and unnamed == []
    assert len(pictures) >= 12 and all(len(name) > 8 for name in pictures)
    assert opened.evaluate("document.documentElement.lang") == "en"
    levels = opened.evaluate("[...document.querySelectorAll('h1, h2, h3')].map(h => Number(h.tagName[1]))")
    assert levels[0] == 1 and levels.count(1) == 1 and max(np.diff(levels)) <= 1


@needs_browser
def test_text_stands_out_from_its_background(opened):
    worst = opened.evaluate(
        """(() => {
        const parts = c => c.match(/[\\d.]+/g).map(Number);
        const light = c => { const [r, g, b] = parts(c).map(v => { v /= 255;
          return v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4; }); return 0.2126 * r + 0.7152 * g + 0.0722 * b; };
        const under = e => { for (; e; e = e.parentElement) { const c = getComputedStyle(e).backgroundColor;
          if ((parts(c)[3] ?? 1) > 0) return c; } return 'rgb(255, 255, 255)'; };
        const found = [];
        for (const e of document.querySelectorAll('body *')) {
          if (e.closest('script, style, noscript') || ![...e.childNodes].some(n => n.nodeType === 3 && n.data.trim())) continue;
          const s = getComputedStyle(e), a = light(e.closest('svg') ? s.fill : s.color), b = light(under(e));
          found.push([(Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05), e.outerHTML.slice(0, 80)]);
        }
        return found.sort((p, q) => p[0] - q[0])[0].concat(found.length);
        })()"""
    )
    # WCAG 2 AA for text of any size
    assert worst[0] >= 4.5 and worst[2] > 200, worst


@needs_browser
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


@needs_browser
def test_names_in_a_scene_are_text_and_nothing_else(browser, tmp_path):
    name = "</script><script>document.title = 'mine'</script><b>&amp;"
    browser.complaints.clear()
    browser.open(page.write_report(write_run(tmp_path / "run.nc", times=(0.0, 1.0), name=name)))
    assert browser.evaluate("document.querySelector('h1').innerText") == f"Gushing into a tunnel: {name}"
    assert browser.evaluate("document.title") == f"Gushing into a tunnel: {name}"
    assert browser.complaints == []


@needs_browser
def test_runs_without_ring_or_with_one_record_or_two_tunnels_have_a_page(browser, tmp_path):
    browser.complaints.clear()
    one = write_run(tmp_path / "one.nc", times=(0.0,), models=(), status="running")
    browser.open(page.write_report(one, tmp_path / "one.html"))
    assert "'running'" in browser.evaluate("document.querySelector('.warnings').innerText")
    assert browser.evaluate("document.querySelectorAll('#player [data-chart] > svg').length") == 5
    twin = coupling.load_scene("twin-tunnels")
    writer = datasets.RunWriter(tmp_path / "twin.nc", root_attributes(twin), twin.mpm)
    for time in (0.0, 1.0):
        made = record(time, n_tunnels=len(twin.mpm.tunnels))
        for k, part in enumerate(made.lining):
            part["soil_pressure"] = part["soil_pressure"] * (1 + k)
        writer.append(made)
    writer.close("finished")
    browser.open(page.write_report(tmp_path / "twin.nc", tmp_path / "twin.html"))
    curve = "document.querySelector('#soil_pressure path.line').getAttribute('d')"
    curves = []
    for tunnel in ("0", "1"):
        browser.evaluate(f"(() => {{ const s = document.getElementById('tunnel'); s.value = '{tunnel}';"
                         " s.dispatchEvent(new Event('change')); })()")  # fmt: skip
        curves.append(browser.evaluate(curve))
    assert curves[0] != curves[1]
    assert browser.complaints == []
