"""Scenes for users: ground, tunnels and gate for the MPM together with the ring for the structure.

A scene is a TOML file, or the name of a built-in one; ``base = "case-3"`` takes over everything that the file does not
say itself (tables are merged, lists are replaced; a table whose keys are numbers, as ``[soils.0]``, changes entries of
a list). What ``[ring]`` leaves out is computed here: the diameters from the
tunnel with the gate, ``[ring.ground]`` from the soil at that tunnel's axis (see `ground_at_axis`).
"""

import difflib
import html
import json
import math
import tomllib
from functools import cached_property
from importlib import resources
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import BaseModel, BeforeValidator, ValidationError, model_validator

from coupling.plausibility import hints, shown
from coupling.ring_units import ring_in_si, ring_number, ring_unit
from coupling.scene_lines import entry_at, holds, line_of, path_of
from mpm.scene import Scene as MpmScene
from mpm.scene import quantity_in
from structure.inputs import Input, InputError, mistakes, models_in, shortened, table_html
from structure.ring import Ring

# No scene is longer; a larger file is something else.
MOST_BYTES = 1_000_000
# The deepest key of a scene is ring.ground.law; what is much deeper is no scene and would overflow the stack.
MOST_LEVELS = 12
CHANGES = "changes in Python"
ADVICE = "no default, see the built-in case-3 for an example"
# Keys of [ring] and [ring.ground] that follow from the ground when left out.
DERIVED = (
    "outer_diameter",
    "inner_diameter",
    "youngs_modulus",
    "poissons_ratio",
    "cohesion",
    "friction_angle",
    "vertical_stress",
    "horizontal_stress",
)


class SceneError(InputError):
    """A scene that can not be run: rule, name, value, remedy, one line a mistake."""


class Layer(NamedTuple):
    """A TOML text that a scene was read from, the scene's own file before its bases.

    name : str;  text : str;  data : dict, its nested dictionary.
    """

    name: str
    text: str
    data: dict[str, Any]


class Scene(Input):
    """A complete scene: `mpm` for the ground and the gate, `ring` for the structure (None: no ring is computed)."""

    mpm: MpmScene
    ring: Ring | None = None

    @property
    def name(self) -> str:
        """Name of the scene."""
        return self.mpm.name

    def __repr__(self) -> str:
        from coupling.report.scene_facts import facts

        rows = facts(self)
        width = max(len(what) for what, _ in rows)
        return "\n".join([f"scene '{self.name}'", *(f"  {what:{width}}  {value}" for what, value in rows)])

    __str__ = __repr__

    def _repr_html_(self) -> str:
        from coupling.report.scene_facts import facts

        text = f"<details><summary>the complete scene</summary><pre>{html.escape(self.source)}</pre></details>"
        rows = {what: html.escape(value) for what, value in facts(self)}
        return table_html(f"scene '{self.name}'", rows) + text

    @cached_property
    def source(self) -> str:
        """The scene as TOML text, complete: every number, defaults included, without a base."""
        head = f"# Scene '{self.name}', complete, in SI units and degrees.\n"
        return head + "\n".join(_toml_lines(self.nested())) + "\n"

    def nested(self) -> dict[str, Any]:
        """The scene as the nested dictionary of its complete TOML file, for :func:`make_scene`."""
        data = self.mpm.model_dump(exclude_none=True, warnings=False)
        if self.ring is not None:
            data["ring"] = self.ring.model_dump(exclude_none=True, warnings=False)
            if self.ring.ground is None:  # left out it would be derived
                data["ring"]["ground"] = NONE
        return data

    def changed(self, **changes: Any) -> "Scene":
        """The scene with other values, validated; what of the ring follows from the ground follows it again.

        Parameters
        ----------
        **changes
            As of :func:`load_scene`: ``scene.changed(stop={"inflow_mass": 50.0})``.

        Raises
        ------
        SceneError
            Invalid values; every mistake found is named.
        """
        data = self.nested()
        if "ring" in data:
            data["ring"] = _without(data["ring"], derived_ring(self.mpm))
        _check_levels(changes, f"changes of scene {self.name!r}")
        return make_scene(_merged((*_change_layers(changes), Layer(self.name, "", data))), self.name)

    @model_validator(mode="after")
    def _check(self) -> "Scene":
        gate, ring = self.mpm.gate, self.ring
        if gate is not None and ring is not None:
            tunnel = self.mpm.tunnels[gate.tunnel]
            if (ring.outer_diameter, ring.inner_diameter) != (tunnel.outer_diameter, tunnel.inner_diameter):
                raise ValueError(
                    f"ring: diameters must be those of tunnel {gate.tunnel} ({tunnel.outer_diameter:g} and "
                    f"{tunnel.inner_diameter:g} m), got {ring.outer_diameter:g} and "
                    f"{ring.inner_diameter:g}; leave them out"
                )
            joints = sorted(ring.joint_angles)
            shortest = min((b - a for a, b in pairwise([*joints, *(a + 360.0 for a in joints[:1])])), default=360.0)
            segment = math.radians(shortest) * ring.inner_diameter / 2
            if gate.width >= segment:
                raise ValueError(
                    f"gate: width must be below the shortest segment of the ring ({segment:.3g} m on its inner face), "
                    f"got {gate.width:g} m; the gate lies in or between segments, give e.g. 0.2"
                )
        return self


