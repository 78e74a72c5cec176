"""Commands that an installed package adds to `gush`: found by their entry points, and harmless to the others."""

import json
import subprocess
import sys

import pytest
from typer.testing import CliRunner

from coupling.cli import app

OTHER = '''"""Another package."""

from typing import Annotated

import typer


def shout(word: str, times: Annotated[int, typer.Option(help="How often.")] = 1):
    """Say a word aloud."""
    typer.echo(times * word.upper())
'''
ENTRIES = """[gush.commands]
shout = other_package:shout
broken = other_package.not_there:command
plan = other_package:shout
"""


@pytest.fixture
def other(tmp_path, monkeypatch):
    """A folder with an installed package, as an installer leaves it."""
    (tmp_path / "other_package.py").write_text(OTHER)
    about = tmp_path / "other_package-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: other-package\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(ENTRIES)
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


def test_command_of_another_package_joins(other):
    run = CliRunner().invoke
    done = run(app, ["shout", "gate", "--times", "2"])
    assert (done.exit_code, done.output) == (0, "GATEGATE\n")
    listed = run(app, ["--help"])
    assert listed.exit_code == 0 and "Say a word aloud." in listed.output
    assert "Did you mean 'shout'" in run(app, ["shuot"]).output


def test_command_that_cannot_be_imported_harms_no_other(other):
    listed = CliRunner().invoke(app, ["--help"])
    assert listed.exit_code == 0 and "broken" in listed.output and "accuracy" in listed.output
    done = CliRunner().invoke(app, ["broken"])
    assert done.exit_code == 2 and "other_package.not_there" in done.output and "correct or remove it" in done.output


def test_own_command_keeps_its_name(other):
    assert "What a run would do and cost" in CliRunner().invoke(app, ["plan", "--help"]).output


def test_own_commands_import_none_that_joined(tmp_path):
    code = (
        "import sys, coupling.cli as c\nsys.argv = ['gush', 'scenes', '--json', '-']\n"
        "try: c.main()\nexcept SystemExit as e: assert not e.code\n"
        "print(*[name for name in sys.modules if name.split('.')[0] == 'verification'], file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path)
    assert json.loads(done.stdout)["scenes"] and not done.stderr.split()
