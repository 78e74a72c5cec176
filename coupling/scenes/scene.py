"""Scenes for users: ground, tunnels and gate for the MPM together with the ring for the structure.

A scene is a TOML file, or the name of a built-in one; ``base = "case-3"`` takes over everything that the file does not
say itself (tables are merged, lists are replaced; a table whose keys are numbers, as ``[soils.0]``, changes entries of
a list). What ``[ring]`` leaves out is computed here: the diameters from the
tunnel with the gate, ``[ring.ground]`` from the soil at that tunnel's axis (see `ground_at_axis`).
"""

import html
import json
import math
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

from pydantic import BaseModel, BeforeValidator, ValidationError, model_validator

from coupling.refused import SceneError
from coupling.scenes.layers import (
    NONE,
    Layer,
    change_layers,
    changed,
    check_levels,
    layers_of,
    layers_of_base,
    merged,
    parse_toml,
)
from coupling.scenes.mistake_lines import mistake_line
from coupling.scenes.plausibility import hints
from coupling.scenes.rings import UNITS, derived_ring, in_si, number_of, ring_of
from mpm.quantities import quantity_in
from mpm.scene import Scene as MpmScene
from mpm.scene import Tunnel
from structure.inputs import Input, mistakes, models_in, shortened, table_html
from structure.limits import Limits
from structure.ring import Ring

ADVICE = "no default, see the built-in case-3 for an example"
# What dotted names of the structure's tables begin with.
STRUCTURE = ("ring.", "limits.")
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


class Scene(Input, MpmScene):
    """A complete scene: ground, tunnels, gate as `mpm.Scene`, `ring` and its `limits` for the structure, or None."""

    ring: Ring | None = None
    limits: Limits | None = None

    def __repr__(self) -> str:
        from coupling.scenes.features import facts

        rows = facts(self)
        width = max(len(what) for what, _ in rows)
        return "\n".join([f"scene '{self.name}'", *(f"  {what:{width}}  {value}" for what, value in rows)])

    __str__ = __repr__

    def _repr_html_(self) -> str:
        from coupling.scenes.features import facts

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
        data = self.model_dump(exclude_none=True, warnings=False)
        if self.ring is not None and self.ring.ground is None:  # left out it would be derived
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
            data["ring"] = _without(data["ring"], derived_ring(self))
        check_levels(changes, f"changes of scene {self.name!r}")
        return make_scene(merged((*change_layers(changes), Layer(self.name, "", data))), self.name)

    @model_validator(mode="after")
    def _check_ring(self) -> "Scene":
        gate, ring = self.gate, self.ring
        if gate is not None and ring is not None:
            tunnel = self.tunnels[gate.tunnel]
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

    @model_validator(mode="after")
    def _check_jointed(self) -> "Scene":
        if not any(self.lining_of(tunnel) == "jointed" for tunnel in self.tunnels):
            return self
        if self.ring is None:
            raise ValueError("lining: 'jointed' must come with a ring, got none; add [ring], or choose 'elastic'")
        from structure.reduced import check_movable

        check_movable(self.ring)
        return self

    def jointed_ring(self, tunnel: Tunnel) -> Any:
        """The ring of a tunnel as it moves in the ground, reduced (:mod:`structure.reduced`)."""
        from structure.models import lining_model
        from structure.reduced import ReducedRing

        model = lining_model(tunnel.lining_model)(ring_of(self, self.tunnels.index(tunnel)))
        return ReducedRing(model, tunnel.lining_density, self.gravity, tunnel.lining_harmonics)

    @model_validator(mode="after")
    def _check_limits(self) -> "Scene":
        if self.limits is None:
            return self
        if self.ring is None:
            raise ValueError("limits: must come with a ring, got none; add [ring], or leave [limits] out")
        for tunnel in range(len(self.tunnels)):
            try:
                self.limits.check_ring(ring_of(self, tunnel))
            except ValueError as problem:
                where = "limits" if len(self.tunnels) == 1 else f"limits, ring of tunnel {tunnel}"
                raise ValueError(f"{where}: {problem}") from None
        return self


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
    layers = layers_of(str(name), ())
    check_levels(changes, f"changes of scene {str(name)!r}")
    # changes come from no file: a layer without a text keeps the lines of the files from being blamed
    layers = (*change_layers(changes), *layers)
    return make_scene(merged(layers), str(name), layers)


def as_scene(scene: Any) -> Scene:
    """A valid scene from what a caller has: a scene, which is validated once more, or the name or file of one.

    An `mpm.Scene` is a scene without a ring.

    Raises SceneError: as :func:`load_scene`; or what is given is neither.
    """
    if isinstance(scene, str | Path):
        return load_scene(scene)
    if isinstance(scene, dict):
        return make_scene(scene)
    if not isinstance(scene, MpmScene):
        raise SceneError(
            f"scene: must be a coupling.Scene, the name of a built-in one or a file, got {shortened(scene)}; "
            "load one: coupling.load_scene('quick')"
        )
    nested = scene.nested() if isinstance(scene, Scene) else scene.model_dump(exclude_none=True, warnings=False)
    return make_scene(nested, str(getattr(scene, "name", "scene")))


