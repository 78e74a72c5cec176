"""The notebooks of the gallery run from top to bottom, in one kernel after the other, and show pictures."""

import re
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
NOTEBOOKS = sorted((ROOT / "examples" / "notebooks").glob("*.ipynb"))


def read(path):
    return pytest.importorskip("nbformat").read(path, as_version=4)


@pytest.fixture(scope="module")
def kernel(tmp_path_factory):
    """One for all notebooks: most of the time of a small one is the start of its kernel."""
    jupyter_client = pytest.importorskip("jupyter_client")
    pytest.importorskip("ipykernel")
    manager = jupyter_client.AsyncKernelManager(kernel_name="python3")
    folder = str(tmp_path_factory.mktemp("gallery"))
    yield manager, folder


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_runs_and_shows_pictures(path, kernel):
    nbclient, (manager, folder) = pytest.importorskip("nbclient"), kernel
    notebook = read(path)
    client = nbclient.NotebookClient(notebook, timeout=300, km=manager, resources={"metadata": {"path": folder}})
    client.execute(cleanup_kc=False)
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    assert sum("image/png" in output.get("data", {}) for output in outputs) >= 2
    assert not [output for output in outputs if output.get("name") == "stderr"]


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
