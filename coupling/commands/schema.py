"""The command `gush schema`."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from coupling.commands.exit_codes import JsonPath, answering, write_json


class Kind(StrEnum):
    """Files that have a schema."""

    scene = "scene"
    study = "study"


def schema_command(
    kind: Annotated[Kind, typer.Argument(help="Of scene files or of study files.")] = Kind.scene,
    json_path: JsonPath = None,
):
    """Print the JSON Schema of scene or study files, by which an editor completes and checks them.

    JSON: the schema.
    """
    with answering(json_path) as answer:
        if kind == Kind.scene:
            from coupling.scenes.editor_schema import scene_schema as schema
        else:
            from coupling.studies.editor_schema import study_schema as schema
        if answer(schema()) and json_path is None:
            write_json(Path("-"), schema())
