"""Scenes for users: ground, tunnels and gate for the MPM together with the ring for the structure.

A scene is a TOML file, or the name of a built-in one; ``base = "case-3"`` takes over everything that the file does not
say itself (tables are merged, lists are replaced). What ``[ring]`` leaves out is computed here: the diameters from the
tunnel with the gate, ``[ring.ground]`` from the soil at that tunnel's axis (see `ground_at_axis`).
"""

import difflib
import json
import math
import tomllib
from functools import cached_property
from importlib import resources
from itertools import pairwise
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError, model_validator

from mpm.scene import Scene as MpmScene
from structure.ring import Ring

# No scene is longer; a larger file is something else.
MOST_BYTES = 1_000_000
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


class SceneError(ValueError):
    """A scene that can not be run: rule, name, value, remedy, one line a mistake."""


class Scene(BaseModel):
    """A complete scene: `mpm` for the ground and the gate, `ring` for the structure (None: no ring is computed)."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    mpm: MpmScene
    ring: Ring | None = None

    @property
    def name(self) -> str:
        """Name of the scene."""
        return self.mpm.name

    @cached_property
    def source(self) -> str:
        """The scene as TOML text, complete: every number, defaults included, without a base."""
        data = self.mpm.model_dump(exclude_none=True)
        if self.ring is not None:
            data["ring"] = self.ring.model_dump(exclude_none=True)
        return f"# Scene '{self.name}', complete, in SI units and degrees.\n" + "\n".join(_toml_lines(data)) + "\n"

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
                    f"got {gate.width:g} m; the gap lies in or between segments, give e.g. 0.2"
                )
        return self


def scene_names() -> list[str]:
    """Names of the built-in scenes, `quick` first."""
    files = resources.files("coupling") / "scenes"
    names = [entry.name.removesuffix(".toml") for entry in files.iterdir() if entry.name.endswith(".toml")]
    return sorted(names, key=lambda n: (n != "quick", n.rstrip("0123456789"), len(n), n))


def load_scene(name: str | Path, **changes: Any) -> Scene:
    """Load a built-in scene by name or a TOML file by path.

    Parameters
    ----------
    name : str or path
        A name of `scene_names`, or a file.
    **changes
        Tables or values that replace those of the file, for instance ``stop={"inflow_mass": 50.0}``.

    Returns
    -------
    Scene

    Raises
    ------
    SceneError
        Unknown name, unreadable file, or invalid values; every mistake found is named.
    """
    return make_scene(_merge(read_scene_data(name), changes), str(name))


def read_scene_data(name: str | Path) -> dict[str, Any]:
    """The nested dictionary of a scene, its bases merged, before validation; for :func:`make_scene`.

    Raises
    ------
    SceneError
        Unknown name or unreadable file.
    """
    return _read(str(name), ())


def make_scene(data: dict[str, Any], origin: str = "scene") -> Scene:
    """Validate a nested dictionary with the keys of the TOML file.

    Parameters
    ----------
    data : dict
        Tables ``box``, ``water``, ``soils`` .. of `mpm.Scene`, and ``ring`` of `structure.Ring`.
    origin : str
        What the message of an error starts with.

    Raises
    ------
    SceneError
        Naming every mistake.
    """
    data = dict(data)
    ring_data = data.pop("ring", None)
    problems: list[str] = []
    mpm_scene = ring = None
    try:
        mpm_scene = MpmScene.model_validate(data)
    except ValidationError as error:
        problems += _messages(error, MpmScene, "", extra_names=("ring", "base"))
    if ring_data is not None:
        if not isinstance(ring_data, dict):
            problems.append(f"ring: must be a table, got {ring_data!r}; write [ring] with its keys below")
        else:
            derived = {} if mpm_scene is None else derived_ring(mpm_scene)
            try:
                ring = Ring.model_validate(_merge(derived, ring_data))
            except ValidationError as error:
                # Without a valid ground there is nothing to derive the missing keys from.
                problems += _messages(error, Ring, "ring", silent=() if derived else DERIVED)
    if not problems and mpm_scene is not None:
        try:
            return Scene(mpm=mpm_scene, ring=ring)
        except ValidationError as error:
            problems += _messages(error, Scene, "")
    lines = [f"scene {origin!r} has {len(problems)} mistake{'s' * (len(problems) > 1)}:", *problems]
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


def ground_at_axis(scene: MpmScene, depth: float) -> dict[str, float]:
    """Soil parameters and effective stresses [Pa] at `depth` [m], for the soil springs of the ring.

    Vertical effective stress is the weight of the column above less the water pressure; the soil is saturated
    throughout, as in the MPM, and above the water table its water hangs at zero pressure; without water it is dry.
    Horizontal: k0 times that.
    """
    water_density = scene.water.density if scene.water is not None else 0.0
    table_depth = scene.water.table_depth if scene.water is not None else 0.0
    vertical = 0.0
    bottoms = [soil.top_depth for soil in scene.soils[1:]] + [math.inf]
    here = scene.soils[0]
    for soil, bottom in zip(scene.soils, bottoms, strict=True):
        if soil.top_depth < depth:
            here = soil
            density = (1 - soil.porosity) * soil.grain_density + soil.porosity * water_density
            vertical += density * scene.gravity * (min(depth, bottom) - soil.top_depth)
    vertical -= water_density * scene.gravity * max(0.0, depth - table_depth)
    return {
        "youngs_modulus": here.youngs_modulus,
        "poissons_ratio": here.poissons_ratio,
        "cohesion": here.cohesion,
        "friction_angle": here.friction_angle,
        "vertical_stress": vertical,
        "horizontal_stress": here.k0 * vertical,
    }


def _read(name: str, chain: tuple[str, ...]) -> dict[str, Any]:
    """The nested dictionary of a scene with its bases merged; `chain` holds the scenes that led here."""
    if name in chain:
        raise SceneError(f"scene {name!r}: base must not lead back to itself, got {' -> '.join([*chain, name])}")
    if name in scene_names():
        text = (resources.files("coupling") / "scenes" / f"{name}.toml").read_text(encoding="utf-8")
    else:
        text = _read_file(name)
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise SceneError(f"scene {name!r}: must be valid TOML, got: {error}; is the file truncated?") from None
    if not data:
        raise SceneError(f"scene {name!r}: must describe a scene, got an empty file; start from base = 'case-3'")
    base = data.pop("base", None)
    if base is None:
        return data
    if not isinstance(base, str):
        raise SceneError(
            f"scene {name!r}: base must be the name or file of a scene, got {base!r}; write base = 'case-3'"
        )
    # A file's base is looked up beside it, wherever the program was started.
    beside = Path(name).parent / base
    return _merge(_read(base if base in scene_names() or not beside.exists() else str(beside), (*chain, name)), data)


def _read_file(name: str) -> str:
    path = Path(name)
    if not path.exists():
        near = difflib.get_close_matches(name, scene_names(), 1)
        hint = f"did you mean {near[0]!r}? " if near else ""
        raise SceneError(
            f"scene {name!r}: must be a built-in scene or a file, got neither; {hint}"
            f"built-in: {', '.join(scene_names())}"
        )
    try:
        size = path.stat().st_size
        if size > MOST_BYTES:
            raise SceneError(f"scene {name!r}: must be shorter than 1 MB, got {size} bytes; this is no scene file")
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise SceneError(
            f"scene {name!r}: must be a readable file, got: {error.strerror}; check path and rights"
        ) from None
    except UnicodeDecodeError as error:
        raise SceneError(f"scene {name!r}: must be UTF-8 text, got: {error}; this is no scene file") from None


#: Tables that a scene may leave out although its base has them: `water = "none"` makes it dry.
OPTIONAL_TABLES = ("water", "gate", "ring")
NONE = "none"


def _merge(base: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    merged = dict(base)
    for key, value in changes.items():
        if value == NONE and key in OPTIONAL_TABLES:
            merged.pop(key, None)
            continue
        both = isinstance(value, dict) and isinstance(merged.get(key), dict)
        merged[key] = _merge(merged[key], value) if both else value
    return merged


def _messages(
    error: ValidationError,
    model: type[BaseModel],
    prefix: str,
    *,
    silent: tuple[str, ...] = (),
    extra_names: tuple[str, ...] = (),
) -> list[str]:
    """One line a mistake: where, rule, value, remedy."""
    lines = []
    missing: dict[tuple[Any, ...], list[str]] = {}
    for item in error.errors():
        if item["type"] == "missing":
            if item["loc"][-1] not in silent:
                missing.setdefault(item["loc"][:-1], []).append(str(item["loc"][-1]))
            continue
        if item["type"] == "too_short" and item["input"]:
            # Only the echo of the mistakes inside its entries.
            continue
        where = _where(item["loc"], prefix)
        lines.append(f"{where}: {_message(item, model, extra_names)}" if where else _message(item, model, extra_names))
    for table, names in missing.items():
        where = _where(table, prefix)
        # A soil is where newcomers change one number and lose the others.
        whole = (
            f"; [[{table[0]}]] replaces all {table[0]} of the base, so copy all keys of it" if len(table) > 1 else ""
        )
        them = "it decides the answer and has" if len(names) == 1 else "they decide the answer and have"
        lines.append(
            f"{where}{': ' if where else ''}{', '.join(names)} missing; {them} no default, see the built-in case-3 for"
            f" an example{whole}"
        )
    return lines


def _where(location: tuple[Any, ...], prefix: str) -> str:
    for part in location:
        prefix += f"[{part}]" if isinstance(part, int) else f"{'.' * bool(prefix)}{part}"
    return prefix


def _message(item: Any, model: type[BaseModel], extra_names: tuple[str, ...]) -> str:
    kind, value = item["type"], item["input"]
    if kind == "extra_forbidden":
        here = [*_names_at(model, item["loc"][:-1]), *(extra_names if len(item["loc"]) == 1 else ())]
        near = difflib.get_close_matches(str(item["loc"][-1]), here, 1)
        return f"unknown key, got {value!r}; " + (f"did you mean {near[0]!r}?" if near else f"known: {', '.join(here)}")
    message = item["msg"].removeprefix("Value error, ")
    if kind == "value_error":
        return message
    rule = message.replace("Input should", "must", 1)
    if kind in ("model_type", "dict_type"):
        rule = "must be a table"
    shown = repr(value) if isinstance(value, str | int | float) else f"a {type(value).__name__}"
    limits = item.get("ctx", {})
    if kind == "too_short":
        return f"must have at least {limits['min_length']} entry, got {value!r}; add one"
    remedy = next(
        (f"give a value {sign} {limits[key]:g}" for key, sign in _LIMITS.items() if key in limits), "correct it"
    )
    return f"{rule}, got {shown}; {remedy}"


_LIMITS = {"gt": "above", "ge": "from", "lt": "below", "le": "up to"}


def _names_at(model: type[BaseModel], location: tuple[Any, ...]) -> list[str]:
    """Keys known in the table at `location`."""
    for part in location:
        if isinstance(part, int):
            continue
        models = list(_models_in(model.model_fields[part].annotation))
        if not models:
            return []
        model = models[0]
    return list(model.model_fields)


def _models_in(annotation: Any) -> Any:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for argument in getattr(annotation, "__args__", ()):
        yield from _models_in(argument)


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
