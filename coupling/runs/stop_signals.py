"""Ctrl-C and the system's request to end, turned into a wish that a loop can grant between two steps."""

import contextlib
import signal
import threading
from types import SimpleNamespace

#: Signals to what a message says of them: Ctrl-C, the end of a job's time or of the machine, a closed terminal.
SIGNALS = {"SIGINT": "Ctrl-C", "SIGTERM": "the signal SIGTERM", "SIGHUP": "the end of the terminal"}


@contextlib.contextmanager
def stop_signals():
    """Collect signals that ask to stop; a second Ctrl-C is a `KeyboardInterrupt` at once.

    Yields an object whose `asked` is None, or says what asked. Outside of the main thread, where Python delivers no
    signals, and for signals that the caller ignores, nothing changes.
    """
    stop = SimpleNamespace(asked=None)

    def note(number, frame):
        if stop.asked is not None and number == signal.SIGINT:
            raise KeyboardInterrupt
        stop.asked = SIGNALS[signal.Signals(number).name]

    former = {}
    if threading.current_thread() is threading.main_thread():
        for name in SIGNALS:
            number = getattr(signal, name, None)
            if number is not None and signal.getsignal(number) not in (signal.SIG_IGN, None):
                former[number] = signal.signal(number, note)
    try:
        yield stop
    finally:
        for number, handler in former.items():
            signal.signal(number, handler)
