"""What is told of a mistake in a scene: line of the file, key, message, and a likely wrong unit."""

from typing import Any

from coupling.scenes.layers import Layer
from coupling.scenes.lines import entry_at, holds, line_of, path_of
from coupling.scenes.plausibility import shown


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
