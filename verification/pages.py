"""What report pages share: the folder of the docs, and the line that says how, when and where a page was made."""

import os
import platform
import sys
from datetime import UTC, datetime
from pathlib import Path

from coupling.files.provenance import revision

#: Docs of the working copy this code runs from; an installed program has none.
DOCS = Path(__file__).resolve().parent.parent / "docs"


def need_docs():
    """Leave with a message where there are no docs to write into, before the work instead of after it."""
    if not DOCS.is_dir():
        sys.exit(f"{DOCS}: must be the docs of the program, got none; run this in a copy of the repository")


def made_by(command, of_revision=None):
    """Beginning of a page's first sentence: command, date, revision (of this code if left out) and machine."""
    made = provenance()
    return f"Made by `{command}` on {made['date']}, revision {of_revision or made['revision']}, {made['machine']}"


def provenance():
    """Date, revision and machine, as texts."""
    return {
        "date": f"{datetime.now(UTC):%Y-%m-%d}",
        "revision": revision() or os.environ.get("GUSH_REVISION", "unknown"),
        "machine": f"{os.cpu_count()} cores, {_processor()}, Python {platform.python_version()}",
    }


def _processor():
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="ascii", errors="replace").splitlines()
    except OSError:
        return platform.machine()
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), platform.machine())
