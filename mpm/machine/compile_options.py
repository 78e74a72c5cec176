"""What makes numba compile in less time: options compared and hashed at once, and no garbage collector meanwhile.

numba asks some ten thousand times a kernel whether two sets of options are equal, and looks each of the options up, and
its default: a fifth of the time to compile. A tenth goes to the garbage collector, which looks through millions of
objects that are nearly all in use (stopped, the process grows by 0.1 GB more at most).
"""

import gc

from numba.core import event
from numba.core.targetconfig import TargetConfig

_equal, _hash = TargetConfig.__eq__, TargetConfig.__hash__
_hashes = {}


def equal(options, others):
    """As numba says; at once where the same are set, to the same."""
    if options is others or (type(options) is type(others) and options._values == others._values):
        return True
    return _equal(options, others)


def hash_of(options):
    """As numba says: that of the names of all options, which are those of their class."""
    kind = type(options)
    if kind not in _hashes:
        _hashes[kind] = _hash(options)
    return _hashes[kind]


class WithoutCollector(event.Listener):
    """Stops the garbage collector while numba compiles a kernel, and others on the way."""

    def __init__(self):
        self.depth, self.runs = 0, True

    def on_start(self, event):
        """A kernel begins."""
        if self.depth == 0:
            self.runs = gc.isenabled()
            gc.disable()
        self.depth += 1

    def on_end(self, event):
        """A kernel is compiled, or is not."""
        self.depth -= 1
        if self.depth == 0 and self.runs:
            gc.enable()


def compile_quickly():
    """Have numba compile in less time; what it compiles is the same."""
    TargetConfig.__eq__, TargetConfig.__hash__ = equal, hash_of
    event.register("numba:compile", WithoutCollector())
