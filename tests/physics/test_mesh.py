"""Crossed quadrilaterals fit the ground, the lining and the gate, and no triangle is a sliver."""

import math
import time
from dataclasses import fields
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import coupling
from mpm.memory import estimated_elements
from mpm.mesh import CHANNEL, HEADROOM, INTERIOR, SOIL, Mesh, MeshError, altitudes, angles, areas
from mpm.mesh.build import build_mesh
from mpm.mesh.sizes import element_size
from mpm.scene import Scene
from mpm.time_step.levels import element_levels

# Coordinates up to 60 m in double precision: a few units in the last place.
ROUND_OFF = 1e-12


def changed(scene, **changes) -> Scene:
    """The scene with other tables."""
    data = scene.model_dump(exclude={"ring", "limits"})
    for key, value in changes.items():
        data[key] = {**data[key], **value} if isinstance(value, dict) and isinstance(data[key], dict) else value
    return Scene(**data)


def polygon_area(points) -> float:
    x, y = points.T
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))


def edges_of(mesh) -> set[tuple[int, int]]:
    pairs = np.concatenate([mesh.elements[:, [i, (i + 1) % 3]] for i in range(3)])
    return {(min(a, b), max(a, b)) for a, b in pairs.tolist()}


def gate_axes(angle):
    a = math.radians(angle)
    return np.array([math.sin(a), math.cos(a)]), np.array([math.cos(a), -math.sin(a)])


def same(a, b) -> bool:
    """Equal arrays; tuples of arrays member by member."""
    if isinstance(a, tuple):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    return np.array_equal(a, b, equal_nan=True) if np.asarray(a).dtype.kind == "f" else np.array_equal(a, b)


def check_cells(mesh):
    """Four triangles a cell around a centre of its own on both diagonals; every inner edge is that of two elements."""
    four = mesh.elements.reshape(-1, 4, 3)
    corners, centre = four[:, :, 0], four[:, 0, 2]
    np.testing.assert_array_equal(mesh.cells, corners)
    np.testing.assert_array_equal(four[:, :, 1], np.roll(corners, -1, axis=1))
    np.testing.assert_array_equal(four[:, :, 2], np.repeat(centre[:, None], 4, axis=1))
    assert len(np.unique(centre)) == len(centre) and not np.isin(centre, corners).any()
    assert len(np.unique(mesh.elements)) == len(mesh.nodes)
    assert areas(mesh.nodes, mesh.elements).min() > 0
    for a in (0, 1):
        first, second = mesh.nodes[corners[:, a]], mesh.nodes[corners[:, a + 2]]
        along, aside = second - first, mesh.nodes[centre] - first
        off = np.abs(along[:, 0] * aside[:, 1] - along[:, 1] * aside[:, 0]) / (along**2).sum(axis=1)
        assert off.max() < 1e-9
    assert all(len(set(cell)) == 1 for cell in mesh.region.reshape(-1, 4).tolist())
    pairs = np.sort(np.concatenate([mesh.elements[:, [i, (i + 1) % 3]] for i in range(3)]), axis=1)
    edges, count = np.unique(pairs, axis=0, return_counts=True)
    assert count.max() == 2
    boundary = edges[count == 1]
    # Every node of the boundary has two of its edges, but for a corner where two boundaries touch.
    assert set(np.unique(boundary, return_counts=True)[1]) <= {2, 4}
    return boundary


def lowest(scene, mesh) -> float:
    """Smallest altitude over the cell size asked for there."""
    place = mesh.nodes[mesh.elements].mean(axis=1)
    return float((altitudes(mesh.nodes, mesh.elements) / element_size(scene, *place.T)).min())


def test_every_cell_is_crossed_by_its_diagonals(quick_mesh):
    check_cells(quick_mesh)


