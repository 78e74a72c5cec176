"""The page about a study: told from a run's, within its budget of bytes; in a real browser values are the dataset's."""

import json
import re
import shutil

import numpy as np
import pytest
import xarray as xr
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
from report_study import REASON
from typer.testing import CliRunner

import coupling
from coupling.cli import app
from coupling.report import curves, page, study_page, trust
from coupling.studies.collect import stored_cases

pytestmark = pytest.mark.slow

ROWS = """(id, name) => Object.fromEntries([...document.querySelectorAll(`#${id} tbody tr`)].map(r => [r.dataset[name],
  [...r.cells].map(c => [c.firstChild ? c.firstChild.textContent : '', c.querySelector('small')?.innerText ?? ''])]))"""
CASES = [0, 1, 2]  # the fourth one fails


@pytest.fixture(scope="module")
def folder(gates, tmp_path_factory):
    return shutil.copytree(gates, tmp_path_factory.mktemp("study") / "gates")


@pytest.fixture(scope="module")
def study(folder):
    return coupling.read_study(folder).load()


@pytest.fixture(scope="module")
def collected(folder):
    return study_page.collect(folder, folder)


@pytest.fixture(scope="module")
def report(folder):
    return page.write_report(folder)


# -- without a browser ------------------------------------------------------------------------------


def test_curves_are_within_half_a_level_and_series_equal_the_dataset(collected, study):
    player = collected["player"]
    assert [case["number"] for case in player["entries"]] == CASES
    for case in player["entries"]:
        one = study.sel(case=case["number"])
        assert case["records"] == list(range(5))
        assert case["at"] == ([0, 1, 2, -1, -1] if case["number"] == 2 else [0, 1, 2, 3, 4])
        for name, entry in case["curves"].items():
            values = one[name].values
            np.testing.assert_allclose(
                entry.values(), values, rtol=0, atol=0.5001 * np.nanmax(np.ptp(values[:3])) / 6e4
            )
        for k, model in enumerate(case["models"]):
            moment = one["bending_moment"].isel(model=k)
            found, at = (model["series"][f"bending_moment_max{end}"] for end in ("", "_angle"))
            np.testing.assert_array_equal(found, moment.max("theta"))
            reached = np.isfinite(found)
            np.testing.assert_array_equal(moment.sel(theta=at[reached]).values.diagonal(), found[reached])


def test_a_case_that_ended_early_and_a_ring_out_of_balance_are_warned_of(folder, study):
    scene = stored_cases(folder)[1][2].scene
    told = trust.case_warnings(study.sel(case=2), scene)
    assert "It ended at 150 of 300 kg/m." in told
    good = study.sel(case=0)
    assert not any("lining equilibrium" in text for text in trust.case_warnings(good, scene))
    bad = good.assign(quality_lining_equilibrium=1e-3)
    assert any("lining equilibrium 1e-03" in text for text in trust.case_warnings(bad, scene))


@pytest.mark.parametrize(
    ("count", "records", "step", "kept"), [(4, 41, 1, 41), (20, 41, 4, 41), (40, 41, 4, 21), (400, 121, 4, 14)]
)
def test_a_page_of_many_cases_stays_under_six_megabytes(collected, study, count, records, step, kept):
    """Of noise, which cannot be compressed."""
    rng = np.random.default_rng(3)
    one = study.sel(case=0).interp(progress=np.linspace(0, 1, records))
    one = one.map(lambda part: part * rng.uniform(size=part.shape) if part.dtype.kind == "f" else part)
    chosen = min(count, study_page.MOST_CASES)
    found, at = curves.budget(one, chosen, study_page.MOST_RECORDS, detail=False)
    assert (found, len(at), at[0], at[-1]) == (step, kept, 0, records - 1)
    made = curves.entry(one, curves.ring_series(one), at, found, detail=False)
    case = {**collected["player"]["entries"][0], **made, "at": list(range(len(at)))}
    player = {**collected["player"], "entries": [case] * chosen}
    many = [collected["done"][0]] * count
    data = {**collected, "player": player, "done": many, "table": study_page._table(many),
            "trust": study_page._trust(many)}  # fmt: skip
    assert len(page.rendered(data)) < 6e6


def test_a_study_of_many_inflow_masses_says_what_it_leaves_out(folder, study, monkeypatch):
    monkeypatch.setattr(study_page, "MOST_IN_DETAIL", 0)
    monkeypatch.setattr(curves, "BYTES_OF_CURVES", 2 * 3240 / 4 * 3 * 3)  # three masses of every fourth value
    monkeypatch.setattr(study_page, "MOST_RECORDS", 4)
    data = study_page.collect(folder, folder)
    assert data["player"]["entries"][0]["records"] == [0, 2, 4] and len(data["player"]["theta"]) == 90
    assert any("every 4. value" in text for text in data["notes"])
    assert any("3 of 5 inflow masses" in text for text in data["notes"])
    assert data["player"]["stops"]["values"].tolist() == [0.0, 150.0, 300.0]


