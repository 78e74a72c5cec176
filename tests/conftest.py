"""Scenes and meshes shared by the tests: built once, changed never."""

import pytest
from browser import Browser, find_browser

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
    return build_mesh(quick_scene.mpm)


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
