"""Which package may import which, and what a light import may load."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FORBIDDEN = {
    "mpm": {"structure", "coupling", "verification", "xarray", "matplotlib", "skfem", "h5netcdf"},
    "structure": {"mpm", "coupling", "verification"},
    "coupling": {"verification"},
    "verification": {"tests", "examples"},
}
#: Rooms of `coupling`: each imports only itself and those before it; the command line is last.
ROOMS = (
    "refused", "scenes", "files", "datasets", "postprocess", "responses", "measurements", "figures", "export", "runs",
    "studies", "fits", "report", "commands", "cli",
)  # fmt: skip
#: The same of `verification`.
MEASURING = (
    "small_event", "synthetic_run", "pages", "child", "boxes", "driven", "monitor", "loads", "problems", "accuracy",
    "sensitivity", "stability", "speed", "robustness", "reports", "published", "commands",
)  # fmt: skip
ORDERS = [("coupling", room) for room in ROOMS] + [("verification", room) for room in MEASURING]
HEAVY = (
    "numba", "xarray", "matplotlib", "scipy", "gmsh", "skfem", "pint", "dask", "distributed", "h5py", "meshio",
    "sklearn",
)  # fmt: skip


def imported(path: Path, executed: bool = False) -> set[str]:
    """Modules a file imports anywhere, inside functions and by name too; `executed`: not for its annotations alone."""
    names, nodes = set(), list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
    if executed:
        typed = [node for node in nodes if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test)]
        nodes = [node for node in nodes if not any(node in ast.walk(block) for block in typed)]
    for node in nodes:
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import, write it in full"
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
        elif isinstance(node, ast.Call) and getattr(node.func, "attr", getattr(node.func, "id", "")) == "import_module":
            names |= {str(a.value) for a in node.args if isinstance(a, ast.Constant)}
    return names


@pytest.mark.parametrize("package", FORBIDDEN)
def test_import_directions(package):
    files = sorted((ROOT / package).rglob("*.py"))
    assert files
    wrong = {
        str(path.relative_to(ROOT)): {name.partition(".")[0] for name in imported(path)} & FORBIDDEN[package]
        for path in files
    }
    assert not {path: names for path, names in wrong.items() if names}


@pytest.mark.parametrize(("package", "room"), ORDERS)
def test_rooms_import_only_those_before_them(package, room):
    place, order = ROOT / package / room, [name for of, name in ORDERS if of == package]
    files = sorted(place.rglob("*.py")) or [place.with_suffix(".py")]
    later = {f"{package}.{name}" for name in order[order.index(room) + 1 :]}
    wrong = {path.name: later & {".".join(name.split(".")[:2]) for name in imported(path)} for path in files}
    assert not {path: names for path, names in wrong.items() if names}


@pytest.mark.parametrize("package", ["coupling", "verification"])
def test_every_module_is_in_a_room(package):
    found = (ROOT / package).iterdir()
    there = {path.stem for path in found if path.suffix == ".py" or (path / "__init__.py").exists()}
    assert there - {"__init__"} == {room for of, room in ORDERS if of == package}


@pytest.mark.parametrize(
    "code",
    [
        "import mpm",
        "import structure",
        "import coupling",
        "import verification.commands",
        "from typer.testing import CliRunner; import coupling.cli as c; "
        "import sys; sys.argv = ['gush', '--help']\ntry: c.main()\nexcept SystemExit as e: assert not e.code",
    ],
    ids=["mpm", "structure", "coupling", "verification", "gush --help"],
)
def test_light_imports_load_no_heavy_library(code):
    check = f"\nimport sys\nprint('HEAVY', *[name for name in {HEAVY!r} if name in sys.modules])"
    result = subprocess.run([sys.executable, "-c", code + check], capture_output=True, text=True, cwd=ROOT, check=True)
    assert result.stdout.splitlines()[-1].split() == ["HEAVY"]
