"""The mesh: its outline, the cells between its lines, their sizes, and the half of a symmetric one."""

from mpm.mesh.mesh import CHANNEL, HEADROOM, INTERIOR, SOIL, Mesh, MeshError, altitudes, angles, areas

__all__ = ["CHANNEL", "HEADROOM", "INTERIOR", "SOIL", "Mesh", "MeshError", "altitudes", "angles", "areas"]
