"""Validated input: immutable, unknown keys refused, and mistakes told in words (rule, name, value, remedy)."""

from __future__ import annotations

import difflib
import html
import re
import reprlib
import textwrap
import warnings
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self, TypeVar

from pydantic import BaseModel, ConfigDict, Discriminator, Tag, ValidationError

from structure.plausibility import Usual, unusual

#: Path of a key in nested tables and the message about it.
Mistake = tuple[tuple[Any, ...], str]

_Entry = TypeVar("_Entry")
#: Ways to read an entry, which pydantic puts into the location of a mistake; no key is called so.
_WAYS = ("<one>", "<several>")
#: One entry, or a tuple of them.
OneOrSeveral = Annotated[
    Annotated[_Entry, Tag(_WAYS[0])] | Annotated[tuple[_Entry, ...], Tag(_WAYS[1])],
    Discriminator(lambda value: _WAYS[isinstance(value, list | tuple)]),
]

_LIMITS = {"gt": "above", "ge": "from", "lt": "below", "le": "up to"}


class InputError(ValueError):
    """Values that an input does not take: rule, name, value, remedy, one line a mistake."""


class GushingWarning(UserWarning):
    """What a user should look at again; the run goes on. All warnings of this program are of this class."""


class Input(BaseModel):
    """Base of what users state: frozen; neither unknown keys nor infinite numbers pass."""

    #: Keys whose unusual values are warned of when the input is made in Python: see `structure.plausibility`.
    usual: ClassVar[Usual] = {}

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    if not TYPE_CHECKING:  # type checkers see the fields as arguments

        def __init__(self, **values):
            try:
                super().__init__(**values)
            except ValidationError as error:
                raise InputError(refusal(type(self).__name__, mistakes(error, type(self)))) from None
            for name, hint in self.unusual().items():
                warnings.warn(f"{type(self).__name__}.{name} {hint}", GushingWarning, stacklevel=2)

        # inner tables are validated with the outer one, whose mistakes then name the whole path
        __init__.__pydantic_base_init__ = True

    def __repr__(self) -> str:
        # a value a line, as Python would take it back
        lines = [f"{name}={value!r}" for name, value in self]
        return f"{type(self).__name__}(\n" + "".join(textwrap.indent(f"{line},\n", "    ") for line in lines) + ")"

    __str__ = __repr__

    def _repr_html_(self) -> str:
        return table_html(type(self).__name__, {name: _short_html(value) for name, value in self})

    def unusual(self) -> dict[str, str]:
        """Values of another order of magnitude than any that is usual: name to what to think of."""
        told = {}
        for name, usual in self.usual.items():
            given = getattr(self, name)
            hints = (unusual(entry, *usual) for entry in (given if isinstance(given, tuple) else (given,)))
            told[name] = next(filter(None, hints), "")
        return {name: hint for name, hint in told.items() if hint}

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """A copy with other values, validated as a new one is.

        Raises
        ------
        InputError
        """
        return type(self)(**{name: getattr(self, name) for name in self.model_fields_set} | dict(update or {}))


def table_html(title: str, rows: Mapping[str, str]) -> str:
    """A table for a notebook: title, and name to HTML of the value."""
    body = "".join(
        f'<tr><th style="text-align:left">{html.escape(name)}</th><td style="text-align:left">{value}</td></tr>'
        for name, value in rows.items()
    )
    return f"<table><caption><b>{html.escape(title)}</b></caption><tbody>{body}</tbody></table>"


def _short_html(value: Any) -> str:
    if isinstance(value, Input):
        return f"<details><summary>{html.escape(type(value).__name__)}</summary>{value._repr_html_()}</details>"
    if isinstance(value, float):
        return html.escape(f"{value:g}")
    return html.escape(", ".join(f"{entry:g}" for entry in value) if isinstance(value, tuple) else str(value))


def refusal(who: str, found: list[Mistake]) -> str:
    """All mistakes of an input as one text."""
    lines = [f"{'.'.join(map(str, location))}: {message}" if location else message for location, message in found]
    if len(lines) == 1:
        return f"{who}: {lines[0]}"
    return "\n  ".join([f"{who} has {len(lines)} mistakes:", *lines])


