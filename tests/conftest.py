"""Scenes and meshes shared by the tests: built once, changed never."""

import pytest

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
