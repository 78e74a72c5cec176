"""The page docs/robustness.md, put together from what fuzz.py, kills.py and lost_worker.py measured."""

import json

from verification.pages import DOCS, provenance

DATA = DOCS / "robustness.json"


def write_part(name, result):
    """Store one part with machine, date and revision, and write the page anew."""
    parts = json.loads(DATA.read_text(encoding="utf-8")) if DATA.exists() else {}
    parts[name] = {**result, **provenance()}
    DATA.write_text(json.dumps(parts, indent=1) + "\n", encoding="utf-8")
    (DOCS / "robustness.md").write_text(page(parts), encoding="utf-8")


def page(parts):
    """Text of the page."""
    lines = [
        "# Bad input, damaged files, kills, lost workers",
        "",
        "Written by the commands named below from their own measurements; the numbers are in robustness.json.",
    ]
    for name, write in WRITERS.items():
        if name in parts:
            lines += ["", *write(parts[name])]
    return "\n".join(lines) + "\n"


def _scenes(part):
    rows = [f"| {name} | {count} |" for name, count in part["verdicts"].items()]
    return [
        "## Generated scenes",
        "",
        f"`uv run python -m verification.robustness.fuzz scenes --count {part['count']} --seed {part['seed']}`. "
        "Each scene is the "
        f"text of a good one ({', '.join(part['bases'])}) with up to six changes: "
        "numbers scaled, nudged or replaced by what is no number, keys "
        "misspelt, dropped and doubled, names that lead out of the folder, bases that are devices or addresses, torn "
        f"text. It is read as TOML and, every {part['python_every']}th time, as Python dictionaries too; each must be "
        "planned, or refused with rule, field, value, remedy and the line of the file. Of those that are planned "
        f"{part['simulated']} were simulated to their end or to a failure with a reason.",
        "",
        f"Every {part['python_every']}th good scene was also changed by dotted names (`soils.0.friction_angle`), one "
        "right and up to two of any kind: unknown names, entries that are not there, units in strings, wrong types. "
        "Where it was planned, the right one had its value in SI: "
        + ", ".join(f"{count} {name}" for name, count in part["dotted"].items())
        + ".",
        "",
        "| verdict | scenes |",
        "|---|---|",
        *rows,
        "",
        f"Faults (a traceback, more than {part['patience']:g} s, a message without its parts, a stored scene that is "
        f"another one, a folder outside): {len(part['faults'])}. Slowest {part['slowest_seconds']:.2f} s, together "
        f"{part['seconds']:.0f} s.",
        *_faults(part["faults"]),
        *_where(part),
    ]


def _files(part):
    kinds = sorted({kind for counts in part["verdicts"].values() for kind in counts})
    rows = [
        f"| {name} | " + " | ".join(str(counts.get(kind, 0)) for kind in kinds) + " |"
        for name, counts in part["verdicts"].items()
    ]
    return [
        "## Damaged files",
        "",
        f"`uv run python -m verification.robustness.fuzz files --count {part['count']} --seed {part['seed']}`. "
        "Bits flipped, blocks "
        "zeroed, overwritten with noise, cut out, doubled or moved, files cut short, emptied or continued; then "
        "everything that reads such a file, in a process of its own with limits on memory and time. A file must be "
        "refused with its name and a remedy, or give what the whole file gives.",
        "",
        "| file | " + " | ".join(kinds) + " |",
        "|---|" + "---|" * len(kinds),
        *rows,
        "",
        f"Faults (a traceback, a crash, more than {part['patience']:g} s of processor time, other values than the "
        f"whole file's without a word, a file changed by a command that refused it): {len(part['faults'])}. Together "
        f"{part['seconds']:.0f} s.",
        *_faults(part["faults"]),
        *_where(part),
    ]