def scene_names() -> list[str]:
    """Names of the built-in scenes, `quick` first."""
    files = resources.files("coupling") / "scenes"
    names = [entry.name.removesuffix(".toml") for entry in files.iterdir() if entry.name.endswith(".toml")]
    return sorted(names, key=lambda n: (n != "quick", n.rstrip("0123456789"), len(n), n))


def load_scene(name: str | Path, /, **changes: Any) -> Scene:
    """Load a built-in scene by name or a TOML file by path.

    Parameters
    ----------
    name : str or path
        A name of `scene_names`, or a file.
    **changes
        Tables or values that replace those of the file, for instance ``stop={"inflow_mass": 50.0}``; or dotted names,
        as ``**{"soils.0.friction_angle": 33}``, which change one value.

    Returns
    -------
    Scene

    Raises
    ------
    SceneError
        Unknown name, unreadable file, or invalid values; every mistake found is named.
    """
    layers = _read(str(name), ())
    _check_levels(changes, f"changes of scene {str(name)!r}")
    # changes come from no file: a layer without a text keeps the lines of the files from being blamed
    layers = (*_change_layers(changes), *layers)
    return make_scene(_merged(layers), str(name), layers)


def read_scene_data(name: str | Path) -> dict[str, Any]:
    """The nested dictionary of a scene, its bases merged, before validation; for :func:`make_scene`.

    Raises
    ------
    SceneError
        Unknown name or unreadable file.
    """
    return _merged(_read(str(name), ()))


def as_scene(scene: Any) -> Scene:
    """A valid scene from what a caller has: a scene, which is validated once more, or the name or file of one.

    Raises
    ------
    SceneError
        As :func:`load_scene`; or what is given is neither.
    """
    if isinstance(scene, str | Path):
        return load_scene(scene)
    if isinstance(scene, MpmScene):
        raise SceneError(
            f"scene '{scene.name}': must be a coupling.Scene, got its part for the ground, an mpm.Scene; "
            "give coupling.Scene(mpm=..), with ring=.. where forces in the ring are wanted"
        )
    if isinstance(scene, dict):
        return make_scene(scene)
    if not isinstance(scene, Scene):
        raise SceneError(
            f"scene: must be a coupling.Scene, the name of a built-in one or a file, got {shortened(scene)}; "
            "load one: coupling.load_scene('quick')"
        )
    return make_scene(scene.nested(), str(getattr(scene.mpm, "name", "scene")))


def parse_scene(text: str, origin: str) -> Scene:
    """A scene from the complete TOML text that a run stores.

    Raises
    ------
    SceneError
        As :func:`load_scene`.
    """
    layer = Layer(origin, text, parse_toml(text, f"scene {origin!r}"))
    return make_scene(layer.data, origin, (layer,))


