"""What editors and type checkers see of the packages: names, versions, types, and a script that they accept."""

import importlib
import inspect
import pkgutil
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

import coupling.postprocess

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
PACKAGES = ("mpm", "structure", "coupling")
#: Modules whose plain functions people call in scripts and notebooks.
MODULES = (
    "coupling.runs.run", "coupling.runs.plan", "coupling.runs.memory", "coupling.runs.rerun",
    "coupling.runs.progress_line", "coupling.responses.respond", "coupling.scenes.features", "coupling.scenes.rings",
    "coupling.datasets.reader", "coupling.datasets.additions", "coupling.datasets.theta_grid", "coupling.export",
    "coupling.export.grids", "coupling.figures.ground", "coupling.figures.ring", "coupling.figures.history",
    "coupling.figures.of_run", "coupling.report.page", "structure.theory", "structure.models", "structure.checks",
    *(f"coupling.postprocess.{module.name}" for module in pkgutil.iter_modules(coupling.postprocess.__path__)),
)  # fmt: skip
SCRIPT = """
import coupling
import mpm
import structure
from coupling.datasets import read_response
from coupling.postprocess import at_inflow

reveal_type(coupling.run("quick", out="run"))
reveal_type(coupling.read_run("run"))
reveal_type(coupling.load_scene("quick").gate)
reveal_type(at_inflow(read_response("run"), 50.0))
reveal_type(next(mpm.simulate(coupling.load_scene("quick"))))
reveal_type(structure.lining_model("continuum"))
reveal_type(coupling.__version__)
coupling.run(figures="all")
coupling.run("quick", thread=2)
"""
REVEALED = (
    "xarray.core.dataset.Dataset", "xarray.core.datatree.DataTree", "mpm.scene.Gate | None",
    "xarray.core.dataset.Dataset", "mpm.simulation.Record", "type[structure.lining.LiningModel]", "str",
)  # fmt: skip


@pytest.mark.parametrize("name", PACKAGES)
def test_package_shows_its_names_and_version(name):
    package = importlib.import_module(name)
    assert (ROOT / name / "py.typed").is_file()
    assert set(package.__all__) == set(package._HOMES) <= set(dir(package))
    assert all(getattr(package, public) is not None for public in package.__all__)
    assert package.__version__ == version("gushing") and "__version__" in dir(package)
    # `dir` alone, before anything has been loaded
    code = f"import {name}; print(*dir({name}))"
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True).stdout
    assert set(package.__all__) <= set(shown.split())


@pytest.mark.parametrize("name", MODULES)
def test_plain_functions_say_their_types(name):
    importlib.import_module(name)
    module = sys.modules[name]  # the package's attribute of that name may be the function
    found = {
        key: inspect.signature(function)
        for key, function in vars(module).items()
        if inspect.isfunction(function) and function.__module__ == name and not key.startswith("_")
    }
    bare = [key for key, signature in found.items() if signature.return_annotation is inspect.Signature.empty]
    bare += [
        f"{key}({parameter.name})"
        for key, signature in found.items()
        for parameter in signature.parameters.values()
        if parameter.annotation is inspect.Parameter.empty
    ]
    assert not bare


def test_type_checker_knows_what_functions_return_and_refuses_wrong_arguments(tmp_path):
    pytest.importorskip("mypy", reason="the development group brings it")
    (tmp_path / "script.py").write_text(SCRIPT)
    command = [sys.executable, "-m", "mypy", "--ignore-missing-imports", "--follow-imports=silent"]
    done = subprocess.run(
        [*command, "--cache-dir", str(tmp_path / "cache"), str(tmp_path / "script.py")],
        capture_output=True, text=True, cwd=ROOT, check=False,
    )  # fmt: skip
    lines = [line.split("script.py:")[1] for line in done.stdout.splitlines() if "script.py:" in line]
    revealed = [line.split('Revealed type is "')[1].rstrip('"') for line in lines if "Revealed type" in line]
    assert tuple(revealed) == REVEALED, done.stdout
    errors = [line for line in lines if "error" in line]
    assert len(errors) == 2 and "figures" in errors[0] and "thread" in errors[1], done.stdout