def test_a_folder_is_told_to_be_a_run_or_a_study_or_refused(folder, tmp_path):
    case = stored_cases(folder)[1][0]
    run = folder / "cases" / case.key / "run"
    assert page.study_folder(folder) == folder == page.study_folder(folder / "study.json")
    assert page.study_folder(run) is None
    both = tmp_path / "both"
    both.mkdir()
    for name in ("run.nc", "study.json"):
        (both / name).touch()
    for path, message in ((tmp_path, "it holds neither"), (both, "name one of these files"),
                          (run.parent, f"for instance {run}"), (tmp_path / "none", "no such file")):  # fmt: skip
        refused = CliRunner().invoke(app, ["report", str(path)])
        assert refused.exit_code == 2 and message in refused.output.replace("\n", ""), refused.output
    refused = CliRunner().invoke(app, ["report", str(run), "--runs"])
    assert refused.exit_code == 2 and "must be a study" in refused.output


def test_a_damaged_study_is_refused_by_name(folder, tmp_path):
    for k, (name, content, message) in enumerate([
        ("study.json", "{", "study.json must be that of a study"), ("status.json", "[1]", "delete it and repeat"),
        ("status.json", '{"a": {}}', "delete it and repeat"), ("case.nc", "none", "delete this file and repeat"),
    ]):  # fmt: skip
        broken = shutil.copytree(folder, tmp_path / str(k))
        file = broken / name
        if name == "case.nc":
            file = broken / "cases" / stored_cases(broken)[1][1].key / name
        file.write_text(content)
        refused = CliRunner().invoke(app, ["report", str(broken)])
        assert refused.exit_code == 2 and message in refused.output, refused.output


def test_a_study_without_a_result_has_a_page_and_a_case_not_run_is_no_failure(folder, tmp_path):
    begun = tmp_path / "begun"
    begun.mkdir()
    shutil.copy(folder / "study.json", begun)
    written = page.write_report(begun).read_text(encoding="utf-8")
    assert "0 of 4 finished" in written and written.count("not run yet; repeat `gush study`") == 4
    told = CliRunner().invoke(app, ["info", str(folder), "--json", "-"])
    facts = json.loads(told.stdout)
    assert facts["kind"] == "study folder" and facts["facts"]["finished"] == 3 and facts["facts"]["failed"] == 1


def test_pages_of_the_runs_are_written_and_linked(folder, tmp_path):
    copy = shutil.copytree(folder, tmp_path / "copy")
    # a run whose file is gone has no page
    for file in sorted(copy.glob("cases/*/run/run.nc"))[1:]:
        file.unlink()
    done = CliRunner().invoke(app, ["report", str(copy), "--runs", "--json", "-"])
    data = json.loads(done.stdout)
    assert data["study"] == str(copy) and len(data["runs"]) == 1 and data["bytes"] < 10e6
    links = re.findall(r'href="(cases/[^"]+/report.html)"', (copy / "report.html").read_text(encoding="utf-8"))
    assert sorted(str(copy / link) for link in links) == sorted(data["runs"])
    # from another folder the links still lead there
    page.write_report(copy, tmp_path)
    link = re.search(r'href="([^"]+report.html)"', (tmp_path / "report.html").read_text(encoding="utf-8"))[1]
    assert (tmp_path / link).is_file()


# -- in a browser -----------------------------------------------------------------------------------


def test_the_page_is_alone_and_names_the_design_and_what_failed(opened, report):
    assert opened.requests == [report.absolute().as_uri()]
    assert opened.evaluate("document.title") == "Gushing into a tunnel: study gates"
    assert opened.evaluate("document.querySelector('.status').innerText") == "3 of 4 finished"
    design = opened.evaluate(
        "Object.fromEntries([...document.querySelectorAll('section[aria-labelledby=design] .facts')[0].rows]"
        ".map(r => [...r.cells].map(c => c.innerText)))"
    )
    assert design["gate.angle"] == "90, 45" and design["soils.0.friction_angle"] == "25, 35"
    assert design["scene"] == "quick" and design["lining models"] == "beam-spring, continuum"
    assert design["cases"] == "4; 3 finished, 1 failed, 0 not run"
    lost = opened.evaluate("document.querySelector('[data-lost]').innerText")
    assert lost.startswith("angle 45, friction_angle 35\tfailed") and REASON in lost


