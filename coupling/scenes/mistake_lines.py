"""What is told of a mistake in a scene: line of the file, key, message, and a likely wrong unit.

The line of a key is found with the parser of TOML itself: the shortest beginning of the text that has it.
"""

import re
import tomllib
from bisect import bisect_left
from functools import cache
from typing import Any

from coupling.scenes.layers import Layer, entry_at
from coupling.scenes.plausibility import shown

# an error message is not worth more; a longer search gives no line
MOST_PARSES = 300
_ABSENT = object()


def mistake_line(
    location: tuple[Any, ...],
    message: str,
    data: dict[str, Any],
    origin: str,
    layers: tuple[Layer, ...],
    unusual: dict[tuple[Any, ...], str],
) -> str:
    """One line for a mistake: the line of the file, where, the message, and a likely wrong unit."""
    path = path_of(message, location, data)
    text = f"{shown(location)}: {message}" if location else message
    for other, hint in unusual.items():
        # the number itself, or one beside it that the message does not blame
        if other == path or (other[:-1] == path[:-1] and path not in unusual):
            text += f"; {shown(other)} {hint}"
    layer, kept = _source(path, layers)
    number = line_of(layer.text, path[:kept]) if kept and layer.text else None
    if number is None:
        return text
    return f"line {number}: {text}" if layer.name == origin else f"{layer.name} line {number}: {text}"


def _source(path: tuple[Any, ...], layers: tuple[Layer, ...]) -> tuple[Layer | None, int]:
    """The text that says most of a path, and how many of its parts: of a missing key only its table stands there."""
    best, most = None, 0
    list_at = next((k for k, part in enumerate(path) if isinstance(part, int)), None)
    for layer in layers:
        kept = next((k for k in range(len(path), 0, -1) if holds(layer.data, path[:k])), 0)
        if kept > most:
            best, most = layer, kept
        if list_at is not None and kept >= list_at and isinstance(entry_at(layer.data, path[:list_at]), list | tuple):
            break  # a list replaces that of a base as a whole
    return best, most


def line_of(text: str, path: tuple[Any, ...]) -> int | None:
    """Number of the line, from 1, on which the statement with a key begins; None where the text has no such key.

    text : valid TOML;  path : tuple of str and int, keys of tables and indices of lists, as ("soils", 0, "porosity").
    """
    lines = text.split("\n")

    @cache
    def parsed(count):
        """Data of the first lines, None where they are no valid TOML: a statement over several lines is cut."""
        if parsed.cache_info().misses > MOST_PARSES:
            raise _TooLong
        try:
            return tomllib.loads("\n".join(lines[:count]))
        except ValueError:
            return None

    def whole(count):
        """The longest valid beginning of at most so many lines."""
        return next(fewer for fewer in range(count, -1, -1) if parsed(fewer) is not None)

    try:
        if not path or not holds(parsed(len(lines)), path):
            return None
        return 1 + whole(bisect_left(range(len(lines)), True, key=lambda count: holds(parsed(whole(count)), path)) - 1)
    except _TooLong:
        return None


def holds(data, path):
    """Whether nested dictionaries and lists have an entry at `path`; a table may name entries of a list by number."""
    return entry_at(data, path, _ABSENT) is not _ABSENT


def path_of(message, location, data):
    """The key that a message is about: its location, and names of tables and keys that the message mentions.

    message : str, as "soil 'sand': porosity must ..", "tunnel 0: ..", "gate: width ..";  location : tuple of str and
    int, of the table whose check failed; empty for the whole scene;  data : dict, the scene.
    """
    path = tuple(location)
    table = entry_at(data, path)
    if not path:
        head = re.match(r"(\w+?)s?\b(?: (?:'([^']*)'|(\d+)))?", message)
        name, called, number = head.groups() if head else ("", None, None)
        entries = data.get(f"{name}s")
        if isinstance(data.get(name), dict):
            path = (name,)
        elif isinstance(entries, list | tuple) and (called or number) is not None:
            names = [entry.get("name") if isinstance(entry, dict) else None for entry in entries]
            index = int(number) if number else names.index(called) if called in names else len(entries)
            path = (f"{name}s", index) if index < len(entries) else (f"{name}s",)
        elif entries is not None:
            path = (f"{name}s",)
        table = entry_at(data, path)
    if isinstance(table, dict):
        key = next((word for word in re.findall(r"\w+", message) if word in table), None)
        path = (*path, key) if key is not None else path
    return path


class _TooLong(Exception):
    """A text that takes too long to search."""