def test_boundary_is_that_of_box_and_lining_and_nothing_else(quick_scene, quick_mesh):
    mesh, tunnel = quick_mesh, quick_scene.tunnels[0]
    middle = mesh.nodes[check_cells(mesh)].mean(axis=1)
    radius = np.hypot(middle[:, 0] - tunnel.x, middle[:, 1] + tunnel.axis_depth)
    sides = [abs(middle[:, 0] - x) < 1e-9 for x in (-50.0, 50.0)]
    sides += [abs(middle[:, 1] - y) < 1e-9 for y in (-50.0, mesh.nodes[:, 1].max())]
    lining = (radius > 0.98 * tunnel.inner_radius) & (radius < tunnel.outer_radius)
    assert np.any([*sides, lining], axis=0).all()


def test_triangles_are_counter_clockwise_and_fill_every_region(quick_scene, quick_mesh):
    scene, mesh = quick_scene, quick_mesh
    area = areas(mesh.nodes, mesh.elements)
    assert area.min() > 0
    by_region = {region: area[mesh.region == region].sum() for region in (SOIL, CHANNEL, INTERIOR, HEADROOM)}
    box = scene.box
    ring = polygon_area(mesh.nodes[mesh.outer_nodes[0]])
    assert by_region[SOIL] == pytest.approx(box.width * box.depth - ring, rel=ROUND_OFF)
    assert by_region[HEADROOM] == pytest.approx(box.width * scene.discretisation.element_size, rel=ROUND_OFF)
    corners = np.concatenate([[mesh.corner_nodes[0]], mesh.opening_nodes, [mesh.corner_nodes[1]]])
    inner_corners = [wall[-1] for wall in (mesh.wall_nodes[mesh.wall_side == -1], mesh.wall_nodes[mesh.wall_side == 1])]
    channel = np.concatenate([corners, [inner_corners[0]], mesh.inner_opening_nodes[::-1], [inner_corners[1]]])
    assert by_region[CHANNEL] == pytest.approx(polygon_area(mesh.nodes[channel]), rel=1e-10)
    face = np.concatenate([[inner_corners[1]], mesh.inner_opening_nodes, [inner_corners[0]], mesh.inner_nodes])
    assert by_region[INTERIOR] == pytest.approx(polygon_area(mesh.nodes[face]), rel=1e-10)


def test_lining_nodes_lie_on_the_circles_at_their_angles(quick_scene, quick_mesh):
    mesh, tunnel = quick_mesh, quick_scene.tunnels[0]
    nodes, theta = mesh.outer_nodes[0], np.radians(mesh.outer_theta[0])
    axis = np.array([tunnel.x, -tunnel.axis_depth])
    direction = np.column_stack([np.sin(theta), np.cos(theta)])
    np.testing.assert_allclose(mesh.nodes[nodes] - axis, tunnel.outer_radius * direction, atol=1e-12 * 60)
    assert np.all(np.diff(mesh.outer_theta[0]) > 0)
    radius = np.hypot(*(mesh.nodes[mesh.inner_nodes] - axis).T)
    np.testing.assert_allclose(radius, tunnel.inner_radius, rtol=ROUND_OFF * 30)


def test_faces_and_walls_are_mesh_edges(quick_mesh):
    mesh, edges = quick_mesh, edges_of(quick_mesh)
    outer = mesh.outer_nodes[0].tolist()
    chains = [[*outer, outer[0]]]
    for corner, side in zip(mesh.corner_nodes, mesh.corner_side, strict=True):
        chains.append([int(corner), *mesh.wall_nodes[mesh.wall_side == side].tolist()])
    for chain in chains:
        assert all((min(a, b), max(a, b)) in edges for a, b in pairwise(chain))


def test_gate_corners_and_walls_are_a_strip_of_the_gate_width(quick_scene, quick_mesh):
    scene, mesh = quick_scene, quick_mesh
    tunnel, width = scene.tunnels[0], scene.gate.width
    _, tangent = gate_axes(scene.gate.angle)
    axis = np.array([tunnel.x, -tunnel.axis_depth])
    across = (mesh.nodes - axis) @ tangent
    np.testing.assert_allclose(across[mesh.corner_nodes], [-width / 2, width / 2], atol=1e-13 * 60)
    np.testing.assert_allclose(across[mesh.wall_nodes], -mesh.wall_side * width / 2, atol=1e-13 * 60)
    assert np.all(np.diff(across[mesh.opening_nodes]) > 0) or len(mesh.opening_nodes) == 1
    assert len(mesh.opening_nodes) == scene.discretisation.elements_across_gate - 1
    assert set(mesh.opening_nodes) | set(mesh.corner_nodes) <= set(mesh.outer_nodes[0])


