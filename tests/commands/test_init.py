"""A scene file from answers: what is answered is in the scene, everything else comes from the base."""

import pytest
from typer.testing import CliRunner

from coupling.cli import app
from coupling.commands.init import QUESTIONS
from coupling.scenes.scene import load_scene


def init(*arguments, said=""):
    return CliRunner().invoke(app, ["init", *map(str, arguments)], input=said)


def test_answers_make_a_scene_and_the_rest_comes_from_the_base(tmp_path):
    # a wrong unit is asked for again; an empty line takes what the base has
    said = ["25", "", "", "45", "15 kPa", "15 cm", *[""] * (len(QUESTIONS) - 5)]
    result = init(tmp_path / "mine.toml", "--base", "quick", said="\n".join(said) + "\n")
    assert result.exit_code == 0, result.output
    assert "must be a quantity in m, got '15 kPa'" in result.output and "next: gush plan" in result.output
    scene, base = load_scene(tmp_path / "mine.toml"), load_scene("quick")
    assert (scene.name, scene.tunnels[0].cover, scene.gate.angle, scene.gate.width) == ("mine", 25.0, 45.0, 0.15)
    assert scene.discretisation == base.discretisation and scene.soils == base.soils and scene.stop == base.stop
    text = (tmp_path / "mine.toml").read_text()
    assert 'width = "15 cm"  # width of the gate [m]' in text


def test_without_questions_it_is_the_base_under_another_name(tmp_path):
    assert init(tmp_path / "copy.toml", "--yes").exit_code == 0
    assert load_scene(tmp_path / "copy.toml") == load_scene("case-3", name="copy")


@pytest.mark.parametrize("name", ["there.toml", "scene.txt", "nowhere/scene.toml"])
def test_file_that_must_not_be_written_is_refused(tmp_path, name):
    (tmp_path / "there.toml").write_text("mine")
    result = init(tmp_path / name, "--yes")
    assert result.exit_code == 2 and "choose another name" in result.output.replace("\n", " ")
    assert (tmp_path / "there.toml").read_text() == "mine" and len(list(tmp_path.iterdir())) == 1


def test_answers_that_do_not_fit_together_leave_no_file(tmp_path):
    said = ["20", "6.6", "7.0", *[""] * (len(QUESTIONS) - 3)]
    result = init(tmp_path / "mine.toml", said="\n".join(said) + "\n")
    assert result.exit_code == 2 and "inner_diameter" in result.output and not (tmp_path / "mine.toml").exists()
