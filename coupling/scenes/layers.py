"""The texts that make up a scene, its own file before its bases, and how they are merged."""

import difflib
import tomllib
from collections.abc import Iterable
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

from coupling.refused import SceneError
from mpm.laws.law import UnknownLaw, soil_law
from structure.inputs import shortened

# No scene is longer; a larger file is something else.
MOST_BYTES = 1_000_000
# The deepest key of a scene is ring.ground.law; what is much deeper is no scene and would overflow the stack.
MOST_LEVELS = 12
CHANGES = "changes in Python"
#: What a scene may leave out although its base has it: `water = "none"` makes it dry.
OPTIONAL = ("water", "gate", "ring", "limits", "k0")
NONE = "none"


class Layer(NamedTuple):
    """A TOML text that a scene was read from, the scene's own file before its bases.

    name : str;  text : str;  data : dict, its nested dictionary.
    """

    name: str
    text: str
    data: dict[str, Any]


def ready_names(room: str) -> list[str]:
    """Names of what a room of `coupling` has built in, those with numbers by these."""
    names = [entry.name.removesuffix(".toml") for entry in (resources.files("coupling") / room / "ready").iterdir()]
    return sorted(names, key=lambda n: (n.rstrip("0123456789"), len(n), n))


def scene_names() -> list[str]:
    """Names of the built-in scenes, `quick` first."""
    return sorted(ready_names("scenes"), key=lambda n: n != "quick")


def text_of(kind: str, name: str, room: str, error: type[SceneError] = SceneError) -> str:
    """TOML text of a "scene" or "study" that a room has built in, or of a file.

    Raises SceneError: neither, or as :func:`read_toml_file`.
    """
    names = scene_names() if room == "scenes" else ready_names(room)
    if name in names:
        return (resources.files("coupling") / room / "ready" / f"{name}.toml").read_text(encoding="utf-8")
    if not _is_there(Path(name)):
        near = difflib.get_close_matches(name, names, 1)
        hint = f"did you mean {near[0]!r}? " if near else ""
        raise error(
            f"{kind} {shortened(name)}: must be a built-in {kind} or a file, got neither; {hint}"
            f"built-in: {', '.join(names)}"
        )
    return read_toml_file(Path(name), f"{kind} {name!r}")


def read_scene_data(name: str | Path) -> dict[str, Any]:
    """The nested dictionary of a scene, its bases merged, before validation; for :func:`make_scene`.

    Raises SceneError: unknown name or unreadable file.
    """
    return merged(layers_of(str(name), ()))


def parse_changes(texts: list[str]) -> dict[str, Any]:
    """Changes for :func:`load_scene` from texts as "gate.angle=45", "gate.width=20 cm" or "water=none".

    Raises SceneError: a text without a name or a value.
    """
    found = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (name and equals and value):
            raise SceneError(f"--set {shortened(text)}: must be NAME=VALUE; write it like --set gate.angle=45")
        try:
            found[name] = tomllib.loads(f"value = {value}")["value"]
        except tomllib.TOMLDecodeError:  # a name or a quantity without quotes, as the shell hands it over
            found[name] = value
    return found


def nested(name: str, value: Any) -> dict[str, Any]:
    """A value under its dotted name as nested tables, for :func:`changed`.

    >>> nested("soils.0.k0", 0.5)
    {'soils': {'0': {'k0': 0.5}}}
    """
    for part in reversed(name.split(".")):
        value = {part: value}
    return value


def entry_at(data: Any, path: Iterable[str | int], otherwise: Any = None) -> Any:
    """The entry at a path of nested tables and lists, whose entries go by their numbers; `otherwise` without one.

    >>> entry_at({"soils": [{"k0": 0.5}]}, "soils.0.k0".split("."))
    0.5
    """
    for part in path:
        try:
            data = data[str(part)] if isinstance(data, dict) else data[int(part)]
        except (KeyError, IndexError, TypeError, ValueError):
            return otherwise
    return data


def change_layers(changes: dict[str, Any]) -> list[Layer]:
    """Changes in Python as the layers that they are, the last one first."""
    return [Layer(CHANGES, "", nested(key, value)) for key, value in reversed(changes.items())]


