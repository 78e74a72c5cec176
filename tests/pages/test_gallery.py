"""The notebooks of the gallery run from top to bottom and show pictures."""

import re
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
NOTEBOOKS = sorted((ROOT / "examples" / "notebooks").glob("*.ipynb"))


def read(path):
    return pytest.importorskip("nbformat").read(path, as_version=4)


@pytest.fixture(scope="module")
def outputs(tmp_path_factory):
    """Name of every notebook to what its cells show; all in one kernel, since its start takes as long as a notebook."""
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    whole, of = nbformat.v4.new_notebook(), []
    for path in NOTEBOOKS:
        for cell in (nbformat.v4.new_code_cell("%reset -f"), *read(path).cells):
            if cell["cell_type"] == "code":
                whole.cells.append(cell)
                of.append(path.stem)
    place = {"metadata": {"path": str(tmp_path_factory.mktemp("gallery"))}}
    nbclient.NotebookClient(whole, timeout=300, allow_errors=True, resources=place).execute()
    found = {path.stem: [] for path in NOTEBOOKS}
    for name, cell in zip(of, whole.cells, strict=True):
        found[name] += cell["outputs"]
    return found


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_runs_and_shows_pictures(path, outputs):
    found = outputs[path.stem]
    assert [output["evalue"] for output in found if output["output_type"] == "error"] == []
    assert sum("image/png" in output.get("data", {}) for output in found) >= 2
    assert not [output for output in found if output.get("name") == "stderr"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_is_kept_without_outputs_and_its_links_lead_somewhere(path):
    notebook = read(path)
    code = [cell for cell in notebook.cells if cell["cell_type"] == "code"]
    assert not [cell for cell in code if cell["outputs"] or cell["execution_count"]]
    text = "\n".join(cell["source"] for cell in notebook.cells if cell["cell_type"] == "markdown")
    for link in re.findall(r"\]\(([^)#]+)", text):
        assert (path.parent / link).is_file(), link


def test_every_notebook_is_on_the_page_of_the_gallery():
    page = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
    assert len(NOTEBOOKS) == 5
    for path in NOTEBOOKS:
        assert f"`examples/notebooks/{path.name}`" in page
