"""What happens during a command as lines of JSON, for scripts that follow it."""

import json
import math
import os
import sys
import time as clock
from datetime import UTC, datetime

from coupling.commands.exit_codes import INTERRUPTED, check_json, exit_code, finite


class EventStream:
    """Writes events as they happen, one JSON object a line; as a context it adds how the command ended when it failed.

    Every object has `event` and `at` (UTC). Events: "progress" (keys of the solver's progress dicts: stage, time [s],
    inflow_mass [kg/m], share, ..), "warning" (message), "result" (keys of the command's --json), and for what went
    wrong "refused", "failed" or "interrupted" (message, exit_code). A reader that goes away stops the
    lines, not the run.

    path : path or None, "-" prints; None writes nothing.
    """

    def __init__(self, path):
        self.printing = str(path) == "-"
        self._path, self._out = path, None

    def __enter__(self):
        check_json(self._path)
        if self.printing:
            self._out = sys.stdout
        elif self._path is not None:
            self._out = open(self._path, "w", encoding="utf-8")
        return self

    def __exit__(self, kind, error, trace):
        code = INTERRUPTED if isinstance(error, KeyboardInterrupt) else error and exit_code(error)
        if code is not None:
            name = {2: "refused", INTERRUPTED: "interrupted"}.get(code, "failed")
            message = "\n".join([str(error) or kind.__name__, *getattr(error, "__notes__", ())])
            self.tell(name, message=message, exit_code=code)
        if self._out not in (None, sys.stdout):
            self._out.close()

    def tell(self, event, **data):
        """Write one event."""
        if self._out is None:
            return
        line = {"event": event, "at": datetime.now(UTC).isoformat(timespec="milliseconds"), **data}
        try:
            self._out.write(json.dumps(finite(line)) + "\n")
            self._out.flush()
        except BrokenPipeError:
            self._out = None
            # else Python complains about the same pipe once more when it ends
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())

    def following(self, show):
        """A progress callable that shows as `show` does and tells new stages at once, the rest every half second."""
        last = {"stage": None, "at": -math.inf}

        def follow(state):
            show(state)
            now = clock.monotonic()
            if state["stage"] != last["stage"] or now - last["at"] >= 0.5:
                last.update(stage=state["stage"], at=now)
                self.tell("progress", **state)

        return follow

    def warning(self, show):
        """A callable for warnings that shows and tells them."""

        def both(message):
            show(message)
            self.tell("warning", message=message)

        return both
