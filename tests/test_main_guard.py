"""A study in a script of its own: refused in one sentence where its workers would begin it again, run where not."""

import subprocess
import sys
from pathlib import Path

import pytest
from test_docs import PAGES, blocks

STUDY = """
import coupling
from coupling.studies import execute

def begun(*arguments):
    print("begun")
    return iter(())

execute._on_cluster = begun  # no processes: what would have begun them is enough
plan = {"name": "tiny", "scene": "quick", "records": 3, "parameters": {"gate.angle": [60.0, 90.0]}}
"""
CALL = "coupling.study(plan, out='study'{more})\n"
GUARD = 'if __name__ == "__main__":\n    '


def run(folder, text):
    (folder / "script.py").write_text(text)
    return subprocess.run([sys.executable, "script.py"], cwd=folder, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    "text", [CALL, "def main():\n    " + CALL + "main()\n", "if True:\n    " + CALL], ids=["plain", "function", "if"]
)
def test_script_without_a_guard_is_refused_in_one_sentence(tmp_path, text):
    done = run(tmp_path, STUDY + text.format(more=""))
    assert done.returncode == 1 and done.stdout == ""
    last = done.stderr.splitlines()[-1]
    assert 'must call it below if __name__ == "__main__":' in last and "script.py" in last and "workers=0" in last
    assert len(done.stderr.splitlines()) < 25


@pytest.mark.parametrize(
    "text", [GUARD + CALL, "def main():\n    " + CALL + GUARD + "main()\n"], ids=["plain", "function"]
)
def test_script_with_a_guard_starts(tmp_path, text):
    done = run(tmp_path, STUDY + text.format(more=""))
    assert done.stdout == "begun\n", done.stderr


def test_nothing_is_asked_of_a_script_without_worker_processes(tmp_path):
    done = run(tmp_path, STUDY + CALL.format(more=", scheduler='tcp://127.0.0.1:1'"))
    assert done.stdout == "begun\n", done.stderr


def test_every_example_of_a_study_has_the_guard():
    root, found = Path(__file__).parent.parent, 0
    texts = [file.read_text(encoding="utf-8") for file in (root / "examples").glob("*.py")]
    for page in PAGES:
        texts += [block.text for block in blocks(page) if block.language == "python"]
    for text in texts:
        if "coupling.study(" in text:
            found += 1
            assert '__name__ == "__main__"' in text.split("coupling.study(")[0], text
    assert found >= 3
