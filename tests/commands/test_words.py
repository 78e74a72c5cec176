"""The words of tables and pages say what the numbers are, whatever their sign."""

import re

import pytest
from typer.testing import CliRunner

from coupling.cli import app
from coupling.report import numbers, run_page
from coupling.report.page import rendered, write_report
from verification.synthetic_run import write_run


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return write_run(tmp_path_factory.mktemp("words") / "run.nc")


@pytest.fixture(scope="module")
def page(run):
    return write_report(run).read_text(encoding="utf-8")


def test_gate_has_one_name_on_the_page(page):
    assert not re.findall(r"\bgaps?\b", re.sub(r"<(style|script).*?</\1>", "", page, flags=re.DOTALL))
    assert "gate" in page


def test_sign_of_a_diameter_and_of_a_joint_is_told_where_it_is_shown(run, page):
    """This ring, all in compression, closes its joints and lengthens one of its diameters."""
    data = run_page.collect(run)
    shown = {n.key: n for group in data["numbers"].values() for n in group}
    assert shown["joint_opening_max"].final < 0
    assert min(shown[f"convergence_{way}"].final for way in ("horizontal", "vertical")) < 0
    for key in ("joint_opening_max", "convergence_horizontal", "convergence_vertical"):
        assert "(+) or" in shown[key].label and "(−)" in shown[key].label
    assert "shortens by" not in page
    response = CliRunner().invoke(app, ["respond", str(run)])
    assert "opening (+) or" in response.output and "closing (−)" in response.output


def test_difference_of_two_models_is_not_called_an_error(run):
    data = run_page.collect(run)
    (ring,) = (group for group in data["numbers"].values() if any(n.key == "bending_moment_max" for n in group))
    assert all(n.is_difference for n in ring) and any(n.error for n in ring)
    table = rendered({**data, "numbers": {"ring": ring}})
    assert "±" not in table and ">error<" not in table
    assert ">difference<" in table and "<caption>Difference from " in table
    scatter = [numbers.Number("p", "soil", "kPa", 1e-3, 1e5, 1e5, 2e3, "scatter of the last records")]
    table = rendered({**data, "numbers": {"pressures": scatter}})
    assert "± 2" in table and ">error<" in table