def test_table_of_cases_shows_the_datasets_values_at_the_last_mass_reached(opened, study):
    rows = opened.evaluate(f"({ROWS})('case-table', 'case')")
    heads = opened.evaluate("[...document.querySelectorAll('#case-table thead th')].map(h => h.innerText)")
    assert [int(k) for k in rows] == CASES
    columns = {"largest N": ("axial_force", "max"), "smallest Q": ("shear_force", "min"),
               "largest M": ("bending_moment", "max"), "smallest M": ("bending_moment", "min")}  # fmt: skip
    for case in CASES:
        cells = {head.split("[")[0].strip(): cell for head, cell in zip(heads, rows[str(case)], strict=True)}
        # case 2 ended at 150 kg/m, the third of five inflow masses
        end = study.sel(case=case).isel(progress=2 if case == 2 else 4)
        assert number(cells["inflow mass"][0]) == written_as(150.0 if case == 2 else 300.0)
        assert number(cells["time"][0]) == written_as(float(end["time"]))
        assert number(cells["flow zone"][0]) == written_as(float(end["flow_zone_area"]))
        assert number(cells["angle"][0]) == study["gate_angle"].values[case]
        for head, (name, extreme) in columns.items():
            beam, other = (
                getattr(end[name].sel(model=m), extreme)().item() / 1e3 for m in ("beam-spring", "continuum")
            )
            assert number(cells[head][0]) == written_as(beam)
            # shown with two digits
            assert number(cells[head][1].removeprefix("Δ ")) == pytest.approx(abs(beam - other), rel=0.06)


def test_the_slider_moves_every_chart_and_the_table(opened):
    seen = []
    for frame in (0, 1, 2):
        show_frame(opened, frame)
        seen.append(opened.evaluate(STATE))
    assert len(seen[0]) == 6 + 4 + 10 + 3
    assert {name for name in seen[0] if len({s[name] for s in seen}) < 3} == set()


@pytest.mark.parametrize(("frame", "model"), [(0, 0), (2, 1), (4, 0)])
def test_values_at_the_sliders_inflow_mass_are_the_datasets(opened, study, frame, model):
    choose(opened, "model", str(model))
    show_frame(opened, frame)
    assert opened.evaluate("document.getElementById('now').innerText") == f"{[0, 75, 150, 225, 300][frame]} kg/m"
    rows = opened.evaluate(f"({ROWS})('now-table', 'now')")
    heads = opened.evaluate(
        "[...document.querySelectorAll('#now-table thead th')].map(h => h.innerText.split(' [')[0])"
    )
    for case in CASES:
        cells = dict(zip(heads, rows[str(case)], strict=True))
        if case == 2 and frame > 2:
            assert cells["inflow mass"][0] == "not reached" and cells["largest N"][0] == "–"
            continue
        one = study.sel(case=case).isel(model=model)
        now, start = one.isel(progress=frame), one.isel(progress=0)
        assert number(cells["inflow mass"][0]) == written_as(float(now["inflow_mass"]))
        assert number(cells["largest soil pressure"][0]) == written_as(now["soil_pressure"].max().item() / 1e3)
        values = {
            "largest N": [s["axial_force"].max().item() / 1e3 for s in (now, start)],
            "smallest M": [s["bending_moment"].min().item() / 1e3 for s in (now, start)],
            "joint opening (+) or closing (−), largest": [s["joint_opening"].max().item() * 1e3 for s in (now, start)],
            "vertical diameter shorter (+) or longer (−)": [
                s["convergence_vertical"].item() * 1e3 for s in (now, start)
            ],
        }
        for head, (value, first) in values.items():
            assert number(cells[head][0]) == written_as(value)
            # f4 in the page: 6e-8 of the values themselves
            assert number(cells[head][1].replace("+", "")) == pytest.approx(
                value - first, rel=6e-3, abs=2e-7 * abs(value)
            )


@pytest.mark.parametrize("against", ["value", "change"])
def test_drawn_curves_are_the_datasets(opened, study, against):
    choose(opened, "shape", "unrolled")
    choose(opened, "against", against)
    show_frame(opened, 2)
    for name in ("soil_pressure", "water_pressure", "axial_force", "bending_moment"):
        for k, case in enumerate(CASES):
            one = study[name].sel(case=case)
            one = one.isel(model=0) if "model" in one.dims else one
            values = (one.isel(progress=2) - (one.isel(progress=0) if against == "change" else 0.0)).values / 1e3
            theta, shown = drawn(opened, name, f"line{k}")
            np.testing.assert_array_equal(theta, [*study["theta"].values, 360])
            level = np.ptp(one.values[np.isfinite(one.values)]) / 1e3 / 65534
            np.testing.assert_allclose(shown, [*values, values[0]], atol=1.01 * level)