def make_scene(data: dict[str, Any], origin: str = "scene", layers: tuple[Layer, ...] = ()) -> Scene:
    """Validate a nested dictionary with the keys of the TOML file.

    Parameters
    ----------
    data : dict
        Tables ``box``, ``water``, ``soils`` .. of `mpm.Scene`, ``ring`` of `structure.Ring`, and ``base`` as in a file.
    origin : str
        What the message of an error starts with.
    layers : tuple of Layer
        Texts that the data come from, for the line numbers of mistakes.

    Raises
    ------
    SceneError
        Naming every mistake.
    """
    if not isinstance(data, dict):
        raise SceneError(
            f"scene {origin!r}: must be a dictionary of tables, got a {type(data).__name__}; "
            "give the nested dictionary of its TOML file"
        )
    _check_levels(data, f"scene {origin!r}")
    if "base" in data:
        below = _read_base(data["base"], origin, ())
        data = _merged((Layer(origin, "", {key: value for key, value in data.items() if key != "base"}), *below))
        layers = (*layers, *below)
    whole, data = data, dict(data)
    ring_data = data.pop("ring", None)
    problems = _truth_values(data, MpmScene, ())
    if isinstance(ring_data, dict):
        problems += _truth_values(ring_data, Ring, ("ring",))
    mpm_scene = ring = None
    try:
        mpm_scene = MpmScene.model_validate(data)
    except ValidationError as error:
        problems += mistakes(error, MpmScene, extra_names=("ring", "base"), advice=ADVICE)
    if ring_data is not None:
        if not isinstance(ring_data, dict):
            problems.append(
                (("ring",), f"must be a table, got {shortened(ring_data)}; write [ring] with its keys below")
            )
        else:
            derived = {} if mpm_scene is None else derived_ring(mpm_scene)
            if ring_data.get("ground") == NONE:
                ring_data = {**ring_data, "ground": None}
            ring_data, wrong = ring_in_si(ring_data)
            problems += wrong
            try:
                ring = Ring.model_validate(changed(derived, ring_data)) if not wrong else None
            except ValidationError as error:
                # Without a valid ground there is nothing to derive the missing keys from.
                found = mistakes(error, Ring, silent=() if derived else DERIVED, advice=ADVICE)
                problems += [(("ring", *location), message) for location, message in found]
    if not problems and mpm_scene is not None:
        try:
            return Scene.model_validate({"mpm": mpm_scene, "ring": ring})
        except ValidationError as error:
            problems += mistakes(error, Scene)
    unusual = hints(whole)
    lines = [f"scene {origin!r} has {len(problems)} mistake{'s' * (len(problems) > 1)}:"]
    lines += [_line(location, message, whole, origin, layers, unusual) for location, message in problems]
    raise SceneError("\n  ".join(lines))


def derived_ring(scene: MpmScene) -> dict[str, Any]:
    """Keys of ``[ring]`` that follow from the tunnel with the gate, else the first: diameters and `ground`."""
    if not scene.tunnels:
        return {}
    tunnel = scene.tunnels[scene.gate.tunnel if scene.gate is not None else 0]
    return {
        "outer_diameter": tunnel.outer_diameter,
        "inner_diameter": tunnel.inner_diameter,
        "ground": ground_at_axis(scene, tunnel.axis_depth),
    }


def ring_of(scene: Scene, tunnel: int) -> Ring:
    """The ring of a tunnel: that of the scene for the tunnel with the gate (else the first), the same concrete and
    joints with the tunnel's own diameters and the ground at its own axis for any other.

    Raises
    ------
    SceneError
        No ring, or joints that the other diameters do not take.
    """
    if scene.ring is None:
        raise SceneError(f"scene '{scene.name}': has no [ring]; add one to get internal forces")
    own = scene.mpm.gate.tunnel if scene.mpm.gate is not None else 0
    if tunnel == own:
        return scene.ring
    there, home = scene.mpm.tunnels[tunnel], scene.mpm.tunnels[own]
    values = scene.ring.model_dump() | {"outer_diameter": there.outer_diameter, "inner_diameter": there.inner_diameter}
    if values["ground"] is not None and there.axis_depth != home.axis_depth:
        values["ground"] |= ground_at_axis(scene.mpm, there.axis_depth)
    try:
        return Ring.model_validate(values)
    except ValidationError as error:
        said = "; ".join(message for _, message in mistakes(error, Ring))
        raise SceneError(f"scene '{scene.name}', ring of tunnel {tunnel}: {said}") from None


