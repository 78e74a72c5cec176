"""The generated blocks of docs/robustness.md, from what fuzz.py, kills.py and lost_worker.py measured."""

import json

from verification.pages import DOCS, docs_page, provenance, table, write_data

DATA = DOCS / "robustness.json"
FUZZ = "fuzz {name} --count {count} --seed {seed}"
#: Name of a block to the command that measures it, and the head of its table.
PARTS = {
    "scenes": (FUZZ, "scenes"), "files": (FUZZ, "file"), "pressures": (FUZZ, "mistake"), "rings": (FUZZ, "rings"),
    "kills": ("kills --kills {kills} --seed {seed}", "kills"), "lost_worker": ("lost_worker {runs}", None),
}  # fmt: skip


def check_page():
    """Leave before the work where its page is not there."""
    return docs_page("robustness", *PARTS)


def write_part(name, result):
    """Store one part with machine, date and revision, and fill all blocks of the page anew."""
    parts = json.loads(DATA.read_text(encoding="utf-8")) if DATA.exists() else {}
    parts[name] = {**result, **provenance()}
    write_data(DATA, parts)
    check_page().fill({name: block(name, part) for name, part in parts.items()})


def block(name, part):
    """Lines of a block: verdicts, numbers, faults, and by which command they were measured, when and where."""
    command, what = PARTS[name]
    counts, lines = part.get("verdicts", part.get("found")), []
    if counts and isinstance(next(iter(counts.values())), dict):
        kinds = sorted({kind for of in counts.values() for kind in of})
        lines = table((what, *kinds), ([key, *(of.get(kind, 0) for kind in kinds)] for key, of in counts.items()))
    elif counts:
        lines = table(("what", what), sorted(counts.items(), key=lambda pair: -pair[1]))
    faults = part.get("faults", part.get("different", []))
    shown = [" ".join(fault.split())[-300:] for fault in faults[:20]]
    told = [*NOTES.get(name, lambda part: ())(part), f"faults: {len(faults)}"]
    if "seconds" in part:
        told.append(f"together {part['seconds']:.0f} s")
    return [
        *lines, "", "- " + "\n- ".join(told), "", *(f"- `{fault}`" for fault in shown), *[""] * bool(shown),
        f"Measured by `uv run python -m verification.robustness.{command.format(name=name, **part)}` on "
        f"{part['date']} at revision {part['revision'] or 'unknown'} on {part['machine']}.",
    ]  # fmt: skip


def _scenes(part):
    dotted = ", ".join(f"{count} {name}" for name, count in part["dotted"].items())
    yield f"changed by dotted names: {dotted}"
    yield f"simulated: {part['simulated']}"
    yield f"slowest {part['slowest_seconds']:.2f} s"


def _rings(part):
    yield "reasons, of both models: " + (", ".join(f"{n} {name}" for name, n in part["reasons"].items()) or "none")
    yield f"largest difference of the mean thrust where both solved: {100 * part['largest_difference']:.2g} %"


def _kills(part):
    yield f"the run takes {part['life_seconds']:.1f} s of processor time"
    yield f"{part['late']} more kills came after the end and do not count"
    yield f"{part['kills']} kills in {part['runs']} runs, of which {part['identical']} ended with the same bits"


def _lost_worker(part):
    different = part["different_variables"]
    yield f"{part['finished']} of {part['runs']} runs finished, {part['workers_killed']} worker killed"
    yield f"variables that differ from the serial study in any bit: {', '.join(different) or 'none'}"
    yield f"{part['parallel_seconds']:.0f} s with the workers, {part['serial_seconds']:.0f} s in one process"


NOTES = {"scenes": _scenes, "rings": _rings, "kills": _kills, "lost_worker": _lost_worker}
