"""The examples of docs/postprocessing.md run as they stand, on a small event."""

import re
from pathlib import Path

import pytest

import coupling
from coupling.responses.respond import respond
from verification.small_event import small_scene

PAGE = (Path(__file__).parents[2] / "docs" / "postprocessing.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"```python\n(.*?)```", PAGE, re.S)


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder with the run that the examples read."""
    from coupling.datasets import write_response

    folder = tmp_path_factory.mktemp("examples")
    scene = small_scene()
    pressures = coupling.run(scene, out=folder / "runs" / "quick", threads=1)
    write_response(folder / "runs" / "quick" / "run.nc", respond(scene, pressures))
    return folder


def test_examples_are_short_and_there_is_one_for_every_topic():
    assert len(EXAMPLES) == PAGE.count("\n## ") - 1 + 1  # one topic has two, the table of functions none
    assert all(len(example.strip().splitlines()) <= 10 for example in EXAMPLES)


@pytest.mark.parametrize("number", range(len(EXAMPLES)))
def test_example_runs(number, place, monkeypatch, capsys):
    monkeypatch.chdir(place)
    exec(compile(EXAMPLES[number], f"docs/postprocessing.md, example {number}", "exec"), {})
    assert capsys.readouterr().out.strip()


def test_every_public_function_is_named_on_the_page():
    from coupling import postprocess

    functions = [n for n in postprocess.__all__ if callable(getattr(postprocess, n)) and n[0].islower()]
    geometry = {"element_areas", "element_centres", "element_of_points", "filled", "gate_diameter", "gate_position"}
    assert not [n for n in functions if f"`{n}`" not in PAGE and n not in geometry | {"tunnels"}]
