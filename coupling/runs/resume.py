"""What a stopped run left behind, checked before it is continued: its scene, its records, its last good checkpoint."""

import contextlib
import os
from dataclasses import dataclass

from coupling.datasets import RunFileError, raw_groups, read_attributes
from coupling.files.checkpoint import last_checkpoint
from coupling.files.folder import RUN_FILE, SCENE_FILE
from coupling.files.journal import recover
from coupling.files.provenance import differences, root_attributes
from coupling.refused import Refused, SceneError
from coupling.scenes.scene import parse_scene


@dataclass(frozen=True)
class Remains:
    """A run as it was found: scene; root attributes (None: begins anew); state and `about` of a checkpoint or None."""

    scene: object
    attributes: dict | None
    state: dict | None
    about: dict | None

    @property
    def finished(self):
        """Whether its simulation came to its end."""
        return self.attributes is not None and self.attributes["status"] == "finished"


def find_remains(folder, scene, warn):
    """Check the run in a folder that is held, finish a write that was cut short, and find its last good checkpoint.

    scene : None or a coupling.Scene, which must be that of the run;  warn : called with a message about each damaged
    file, which is set aside, while what came before it is used.

    Raises Refused: another scene, another version of what decides the result, or a run that would fail again.
    """
    file = folder / RUN_FILE
    attributes, records = None, 0
    if file.exists():
        try:
            recover(file)
            attributes, records = read_attributes(file), len(raw_groups(file)["history"]["time"])
        except RunFileError as damage:
            aside = file.with_name(f"{file.name}.damaged")
            os.replace(file, aside)
            warn(f"{damage}; it is kept as '{aside}', and the run begins anew from '{folder / SCENE_FILE}'")
    stored = _stored_scene(folder, attributes)
    if scene is not None and scene.source != stored.source:
        raise Refused(
            f"scene '{scene.name}': must be the one that the run in '{folder}' began with, "
            f"{_first_difference(stored, scene)}; leave SCENE out, or start a new run with another --out"
        )
    if attributes is None or attributes["status"] == "finished":
        return Remains(stored, attributes, None, None)
    if attributes["status"] == "failed":
        raise Refused(
            f"run '{folder}': must not have failed, got: {attributes['status_message']}; continued it would fail "
            "again, change the scene and start a new run"
        )
    _check_versions(folder, attributes, stored, warn)
    state, about = last_checkpoint(folder, records, warn)
    return Remains(stored, attributes, state, about)


def _stored_scene(folder, attributes):
    """The scene of the run file; `scene.toml` must not say otherwise, and stands in where there is no run file."""
    path = folder / SCENE_FILE
    written = None
    with contextlib.suppress(FileNotFoundError):
        written = path.read_text(encoding="utf-8", errors="replace")
    text = written if attributes is None else attributes["scene"]
    if text is None:
        raise Refused(f"run '{folder}': its scene must be readable, {SCENE_FILE} is missing; start a new run")
    try:
        scene = parse_scene(text, str(path))
    except SceneError as error:
        raise Refused(f"{error}\nthe scene that the run in '{folder}' began with is damaged; start a new run") from None
    if written is not None and written != text:
        try:
            changed = parse_scene(written, str(path))
        except ValueError:
            changed = None
        if changed != scene:
            what = "it can not be read any more" if changed is None else _first_difference(scene, changed)
            raise Refused(
                f"scene '{path}': must be the one that the run began with, {what}; take the change back, or start a "
                f"new run with it: gush run {path} --out OTHER"
            )
    return scene


def _first_difference(stored, other):
    """The first line that differs between the complete texts of two scenes, table and all."""
    table = ""
    before, after = stored.source.splitlines(), other.source.splitlines()
    for a, b in zip(before[1:], after[1:], strict=False):
        if a != b:
            return f"{table}{a or 'nothing'} became {b or 'nothing'}"
        if a.startswith("["):
            table = f"{a} "
    return f"{len(before)} lines became {len(after)}"


def _check_versions(folder, attributes, scene, warn):
    now = root_attributes(scene)
    changed = differences(attributes, now)
    if changed:
        said = "; ".join(f"{name} {_short(before)}, now {_short(after)}" for name, (before, after) in changed.items())
        raise Refused(
            f"run '{folder}': what computes it must be what began it, got {said}; go back to revision "
            f"{attributes.get('revision') or 'unknown'} and these versions, or start a new run from "
            f"{folder / SCENE_FILE}"
        )
    for name, (before, after) in differences(attributes, now, ("processor",)).items():
        warn(f"{name}: the run began on {before}, this is {after}; its last bits may differ from an uninterrupted run")


def _short(text):
    return text if len(text) <= 24 else f"{text[:12]}.."
