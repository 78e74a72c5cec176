"""JSON Schema of scene files, by which editors complete keys, show what they mean and mark mistakes while one types.

It is pydantic's schema of :class:`coupling.Scene`, with what a file may say beyond it: strings with units, a base,
"none", entries of a list by their numbers. What a file must say depends on its base, so nothing is required.
"""

import inspect
import re
from collections.abc import Iterator
from functools import partial
from typing import Any

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema

from coupling.scenes.layers import NONE, OPTIONAL, scene_names
from coupling.scenes.rings import UNITS
from coupling.scenes.scene import Scene
from mpm.laws.law import built_in_laws
from mpm.quantities import quantity_in
from structure.inputs import models_in

DIALECT = "https://json-schema.org/draft/2020-12/schema"
#: A number and a unit; which units there are pint knows.
QUANTITY = r"^\s*[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?\s*\S+.*$"
LISTS = ("soils", "tunnels")


class QuantitySchema(GenerateJsonSchema):
    """pydantic's schema in which numbers with a unit may be strings."""

    def function_before_schema(self, schema: Any) -> dict[str, Any]:
        """A field behind a validator: that of quantities takes strings."""
        validator, inner = schema["function"]["function"], super().function_before_schema(schema)
        if isinstance(validator, partial) and validator.func is quantity_in:
            return with_unit(inner, validator.args[0])
        return inner


def scene_schema() -> dict[str, Any]:
    """JSON Schema of the nested dictionary of a scene file."""
    schema = file_schema(Scene)
    tables = schema["$defs"]
    for name, unit in UNITS.items():
        *path, key = name.split(".")
        properties = _properties(schema, path)
        properties[key] = with_unit(properties.get(key, {"type": "number"}), unit)
    properties = schema["properties"]
    for table in (schema, *tables.values()):
        for key in OPTIONAL:
            if key in table.get("properties", {}):
                table["properties"][key] = _or(table["properties"][key], {"const": NONE})
    tables["Ring"]["properties"]["ground"] = _or(tables["Ring"]["properties"]["ground"], {"const": NONE})
    known = [law.model_json_schema()["properties"]["model"].get("const") for law in built_in_laws()]
    other = {
        "type": "object",
        "properties": {"model": {"type": "string", "not": {"enum": known}}},
        "required": ["model"],
    }
    properties["soils"]["items"] = _or(properties["soils"]["items"], other)  # a law of somebody's own
    for key in LISTS:
        numbered = {"type": "object", "additionalProperties": False}
        numbered["patternProperties"] = {"^[0-9]+$": properties[key]["items"]}
        properties[key] = _or(properties[key], numbered)
    about = "Built-in scene, or file, from which everything comes that this file does not say."
    properties["base"] = {"anyOf": [{"enum": scene_names()}, {"type": "string"}], "description": about}
    return schema


def _properties(schema: dict[str, Any], path: list[str]) -> dict[str, Any]:
    """Properties of a table within tables; an open one, of names to numbers, gets them."""
    table = schema
    for name in path:
        table = table["properties"][name]
        named = [entry["$ref"] for entry in (table, *table.get("anyOf", ())) if "$ref" in entry]
        table = schema["$defs"][named[0].rpartition("/")[2]] if named else table
    return table.setdefault("properties", {})


def file_schema(model: type[BaseModel]) -> dict[str, Any]:
    """pydantic's schema of a model for files: quantities with units, no nulls, nothing required; what keys mean."""
    schema = _plain(model.model_json_schema(schema_generator=QuantitySchema))
    named = {each.__name__: each for each in _models(model)}
    for name, table in {model.__name__: schema, **schema.get("$defs", {})}.items():
        texts = parameter_texts(named[name]) if name in named else {}
        for key, entry in table.get("properties", {}).items():
            entry.update({"description": texts[key]} if key in texts else {})
    return {"$schema": DIALECT, **schema}


def with_unit(entry: dict[str, Any], unit: str) -> dict[str, Any]:
    """The schema of a number, or of a list of numbers, that may also be a string with a unit."""
    if "items" in entry:
        return entry | {"items": with_unit(entry["items"], unit)}
    return _or(entry, {"type": "string", "pattern": QUANTITY, "title": f"a quantity in {unit}"})


def parameter_texts(model: type) -> dict[str, str]:
    """What the docstrings of a class and its bases say of its parameters, by name."""
    found: dict[str, str] = {}
    for each in reversed(model.__mro__):
        section = re.search(r"^Parameters\n-+\n(.*?)(?=^\w[^\n]*\n---|\Z)", inspect.getdoc(each) or "", re.M | re.S)
        names: list[str] = []
        for line in section[1].splitlines() if section else ():
            if re.match(r"\w.* : ", line):
                names = [name.strip() for name in line.partition(" : ")[0].split(",")]
                found |= dict.fromkeys(names, "")
            elif line.startswith(" "):
                found |= {name: f"{found[name]} {line.strip()}".strip() for name in names}
    return found


def dotted_names(model: type[BaseModel] = Scene, home: str = "") -> Iterator[str]:
    """Names of all keys of a scene as a study takes them: "gate", "gate.angle", "soils.0.porosity"."""
    for name, field in model.model_fields.items():
        yield f"{home}{name}"
        inner = f"{home}{name}.0." if name in LISTS else f"{home}{name}."
        for table in models_in(field.annotation):
            yield from dotted_names(table, inner)


def _models(model):
    yield model
    for field in model.model_fields.values():
        for inner in models_in(field.annotation):
            yield from _models(inner)


def _or(entry, other):
    """Either of two schemas; what is told of a key stays with it."""
    told = {key: value for key, value in entry.items() if key in ("default", "description", "title")}
    rest = {key: value for key, value in entry.items() if key not in told}
    return told | {"anyOf": [*(rest["anyOf"] if rest.keys() == {"anyOf"} else [rest]), other]}


def _plain(node):
    """Without what is required and without nulls, which TOML does not have."""
    if isinstance(node, list):
        return [_plain(entry) for entry in node if entry != {"type": "null"}]
    if not isinstance(node, dict):
        return node
    kept = {key: _plain(value) for key, value in node.items() if not (key == "required" and isinstance(value, list))}
    return {key: value for key, value in kept.items() if not (key == "default" and value is None)}
