"""What README.md and docs/ tell people to type works: blocks run, doctests hold, commands know their options.

The tutorial is followed first; every other page starts from the folder that it leaves. Commands run as `gush` would,
in this process. A block that would take minutes or another machine says so in its title; its commands are parsed only.
"""

import contextlib
import doctest
import importlib
import os
import pkgutil
import re
import shlex
import shutil
import subprocess
import tomllib
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import ClassVar

import h5py
import matplotlib
import numpy as np
import pytest
import typer
from markdown_it import MarkdownIt

import coupling
import mpm
import structure
import structure.models
from coupling.cli import app

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
PAGES = ["README.md", "CONTRIBUTING.md", *(str(p.relative_to(ROOT)) for p in sorted((ROOT / "docs").rglob("*.md")))]
TUTORIAL = "docs/tutorial.md"
TITLE = re.compile(r'title="([^"]*)"')
NOT_RUN = re.compile(r"not run by the tests: \S.*")
FILE_NAME = re.compile(r"[\w.-]+")
#: Languages of blocks that are shown, not executed; with a title they are saved for the page.
SHOWN = ("text",)


class Block:
    """A fenced block: its language, title, text and first line on the page."""

    def __init__(self, page, token):
        self.language, _, rest = token.info.strip().partition(" ")
        title = TITLE.search(rest)
        self.title, self.text, self.line = title[1] if title else "", token.content, token.map[0] + 2
        self.place = f"{page}:{self.line}"
        self.is_run = not NOT_RUN.fullmatch(self.title)


def blocks(page):
    """All fenced blocks of a page."""
    tokens = MarkdownIt().parse((ROOT / page).read_text(encoding="utf-8"))
    return [Block(page, token) for token in tokens if token.type == "fence"]


def command_lines(text):
    """Commands of a shell block as lists of words, comments left out."""
    lines = (shlex.split(line, comments=True) for line in text.replace("\\\n", " ").splitlines())
    return [words for words in lines if words]


def is_gush(words):
    """Whether a command is ours, from a clone or installed."""
    return words[0] in ("./gush", "gush")


def parse(words, place):
    """Fail unless `gush` knows the command and all its options."""
    group = typer.main.get_command(app)
    name, *rest = words[1:]
    command = group.get_command(None, name)
    assert command or name in ("--version", "--help", "--install-completion"), f"{place}: gush {name}: no such command"
    try:
        if command:
            command.make_context(name, rest)
    except typer.Exit as done:
        assert done.exit_code == 0, place
    except Exception as problem:  # whatever class the parser has in this version of typer
        pytest.fail(f"{place}: {shlex.join(words)}: {problem}")


def execute(words, place):
    """Run one command of a shell block."""
    if not is_gush(words):
        subprocess.run(words, check=True)
        return
    parse(words, place)
    try:
        code = app(words[1:], standalone_mode=False)
    except typer.Exit as end:
        code = end.exit_code
    assert not code, f"{place}: {shlex.join(words)}: exit code {code}"


def save(block):
    """Write a block into the file that its title names, for the page."""
    assert FILE_NAME.fullmatch(block.title), f"{block.place}: title must be a file name, got {block.title!r}"
    Path(block.title).write_text(block.text, encoding="utf-8")


def read_toml(block):
    """A TOML block must mean something: scene, study, priors or limits; with a title it is saved for the page."""
    data = tomllib.loads(block.text)
    if block.title:
        save(block)
    if "parameters" in data and "name" not in data:
        from coupling.fits.prior import read_plan

        assert read_plan(data).study("quick"), block.place
    elif "parameters" in data:
        from coupling.studies.cases import cases
        from coupling.studies.design import load_study

        assert cases(load_study(data)), block.place
    elif "base" in data:
        path = Path("scene-of-a-page.toml")
        path.write_text(block.text, encoding="utf-8")
        coupling.load_scene(path)
    else:
        structure.Limits.model_validate(data)


def follow(page, whole=False, more=()):
    """Do in the current folder what a page says; `whole`: also what is not run otherwise; `more`: words of commands."""
    names = {"__name__": "__main__"}
    for block in blocks(page):
        if block.language in SHOWN:
            if block.title:
                save(block)
            continue
        if block.language == "bash":
            for words in command_lines(block.text):
                if block.is_run or whole:
                    execute([*words, *more], block.place)
                elif is_gush(words):
                    parse(words, block.place)
        elif block.language == "toml":
            read_toml(block)
        elif block.language == "python":
            # line numbers of the page, so that a traceback points into it
            code = compile("\n" * (block.line - 1) + block.text, str(ROOT / page), "exec")
            if block.is_run or whole:
                exec(code, names)
        else:
            pytest.fail(f"{block.place}: a block must name its language, one of bash, toml, python, text")


class Remembered(mpm.Simulation):
    """Gives the records of a scene once more that was simulated to its end before: pages run the same scenes."""

    __module__ = mpm.Simulation.__module__  # stands for it, also in the reference
    known: ClassVar[dict] = {}
    made = again = None

    def begin(self):
        self.made = []
        if self.scene.source in self.known:
            self.again = iter(self.known[self.scene.source])
        return self._next(super().begin)

    def advance(self, pause=None):
        return super().advance(pause) if self.made is None else self._next(partial(super().advance, pause))

    def _next(self, compute):
        if self.again is not None:
            record, self.done, self.unborne_shear = next(self.again)
            return record
        record = compute()
        self.made.append((record, self.done, self.unborne_shear))
        if self.done:
            self.known[self.scene.source] = self.made
        return record


@pytest.fixture(scope="module", autouse=True)
def remembered(simulated_event, quick_scene):
    Remembered.known[quick_scene.source] = simulated_event[0]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mpm, "Simulation", Remembered)
        yield