def test_tributary_arcs_are_symmetric_about_the_gate(quick_scene, quick_mesh):
    offset = (quick_mesh.outer_theta[0] - quick_scene.gate.angle + 180) % 360 - 180
    clockwise, counter_clockwise = np.sort(offset[offset > 1e-9]), np.sort(-offset[offset < -1e-9])
    # The node opposite the gate is at -180 only. The rest: to the error of the integration that places the nodes.
    np.testing.assert_allclose(counter_clockwise[:-1], clockwise, rtol=1e-5)
    assert counter_clockwise[-1] == pytest.approx(180)


def test_box_sides_hold_the_nodes_of_the_box_sides(quick_scene, quick_mesh):
    scene, mesh = quick_scene, quick_mesh
    x, y = mesh.nodes.T
    half, top = scene.box.width / 2, scene.discretisation.element_size
    assert set(mesh.left) == set(np.flatnonzero(x == -half)) and set(mesh.right) == set(np.flatnonzero(x == half))
    assert set(mesh.bottom) == set(np.flatnonzero(y == -scene.box.depth)) and set(mesh.top) == set(
        np.flatnonzero(y == top)
    )
    assert x.min() == -half and x.max() == half and y.min() == -scene.box.depth and y.max() == top


def test_ground_surface_is_a_mesh_line(quick_mesh):
    height = quick_mesh.nodes[quick_mesh.elements][:, :, 1]
    assert not np.any((height.min(axis=1) < -1e-9) & (height.max(axis=1) > 1e-9))
    assert np.all(height[quick_mesh.region == HEADROOM] >= 0)


def test_size_at_the_gate_follows_the_elements_across_and_grows_linearly(quick_scene):
    scene = quick_scene
    tunnel, d = scene.tunnels[0], scene.discretisation
    at_gate = scene.gate.width / d.elements_across_gate
    size = element_size(scene, tunnel.x + tunnel.outer_radius + np.array([0.0, 1.0, 40.0]), -tunnel.axis_depth)
    np.testing.assert_allclose(size, [at_gate, at_gate + d.size_growth, d.element_size])


def test_quality_reports_the_smallest_altitude(quick_mesh):
    altitude = altitudes(quick_mesh.nodes, quick_mesh.elements)
    quality = quick_mesh.quality
    assert quality["min_altitude"] == altitude.min()
    assert (quality["n_nodes"], quality["n_elements"]) == (len(quick_mesh.nodes), len(quick_mesh.elements))
    assert quality["min_relative_altitude"] > 0.25
    # a crossed rhombus of 60 degrees at a node of six cells has 30 and 120
    assert quality["min_angle"] > 10 and quality["max_angle"] < 140


@pytest.mark.parametrize("name", ["case-1", "case-2", "case-3", "case-4", "case-5", "case-9", "quick", "twin-tunnels"])
@pytest.mark.slow
def test_built_in_scenes_have_no_flat_triangle_and_the_gate_sets_the_smallest(name):
    scene = coupling.load_scene(name)
    mesh = build_mesh(scene)
    check_cells(mesh)
    assert lowest(scene, mesh) > 0.25
    natural = 0.5 * scene.gate.width / scene.discretisation.elements_across_gate  # of a crossed square
    assert mesh.quality["min_altitude"] > 0.8 * natural


@pytest.mark.slow
def test_meshing_the_largest_case_takes_seconds():
    scene = coupling.load_scene("case-3")
    build_mesh(scene)  # loads what it needs
    begin = time.process_time()
    build_mesh(scene)
    assert time.process_time() - begin < 3.0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["case-1", "case-3", "quick", "twin-tunnels"])