def _pressures(part):
    kinds = sorted({kind for counts in part["verdicts"].values() for kind in counts})
    rows = [
        f"| {name} | " + " | ".join(str(counts.get(kind, 0)) for kind in kinds) + " |"
        for name, counts in part["verdicts"].items()
    ]
    return [
        "## Imported pressures",
        "",
        f"`uv run python -m verification.robustness.fuzz pressures --count {part['count']} --seed {part['seed']}`. "
        "netCDF files of "
        "random pressures in random units, orders and precisions, each with one mistake or none. The generator knows "
        "what was meant: a file must give that, be warned of, or be refused with rule, value and remedy. "
        "Untold: eight or nine uneven angles in gon that are called degrees, all within one turn, are as good a file "
        "in degrees; nobody can know better.",
        "",
        "| mistake | " + " | ".join(kinds) + " |",
        "|---|" + "---|" * len(kinds),
        *rows,
        "",
        f"Faults (a traceback, more than {part['patience']:g} s, a message without its parts, other values than meant "
        f"without a word): {len(part['faults'])}. Together {part['seconds']:.0f} s.",
        *_faults(part["faults"]),
        *_where(part),
    ]


def _rings(part):
    return [
        "## Random rings",
        "",
        f"`uv run python -m verification.robustness.fuzz rings --count {part['count']} --seed {part['seed']}`. "
        "Rings of 3 to 12 "
        "joints anywhere, some without a stiffness, in all kinds of soil springs and in none, under random loads in "
        "balance, by beams on springs and by the continuum.",
        "",
        "| verdict | rings |",
        "|---|---|",
        *(f"| {name} | {count} |" for name, count in part["verdicts"].items()),
        "",
        "Reasons, of both models: "
        + (", ".join(f"{count} {name}" for name, count in part["reasons"].items()) or "none")
        + f". Largest difference of the mean thrust where both solved: {100 * part['largest_difference']:.2g} %.",
        "",
        "Faults (a traceback, one model alone refuses, a reason that does not hold, residual above 1e-8 of the loads): "
        f"{len(part['faults'])}. Together {part['seconds']:.0f} s.",
        *_faults(part["faults"]),
        *_where(part),
    ]


def _kills(part):
    rows = [f"| {name} | {count} |" for name, count in sorted(part["found"].items(), key=lambda pair: -pair[1])]
    return [
        "## Kills",
        "",
        f"`uv run python -m verification.robustness.kills --kills {part['kills']} --seed {part['seed']}`. "
        "A small run that takes "
        f"{part['life_seconds']:.1f} s of processor time is ended by SIGKILL at a moment drawn evenly over that time, "
        "and resumed; every fourth resumed one is killed again. What the kills left behind:",
        "",
        "| state | kills |",
        "|---|---|",
        *rows,
        "",
        f'All of them struck before the run\'s file said "finished"; {part["late"]} more came later and do not count. '
        f"{part['kills']} kills in {part['runs']} runs; {part['identical']} of {part['runs']} runs ended with the bits "
        f"of the uninterrupted run, in {part['seconds']:.0f} s.",
        *_faults(part["different"]),
        *_where(part),
    ]


def _lost_worker(part):
    different = part["different_variables"]
    return [
        "## A lost worker",
        "",
        f"`uv run python -m verification.robustness.lost_worker {part['runs']}`. "
        f"A study of {part['runs']} coarse runs on a dask "
        f"scheduler with two worker processes, of which {part['workers_killed']} was killed in the middle, against the "
        "same study in one process.",
        "",
        f"{part['finished']} of {part['runs']} runs finished; variables of the study's dataset that differ from the "
        f"serial one in any bit: {len(different)}{''.join(f', {name}' for name in different)}. "
        f"{part['parallel_seconds']:.0f} s with the workers, {part['serial_seconds']:.0f} s in one process.",
        *_where(part),
    ]


WRITERS = {
    "scenes": _scenes, "files": _files, "pressures": _pressures, "rings": _rings, "kills": _kills,
    "lost_worker": _lost_worker,
}  # fmt: skip


def _faults(faults):
    shown = [" ".join(fault.split())[-300:] for fault in faults[:20]]
    return ["", *(f"- `{fault}`" for fault in shown)] if faults else []


def _where(part):
    note = ["", part["note"]] if "note" in part else []
    return [*note, "", f"Measured {part['date']} at revision {part['revision'] or 'unknown'} on {part['machine']}."]
