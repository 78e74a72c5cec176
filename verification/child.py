"""Work in a process of its own, with limits on time and memory: a crash, a hang or a flood stays there."""

import os
import pickle
import resource
import signal
import traceback

#: Memory that the work may ask for beyond what is in use [bytes].
MEMORY = 4_000_000_000
#: On the clock it may take so many times as long: a busy machine is no hang, a process that sleeps for good is one.
BUSY = 15


def in_a_process(work, seconds):
    """What `work` returns, or how it ended.

    work : callable;  seconds : float, processor time that it may take [s].

    Returns str, object: "returned" and the value; "raised" and (names of its types, message, traceback); "killed" and
    the signal's name.
    """
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(read)
        code = 1
        try:
            used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
            resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY, used + MEMORY))
            signal.setitimer(signal.ITIMER_PROF, seconds)
            signal.setitimer(signal.ITIMER_REAL, BUSY * seconds)
            try:
                answer = "returned", work()
            except Exception as error:
                kinds = {kind.__name__ for kind in type(error).__mro__}
                answer = "raised", (kinds, str(error), traceback.format_exc())
            with os.fdopen(write, "wb") as out:
                pickle.dump(answer, out)
            code = 0
        finally:
            os._exit(code)
    os.close(write)
    with os.fdopen(read, "rb") as answer:
        data = answer.read()
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if code < 0:
        return "killed", signal.Signals(-code).name
    return pickle.loads(data) if code == 0 else ("killed", f"exit code {code}")
