"""Report pages: Markdown written by hand, in which commands replace the blocks between two comments that name them.

What a block shows of the numbers that were measured is a jinja2 template in `templates/`, a page of blocks alone.
"""

import json
import os
import platform
import re
import sys
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path

import jinja2

from coupling.files.provenance import revision
from coupling.refused import Refused

#: Docs of the working copy this code runs from; an installed program has none.
DOCS = Path(__file__).resolve().parent.parent / "docs"
#: Text of a block by its name.
MARKED = re.compile("<!-- (?P<name>[^\n]+) -->\n(?P<text>.*?)<!-- end of (?P=name) -->", re.S)
TEMPLATES = jinja2.Environment(
    loader=jinja2.PackageLoader("verification"), trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined
)


class Page:
    """A page with generated blocks, each from `<!-- NAME -->` to `<!-- end of NAME -->`; the rest is written by hand.

    path : path;  title : str, heading of a page that is not there yet; it begins as the heading and all blocks, in
    their order;  blocks : sequence of str.

    Raises coupling.refused.Refused: the page is there and lacks a block: before the work that would fill it.
    """

    def __init__(self, path, title, blocks):
        self.path = Path(path)
        if self.path.is_file():
            self.text = self.path.read_text(encoding="utf-8")
        else:
            self.text = f"# {title}\n" + "".join(f"\n<!-- {name} -->\n<!-- end of {name} -->\n" for name in blocks)
        marked = {found["name"] for found in MARKED.finditer(self.text)}
        for name in blocks:
            if name not in marked:
                raise Refused(
                    f"{self.path}: must mark the block {name!r} by '<!-- {name} -->' and '<!-- end of {name} -->', got "
                    "none; mark it, or move the page away"
                )

    def fill(self, blocks):
        """Replace blocks, name to lines of text, and write the page; returns its path as text."""

        def filled(found):
            name, lines = found["name"], blocks.get(found["name"], found["text"])
            text = "\n".join([lines] if isinstance(lines, str) else lines).strip("\n")
            return f"<!-- {name} -->\n" + text + "\n" * bool(text) + f"<!-- end of {name} -->"

        self.text = MARKED.sub(filled, self.text)
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self.path.write_text(self.text, encoding="utf-8")
        return str(self.path)


def rendered(template, **numbers):
    """Blocks of a template filled with numbers, name to text; those that the template leaves out are not there."""
    text = TEMPLATES.get_template(f"{template}.md").render(numbers)
    return {found["name"]: found["text"] for found in MARKED.finditer(text)}


def templated_page(folder, template):
    """The page of a template in a folder, with the block "made" and all of the template."""
    source = TEMPLATES.loader.get_source(TEMPLATES, f"{template}.md")[0]
    title = source.partition("\n")[0].removeprefix("# ")
    return Page(Path(folder) / f"{template}.md", title, ["made", *(found["name"] for found in MARKED.finditer(source))])


def docs_page(name, *blocks):
    """A page of the docs; leaves with a message where there are none, before the work instead of after it."""
    if not DOCS.is_dir():
        sys.exit(f"{DOCS}: must be the docs of the program, got none; run this in a copy of the repository")
    return Page(DOCS / f"{name}.md", name, blocks)


def table(head, rows):
    """Lines of a table; cells are shown by `str`, bars in them, as of |Q|, escaped."""
    cells = [[re.sub(r"(?<!\\)\|", r"\|", str(cell)) for cell in row] for row in (head, *rows)]
    first, *others = ["| " + " | ".join(row) + " |" for row in cells]
    return [first, "|" + "---|" * len(head), *others]


def table_text(head, rows):
    """The same as one text, "Not run." without rows."""
    rows = list(rows)
    return "\n".join(table(head, rows)) if rows else "Not run."


TEMPLATES.globals["table"] = table_text


def write_data(path, data):
    """Write the numbers of a page as JSON; returns the path as text."""
    Path(path).write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    return str(path)


@contextmanager
def picture(path, width, height):
    """A figure of so many inches in the style of the docs, saved on leaving, in a folder that is made when absent."""
    from coupling.figures import RESOLUTION
    from coupling.figures.picture import styled

    with styled(width, height) as figure:
        yield figure
        Path(path).parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=RESOLUTION)


def made_by(command, of_revision=None):
    """First sentence of a page: command, date, revision (of this code if left out) and machine."""
    made = provenance()
    return f"Made by `{command}` on {made['date']}, revision {of_revision or made['revision']}, {made['machine']}."


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
