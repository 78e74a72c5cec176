"""Scenes and meshes shared by the tests: built once, changed never."""

import pytest
import xarray as xr
from browser import Browser, find_browser
from running import without_simulation

import coupling
from mpm.mesh import Mesh
from mpm.meshing import build_mesh


@pytest.fixture(scope="session")
def quick_scene() -> coupling.Scene:
    """The built-in coarse scene."""
    return coupling.load_scene("quick")


@pytest.fixture(scope="session")
def quick_mesh(quick_scene: coupling.Scene) -> Mesh:
    """Its mesh, a few thousand triangles."""
    return build_mesh(quick_scene)


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
