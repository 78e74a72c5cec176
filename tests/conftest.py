"""Scenes, meshes and events shared by the tests: built once, changed never."""

import os
import sys
from pathlib import Path

# Where Python is told to keep no bytecode, as in images of containers, each of the many processes that tests start
# would compile all libraries anew, for seconds. This comes before they are imported.
if os.environ.pop("PYTHONDONTWRITEBYTECODE", ""):
    os.environ["PYTHONPYCACHEPREFIX"] = sys.pycache_prefix = str(Path(__file__).parents[1] / ".pytest_cache/bytecode")
    sys.dont_write_bytecode = False

# Two processes for two cores: with threads of its own the linear algebra of each would wait, at full load, for the
# other's. Read when numpy is loaded, here and in the processes that tests start.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pickle

import filelock
import pytest
import xarray as xr
from browser import Browser, find_browser
from matplotlib.figure import Figure
from report_study import write_study
from running import without_simulation

import coupling
import mpm
from mpm.mesh import Mesh
from mpm.mesh.build import build_mesh


@pytest.fixture(scope="session")
def quick_scene() -> coupling.Scene:
    """The built-in coarse scene."""
    return coupling.load_scene("quick")


@pytest.fixture(scope="session")
def quick_mesh(quick_scene: coupling.Scene) -> Mesh:
    """Its mesh, a few thousand triangles."""
    return build_mesh(quick_scene)


@pytest.fixture(scope="session")
def once(tmp_path_factory, worker_id):
    """Calls a function, of which all processes of the tests share what it returns, by a name."""
    folder = tmp_path_factory.getbasetemp()
    folder = folder if worker_id == "master" else folder.parent

    def made(name, make):
        file = folder / f"{name}.pickle"
        with filelock.FileLock(f"{file}.lock"):
            if not file.exists():
                file.write_bytes(pickle.dumps(make()))
        return pickle.loads(file.read_bytes())

    return made


@pytest.fixture(scope="session")
def simulated_event(once, quick_scene):
    """The scene `quick` to its end: records, each with `done` and `unborne_shear` of the simulation; the last state."""

    def simulated():
        simulation = mpm.Simulation(quick_scene)
        told = [(simulation.begin(), simulation.done, simulation.unborne_shear)]
        while not simulation.done:
            told.append((simulation.advance(), simulation.done, simulation.unborne_shear))
        return told, simulation.state()

    return once("quick", simulated)


@pytest.fixture(scope="session")
def event(simulated_event, quick_scene):
    """The scene `quick`, and its records."""
    return quick_scene, [record for record, *_ in simulated_event[0]]


@pytest.fixture(scope="session")
def gates(once, tmp_path_factory):
    """Folder of the study of two gates and two soils, answered by both lining models; to be copied."""
    with pytest.MonkeyPatch.context() as patch:
        return once("gates", lambda: write_study(tmp_path_factory.mktemp("gates"), patch))


@pytest.fixture(scope="module")
def browser():
    """A headless browser; tests that need it are skipped where there is none."""
    if find_browser() is None:
        pytest.skip("no Chromium on this machine; Debian: apt-get install chromium-headless-shell")
    with Browser(find_browser()) as opened:
        yield opened


@pytest.fixture
def opened(report, browser):
    """The browser with the page of the module's fixture `report`, fresh."""
    browser.complaints.clear()
    browser.requests.clear()
    browser.resize(1366, 768)
    browser.open(report)
    yield browser
    assert browser.complaints == []


@pytest.fixture
def undrawn(monkeypatch):
    """Figures are made, and their files stay empty: for tests of what else a command does."""
    monkeypatch.setattr(Figure, "savefig", lambda figure, path, **options: Path(path).touch())


@pytest.fixture
def simulated(monkeypatch):
    """Replaces meshing and simulation by made records; `ending` is what is raised after them."""
    return without_simulation(monkeypatch)


@pytest.fixture
def written(tmp_path):
    """A file by another program: three times, inflow and gate, the ring as an attribute."""
    from rings import case_3_pressures as pressures
    from rings import case_3_ring as ring

    base = pressures().isel(time=0, drop=True)
    times = xr.DataArray([0.0, 1.0, 2.0], dims="time", attrs={"units": "s"})
    loads = base.map(lambda part: part * (1 - 0.1 * times)).transpose("time", "theta").assign_coords(time=times)
    loads["inflow_mass"] = ("time", [0.0, 50.0, 100.0])
    loads.attrs = {"ring": ring().model_dump_json(), "gate_angle": 90.0, "gate_width": 0.2}
    file = tmp_path / "mine.nc"
    loads.to_netcdf(file, engine="h5netcdf")
    return file