def test_estimated_elements_are_those_of_the_mesh_within_a_fifth(name):
    scene = coupling.load_scene(name)
    computed = len(build_mesh(scene).elements) / (2 if scene.is_half else 1)
    assert estimated_elements(scene) == pytest.approx(computed, rel=0.2)


def test_elements_of_a_cell_are_of_one_level(quick_mesh):
    mesh = quick_mesh
    altitude = altitudes(mesh.nodes, mesh.elements)
    nowhere = np.zeros(len(mesh.nodes), bool)
    level = element_levels(mesh.elements, len(mesh.nodes), altitude, np.ones(len(altitude)), nowhere).reshape(-1, 4)
    assert np.array_equal(level, np.repeat(level[:, :1], 4, axis=1)) and level.max() > 3
    assert (altitude >= 0.5 * altitude.min() * 2.0 ** level.ravel()).all()


def test_altitude_of_a_right_triangle():
    nodes, elements = np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 4.0]]), np.array([[0, 1, 2]])
    assert altitudes(nodes, elements) == pytest.approx([12 / 5])
    np.testing.assert_allclose(np.sort(np.degrees(angles(nodes, elements)[0]))[-1], 90)


def test_mesh_twice_is_the_same_bit_for_bit(quick_scene, quick_mesh):
    again = build_mesh(quick_scene)
    assert all(same(getattr(again, f.name), getattr(quick_mesh, f.name)) for f in fields(Mesh))


def test_mirrored_mesh_is_the_mesh_seen_from_behind(quick_scene, quick_mesh):
    mesh, mirror = quick_mesh, quick_mesh.mirrored()
    np.testing.assert_array_equal(mirror.nodes, mesh.nodes * [-1, 1])
    # the corners of a cell the other way around
    mine, theirs = (areas(m.nodes, m.elements).reshape(-1, 4) for m in (mesh, mirror))
    np.testing.assert_allclose(theirs, mine[:, ::-1], atol=1e-12)
    check_cells(mirror)
    assert mirror.gate_angle == 360 - mesh.gate_angle
    assert np.all(mirror.nodes[mirror.left, 0] == mirror.nodes[:, 0].min())
    tunnel = quick_scene.tunnels[0]
    theta = np.radians(mirror.outer_theta[0])
    assert np.all(np.diff(mirror.outer_theta[0]) > 0)
    np.testing.assert_allclose(
        mirror.nodes[mirror.outer_nodes[0], 0], tunnel.outer_radius * np.sin(theta), atol=1e-12 * 60
    )
    _, tangent = gate_axes(mirror.gate_angle)
    across = (mirror.nodes - [tunnel.x, -tunnel.axis_depth]) @ tangent
    assert across[mirror.corner_nodes[0]] < 0 < across[mirror.corner_nodes[1]]
    assert np.all(np.sign(across[mirror.wall_nodes]) == -mirror.wall_side)


def test_mirrored_twice_is_the_mesh(quick_mesh):
    twice = quick_mesh.mirrored().mirrored()
    # Angles go through 360 - theta twice: one rounding.
    np.testing.assert_allclose(twice.outer_theta[0], quick_mesh.outer_theta[0], atol=1e-12 * 360)
    for f in fields(Mesh):
        assert f.name == "outer_theta" or same(getattr(twice, f.name), getattr(quick_mesh, f.name)), f.name


def test_saved_mesh_loads_as_the_same_mesh(quick_mesh, tmp_path):
    quick_mesh.save(tmp_path / "mesh.vtu")
    loaded = Mesh.load(tmp_path / "mesh.vtu")
    for f in fields(Mesh):
        assert same(getattr(loaded, f.name), getattr(quick_mesh, f.name)), f.name


@pytest.mark.parametrize("content", [None, b"", b"<VTKFile", bytes(range(256))])
def test_unreadable_mesh_file_is_refused_with_its_name(tmp_path, content):
    path = tmp_path / "mesh.vtu"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(MeshError, match=r"mesh\.vtu"):
        Mesh.load(path)


