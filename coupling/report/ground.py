"""Pictures of the ground that the page draws itself: points around the tunnel at some times, the mesh, a section."""

import numpy as np

from coupling.datasets.geometry import Tunnel, gate_of, has_tunnels, tunnel_list, tunnel_of
from coupling.report.packing import evenly, quantised
from mpm.mesh import altitudes, angles

BYTES_OF_FIELDS = 1.7e6  # of all snapshots, before they are compressed
MOST_SNAPSHOTS = 12
MOST_ELEMENTS = 30_000
VIEW_RADII = 3.0  # half the width of the view, in outer radii
COLOURS = 32
NEIGHBOURS = 1.35  # how much larger points are drawn when some are left out


def point_fields(points):
    """Scalars that are drawn on the points of one time.

    Returns a dict: name: (label, unit, values (n,), colour map, "log" or "linear").
    """
    data = {name: points[name].values.astype(float) for name in points.data_vars if points[name].dims == ("point",)}
    known = {
        "displacement": (
            "displacement", "mm", lambda: 1e3 * np.hypot(data["displacement_x"], data["displacement_y"]),
            "viridis", (1.0, 1000.0),
        ),
        # a negative value stands for water that is missing: it carries nothing
        "pore_pressure": ("pore pressure", "kPa", lambda: np.maximum(data["pore_pressure"], 0) / 1e3, "YlGnBu", None),
        "porosity": ("porosity", "-", lambda: data["porosity"], "YlOrBr", None),
        "deviatoric_strain": (
            "deviatoric strain", "-", lambda: data["deviatoric_strain"], "magma_r", (1e-3, 1.0),
        ),
        "vertical_stress": ("vertical effective stress", "kPa", lambda: -data["stress_yy"] / 1e3, "cividis", None),
        "speed": (
            "speed of the grains", "m/s", lambda: np.hypot(data["velocity_solid_x"], data["velocity_solid_y"]),
            "plasma", (1e-2, 10.0),
        ),
    }  # fmt: skip
    needs = {"displacement": "displacement_x", "vertical_stress": "stress_yy", "speed": "velocity_solid_x"}
    fields = {}
    for name, (label, unit, values, colours, log_range) in known.items():
        if needs.get(name, name) in data:
            fields[name] = {"label": label, "unit": unit, "values": values(), "colours": colours, "range": log_range}
    return fields


def field_snapshots(points, budget=BYTES_OF_FIELDS):
    """Snapshots of the points near the tunnel, small enough for a page.

    points : xarray.Dataset, `/points` of a run;  budget : float, bytes at most.

    Returns dict or None: view: {x, y, half} [m]; fields: name to {label, unit, low, high, log, colours}; snapshots:
    list of {time, present, drawn, x, y, side, <field> ..}: x and y as 65535ths of the view's width, side (of a square
    with the point's area) as 255ths of `largest_side`, a field as 255ths of its range. None without snapshots.
    """
    if "x" not in points or not points.sizes.get("time"):
        return None
    view = _view(points)
    kept = evenly(points.sizes["time"], MOST_SNAPSHOTS)
    near = [_near(points.isel(time=int(k)), view) for k in kept]
    fields = [point_fields(snapshot) for snapshot in near]
    scales = {name: _scale(name, [f[name] for f in fields]) for name in fields[0]}
    most = int(budget / len(kept) / (5 + len(scales)))
    largest = max(float(np.sqrt(snapshot["volume"].max())) for snapshot in near)
    return {
        "view": view,
        "largest_side": largest,
        "fields": scales,
        "snapshots": [_snapshot(n, f, scales, view, largest, most) for n, f in zip(near, fields, strict=True)],
        "available": int(points.sizes["time"]),
    }


def _view(points):
    if has_tunnels(points):
        tunnel = tunnel_of(points)
        return {"x": tunnel.x, "y": tunnel.y, "half": VIEW_RADII * tunnel.outer}
    extent = [(float(points[name].min()), float(points[name].max())) for name in ("x", "y")]
    middle = [0.5 * (low + high) for low, high in extent]
    return {"x": middle[0], "y": middle[1], "half": max(0.52 * (high - low) for low, high in extent) or 1.0}


def _near(snapshot, view):
    """Points of one time inside the view, the largest first, so that small ones are drawn on top."""
    x, y, half = snapshot["x"].values, snapshot["y"].values, view["half"]
    inside = np.flatnonzero((np.abs(x - view["x"]) < half) & (np.abs(y - view["y"]) < half))
    order = np.argsort(-snapshot["volume"].values[inside], kind="stable")
    return snapshot.isel(point=inside[order])