def test_extremes_over_inflow_mass_and_their_dots_are_the_datasets(opened, study):
    show_frame(opened, 1)
    moment = study["bending_moment"].isel(model=0) / 1e3
    expected = [pick(moment.sel(case=case), "theta") for case in CASES for pick in (xr.DataArray.max, xr.DataArray.min)]
    for k, values in enumerate(expected):
        mass, shown = drawn(opened, "bending_moment_extremes", f"line{k}")
        np.testing.assert_allclose(shown, values[np.isfinite(values)][: len(shown)], rtol=1e-6)
        assert len(shown) == (3 if k >= 4 else 5) and mass[1] == 75.0
    mass, shown = drawn(opened, "bending_moment_extremes", "dots")
    assert set(mass) == {75.0}
    np.testing.assert_allclose(shown, [values[1] for values in expected], rtol=1e-6)


def test_boxes_choose_the_cases_by_key_too(opened):
    charts = ("soil_pressure", "bending_moment", "inflow_mass", "bending_moment_extremes")
    lines = (
        "dispatchEvent(new Event('beforeprint')); dispatchEvent(new Event('afterprint'));"
        "echarts.getInstanceByDom(document.getElementById('{}')).getOption().series"
        ".filter(s => s.id.startsWith('line')).length"
    )
    count = lambda: [opened.evaluate(lines.format(chart)) for chart in charts]  # noqa: E731
    assert count() == [3, 3, 3, 6]
    opened.evaluate("document.getElementById('case-1').focus()")
    opened.press(" ")
    assert count() == [2, 2, 2, 4]
    assert opened.evaluate("[...document.querySelectorAll('[data-now]')].map(r => r.dataset.now)") == ["0", "2"]
    # the space bar belongs to the box: nothing plays
    assert opened.evaluate("document.getElementById('play').getAttribute('aria-pressed')") == "false"
    opened.evaluate("document.getElementById('none').click()")
    assert count() == [0, 0, 0, 0]
    opened.evaluate("document.getElementById('all').click()")
    assert count() == [3, 3, 3, 6]


def test_headings_sort_the_tables(opened, study):
    order = "[...document.querySelectorAll('#{} tbody tr')].map(r => r.cells[0].dataset.value)"
    head = "[...document.querySelectorAll('#{} thead th')].find(h => h.innerText.startsWith('{}'))"
    largest = study["bending_moment"].isel(model=0).max("theta").values
    reached = {0: largest[0, 4], 1: largest[1, 4], 2: largest[2, 2]}
    ascending = [str(k) for k in sorted(reached, key=reached.get)]
    for expected, sort in ((ascending, "ascending"), (ascending[::-1], "descending")):
        opened.evaluate(f"{head.format('case-table', 'largest M')}.querySelector('button').click()")
        assert opened.evaluate(order.format("case-table")) == expected
        assert opened.evaluate(f"{head.format('case-table', 'largest M')}.getAttribute('aria-sort')") == sort
    # the order holds while the slider moves; what is not reached stays below
    opened.evaluate(f"{head.format('now-table', 'largest N')}.querySelector('button').click()")
    opened.evaluate(f"{head.format('now-table', 'largest N')}.querySelector('button').click()")
    for frame in (1, 4):
        show_frame(opened, frame)
        rows = opened.evaluate(f"({ROWS})('now-table', 'now')")
        names = opened.evaluate(order.format("now-table"))
        column = opened.evaluate(f"{head.format('now-table', 'largest N')}.cellIndex")
        values = [rows[name][column][0] for name in names]
        known = [number(v) for v in values if v != "–"]
        assert known == sorted(known, reverse=True) and values[len(known) :] == ["–"] * (3 - len(known))


@pytest.mark.parametrize("width", [360, 400, 1600])
def test_nothing_is_wider_than_the_screen(opened, width):
    assert wider_than_the_screen(opened, width) == []


def test_the_page_can_be_heard_and_read(opened):
    focusable, unnamed, pictures, levels = spoken(opened)
    assert focusable >= 3 + 4 + 12 and unnamed == []
    assert len(pictures) >= 15 and all("friction_angle 25: " in name for name in pictures)
    assert levels[0] == 1 and levels.count(1) == 1 and max(np.diff(levels)) <= 1
    worst = opened.evaluate(CONTRAST)
    # WCAG 2 AA for text of any size
    assert worst[0] >= 4.5 and worst[2] > 200, worst


def test_on_paper_only_the_chosen_cases_are_named(opened, tmp_path):
    opened.evaluate("document.getElementById('case-1').click()")
    opened.send("Emulation.setEmulatedMedia", media="print")
    shown = "getComputedStyle({}).display"
    assert opened.evaluate(shown.format("document.getElementById('play')")) == "none"
    labels = "[...document.querySelectorAll('.case')].map(e => getComputedStyle(e).display)"
    assert opened.evaluate(labels) == ["flex", "none", "flex"]
    opened.send("Emulation.setEmulatedMedia", media="")
    opened.print_to(tmp_path / "page.pdf")
    assert (tmp_path / "page.pdf").read_bytes().startswith(b"%PDF")