def test_truncated_mesh_file_is_refused(quick_mesh, tmp_path):
    path = tmp_path / "mesh.vtu"
    quick_mesh.save(path)
    path.write_bytes(path.read_bytes()[:-2000])
    with pytest.raises(MeshError, match=r"mesh\.vtu"):
        Mesh.load(path)


def test_sink_ends_at_the_inner_face(quick_scene):
    mesh = build_mesh(changed(quick_scene, interior="sink"))
    assert set(np.unique(mesh.region)) == {SOIL, CHANNEL, HEADROOM} and len(mesh.inner_nodes) == 0


def test_without_gate_there_is_neither_channel_nor_interior(quick_scene):
    mesh = build_mesh(changed(quick_scene, gate=None, stop={"time": 1.0}))
    assert set(np.unique(mesh.region)) == {SOIL, HEADROOM}
    assert len(mesh.corner_nodes) == len(mesh.wall_nodes) == len(mesh.opening_nodes) == 0
    assert {0.0, 90.0, 180.0, 270.0} <= set(mesh.outer_theta[0])


def test_level_ground_without_tunnels_is_a_rectangle(quick_scene):
    mesh = build_mesh(changed(quick_scene, gate=None, tunnels=(), stop={"time": 1.0}))
    area = areas(mesh.nodes, mesh.elements)
    assert area[mesh.region == SOIL].sum() == pytest.approx(100.0 * 50.0, rel=ROUND_OFF)


def test_soil_layer_boundaries_are_mesh_lines_also_where_they_meet_the_lining(quick_scene):
    scene = quick_scene
    layer = scene.soils[0].model_dump()
    depths = (7.3, 22.0)
    mesh = build_mesh(changed(scene, soils=[layer, *({**layer, "top_depth": depth} for depth in depths)]))
    height = mesh.nodes[mesh.elements[mesh.region == SOIL]][:, :, 1]
    for depth in depths:
        across = (height.min(axis=1) < -depth - 1e-9) & (height.max(axis=1) > -depth + 1e-9)
        assert not across.any()


def crossed_levels(mesh, heights):
    """How many elements of the ground cross each of the heights."""
    y = mesh.nodes[mesh.elements[mesh.region == SOIL]][:, :, 1]
    return [int(((y.min(axis=1) < h - 1e-9) & (y.max(axis=1) > h + 1e-9)).sum()) for h in heights]


@pytest.mark.slow
@pytest.mark.parametrize("angle", [0.0, 90.0, 137.0])
@pytest.mark.parametrize("depth", [2.5, 10.0, 22.9, 30.0])
def test_ground_water_table_is_a_mesh_line_interrupted_by_the_lining(quick_scene, angle, depth):
    scene = changed(quick_scene, water={"table_depth": depth}, gate={"angle": angle})
    mesh = build_mesh(scene)
    check_cells(mesh)
    assert crossed_levels(mesh, [-depth]) == [0]
    assert lowest(scene, mesh) > 0.2


@pytest.mark.parametrize("table", [0.5, 7.5, 20.1, 23.3, 26.4])
def test_water_table_beside_another_line_the_gate_or_the_crown_spoils_no_cells(quick_scene, table):
    layer = quick_scene.soils[0].model_dump()
    soils = [layer, {**layer, "top_depth": 7.3}]
    scene = changed(quick_scene, soils=soils, water={"table_depth": table})
    mesh = build_mesh(scene)
    assert lowest(scene, mesh) > 0.2
    assert crossed_levels(mesh, [-7.3]) == [0] and crossed_levels(mesh, [-table])[0] > 0


@pytest.mark.slow
@pytest.mark.parametrize("depths", [(24.4, 26.0), (2.0, 3.5), (10.0, 10.5)])
def test_layers_thinner_than_an_element_have_two_rows_of_cells(quick_scene, depths):
    layer = quick_scene.soils[0].model_dump()
    scene = changed(quick_scene, soils=[layer, *({**layer, "top_depth": depth} for depth in depths)])
    mesh = build_mesh(scene)
    check_cells(mesh)
    assert crossed_levels(mesh, [-depth for depth in depths]) == [0] * len(depths)