def ground_at_axis(scene: MpmScene, depth: float) -> dict[str, float]:
    """Soil parameters and effective stresses [Pa] at `depth` [m], for the soil springs of the ring.

    Vertical: :meth:`mpm.Scene.vertical_stress`; horizontal: the K0 of
    :meth:`mpm.scene.Soil.lateral_pressure_coefficient` times that.
    """
    vertical = scene.vertical_stress(depth)
    here = [soil for soil in scene.soils if soil.top_depth < depth or soil is scene.soils[0]][-1]
    return {
        "youngs_modulus": here.youngs_modulus,
        "poissons_ratio": here.poissons_ratio,
        "cohesion": here.cohesion,
        "friction_angle": here.friction_angle,
        "vertical_stress": vertical,
        "horizontal_stress": here.lateral_pressure_coefficient(vertical) * vertical,
    }


def _read(name: str, chain: tuple[str, ...]) -> tuple[Layer, ...]:
    """The texts that make up a scene, its own first; `chain` holds the scenes that led here."""
    if name in chain:
        raise SceneError(
            f"scene {name!r}: base must not lead back to itself, got {' -> '.join([*chain, name])}; name another base"
        )
    if len(chain) > MOST_LEVELS:
        raise SceneError(f"scene {name!r}: at most {MOST_LEVELS} bases may follow each other; merge some of the files")
    if name in scene_names():
        text = (resources.files("coupling") / "scenes" / f"{name}.toml").read_text(encoding="utf-8")
    else:
        text = _read_file(name)
    data = parse_toml(text, f"scene {name!r}")
    if not data:
        raise SceneError(f"scene {name!r}: must describe a scene, got an empty file; start from base = 'case-3'")
    base = data.pop("base", None)
    layer = Layer(name, text, data)
    if base is None:
        return (layer,)
    return (layer, *_read_base(base, name, chain))


def _read_base(base: Any, name: str, chain: tuple[str, ...]) -> tuple[Layer, ...]:
    """The texts of the base that the scene `name` states."""
    if not isinstance(base, str):
        raise SceneError(
            f"scene {name!r}: base must be the name or file of a scene, got {shortened(base)}; write base = 'case-3'"
        )
    # A file's base is looked up beside it, wherever the program was started.
    beside = Path(name).parent / base
    return _read(base if base in scene_names() or not _is_there(beside) else str(beside), (*chain, name))


def nested(name: str, value: Any) -> dict[str, Any]:
    """A value under its dotted name as nested tables, for :func:`changed`.

    >>> nested("soils.0.k0", 0.5)
    {'soils': {'0': {'k0': 0.5}}}
    """
    for part in reversed(name.split(".")):
        value = {part: value}
    return value


def _change_layers(changes: dict[str, Any]) -> list[Layer]:
    """Changes in Python as the layers that they are, the last one first."""
    return [Layer(CHANGES, "", nested(key, value)) for key, value in reversed(changes.items())]


def number_in_unit(name: str, value: Any) -> Any:
    """A string with a unit as the number that the key of that dotted name takes; anything else as it is.

    Raises
    ------
    ValueError
        As :func:`mpm.scene.quantity_in`.
    """
    parts = _without_numbers(name)
    if parts[0] == "ring":
        return ring_number(tuple(parts), value)
    unit = unit_of(name)
    return value if unit is None else quantity_in(unit, value)


def unit_of(name: str) -> str | None:
    """Unit of the key of a dotted name, as pint reads it; None where it has none, or where there is no such key."""
    parts = _without_numbers(name)
    if parts[0] == "ring":
        return ring_unit(tuple(parts))
    try:
        model = MpmScene
        for part in parts[:-1]:
            model = next(models_in(model.model_fields[part].annotation))
        field = model.model_fields[parts[-1]]
    except (KeyError, StopIteration):
        return None
    kinds = (field, *getattr(field.annotation, "__args__", ()))
    metadata = [each for kind in kinds for each in getattr(kind, "metadata", getattr(kind, "__metadata__", ()))]
    return next((each.func.args[0] for each in metadata if isinstance(each, BeforeValidator)), None)


def _without_numbers(name):
    return [part for part in name.split(".") if not part.isdecimal()]


