"""Two-phase material point method: soil and water around a shield tunnel, and their pressure on its lining."""

_HOME = {
    "Record": "simulation", "simulate": "simulation", "Simulation": "simulation", "RunFailed": "solver",
    "Solver": "solver", "Scene": "scene", "Mesh": "mesh", "build_mesh": "meshing",
}  # fmt: skip
__all__ = sorted(_HOME)


def __getattr__(name):
    """Load a public name where it is used: importing the package alone stays fast."""
    if name not in _HOME:
        raise AttributeError(f"module 'mpm' has no attribute {name!r}")
    import importlib

    return getattr(importlib.import_module(f"mpm.{_HOME[name]}"), name)
