"""Tunnels and gate of a run: as attributes of its datasets, and read from them again."""

from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from mpm.scene import Scene as MpmScene

NAMES = ("tunnel_x", "tunnel_axis_depth", "tunnel_outer_radius", "tunnel_inner_radius")


class Tunnel(NamedTuple):
    """Axis and radii of a lining [m]."""

    x: float
    y: float
    outer: float
    inner: float

    def at(self, theta: Any, radius: Any) -> tuple[Any, Any]:
        """Positions (x, y) [m] at angles [degree] from the crown, clockwise, and radii [m]."""
        angle = np.radians(theta)
        return self.x + radius * np.sin(angle), self.y + radius * np.cos(angle)

    def distance(self, x: NDArray[np.floating], y: NDArray[np.floating]) -> NDArray[np.floating]:
        """Distances of places from the axis [m]."""
        return np.hypot(x - self.x, y - self.y)


class Gate(NamedTuple):
    """Number of its tunnel, angle of its middle [degree], width [m]; None where the dataset does not say."""

    tunnel: int
    angle: float
    width: float | None


def geometry_attributes(scene: MpmScene) -> dict[str, Any]:
    """Tunnels and gate as attributes [m, degree], for figures that read datasets only."""
    attributes: dict[str, Any] = {}
    if scene.tunnels:
        columns = zip(*((t.x, t.axis_depth, t.outer_radius, t.inner_radius) for t in scene.tunnels), strict=True)
        attributes |= {name: np.array(column) for name, column in zip(NAMES, columns, strict=True)}
    if scene.gate is not None:
        attributes |= {
            "gate_tunnel": np.int64(scene.gate.tunnel),
            "gate_angle": float(scene.gate.angle),
            "gate_width": float(scene.gate.width),
        }
    return attributes


def has_tunnels(dataset: xr.Dataset) -> bool:
    """Whether there is any tunnel in the run."""
    return NAMES[0] in dataset.attrs


def tunnel_list(dataset: xr.Dataset) -> list[Tunnel]:
    """All tunnels by their numbers.

    Raises ValueError: the dataset does not say.
    """
    missing = [name for name in NAMES if name not in dataset.attrs]
    if missing:
        raise ValueError(f"dataset: attributes {', '.join(missing)} must be there, got none; read it from a run")
    columns = zip(*(np.atleast_1d(dataset.attrs[name]).astype(float).tolist() for name in NAMES), strict=True)
    return [Tunnel(x, -depth, outer, inner) for x, depth, outer, inner in columns]


def tunnel_of(dataset: xr.Dataset, number: int | None = None) -> Tunnel:
    """A tunnel by its number; None: the one with the gate."""
    return tunnel_list(dataset)[gate_tunnel(dataset) if number is None else number]


def gate_of(dataset: xr.Dataset) -> Gate | None:
    """The gate; None without one."""
    attributes = dataset.attrs
    if "gate_angle" not in attributes:
        return None
    width = float(attributes["gate_width"]) if "gate_width" in attributes else None
    return Gate(gate_tunnel(dataset), float(attributes["gate_angle"]), width)


def gate_tunnel(dataset: xr.Dataset) -> int:
    """Number of the tunnel with the gate, 0 without one."""
    return int(dataset.attrs.get("gate_tunnel", 0))


def on_tunnel(dataset: xr.Dataset, number: int | None = None) -> xr.Dataset:
    """What a dataset over tunnels holds of one; None: of the one with the gate. That of a single tunnel as it is."""
    if "tunnel" not in dataset.dims:
        return dataset
    return dataset.isel(tunnel=gate_tunnel(dataset) if number is None else number, drop=True)


def tunnels_beside(dataset: xr.Dataset) -> list[int]:
    """Numbers of the tunnels without the gate in a dataset over tunnels."""
    return [k for k in range(dataset.sizes.get("tunnel", 1)) if k != gate_tunnel(dataset)]


def joints_of(response: xr.Dataset) -> NDArray[np.float64]:
    """Angles of a response's joints [degree], none without joints."""
    return response["joint_angle"].values if response.sizes.get("joint") else np.array([])


def tunnels(dataset: xr.Dataset) -> NDArray[np.float64]:
    """Tunnels of a dataset, (n, 4) float64: x and y of the axis, outer and inner radius [m]."""
    return np.array(tunnel_list(dataset), float)


def gate_diameter(dataset: xr.Dataset) -> float:
    """Outer diameter D of the tunnel with the gate [m]."""
    return 2 * tunnel_of(dataset).outer


def gate_position(dataset: xr.Dataset) -> NDArray[np.float64]:
    """Middle of the gate on the outer face, (x, y) [m]."""
    tunnel = tunnel_of(dataset)
    return np.array(tunnel.at(float(dataset.attrs["gate_angle"]), tunnel.outer))