def parse_scene(text: str, origin: str) -> Scene:
    """A scene from the complete TOML text that a run stores.

    Raises SceneError: as :func:`load_scene`.
    """
    layer = Layer(origin, text, parse_toml(text, f"scene {origin!r}"))
    return make_scene(layer.data, origin, (layer,))


def make_scene(data: dict[str, Any], origin: str = "scene", layers: tuple[Layer, ...] = ()) -> Scene:
    """Validate a nested dictionary with the keys of the TOML file.

    Parameters
    ----------
    data : dict
        Tables ``box``, ``water``, ``soils`` .. of `mpm.Scene`, ``ring`` of `structure.Ring`, ``limits`` of
        `structure.Limits`, and ``base`` as in a file.
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
    check_levels(data, f"scene {origin!r}")
    if "base" in data:
        below = layers_of_base(data["base"], origin, ())
        data = merged((Layer(origin, "", {key: value for key, value in data.items() if key != "base"}), *below))
        layers = (*layers, *below)
    whole, data = data, dict(data)
    ring_data, limits_data = data.pop("ring", None), data.pop("limits", None)
    problems = _truth_values(whole, Scene, ())
    ground = None
    try:
        ground = MpmScene.model_validate(data)
    except ValidationError as error:
        problems += mistakes(error, MpmScene, extra_names=("ring", "limits", "base"), advice=ADVICE)
    # Without a valid ground there is nothing to derive the missing keys of the ring from.
    derived = {} if ground is None else derived_ring(ground)
    if isinstance(ring_data, dict) and ring_data.get("ground") == NONE:
        ring_data = {**ring_data, "ground": None}
    ring, found = _of_structure("ring", Ring, ring_data, derived, silent=() if derived else DERIVED, advice=ADVICE)
    limits, more = _of_structure("limits", Limits, limits_data, {})
    problems += found + more
    if not problems and ground is not None:
        try:
            return Scene.model_validate(data | {"ring": ring, "limits": limits})
        except ValidationError as error:
            problems += mistakes(error, Scene)
    unusual = hints(whole)
    lines = [f"scene {origin!r} has {len(problems)} mistake{'s' * (len(problems) > 1)}:"]
    lines += [mistake_line(location, message, whole, origin, layers, unusual) for location, message in problems]
    raise SceneError("\n  ".join(lines))


def _of_structure(table, model, data, derived, **about_mistakes):
    """What a table of the structure describes, None where it is left out or wrong, and its mistakes."""
    if data is None:
        return None, []
    if not isinstance(data, dict):
        return None, [((table,), f"must be a table, got {shortened(data)}; write [{table}] with its keys below")]
    data, wrong = in_si(data, table)
    if wrong:
        return None, wrong
    try:
        return model.model_validate(changed(derived, data)), []
    except ValidationError as error:
        found = mistakes(error, model, **about_mistakes)
        return None, [((table, *location), message) for location, message in found]


def number_in_unit(name: str, value: Any) -> Any:
    """A string with a unit as the number that the key of that dotted name takes; anything else as it is.

    Raises ValueError: as :func:`mpm.quantities.quantity_in`.
    """
    if name.startswith(STRUCTURE):
        return number_of(".".join(_without_numbers(name)), value)
    unit = unit_of(name)
    return value if unit is None else quantity_in(unit, value)


def unit_of(name: str) -> str | None:
    """Unit of the key of a dotted name, as pint reads it; None where it has none, or where there is no such key."""
    *tables, key = _without_numbers(name)
    if name.startswith(STRUCTURE):
        return UNITS.get(".".join([*tables, key]))
    try:
        model = MpmScene
        for table in tables:
            models = list(models_in(model.model_fields[table].annotation))  # of soils one a law
            model = next((each for each in models if key in each.model_fields), models[0])
        field = model.model_fields[key]
    except (KeyError, IndexError):
        return None
    kinds = (field, *getattr(field.annotation, "__args__", ()))
    metadata = [each for kind in kinds for each in getattr(kind, "metadata", getattr(kind, "__metadata__", ()))]
    return next((each.func.args[0] for each in metadata if isinstance(each, BeforeValidator)), None)


def _without_numbers(name):
    return [part for part in name.split(".") if not part.isdecimal()]


def _without(table: dict[str, Any], derived: dict[str, Any]) -> dict[str, Any]:
    """A table less the entries that only say what is derived anyway."""
    kept = {}
    for key, value in table.items():
        if isinstance(value, dict) and isinstance(derived.get(key), dict):
            kept[key] = _without(value, derived[key])
        elif key not in derived or value != derived[key]:
            kept[key] = value
    return kept


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