def test_layer_through_the_gate_is_refused(quick_scene):
    scene = quick_scene
    layer = scene.soils[0].model_dump()
    soils = [layer, {**layer, "top_depth": scene.tunnels[0].axis_depth + 0.02}]
    with pytest.raises(MeshError, match="gate: must not touch a soil layer boundary"):
        build_mesh(changed(scene, soils=soils))


@pytest.mark.slow
def test_layer_that_leaves_a_sliver_above_the_crown_is_refused_with_its_place(quick_scene):
    scene = quick_scene
    layer = scene.soils[0].model_dump()
    with pytest.raises(MeshError, match=r"flattest near x = .* y = -(20|19.99)"):
        build_mesh(changed(scene, soils=[layer, {**layer, "top_depth": 19.99}]))


def test_twin_tunnels_have_a_ring_of_nodes_each():
    scene = coupling.load_scene("twin-tunnels", discretisation=coupling.load_scene("quick").discretisation.model_dump())
    mesh = build_mesh(scene)
    for tunnel, nodes in zip(scene.tunnels, mesh.outer_nodes, strict=True):
        radius = np.hypot(mesh.nodes[nodes, 0] - tunnel.x, mesh.nodes[nodes, 1] + tunnel.axis_depth)
        np.testing.assert_allclose(radius, tunnel.outer_radius, rtol=1e-13)
    assert len(mesh.corner_nodes) == 2


@pytest.mark.parametrize("gap", [0.3, 2.0])
def test_tunnels_close_to_each_other_can_be_meshed(quick_scene, gap):
    tunnel = quick_scene.tunnels[0].model_dump()
    x = tunnel["outer_diameter"] / 2 + gap / 2
    scene = changed(quick_scene, tunnels=[{**tunnel, "x": -x}, {**tunnel, "x": x}])
    mesh = build_mesh(scene)
    check_cells(mesh)
    assert lowest(scene, mesh) > 0.2 and len(mesh.outer_nodes) == 2


@pytest.mark.parametrize("cover", [0.5, 2.0])
def test_shallow_tunnel_can_be_meshed(quick_scene, cover):
    scene = changed(quick_scene, tunnels=[{**quick_scene.tunnels[0].model_dump(), "cover": cover}])
    mesh = build_mesh(scene)
    check_cells(mesh)
    assert lowest(scene, mesh) > 0.15


COARSE = {"element_size": 4.0, "element_size_lining": 0.8, "element_size_interior": 0.5, "size_growth": 0.4}


@settings(max_examples=25, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    angle=st.one_of(st.sampled_from([0.0, 90.0, 180.0, 270.0]), st.floats(0, 359.9)),
    width=st.floats(math.log(0.005), math.log(1.475)).map(math.exp),
    across=st.integers(2, 12),
    interior=st.sampled_from(["resolved", "sink"]),
    coarse=st.booleans(),
)
@pytest.mark.slow
def test_any_gate_can_be_meshed(quick_scene, angle, width, across, interior, coarse):
    sizes = {"elements_across_gate": across} | (COARSE if coarse else {})
    scene = changed(quick_scene, gate={"angle": angle, "width": width}, discretisation=sizes, interior=interior)
    mesh = build_mesh(scene)
    check_cells(mesh)
    assert lowest(scene, mesh) > 0.15
    d = scene.discretisation
    inside = [d.element_size_interior] if interior == "resolved" else []
    assert mesh.quality["min_altitude"] > 0.3 * min(width / across, d.element_size_lining, *inside)
    assert len(mesh.opening_nodes) == across - 1
    across_gate = (mesh.nodes - [0, -scene.tunnels[0].axis_depth]) @ gate_axes(angle)[1]
    assert np.sign(across_gate[mesh.corner_nodes]).tolist() == [-1, 1]
