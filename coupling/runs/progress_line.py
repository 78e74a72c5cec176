"""How a computation shows that it goes on: a live line on a terminal or in a notebook, else a line now and then."""

from __future__ import annotations

import sys
import threading
import time as clock
from typing import Any

from rich.console import Console

SECONDS_BETWEEN_LINES = 10.0
SECONDS_BETWEEN_DISPLAYS = 0.5
STAGES = {"mesh": "meshing", "respond": "ring response", "figures": "pictures"}


def in_notebook() -> bool:
    """Whether a kernel of Jupyter runs this program."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return hasattr(shell, "kernel")


class ProgressLine:
    """The line of a computation, as a context; callable with the solver's progress dicts.

    On a terminal and in a notebook it is one line that changes. Elsewhere (a log, a pipe, a queue) a line is printed to
    standard error every ten seconds, also while nothing is told. With `quiet` nothing is shown.
    """

    def __init__(self, quiet: bool = False):
        self._begin: tuple[float, float] | None = None
        self._said, self._quiet = "starting", quiet
        self._console = Console(stderr=True)
        self._status = self._display = self._writer = None
        self._started = self._displayed = 0.0
        self._over = threading.Event()

    def __enter__(self) -> ProgressLine:
        self._started = clock.monotonic()
        if self._quiet:
            return self
        if in_notebook():
            from IPython.display import DisplayHandle

            self._display = DisplayHandle()
            self._display.display({"text/plain": self._said}, raw=True)
        elif self._console.is_terminal:
            self._status = self._console.status(self._said)
            self._status.start()
        else:
            self._writer = threading.Thread(target=self._write_lines, daemon=True)
            self._writer.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        if self._status is not None:
            self._status.stop()
        if self._writer is not None:
            self._writer.join()
        if self._display is not None:
            self._show(f"{self._said}, {duration(clock.monotonic() - self._started)} in all")

    def __call__(self, state: dict[str, Any]) -> None:
        """Show one progress dict of `mpm.simulate`."""
        self.say(self.text(state))

    def say(self, text: str) -> None:
        """Show a text in place of the one before."""
        self._said = text
        if self._status is not None:
            self._status.update(text, spinner_style="blue")
        if self._display is not None and clock.monotonic() - self._displayed >= SECONDS_BETWEEN_DISPLAYS:
            self._show(text)

    def _show(self, text):
        self._displayed = clock.monotonic()
        self._display.update({"text/plain": text}, raw=True)

    def _write_lines(self):
        while not self._over.wait(SECONDS_BETWEEN_LINES):
            line = f"{duration(clock.monotonic() - self._started)}: {self._said}"
            self._console.print(line, markup=False, highlight=False, soft_wrap=True)

    def text(self, state: dict[str, Any]) -> str:
        """The line for one progress dict."""
        stage = state["stage"]
        if stage == "relax":
            return f"initial equilibrium: step {state['step']}, residual {state['residual']:.1e}"
        if stage != "gush":
            return STAGES.get(stage, stage)
        if self._begin is None:
            self._begin = clock.monotonic(), state["share"]
        return (
            f"t {state['time']:.3f} s  inflow {state['inflow_mass']:.0f} kg/m  "
            f"dt {1e6 * state['dt']:.0f} µs ({state['dt_limit']})  "
            f"{state['point_steps_per_second'] / 1e6:.1f} M point-steps/s  {self._left(state)} left"
        )

    def _left(self, state):
        begin, share_before = self._begin
        share, elapsed = min(state["share"], 1.0), clock.monotonic() - begin
        if share - share_before < 0.01 or elapsed < 1.0:
            return "?"
        return duration(elapsed * (1 - share) / (share - share_before))


def duration(seconds: float) -> str:
    """Seconds as people say them."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
