"""The cases of a study: scenes that differ in its parameters, each under a key of all that decides its result."""

import hashlib
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from coupling.refused import Refused, SceneError
from coupling.scenes.layers import changed, entry_at, nested, read_scene_data
from coupling.scenes.scene import Scene, make_scene
from coupling.studies.design import AS_IT_IS, Study, StudyError, short_names, value_text
from mpm.k0_procedure import lateral_pressure_range

#: Changes when stored cases can no longer be used.
FORMAT = "2"


@dataclass(frozen=True)
class Case:
    """One scene of a study: its parameters, and a key that is the same whenever the same would be computed.

    parameters : every parameter of the study, as the scene takes it (SI);  changes : those that the design sets in this
    case.
    """

    index: int
    parameters: dict[str, Any]
    changes: dict[str, Any]
    scene: Scene
    key: str

    @property
    def name(self) -> str:
        """What the case changes, in a few words."""
        names = short_names(self.changes)
        return ", ".join(f"{n} {value_text(v)}" for n, v in zip(names, self.changes.values(), strict=True)) or AS_IT_IS


def cases(study: Study) -> list[Case]:
    """All cases of a study, validated before any of them runs.

    Raises StudyError: a parameter that the scene does not have, or values that it refuses; the case is named.
    """
    found: dict[str, Case] = {}
    for number, changes in enumerate(study.combinations()):
        base = changes.get("scene", study.scene)
        try:
            data = read_scene_data(base)
            for name, value in {**study.fixed, **changes}.items():
                if name != "scene":
                    data = changed(data, nested(name, value))
            scene = make_scene(data, f"case {number}")
        except SceneError as problem:
            shown = ", ".join(f"{name} = {value}" for name, value in changes.items())
            raise StudyError(f"study '{study.name}', case {number} ({shown}): {problem}") from None
        values = {name: base if name == "scene" else _value_in(scene, name) for name in study.parameters}
        known = {name: changes.get(name, AS_IT_IS) if isinstance(v, dict) else v for name, v in values.items()}
        key = _key(scene, study)
        # what a scene is already is no case more
        found.setdefault(key, Case(len(found), known, {name: known[name] for name in changes}, scene, key))
    return list(found.values())


def check_backends(study: Study, todo: list[Case]):
    """Refuse lining models that are not there before anything runs; a study that ran is read without them.

    Raises StudyError: an unknown model, the same one twice, or another than has moved the ring of a case.
    """
    from coupling.responses.respond import check_backend
    from coupling.scenes.rings import moved_by
    from structure.models import lining_model, lining_model_names, model_name

    try:
        for backend in study.backends:
            if backend not in lining_model_names():
                lining_model(backend)  # says why not, or finds the class in a file
    except ValueError as problem:
        raise StudyError(f"study '{study.name}': backends: {problem}") from None
    names = [model_name(backend) for backend in study.backends]
    if len(set(names)) < len(names):
        raise StudyError(f"study '{study.name}': backends: must differ, got {', '.join(names)}; name each once")
    moved = {moved_by(case.scene, tunnel) for case in todo for tunnel in range(len(case.scene.tunnels))}
    try:
        for backend in study.backends:
            for model in moved:
                check_backend(backend, model)
    except Refused as problem:
        raise StudyError(f"study '{study.name}': backends: {problem}") from None


def _value_in(scene, name):
    """Value of a complete scene at a dotted name, a K0 that is left out as it is used; None where it has none."""
    value = scene.model_dump()
    for soil, table in zip(scene.soils, value["soils"], strict=True):
        lowest, highest = lateral_pressure_range(scene, soil)
        table["k0"] = highest if lowest == highest else None
    return entry_at(value, name.split("."))


@cache
def _code() -> str:
    """Hash of the sources that decide a result: `mpm`, `structure`, and what turns a run into a case."""
    total = hashlib.sha256(FORMAT.encode())
    ours = (f"coupling.{room}" for room in ("datasets", "responses", "runs", "postprocess.at_inflow", "studies.case"))
    for package in ("mpm", "structure", *ours):
        origin = Path(find_spec(package).origin)
        for file in sorted(origin.parent.rglob("*.py")) if origin.name == "__init__.py" else [origin]:
            total.update(file.read_bytes())
    return total.hexdigest()


def _key(scene: Scene, study: Study) -> str:
    models = [_source_of(backend) for backend in study.backends]
    text = "\n".join([_code(), scene.source, ",".join(models), str(study.records)])
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _source_of(backend):
    """What decides the answers of a lining model besides the sources of this program."""
    file = Path(backend.rpartition(":")[0])
    return backend + file.read_text(encoding="utf-8") if ".py:" in backend and file.is_file() else backend
