"""From a scene to its mesh, by gmsh."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from mpm.element_size import element_size, headroom_height, size_callback
from mpm.half_model import right_half, with_mirror_image
from mpm.mesh import Mesh, MeshError, altitudes, areas
from mpm.outline import Drawing, Outline, draw_scene
from mpm.scene import Scene

if TYPE_CHECKING:
    from numpy.typing import NDArray

# Smallest altitude over the size asked for at that place; equilateral is 0.87. Flatter triangles would set the time
# step of the whole run while resolving nothing.
MIN_RELATIVE_ALTITUDE = 0.3
# Meshing algorithms of gmsh in the order tried until no triangle is flatter than that: frontal, Delaunay, adaptive.
ALGORITHMS = (6, 5, 1)
# Share of the element size within which a node belongs to the mirror line x = 0 of a half model: those of the strip
# through the gate are relocated by some thousandths.
ON_MIRROR_LINE = 0.02
SYSTEM_PACKAGES = "libglu1-mesa libgl1 libxrender1 libxcursor1 libxft2 libxinerama1 libgomp1"


def build_mesh(scene: Scene) -> Mesh:
    """Mesh a scene, the whole of it: for a half model, of a half and its mirror image.

    Parameters
    ----------
    scene : Scene
        Validated scene.

    Returns
    -------
    Mesh

    Raises
    ------
    MeshError
        When a triangle would be much flatter than the size asked for, or gmsh or its system libraries fail.
    """
    gmsh = _import_gmsh()
    best: tuple[float, Mesh] | None = None
    for algorithm in ALGORITHMS:
        mesh = _mesh_once(scene, gmsh, algorithm)
        if scene.is_half:
            mesh = with_mirror_image(right_half(mesh))
        centre = mesh.nodes[mesh.elements].mean(axis=1)
        relative = altitudes(mesh.nodes, mesh.elements) / element_size(scene, centre[:, 0], centre[:, 1])
        flattest = float(relative.min())
        if best is None or flattest > best[0]:
            best = flattest, mesh
        if flattest >= MIN_RELATIVE_ALTITUDE:
            return mesh
    assert best is not None
    quality = best[1].quality
    raise MeshError(
        f"mesh: the flattest triangle must be at least {MIN_RELATIVE_ALTITUDE:g} element sizes high, got {best[0]:.2g} "
        f"({quality['min_altitude']:.2g} m, flattest near x = {quality['min_altitude_x']:.2f} m, "
        f"y = {quality['min_altitude_y']:.2f} m); keep soil layers, tunnels and box sides further apart or refine there"
    )


def _mesh_once(scene: Scene, gmsh: Any, algorithm: int) -> Mesh:
    """One attempt with one gmsh algorithm."""
    # gmsh is one global session: leave a caller's own session as it was.
    mine = not gmsh.isInitialized()
    if mine:
        gmsh.initialize(interruptible=False, readConfigFiles=False)
    previous = None if mine else gmsh.model.getCurrent()
    name = "gushing scene"
    try:
        for option, value in {
            "General.Terminal": 0,
            "General.NumThreads": 1,
            "Mesh.Algorithm": algorithm,
            "Mesh.MeshSizeExtendFromBoundary": 0,
            "Mesh.MeshSizeFromPoints": 0,
            "Mesh.MeshSizeFromCurvature": 0,
            "Mesh.Optimize": 1,
        }.items():
            gmsh.option.setNumber(option, value)
        gmsh.model.add(name)
        draw, outline, regions, sides = draw_scene(scene, gmsh)
        gmsh.model.mesh.setSizeCallback(size_callback(scene))
        gmsh.model.mesh.generate(2)
        gmsh.model.mesh.optimize("Relocate2D")
        return _extract(scene, gmsh, draw, outline, regions, sides)
    except MeshError:
        raise
    except Exception as error:
        # gmsh raises bare Exception with its last message.
        raise MeshError(f"mesh: gmsh could not mesh the scene ({error}); check distances between its parts") from error
    finally:
        gmsh.model.mesh.removeSizeCallback()
        if mine:
            gmsh.finalize()
        else:
            gmsh.model.setCurrent(name)
            gmsh.model.remove()
            if previous is not None:
                gmsh.model.setCurrent(previous)


def _extract(
    scene: Scene,
    gmsh: Any,
    draw: Drawing,
    outline: Outline,
    regions: dict[int, int],
    sides: dict[str, list[int]],
) -> Mesh:
    """Arrays of the current gmsh mesh, sorted for locality."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    node_of_tag = np.full(int(tags.max()) + 1, -1, dtype=np.int64)
    node_of_tag[tags] = np.arange(len(tags))
    nodes = coordinates.reshape(-1, 3)[:, :2].copy()
    elements, region = [], []
    for surface, kind in regions.items():
        triangles = gmsh.model.mesh.getElementsByType(2, surface)[1].reshape(-1, 3)
        elements.append(node_of_tag[triangles])
        region.append(np.full(len(triangles), kind, dtype=np.int8))
    triangles, kinds = np.concatenate(elements), np.concatenate(region)
    flipped = areas(nodes, triangles) < 0
    triangles[flipped] = triangles[flipped][:, [0, 2, 1]]
    order = np.argsort(_hilbert(nodes[triangles].mean(axis=1)), kind="stable")
    triangles, kinds = triangles[order], kinds[order]
    # Nodes numbered by first use, so that neighbours in space are neighbours in memory; unused ones drop out.
    used, first = np.unique(triangles.ravel(), return_index=True)
    used = used[np.argsort(first)]
    renumber = np.full(len(nodes), -1, dtype=np.int64)
    renumber[used] = np.arange(len(used))
    nodes, triangles = nodes[used], renumber[triangles]

    node_of_point = {tag: int(renumber[node_of_tag[gmsh.model.mesh.getNodes(0, tag)[0][0]]]) for tag in draw.exact}
    for tag, position in draw.exact.items():
        nodes[node_of_point[tag]] = position

    def numbers(points: list[int]) -> NDArray[np.int32]:
        return np.array([node_of_point[tag] for tag in points], dtype=np.int32)

    box: dict[str, NDArray[np.int32]] = {}
    places = {"left": (0, -scene.box.width / 2), "right": (0, scene.box.width / 2)}
    places |= {"bottom": (1, -scene.box.depth), "top": (1, headroom_height(scene))}
    for name, curves in sides.items():
        on_side = np.concatenate([gmsh.model.mesh.getNodes(1, abs(curve), includeBoundary=True)[0] for curve in curves])
        members = np.unique(renumber[node_of_tag[on_side]])
        axis, value = places[name]
        nodes[members, axis] = value
        box[name] = members[np.argsort(nodes[members, 1 - axis])].astype(np.int32)

    if scene.is_half:
        nodes[np.abs(nodes[:, 0]) < ON_MIRROR_LINE * element_size(scene, nodes[:, 0], nodes[:, 1]), 0] = 0.0
    outer_nodes, outer_theta = [], []
    for chain, theta in zip(outline.outer, outline.theta, strict=True):
        angle = np.mod(np.array(theta), 360.0)
        ascending = np.argsort(angle)
        outer_nodes.append(numbers(chain)[ascending])
        outer_theta.append(angle[ascending])
    walls: list[int] = []
    wall_side: list[int] = []
    for side, wall, inner in zip((1, -1), outline.walls, outline.inner_corners, strict=False):
        walls += [*wall, inner]
        wall_side += [side] * (len(wall) + 1)
    return Mesh(
        nodes=np.ascontiguousarray(nodes),
        elements=np.ascontiguousarray(triangles, dtype=np.int32),
        region=kinds,
        outer_nodes=tuple(outer_nodes),
        outer_theta=tuple(outer_theta),
        opening_nodes=numbers(outline.opening),
        corner_nodes=numbers(outline.corners),
        wall_nodes=numbers(walls),
        wall_side=np.array(wall_side, dtype=np.int8),
        corner_side=np.array([1, -1][: len(outline.corners)], dtype=np.int8),
        inner_nodes=numbers(outline.inner),
        inner_opening_nodes=numbers(outline.inner_opening),
        gate_angle=math.nan if scene.gate is None else scene.gate.angle % 360.0,
        **box,
    )


def _hilbert(positions: NDArray[np.float64], bits: int = 16) -> NDArray[np.int64]:
    """Index of each position along a Hilbert curve over their bounding square, shape (n,)."""
    low = positions.min(axis=0)
    scale = (2**bits - 1) / (positions - low).max()
    x, y = ((positions - low) * scale).astype(np.int64).T
    index = np.zeros(len(positions), dtype=np.int64)
    for level in range(bits - 1, -1, -1):
        right, up = (x >> level) & 1, (y >> level) & 1
        index += ((3 * right) ^ up) << (2 * level)
        # Turn the quadrant so that the curve inside it starts where the last one ended (Warren, Hacker's Delight).
        flip = (up == 0) & (right == 1)
        x, y = np.where(flip, ~x, x), np.where(flip, ~y, y)
        swap = up == 0
        x, y = np.where(swap, y, x), np.where(swap, x, y)
    return index


def _import_gmsh() -> Any:
    try:
        import gmsh
    except OSError as error:
        raise MeshError(
            f"meshing needs system libraries that are missing ({error}); "
            f"on Debian or Ubuntu type: sudo apt-get install -y {SYSTEM_PACKAGES}"
        ) from error
    return gmsh