def mistakes(
    error: ValidationError,
    model: type[BaseModel],
    *,
    silent: tuple[str, ...] = (),
    extra_names: tuple[str, ...] = (),
    advice: str = "no default: give it a value",
) -> list[Mistake]:
    """Location and message of every mistake: rule, value, remedy.

    Parameters
    ----------
    error : pydantic.ValidationError
    model : type
        What was validated.
    silent : tuple of str
        Keys whose absence is not told.
    extra_names : tuple of str
        Further keys that its outermost table knows.
    advice : str
        What to do about a missing number.
    """
    found: list[Mistake] = []
    missing: dict[tuple[Any, ...], list[str]] = {}
    for item in error.errors(include_url=False):
        item["loc"] = tuple(part for part in item["loc"] if part not in _WAYS)
        if item["type"] == "missing":
            if item["loc"][-1] not in silent:
                missing.setdefault(item["loc"][:-1], []).append(str(item["loc"][-1]))
            continue
        if item["type"] == "too_short" and item["input"]:
            # Only the echo of the mistakes inside its entries.
            continue
        found.append((item["loc"], _message(item, model, extra_names)))
    for name in missing.pop((), []):
        found.append(((name,), f"missing; it decides the answer and has {advice}"))
    for table, names in missing.items():
        # A soil is where newcomers change one number and lose the others.
        whole = (
            f"; [[{table[0]}]] replaces all {table[0]} of the base, so copy all keys of it, or change the entry of the "
            f"base by [{table[0]}.{table[1]}]"
            if len(table) > 1
            else ""
        )
        them = "it decides the answer and has" if len(names) == 1 else "they decide the answer and have"
        found.append((table, f"{', '.join(names)} missing; {them} {advice}{whole}"))
    return found


def _message(item: Any, model: type[BaseModel], extra_names: tuple[str, ...]) -> str:
    kind, value = item["type"], item["input"]
    if kind == "extra_forbidden":
        here = [*_names_at(model, item["loc"][:-1]), *(extra_names if len(item["loc"]) == 1 else ())]
        near = difflib.get_close_matches(str(item["loc"][-1]), here, 1)
        return f"unknown key, got {shortened(value)}; " + (
            f"did you mean {near[0]!r}?" if near else f"known: {', '.join(here)}"
        )
    message = item["msg"].removeprefix("Value error, ")
    if kind == "value_error":
        return message
    rule = message.replace("Input should", "must", 1).replace("be a valid tuple", "be a list")
    if kind in ("model_type", "dict_type"):
        rule = "must be a table"
    limits = item.get("ctx", {})
    given = shortened(value) if isinstance(value, str | int | float) else f"a {type(value).__name__}"
    if kind == "too_short":
        return f"must have at least {limits['min_length']} entry, got {shortened(value)}; add one"
    if kind == "too_long":
        return f"must have at most {limits['max_length']} entries, got {len(value)}; merge or leave out some"
    if kind == "string_pattern_mismatch":
        return f"must be letters, digits and the like, beginning with a letter or digit, got {given}; rename it"
    if kind == "literal_error" and isinstance(value, str):
        names = {name.lower(): name for name in re.findall("'([^']*)'", limits["expected"])}
        near = difflib.get_close_matches(value.lower(), names, 1)
        return f"{rule}, got {given}; " + (f"did you mean {names[near[0]]!r}?" if near else "choose one of these")
    remedy = next(
        (f"give a value {sign} {limits[key]:g}" for key, sign in _LIMITS.items() if key in limits), "correct it"
    )
    if kind == "float_parsing":
        remedy = "give a plain number"
    return f"{rule}, got {given}; {remedy}"


def shortened(value: Any) -> str:
    """A value as a message shows it, never long."""
    short = reprlib.Repr()
    short.maxstring = short.maxother = short.maxlong = 60
    return short.repr(value)


def _names_at(model: type[BaseModel], location: tuple[Any, ...]) -> list[str]:
    """Keys known in the table at `location`."""
    for part in location:
        if isinstance(part, int):
            continue
        models = list(models_in(model.model_fields[part].annotation))
        if not models:
            return []
        model = models[0]
    return list(model.model_fields)


def models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    """Input models that an annotation names."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for argument in getattr(annotation, "__args__", ()):
        yield from models_in(argument)
