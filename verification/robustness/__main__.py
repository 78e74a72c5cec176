"""Measure how the program takes bad input, damaged files, kills and lost workers; docs/robustness.md and .json.

    uv run python -m verification.robustness [NAME] [--count N] [--seed 0] [--print-only]

NAME is one of scenes, files, pressures, rings, kills and lost_worker, all of them when left out. Ends with exit code 1
where there is a fault.
"""

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path

from verification.pages import DOCS, docs_page, provenance, rendered, write_data
from verification.robustness import fuzz
from verification.robustness.kills import kill_and_resume
from verification.robustness.lost_worker import lost_worker

DATA = DOCS / "robustness.json"
#: Name to measurement and usual number of tries.
PARTS = {
    "scenes": (fuzz.scenes, 10_000), "files": (fuzz.files, 1_000), "pressures": (fuzz.pressures, 2_000),
    "rings": (fuzz.rings, 200), "kills": (kill_and_resume, 200), "lost_worker": (lost_worker, 64),
}  # fmt: skip


def measured(name, count, seed):
    """Numbers of a part, with the command, date, revision and machine."""
    measure, usual = PARTS[name]
    count, begin = count or usual, time.monotonic()
    with tempfile.TemporaryDirectory(prefix="gush-robustness-") as place:
        result = measure(Path(place), count, seed)
    command = f"uv run python -m verification.robustness {name} --count {count} --seed {seed}"
    seconds = time.monotonic() - begin
    return {**result, "count": count, "seed": seed, "seconds": seconds, "command": command, **provenance()}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("name", nargs="?", choices=tuple(PARTS))
    parser.add_argument("--count", type=int)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--print-only", action="store_true", help="leave docs/robustness.md as it is")
    options, faults = parser.parse_args(), 0
    page = None if options.print_only else docs_page("robustness", *PARTS)
    for name in [options.name] if options.name else PARTS:
        part = measured(name, options.count, options.seed)
        print(json.dumps({name: part}, indent=1))
        faults += len(part["faults"])
        if page is not None:
            stored = json.loads(DATA.read_text(encoding="utf-8")) if DATA.exists() else {}
            write_data(DATA, stored | {name: part})
            page.fill(rendered("robustness", **{name: part}))
    sys.exit(bool(faults))


if __name__ == "__main__":
    main()
