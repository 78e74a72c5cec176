"""The example notebook as Jupyter runs it: scenes, rings and figures show themselves, once, and a run its progress."""

import re
from pathlib import Path

import matplotlib.figure
import pytest

import coupling
import structure
from coupling.figures import inflow
from verification.small_event import small_scene

pytestmark = pytest.mark.slow

NOTEBOOK = Path(__file__).parents[2] / "examples" / "notebook_run.ipynb"


@pytest.fixture(scope="module")
def cells(tmp_path_factory):
    """Outputs of the code cells, in order."""
    nbclient, nbformat = pytest.importorskip("nbclient"), pytest.importorskip("nbformat")
    pytest.importorskip("ipykernel")
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    folder = str(tmp_path_factory.mktemp("notebook"))
    nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": folder}}).execute()
    return [cell["outputs"] for cell in notebook.cells if cell["cell_type"] == "code"]


def kinds(outputs):
    return [kind for output in outputs for kind in output.get("data", {}) if kind != "text/plain"]


def test_scene_and_ring_show_themselves_as_tables(cells):
    scene, ring = ["scene &#x27;quick&#x27;", "gate in the lining"], ["Ring", "joint_angles"]
    for outputs, parts in ((cells[0], scene), (cells[-1], ring)):
        assert kinds(outputs) == ["text/html"]
        assert all(part in outputs[0]["data"]["text/html"] for part in parts)


def test_run_shows_how_far_it_came_in_one_line_and_then_its_pressures(cells):
    line, dataset = cells[1]
    assert line["output_type"] == "display_data"
    assert re.fullmatch(r"[^\n]*, \d+ s in all", line["data"]["text/plain"])
    assert "inflow_mass" in dataset["data"]["text/html"] and "soil_pressure" in dataset["data"]["text/html"]


def test_figures_show_once(cells):
    for outputs in (cells[2], cells[5]):
        assert kinds(outputs) == ["image/png"]


def test_selection_by_inflow_gives_a_table_of_two_angles(cells):
    assert cells[3][0]["data"]["text/html"].count("<tr") == 4  # two heads, crown and invert
    assert float(cells[4][0]["data"]["text/plain"]) > 50.0  # kN m/m of the ring at rest


def test_figure_is_one_of_matplotlib_that_shows_itself(tmp_path):
    import numpy as np
    import xarray as xr

    time = np.linspace(0, 1, 5)
    names = ("inflow_mass", "flow_zone_area", "disturbed_area")
    figure = inflow(xr.Dataset({name: ("time", time) for name in names}, coords={"time": time}))
    assert isinstance(figure, matplotlib.figure.Figure)
    assert figure._repr_png_().startswith(b"\x89PNG")


def test_scene_and_ring_print_as_lines_and_a_ring_as_what_makes_it_again():
    scene = small_scene()
    for thing in (scene, scene.ring):
        lines = repr(thing).splitlines()
        assert len(lines) > 8 and max(map(len, lines)) < 160
    made = eval(repr(scene.ring), {name: getattr(structure, name) for name in ("Ring", "Ground")})
    assert made == scene.ring
    assert "&lt;" in coupling.load_scene("quick")._repr_html_() or "<pre>" in scene._repr_html_()
