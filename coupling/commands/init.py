"""The command `gush init`."""

from pathlib import Path
from typing import Annotated

import typer

from coupling.commands.exit_codes import JsonPath, answering, say, warn
from coupling.commands.options import completed
from coupling.refused import Refused, SceneError

#: What is asked for, as far as the base has it: key of the scene, meaning.
QUESTIONS = {
    "tunnels.0.cover": "soil above the crown",
    "tunnels.0.outer_diameter": "outer diameter of the lining",
    "tunnels.0.inner_diameter": "inner diameter of the lining",
    "gate.angle": "angle of the gate from the crown, clockwise",
    "gate.width": "width of the gate",
    "water.table_depth": "ground water below the surface",
    "soils.0.friction_angle": "friction angle of the first soil",
    "soils.0.cohesion": "its effective cohesion",
    "soils.0.youngs_modulus": "its Young's modulus",
    "soils.0.hydraulic_conductivity": "its Darcy conductivity; it decides the inflow rate",
    "stop.inflow_mass": "inflow per metre of tunnel at which the run ends",
    "stop.time": "time at which it ends at the latest",
}


def init_command(
    file: Annotated[Path, typer.Argument(help="The scene file to write; it must not exist.")],
    base: Annotated[
        str,
        typer.Option(
            help="Scene that it starts from: what is not asked comes from there.", autocompletion=completed("scenes")
        ),
    ] = "case-3",
    yes: Annotated[bool, typer.Option("--yes", help="Ask nothing: take all from the base.")] = False,
    json_path: JsonPath = None,
):
    """Write a commented scene file from answers; those of the base are offered, strings carry their unit ("15 cm").

    JSON: `file`, `answers` (key of the scene to value).
    """
    with answering(json_path) as answer:
        from coupling.scenes.scene import load_scene

        if file.suffix != ".toml" or file.exists() or not file.absolute().parent.is_dir():
            raise Refused(
                f"scene file '{file}': must be a new file NAME.toml in an existing folder; choose another name"
            )
        asked = _values(load_scene(base))
        answers = asked if yes else {name: _ask(name, value) for name, value in asked.items()}
        text = scene_text(file.stem, base, answers)
        try:
            file.write_text(text, encoding="utf-8")
            load_scene(file)
        except SceneError:
            file.unlink()
            raise
        if answer({"file": str(file), "answers": answers}):
            say(f"wrote {file}\nnext: gush plan {file}")


def _values(scene):
    """Values of the base by the keys that are asked for, where it has them."""
    from coupling.scenes.layers import entry_at

    found = {name: entry_at(scene.nested(), name.split(".")) for name in QUESTIONS}
    return {name: value for name, value in found.items() if value is not None}


def _ask(name, value):
    """The answer to one question, asked again until it is a number in the unit of the key."""
    from coupling.scenes.layers import parse_changes
    from coupling.scenes.scene import number_in_unit, unit_of

    while True:
        said = typer.prompt(f"{QUESTIONS[name]} [{unit_of(name) or '-'}]", default=f"{value:g}", err=True)
        given = parse_changes([f"{name}={said}"])[name]
        try:
            float(number_in_unit(name, given))
        except (ValueError, TypeError) as problem:
            warn(str(problem))
        else:
            return given


def scene_text(name, base, answers):
    """The scene file: a comment with meaning and unit at every key."""
    import json

    from coupling.scenes.scene import unit_of

    lines = [
        f"# Scene '{name}'. Numbers are SI, angles degrees; strings carry their unit, as \"15 cm\".",
        f"base = {json.dumps(base)}  # what this file does not say comes from there",
        f"name = {json.dumps(name)}",
    ]
    table = None
    for key, value in answers.items():
        home, _, entry = key.rpartition(".")
        if home != table:
            table = home
            lines += ["", f"[{home}]"]
        lines.append(f"{entry} = {json.dumps(value, ensure_ascii=False)}  # {QUESTIONS[key]} [{unit_of(key) or '-'}]")
    return "\n".join(lines) + "\n"
