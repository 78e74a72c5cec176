"""The schemas that editors read: every file that this program takes passes, mistakes do not; names are completed."""

import json
import tomllib
from importlib import resources

import jsonschema
import pytest
from running import gush

from coupling.commands.options import completed
from coupling.scenes.editor_schema import dotted_names, parameter_texts, scene_schema
from coupling.scenes.layers import ready_names
from coupling.scenes.scene import load_scene
from coupling.studies.editor_schema import study_schema
from mpm.scene import Numerics

SCHEMAS = {"scenes": scene_schema(), "studies": study_schema()}


def mistakes(room, text):
    return list(jsonschema.Draft202012Validator(SCHEMAS[room]).iter_errors(tomllib.loads(text)))


@pytest.mark.parametrize("room", SCHEMAS)
def test_every_built_in_file_passes(room):
    jsonschema.Draft202012Validator.check_schema(SCHEMAS[room])
    for name in ready_names(room):
        text = (resources.files("coupling") / room / "ready" / f"{name}.toml").read_text(encoding="utf-8")
        assert not mistakes(room, text), name


def test_complete_text_of_a_scene_passes():
    assert not mistakes("scenes", load_scene("case-3").source)


@pytest.mark.parametrize(
    "text",
    ['[gate]\nwidth = "15 cm"', 'water = "none"', "[soils.0]\nfriction_angle = 33", 'base = "mine.toml"',
     '[ring]\njoint_angles = ["0.1 rad", 90]\nground = "none"', '[[soils]]\nmodel = "mine.py:Peat"\nwood = 3'],
)  # fmt: skip
def test_what_only_a_file_may_say_passes(text):
    assert not mistakes("scenes", text)


@pytest.mark.parametrize(
    ("room", "text"),
    [("scenes", "[gate]\nangel = 45"), ("scenes", "[gate]\nwidth = -1"), ("scenes", '[gate]\nwidth = "wide"'),
     ("scenes", 'interior = "resolvd"'), ("scenes", "[soils.first]\nk0 = 1"), ("scenes", "[soils.0]\nfriction = 1"),
     ("scenes", "[ring]\nn_elements = 3"), ("studies", 'design = "sobl"'), ("studies", "records = 1"),
     ("studies", '[parameters]\n"gate.angle" = 45')],
)  # fmt: skip
def test_mistakes_are_marked(room, text):
    assert mistakes(room, text)


def test_keys_say_what_they_mean():
    assert "1/s" in parameter_texts(Numerics)["pic_rate"]
    described = SCHEMAS["scenes"]["$defs"]["Numerics"]["properties"]["pic_rate"]
    assert described["default"] == 1.0 and described["description"].startswith("Rate at which point velocities")
    assert {"gate.angle", "soils.0.hydraulic_conductivity", "ring.joint_angles", "water"} <= set(dotted_names())


@pytest.mark.parametrize(("kind", "room"), [("scene", "scenes"), ("study", "studies")])
def test_command_prints_the_schema_and_writes_it(kind, room, tmp_path):
    assert json.loads(gush("schema", kind).stdout) == SCHEMAS[room]
    assert gush("schema", kind, "--json", tmp_path / "a.json").exit_code == 0
    assert json.loads((tmp_path / "a.json").read_text()) == SCHEMAS[room]


def test_names_and_paths_are_completed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "case-mine.toml").write_text("")
    (tmp_path / "case-folder").mkdir()
    found = completed("scenes")("case-")
    assert {"case-3", "case-10", "case-mine.toml", "case-folder/"} <= set(found) and "quick" not in found
    assert "table-2" in completed("studies")("")
    assert "--install-completion" in gush("--help").output