@pytest.fixture(scope="module")
def followed(tmp_path_factory):
    """The folder that the tutorial leaves."""
    folder = tmp_path_factory.mktemp("tutorial")
    with contextlib.chdir(folder), matplotlib.rc_context():
        follow(TUTORIAL)
    return folder


def test_tutorial_makes_what_it_shows(followed):
    figures = {path.name for path in (followed / "runs/quick/figures").iterdir()}
    shown = re.findall(r"^\*`(\w+\.png)`", (ROOT / TUTORIAL).read_text(encoding="utf-8"), re.MULTILINE)
    assert shown and set(shown) <= figures
    assert (followed / "runs/quick/report.html").is_file()
    assert coupling.read_run(followed / "runs/mine").attrs["status"] == "finished"


@pytest.mark.parametrize("page", [page for page in PAGES if page != TUTORIAL and blocks(page)])
def test_page_works(page, followed, tmp_path, monkeypatch):
    shutil.copytree(followed, tmp_path / "here")
    monkeypatch.chdir(tmp_path / "here")
    monkeypatch.setattr(structure.models, "_REGISTERED", {})
    with matplotlib.rc_context():
        follow(page)


def test_page_of_the_fit_goes_from_a_table_to_a_band_of_utilisation_in_an_empty_folder(tmp_path, monkeypatch, capsys):
    """All of it as it stands, in this process; sixteen runs are copies of one, scaled by their parameters."""
    page, real, begun = "docs/how-to/fit.md", import_module("coupling.runs.run").run, []

    def stand_in(scene, folder, **_):
        begun.append(folder)
        (ground,) = scene.soils
        if not (tmp_path / "one").exists():
            real(scene.model_copy(update={"stop": scene.stop.model_copy(update={"time": 0.16})}), tmp_path / "one")
        shutil.copytree(tmp_path / "one", folder, dirs_exist_ok=True)
        rest = ground.k0 / 0.55
        with h5py.File(folder / "run.nc", "r+") as file:
            turned = np.cos(np.radians(file["lining/theta"][:] - scene.gate.angle))
            file["lining/soil_pressure"][:] *= rest * (1 + 0.1 * turned)
            for group in ("history", "lining"):
                file[f"{group}/inflow_mass"][:] *= (ground.hydraulic_conductivity / 1e-4) ** 0.5
            for name in ("stress_xx", "displacement_y"):
                file[f"points/{name}"][:] *= rest

    monkeypatch.setattr(import_module("coupling.runs.run"), "run", stand_in)
    monkeypatch.setattr(import_module("coupling.fits.emulator"), "MOST_COMPONENTS", 2)  # fewer; the way is the same
    monkeypatch.chdir(tmp_path)
    with matplotlib.rc_context():
        follow(page, whole=True, more=("--workers", "0"))
    assert len(begun) == 16
    assert {path.name for path in (tmp_path / "fits/leak").iterdir()} == {"ensemble", "fit.nc", "fit.png"}
    printed = capsys.readouterr().out
    assert "bending_moment_utilisation" in printed and "of the posterior passes the limit" in printed


def test_docstring_examples_hold():
    attempted = 0
    for package in ("mpm", "structure", "coupling", "verification"):
        root = importlib.import_module(package)
        names = [package, *(m.name for m in pkgutil.walk_packages(root.__path__, f"{package}."))]
        for name in names:
            result = doctest.testmod(importlib.import_module(name), optionflags=doctest.ELLIPSIS)
            assert result.failed == 0, name
            attempted += result.attempted
    assert attempted >= 10


def test_every_report_of_the_site_is_a_page_or_is_made_by_a_command_that_exists():
    text = (ROOT / "scripts/docs_hooks.py").read_text(encoding="utf-8")
    commands = re.findall(r'"(gush [\w -]+)"\)', text)
    assert len(commands) == 4
    for command in commands:
        parse(command.split(), "scripts/docs_hooks.py")


def test_every_example_is_on_its_page():
    shown = re.findall("<!-- example (.*) -->", (ROOT / "docs/examples.md").read_text(encoding="utf-8"))
    assert sorted(shown) == sorted(path.name for path in (ROOT / "examples").glob("*.py"))


@pytest.mark.parametrize("page", ["README.md", "CONTRIBUTING.md"])
def test_links_of_pages_outside_the_site_lead_somewhere(page):
    links = re.findall(r"(?<!!)\[[^\]]*\]\(([^)#]+)\)", (ROOT / page).read_text(encoding="utf-8"))
    assert [link for link in links if "//" not in link and not (ROOT / link).exists()] == []


@pytest.mark.parametrize("package", ["mpm", "structure", "coupling"])
def test_every_public_name_is_in_the_reference(package):
    page = (ROOT / f"docs/reference/{package}.md").read_text(encoding="utf-8")
    shown = set(re.findall(r"^::: (\S+)$", page, re.MULTILINE)) | set(re.findall(r"members: \[(.*)\]", page))
    for name in importlib.import_module(package).__all__:
        public = getattr(importlib.import_module(package), name)
        whole = public.__module__ in shown or any(name in members.split(", ") for members in shown)
        assert whole or f"{public.__module__}.{name}" in shown, f"add {public.__module__}.{name} to docs/reference"


def test_nothing_on_the_site_comes_from_a_network():
    config = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    assert "font: false" in config and "https://" not in config
    for page in PAGES:
        images = re.findall(r"!\[[^\]]*\]\(([^)]*)\)", (ROOT / page).read_text(encoding="utf-8"))
        assert not [image for image in images if "//" in image], page
        for image in images:
            assert ((ROOT / page).parent / image).is_file(), f"{page}: {image}"
    assert os.path.getsize(ROOT / "docs/assets/iframe-worker.js") > 1000
