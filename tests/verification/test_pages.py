"""Generated blocks of the report pages are those of the numbers stored beside them."""

import json
import re

import pytest

from verification.pages import DOCS, Page, docs_page, rendered


@pytest.mark.parametrize("name", ["left-out", "lining-in-mpm", "performance", "robustness", "stability"])
def test_blocks_of_a_page_are_those_of_its_stored_numbers(name, tmp_path):
    stored = json.loads((DOCS / f"{name}.json").read_text())
    blocks = rendered(name, **stored)
    assert blocks
    text = docs_page(name, *blocks).text
    path = tmp_path / "page.md"
    path.write_text(text)
    Page(path, name, blocks).fill(blocks)
    assert re.sub(r"\n\n+", "\n\n", path.read_text()) == re.sub(r"\n\n+", "\n\n", text)


def test_page_keeps_what_is_written_by_hand_and_refuses_one_without_its_blocks(tmp_path):
    path = tmp_path / "page.md"
    Page(path, "Title", ["one", "two"]).fill({"one": "first", "two": ["a", "b"]})
    text = path.read_text().replace("# Title\n", "# Title\n\nBy hand.\n")
    path.write_text(text)
    Page(path, "Title", ["one"]).fill({"one": r"\1 anew"})
    assert path.read_text() == text.replace("first", r"\1 anew") and "By hand." in text
    with pytest.raises(ValueError, match="must mark the block 'three'"):
        Page(path, "Title", ["three"])