def parse_changes(texts: list[str]) -> dict[str, Any]:
    """Changes for :func:`load_scene` from texts as "gate.angle=45", "gate.width=20 cm" or "water=none".

    Raises
    ------
    SceneError
        A text without a name or a value.
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


def _merged(layers: tuple[Layer, ...]) -> dict[str, Any]:
    data: dict[str, Any] = {}
    file = ""
    for layer in reversed(layers):
        file = file if layer.name == CHANGES else layer.name
        try:
            data = changed(data, layer.data)
        except SceneError as problem:
            raise SceneError(f"scene {file!r}: {problem}") from None
    return data


def parse_toml(text: str, who: str) -> dict[str, Any]:
    """Nested dictionary of a TOML text.

    Raises
    ------
    SceneError
        Not valid TOML, with the line, or nested more deeply than any scene.
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
    _check_levels(data, who)
    return data


def _check_levels(data: Any, who: str) -> None:
    entries = [data]
    for _ in range(MOST_LEVELS):
        inner = (each.values() if isinstance(each, dict) else each for each in entries)
        entries = [entry for each in inner for entry in each if isinstance(entry, dict | list | tuple)]
        if not entries:
            return
    raise SceneError(f"{who}: must not nest tables and lists more than {MOST_LEVELS} deep; this is no scene")


def _is_there(path: Path) -> bool:
    try:
        return path.exists()
    except (OSError, ValueError):  # too long a name, a zero in it
        return False


def _read_file(name: str) -> str:
    path = Path(name)
    if not _is_there(path):
        near = difflib.get_close_matches(name, scene_names(), 1)
        hint = f"did you mean {near[0]!r}? " if near else ""
        raise SceneError(
            f"scene {shortened(name)}: must be a built-in scene or a file, got neither; {hint}"
            f"built-in: {', '.join(scene_names())}"
        )
    return read_toml_file(path, f"scene {name!r}")


def read_toml_file(path: Path, who: str) -> str:
    """Text of a file that is meant to be TOML.

    Raises
    ------
    SceneError
        No regular file (a device or a pipe may never end), longer than 1 MB, unreadable, or no text.
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


#: What a scene may leave out although its base has it: `water = "none"` makes it dry.
OPTIONAL = ("water", "gate", "ring", "k0")
NONE = "none"


def _without(table: dict[str, Any], derived: dict[str, Any]) -> dict[str, Any]:
    """A table less the entries that only say what is derived anyway."""
    kept = {}
    for key, value in table.items():
        if isinstance(value, dict) and isinstance(derived.get(key), dict):
            kept[key] = _without(value, derived[key])
        elif key not in derived or value != derived[key]:
            kept[key] = value
    return kept


def changed(base: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """The nested dictionary of a scene with that of some changes merged into it, see the module's description.

    Raises
    ------
    SceneError
        A list is asked for an entry that it does not have.
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
        result[number] = changed(here, value) if isinstance(here, dict) and isinstance(value, dict) else value
    return result


def _line(
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


def _truth_values(data: Any, model: type[BaseModel], location: tuple[Any, ...]) -> list[tuple[tuple[Any, ...], str]]:
    """Where a number or text is asked for and a truth value is given, which pydantic would take for 0 or 1."""
    found = []
    for key, value in data.items() if isinstance(data, dict) else ():
        field, where = model.model_fields.get(key) if isinstance(key, str) else None, (*location, key)
        if field is None:
            continue
        inner = next(models_in(field.annotation), None)
        entries = enumerate(value) if isinstance(value, list | tuple) else [(None, value)]
        for index, entry in entries:
            at = where if index is None else (*where, index)
            if isinstance(entry, bool) and field.annotation is not bool:
                found.append((at, f"must not be a truth value, got {str(entry).lower()}; give the number or name"))
            elif inner is not None:
                found += _truth_values(entry, inner, at)
    return found


def _toml_lines(data: dict[str, Any], path: str = "") -> list[str]:
    """TOML of nested dictionaries whose leaves are strings, numbers, booleans and tuples of these."""
    # JSON writes such leaves as TOML does.
    lines, tables = [], []
    for key, value in data.items():
        name = f"{path}.{key}" if path else key
        if isinstance(value, dict):
            tables += ["", f"[{name}]", *_toml_lines(value, name)]
        elif isinstance(value, list | tuple) and value and isinstance(value[0], dict):
            for entry in value:
                tables += ["", f"[[{name}]]", *_toml_lines(entry, name)]
        else:
            lines.append(f"{key} = {json.dumps(value, ensure_ascii=False)}")
    return lines + tables