def _scale(name, fields):
    """One range of values for all times, so that colours can be compared through time."""
    first = fields[0]
    if first["range"] is not None:
        low, high = first["range"]
    else:
        values = np.concatenate([field["values"] for field in fields])
        low = 0.0 if name != "porosity" else float(np.nanmin(values))
        high = max(float(np.nanpercentile(values, 99.5)), low + 1e-6)
    return {
        "label": first["label"],
        "unit": first["unit"],
        "low": low,
        "high": high,
        "log": first["range"] is not None,
        "colours": _colour_stops(first["colours"]),
    }


def _colour_stops(name):
    import matplotlib

    return [[int(c) for c in rgba[:3]] for rgba in matplotlib.colormaps[name](np.linspace(0, 1, COLOURS), bytes=True)]


def scaled(values, scale):
    """Values as 255ths of a scale, logarithmic where it says so: (n,) uint8."""
    if scale["log"]:
        with np.errstate(divide="ignore", invalid="ignore"):
            logarithm = np.maximum(np.log10(values), np.log10(scale["low"]))
        return quantised(logarithm, np.log10(scale["low"]), np.log10(scale["high"]))
    return quantised(values, scale["low"], scale["high"])


def _snapshot(near, fields, scales, view, largest, most):
    count = near.sizes["point"]
    drawn = evenly(count, most)
    # fewer points are drawn larger, so that they still cover the ground, also where two neighbours are left out
    spread = 1.0 if len(drawn) == count else NEIGHBOURS * np.sqrt(count / max(len(drawn), 1))
    left, bottom, width = view["x"] - view["half"], view["y"] - view["half"], 2 * view["half"]
    side = np.sqrt(near["volume"].values[drawn])
    return {
        "time": float(near["time"]),
        "present": count,
        "drawn": len(drawn),
        "spread": float(spread),
        "x": quantised(near["x"].values[drawn], left, left + width, "u2"),
        "y": quantised(near["y"].values[drawn], bottom, bottom + width, "u2"),
        "side": quantised(side, 0.0, largest),
        **{name: scaled(fields[name]["values"][drawn], scale) for name, scale in scales.items()},
    }


def mesh_picture(mesh):
    """Nodes and triangles for the page, and what the mesh is made of.

    Returns a dict: elements, nodes (count of all); min_altitude [m]; min_angle [degree]; x, y (n_nodes,), corners (n,
    3), region (n,); whole: False where only triangles near the tunnel are kept.
    """
    x, y = mesh["x"].values, mesh["y"].values
    corners, region = mesh["element_nodes"].values, mesh["region"].values
    nodes = np.stack([x, y], axis=1)
    whole = len(corners) <= MOST_ELEMENTS
    kept = np.arange(len(corners)) if whole else _nearest_elements(mesh, corners)
    used, renumbered = np.unique(corners[kept], return_inverse=True)
    return {
        "elements": len(corners),
        "nodes": len(x),
        "min_altitude": float(altitudes(nodes, corners).min()),
        "min_angle": float(np.degrees(angles(nodes, corners)).min()),
        "whole": whole,
        "x": x[used],
        "y": y[used],
        "corners": renumbered.reshape(-1, 3).astype("u4" if len(used) > 65535 else "u2"),
        "region": region[kept].astype("u1"),
    }


def _nearest_elements(mesh, corners):
    tunnel = tunnel_of(mesh) if has_tunnels(mesh) else Tunnel(0.0, 0.0, 0.0, 0.0)
    distance = tunnel.distance(mesh["x"].values[corners].mean(axis=1), mesh["y"].values[corners].mean(axis=1))
    return np.sort(np.argsort(distance, kind="stable")[:MOST_ELEMENTS])


def section(scene, lining):
    """What the page needs to draw the ground in section.

    scene : coupling.Scene or None;  lining : xarray.Dataset, `/lining`, whose attributes are tunnels and gate.

    Returns a dict: tunnels: list of {x, y, outer, inner} [m]; gate: {tunnel, angle [degree], width [m]} or None; box:
    {width, depth} or None; water_table: depth [m] or None; soils: list of {name, top}.
    """
    gate = gate_of(lining)
    return {
        "tunnels": [tunnel._asdict() for tunnel in (tunnel_list(lining) if has_tunnels(lining) else ())],
        "gate": None if gate is None else gate._asdict(),
        "box": None if scene is None else {"width": scene.box.width, "depth": scene.box.depth},
        "water_table": None if scene is None or scene.water is None else scene.water.table_depth,
        "soils": [] if scene is None else [{"name": s.name, "top": s.top_depth} for s in scene.soils],
    }
