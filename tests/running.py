"""Commands in this process, and runs whose simulation is replaced by made records."""

from types import SimpleNamespace

from typer.testing import CliRunner

import mpm
from coupling.cli import app
from verification.synthetic_run import TwoTriangles, record


def gush(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


class Bare:
    """A mesh for runs that are not simulated."""

    def __init__(self):
        self.nodes, self.elements, self.region = TwoTriangles.nodes, TwoTriangles.elements, TwoTriangles.region
        self.quality = {"n_elements": 2}

    def save(self, path):
        path.write_text("<mesh/>")


def without_simulation(monkeypatch):
    """Replaces meshing and simulation by synthetic records; `ending` is what is raised after them."""
    state = SimpleNamespace(ending=None)

    class Simulation:
        def __init__(self, scene, mesh, threads, progress):
            self.count, self.done, self.progress, self.unborne_shear = 0, False, progress, 0.0

        def begin(self):
            return self.advance(None)

        def advance(self, pause):
            k, self.count = self.count, self.count + 1
            self.progress({"stage": "gush", "time": 0.1 * k, "inflow_mass": 30.0 * k, "dt": 1e-4, "step": k,
                           "dt_limit": "acoustic", "point_steps_per_second": 5e6, "share": 0.3 * k})  # fmt: skip
            if k == 3:
                raise state.ending
            self.done = k == 2 and state.ending is None
            return record(0.1 * k, snapshot=k != 1)

        def state(self):
            return {"step_count": self.count}

    monkeypatch.setitem(vars(mpm), "Simulation", Simulation)
    monkeypatch.setitem(vars(mpm), "build_mesh", lambda scene: Bare())
    return state