def changed(base: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """The nested dictionary of a scene with that of some changes merged into it, see the module's description.

    Raises SceneError: a list is asked for an entry that it does not have.
    """
    merged = dict(base)
    for key, value in changes.items():
        if value == NONE and key in OPTIONAL:
            merged.pop(key, None)
            continue
        here = merged.get(key)
        if isinstance(value, dict) and isinstance(here, dict):
            merged[key] = changed(here, value)
        elif isinstance(value, dict) and isinstance(here, list | tuple):
            merged[key] = _with_entries(key, here, value)
        else:
            merged[key] = value
    return merged


def _for_law(soil: dict[str, Any], model: Any) -> dict[str, Any]:
    """A soil of a base without what another law does not know; the rest is taken over."""
    try:
        known = soil_law(model).model_fields if isinstance(model, str) and model != soil.get("model") else soil
    except UnknownLaw:  # told where the scene is validated
        return soil
    return {key: value for key, value in soil.items() if key in known}


def _with_entries(name: str, entries: list[Any] | tuple[Any, ...], changes: dict[str, Any]) -> list[Any]:
    """A list in which the entries of some numbers, the keys of `changes`, are changed."""
    result = list(entries)
    for key, value in changes.items():
        # Python refuses to read a number of thousands of digits
        number = int(key) if str(key).isdecimal() and len(str(key)) < 10 else len(result)
        if number >= len(result):
            raise SceneError(
                f"{name}.{shortened(str(key))[1:-1]}: must be a number below {len(result)}, the length of that list; "
                f"as in {name}.0"
            )
        here = result[number]
        if name == "soils" and isinstance(here, dict) and isinstance(value, dict) and "model" in value:
            here = _for_law(here, value["model"])
        result[number] = changed(here, value) if isinstance(here, dict) and isinstance(value, dict) else value
    return result


def merged(layers: tuple[Layer, ...]) -> dict[str, Any]:
    data: dict[str, Any] = {}
    file = ""
    for layer in reversed(layers):
        file = file if layer.name == CHANGES else layer.name
        try:
            data = changed(data, layer.data)
        except SceneError as problem:
            raise SceneError(f"scene {file!r}: {problem}") from None
    return data


def layers_of(name: str, chain: tuple[str, ...]) -> tuple[Layer, ...]:
    """The texts that make up a scene, its own first; `chain` holds the scenes that led here."""
    if name in chain:
        raise SceneError(
            f"scene {name!r}: base must not lead back to itself, got {' -> '.join([*chain, name])}; name another base"
        )
    if len(chain) > MOST_LEVELS:
        raise SceneError(f"scene {name!r}: at most {MOST_LEVELS} bases may follow each other; merge some of the files")
    text = text_of("scene", name, "scenes")
    data = parse_toml(text, f"scene {name!r}")
    if not data:
        raise SceneError(f"scene {name!r}: must describe a scene, got an empty file; start from base = 'case-3'")
    base = data.pop("base", None)
    layer = Layer(name, text, data)
    if base is None:
        return (layer,)
    return (layer, *layers_of_base(base, name, chain))


def layers_of_base(base: Any, name: str, chain: tuple[str, ...]) -> tuple[Layer, ...]:
    """The texts of the base that the scene `name` states."""
    if not isinstance(base, str):
        raise SceneError(
            f"scene {name!r}: base must be the name or file of a scene, got {shortened(base)}; write base = 'case-3'"
        )
    # A file's base is looked up beside it, wherever the program was started.
    beside = Path(name).parent / base
    return layers_of(base if base in scene_names() or not _is_there(beside) else str(beside), (*chain, name))


def _is_there(path: Path) -> bool:
    try:
        return path.exists()
    except (OSError, ValueError):  # too long a name, a zero in it
        return False


def parse_toml(text: str, who: str) -> dict[str, Any]:
    """Nested dictionary of a TOML text.

    Raises SceneError: not valid TOML, with the line, or nested more deeply than any scene.
    """
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        remedy = "is the file truncated?" if "at end of document" in str(error) else "correct that place"
        raise SceneError(f"{who}: must be valid TOML, got: {error}; {remedy}") from None
    except RecursionError:
        raise SceneError(f"{who}: must not nest brackets hundreds deep; this is no scene file") from None
    except ValueError as error:
        raise SceneError(f"{who}: must hold numbers of ordinary length, got: {error}; shorten them") from None
    check_levels(data, who)
    return data


def check_levels(data: Any, who: str) -> None:
    entries = [data]
    for _ in range(MOST_LEVELS):
        inner = (each.values() if isinstance(each, dict) else each for each in entries)
        entries = [entry for each in inner for entry in each if isinstance(entry, dict | list | tuple)]
        if not entries:
            return
    raise SceneError(f"{who}: must not nest tables and lists more than {MOST_LEVELS} deep; this is no scene")


def read_toml_file(path: Path, who: str) -> str:
    """Text of a file that is meant to be TOML.

    Raises SceneError: no regular file (a device or a pipe may never end), longer than 1 MB, unreadable, or no text.
    """
    try:
        if not path.is_file():
            raise SceneError(f"{who}: must be a readable file, got a folder or device; give the TOML file itself")
        size = path.stat().st_size
        if size > MOST_BYTES:
            raise SceneError(f"{who}: must be shorter than 1 MB, got {size} bytes; this is no scene file")
        return path.read_text(encoding="utf-8-sig")  # editors of Windows begin a text with a byte order mark
    except OSError as error:
        raise SceneError(f"{who}: must be a readable file, got: {error.strerror}; check path and rights") from None
    except UnicodeDecodeError as error:
        raise SceneError(f"{who}: must be UTF-8 text, got: {error}; this is no scene file") from None
