"""Tunnels and gate of a dataset, from its attributes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray


def tunnels(dataset: xr.Dataset) -> NDArray[np.float64]:
    """Tunnels of a dataset, (n, 4) float64: x and y of the axis, outer and inner radius [m]."""
    names = ("tunnel_x", "tunnel_axis_depth", "tunnel_outer_radius", "tunnel_inner_radius")
    missing = [name for name in names if name not in dataset.attrs]
    if missing:
        raise ValueError(f"dataset: attributes {', '.join(missing)} must be there, got none; read it from a run")
    x, depth, outer, inner = (np.atleast_1d(dataset.attrs[name]).astype(float) for name in names)
    return np.column_stack([x, -depth, outer, inner])


def gate_diameter(dataset: xr.Dataset) -> float:
    """Outer diameter D of the tunnel with the gate [m]."""
    return 2 * float(tunnels(dataset)[int(dataset.attrs.get("gate_tunnel", 0)), 2])


def gate_position(mesh: xr.Dataset) -> NDArray[np.float64]:
    """Middle of the gate on the outer face, (x, y) [m]."""
    tunnel = int(mesh.attrs["gate_tunnel"])
    x, depth, radius = (
        float(np.atleast_1d(mesh.attrs[name])[tunnel])
        for name in ("tunnel_x", "tunnel_axis_depth", "tunnel_outer_radius")
    )
    angle = np.radians(float(mesh.attrs["gate_angle"]))
    return np.array([x + radius * np.sin(angle), -depth + radius * np.cos(angle)])
