"""How far a study is: each case writes its state into its folder, whoever shares the folder can read them all."""

import contextlib
import json
import threading
import time as clock
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

from coupling.files.replace import replace_file
from coupling.studies.folder import CASE_FILE, PROGRESS_FILE

SECONDS_BETWEEN_STATES = 1.0
#: A case that has not written for so long is taken for lost; the slowest stage between two states takes some seconds.
SECONDS_UNTIL_LOST = 120.0


class CaseProgress:
    """Writes the state of one case into its folder, about once a second; callable with progress dicts of a run."""

    def __init__(self, folder: Path):
        self._path, self._last = Path(folder) / PROGRESS_FILE, -1e9

    def __call__(self, state):
        """Store one progress dict."""
        now = clock.monotonic()
        if state["stage"] == "gush" and now - self._last < SECONDS_BETWEEN_STATES:
            return
        self._last = now
        kept = {name: state[name] for name in ("stage", "time", "inflow_mass", "share") if name in state}
        with contextlib.suppress(OSError):  # a full disk stops the run itself, where it loses something
            replace_file(self._path, json.dumps(kept), lasting=False)

    def end(self):
        """Take the state away: the case is done."""
        self._path.unlink(missing_ok=True)


@dataclass(frozen=True)
class StudyState:
    """The state of a whole study.

    total, done, failed : number of cases;  running : number of the case to its last state (stage, time [s],
    inflow_mass [kg/m], share [-]).
    """

    total: int
    done: int
    failed: int
    running: dict[int, dict]

    @property
    def share(self):
        """Share of the study that is behind it, every case counted alike [-]."""
        begun = sum(min(state.get("share", 0.0), 1.0) for state in self.running.values())
        return (self.done + self.failed + begun) / max(self.total, 1)


def study_state(folder: Path, numbers: dict[str, int], failures: dict[str, str]) -> StudyState:
    """Read the state of all cases from their folders.

    folder : that holds those of the cases;  numbers : key of a case to its number;  failures : by keys.
    """
    done, running = 0, {}
    for key, number in numbers.items():
        place = folder / key
        if (place / CASE_FILE).is_file():
            done += 1
        elif key not in failures:
            with contextlib.suppress(OSError, ValueError):
                if clock.time() - (place / PROGRESS_FILE).stat().st_mtime < SECONDS_UNTIL_LOST:
                    running[number] = json.loads((place / PROGRESS_FILE).read_text(encoding="utf-8"))
    return StudyState(len(numbers), done, len(failures), running)


@contextlib.contextmanager
def watching(folder, numbers, failures, watch: Callable[[StudyState], None] | None):
    """Tell `watch` the state of a study once a second while the block runs, and once at its end."""
    if watch is None:
        yield
        return
    ended = threading.Event()

    def tell():
        while not ended.wait(SECONDS_BETWEEN_STATES):
            watch(study_state(folder, numbers, dict(failures)))

    thread = threading.Thread(target=tell, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
        watch(study_state(folder, numbers, dict(failures)))


class StudyLine(Progress):
    """The live lines of a study on a console of rich, if it is a terminal: the whole, and every case at work."""

    def __init__(self, console: Console):
        columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.percentage:3.0f} %"))
        disable = not console.is_terminal
        super().__init__(*columns, TimeRemainingColumn(), console=console, transient=True, disable=disable)
        self._shown: dict[int, TaskID] = {}
        self._whole = self.add_task("study", total=1.0)

    def __call__(self, state):
        """Show one :class:`StudyState`."""
        text = f"{state.done} of {state.total} cases" + (f", {state.failed} failed" if state.failed else "")
        self.update(self._whole, completed=state.share, description=text)
        for number in set(self._shown) - set(state.running):
            self.remove_task(self._shown.pop(number))
        for number, case in state.running.items():
            if number not in self._shown:
                self._shown[number] = self.add_task("", total=1.0)
            what = f"{case['inflow_mass']:.0f} kg/m" if case.get("stage") == "gush" else case.get("stage", "")
            self.update(
                self._shown[number], completed=min(case.get("share", 0.0), 1.0), description=f"  case {number}: {what}"
            )
