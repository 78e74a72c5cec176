"""One version, one licence, wherever they are stated; scripts/check_release.sh checks what a release holds."""

import os
import re
import shutil
import subprocess
import tomllib
from importlib.metadata import distribution, version
from pathlib import Path

import pytest
from typer.testing import CliRunner

from coupling.cli import app

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
CITATION = (ROOT / "CITATION.cff").read_text(encoding="utf-8")


def test_version_is_the_same_everywhere():
    result = CliRunner().invoke(app, ["--version"])
    assert (result.exit_code, result.output) == (0, f"gush {PROJECT['version']}\n")
    assert version(PROJECT["name"]) == PROJECT["version"]
    assert re.search(r"^version: (.*)$", CITATION, re.MULTILINE)[1] == PROJECT["version"]


def test_licence_is_the_same_everywhere():
    assert (ROOT / "LICENSE").read_text(encoding="utf-8").startswith(f"{PROJECT['license']} License")
    assert re.search(r"^license: (.*)$", CITATION, re.MULTILINE)[1] == PROJECT["license"]


def test_citation_file_names_the_study_that_is_reproduced():
    # the schema's required keys (citation-file-format 1.2.0), and the article
    for key in ("cff-version: 1.2.0", "message:", "title:", "authors:"):
        assert re.search(f"^{key}", CITATION, re.MULTILINE), key
    assert "water-soil gushing" in CITATION


def test_every_dependency_has_a_lower_bound():
    assert all(">=" in dependency for dependency in PROJECT["dependencies"])


def test_what_runs_takes_less_than_700_megabytes():
    """Installed files of the program and all that it depends on, without bytecode."""
    requirements = pytest.importorskip("packaging.requirements")
    sizes = {}

    def add(name, extras=()):
        found = distribution(name)
        if found.name in sizes:
            return
        files = [Path(found.locate_file(file)) for file in found.files or ()]
        sizes[found.name] = sum(file.stat().st_size for file in files if file.suffix != ".pyc" and file.is_file())
        for each in map(requirements.Requirement, found.requires or ()):
            if each.marker is None or any(each.marker.evaluate({"extra": extra}) for extra in ("", *extras)):
                add(each.name, each.extras)

    add(PROJECT["name"])
    assert {"gmsh", "numba", "scipy", "xarray"} <= set(sizes) and "pytest" not in sizes
    assert sum(sizes.values()) < 700e6, sorted(sizes.items(), key=lambda item: -item[1])[:5]


def test_one_command_leaves_out_what_only_developers_need():
    """`./gush` syncs what runs, some 650 MB; the groups of development would make it more than a gigabyte."""
    (command,) = (line for line in (ROOT / "gush").read_text(encoding="utf-8").splitlines() if "uv run" in line)
    assert "--no-dev" in command and "--locked" in command
    uv = os.environ.get("UV") or shutil.which("uv")  # `uv run` tells its own place
    if uv is None:
        pytest.skip("no uv on this machine")
    exported = subprocess.run(
        [uv, "export", "--locked", "--no-dev", "--no-hashes", "--no-header", "--no-emit-project"],
        capture_output=True, text=True, cwd=ROOT, check=True,
    ).stdout  # fmt: skip
    runs = {re.split(r"[=\s]", line)[0].lower() for line in exported.splitlines() if line and line[0].isalpha()}
    tools = {"pytest", "hypothesis", "ruff", "mypy", "mkdocs", "compliance-checker", "jedi", "ipykernel", "openseespy"}
    assert {"numba", "xarray", "gmsh"} <= runs and not tools & runs
