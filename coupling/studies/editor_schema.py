"""JSON Schema of study files, see :mod:`coupling.scenes.editor_schema`."""

from typing import Any

from coupling.scenes.editor_schema import dotted_names, file_schema, with_unit
from coupling.scenes.scene import unit_of
from coupling.studies.design import Study


def study_schema() -> dict[str, Any]:
    """JSON Schema of the nested dictionary of a study file; names of parameters are completed, others pass."""
    schema = file_schema(Study)
    ends = schema["$defs"]["Range"]["properties"]
    for key in ("low", "high"):
        ends[key] = with_unit(ends[key], "the unit of the parameter")
    names = dict.fromkeys(["scene", *dotted_names()])
    values = schema["properties"]["parameters"].pop("additionalProperties")
    about = {name: {} if (unit := unit_of(name)) is None else {"description": f"[{unit}]"} for name in names}
    schema["properties"]["parameters"] |= {
        "properties": {name: {**values, **told} for name, told in about.items()},
        "additionalProperties": values,
    }
    schema["properties"]["fixed"] |= {"properties": {name: told for name, told in about.items() if name != "scene"}}
    return schema


__all__ = ["study_schema"]
