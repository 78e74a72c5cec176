"""Files of a run with damage in them, and what everything that reads them has to make of it."""

import re

import numpy as np

from verification.child import in_a_process

#: Longest that reading a damaged file may take [s of processor time].
PATIENCE = 20


def damaged(random, content):
    """Bytes of a file after something happened to it; never what they were."""
    size = len(content)
    at, length, kind = random.randrange(size), random.choice((1, 8, 512, 4096)), random.randrange(9)
    if kind <= 2:
        changed = bytearray(content)
        for _ in range(random.choice((1, 1, 1, 4, 64))):
            changed[random.randrange(size)] ^= 1 << random.randrange(8)
        result = bytes(changed)
    elif kind == 8:
        # the head is small, and the first thing that a library believes
        at = random.randrange(min(size, 600))
        result = content[:at] + random.randbytes(4) + content[at + 4 :]
    else:
        noise, zeros, cut, _, doubled = range(3, 8)  # the other one: a piece is gone
        middle = random.randbytes(length) if kind == noise else bytes(length) if kind == zeros else b""
        middle = content[at : at + length] if kind == doubled else middle
        result = content[:at] + middle + {cut: b"", doubled: content[at:]}.get(kind, content[at + length :])
    return result if result != content else damaged(random, content)


def run_content(path):
    """Everything that the program reads of a run file, as arrays and texts that can be compared."""
    from coupling.commands.describe import describe
    from coupling.datasets import read_run
    from coupling.report.run_page import collect
    from coupling.responses.source import read_source

    content = {}
    for node in read_run(path).subtree:
        content |= {f"{node.path}@{name}": str(value) for name, value in node.attrs.items()}
        for name, variable in node.variables.items():
            content[f"{node.path}/{name}"] = np.asarray(variable.values)
            content |= {f"{node.path}/{name}@{key}": str(value) for key, value in variable.attrs.items()}
    content["info"] = describe(path)["facts"]
    source = read_source(path)
    content["ring"] = source.ring.model_dump_json()
    content["page"] = len(str(collect(path)["numbers"]))
    return content


def checkpoint_content(path):
    """State and notes of a checkpoint."""
    from coupling.files.checkpoint import read_checkpoint

    state, about = read_checkpoint(path)
    return {**{name: np.asarray(value) for name, value in state.items()}, "about": str(about)}


def journal_content(path):
    """A run file as it shows with a journal beside it."""
    from coupling.datasets import raw_groups

    groups = raw_groups(path.with_name(path.name.removesuffix(".journal")))
    return {f"{group}/{name}": array for group, arrays in groups.items() for name, array in arrays.items()}


def scene_content(path):
    """A scene file."""
    from coupling.scenes.scene import load_scene

    return {"source": load_scene(path).source}


def study_content(path):
    """A study file and its cases."""
    from coupling.studies.cases import cases
    from coupling.studies.design import load_study

    return {"cases": str([case.key for case in cases(load_study(str(path)))])}


REFUSALS = {"RunFileError", "Refused", "SceneError", "StudyError", "CheckpointDamaged"}
#: Kind of file to its reader, and whether it guards its content: then other content must never pass unnoticed.
READERS = {
    "run.nc": (run_content, True),
    "checkpoint.h5": (checkpoint_content, True),
    "run.nc.journal": (journal_content, True),
    "scene.toml": (scene_content, False),
    "study.toml": (study_content, False),
}
#: Texts lie in HDF5 without a checksum; they are shown, and nothing is computed from them but the guarded scene.
TEXT = re.compile(r"@|^info$")


def judged(path, kind, whole, before_change=None):
    """What becomes of a damaged file.

    path : path;
    kind : str, of `READERS`;
    whole : dict, what the reader gives for the undamaged file;
    before_change : dict or None, what it gives without the journal: an incomplete one belongs to a change that never
        began.

    Returns str: "refused"; "same content"; "content before the change"; "another text" (it differs, and is valid).

    Raises AssertionError.
    """
    reader, guarded = READERS[kind]
    before = path.read_bytes()
    how, answer = in_a_process(lambda: reader(path), PATIENCE)
    assert path.read_bytes() == before, "the file was changed by reading it"
    assert how != "killed", f"{kind}: the process was ended by {answer}"
    if how == "raised":
        kinds, message, trace = answer
        assert kinds & REFUSALS, f"{kind}: {trace[-900:]}"
        assert path.name.removesuffix(".journal") in message or re.search("scene|study|run file", message), message
        assert kind in ("checkpoint.h5", "run.nc.journal") or ";" in message or "missing" in message, message
        return "refused"
    other = [name for name in sorted(whole.keys() | answer.keys()) if not _equal(whole.get(name), answer.get(name))]
    if not other:
        return "same content"
    if before_change is not None and all(_equal(before_change[name], answer.get(name)) for name in before_change):
        return "content before the change"
    assert not guarded or all(TEXT.search(name) for name in other), f"{kind}: other content without a word: {other[:5]}"
    return "another text"


def _equal(one, other):
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
        return one.dtype == other.dtype and one.shape == other.shape and one.tobytes() == other.tobytes()
    return type(one) is type(other) and one == other
