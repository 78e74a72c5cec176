"""Where the threads of a compiled step wait for each other: a few atomic instructions, no lock and no interpreter.

A thread that waits spins for some microseconds, about as long as the passes of a step differ, and then gives its
processor to whoever wants it, again and again: on a machine with other work the other thread is one of those.
"""

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from mpm.jit import kernel

SPINS = 2000  # some microseconds
#: Places in the array of a meeting, each in a cache line of its own: who has come, how many meetings there were, and
#: whether one will never come.
COME, HELD, ABANDONED, MEETING_WIDTH = 0, 16, 32, 48

give_way = types.ExternalFunction("sched_yield", types.int32())  # POSIX


@intrinsic
def add_atomic(typing_context, array, place, value):
    """Add to an element of an int64 array, seen by all threads at once; returns what it was."""

    def lower(context, builder, signature, arguments):
        pointer = _pointer(context, builder, signature.args[0], *arguments[:2])
        return builder.atomic_rmw("add", pointer, arguments[2], "seq_cst")

    return types.int64(array, types.int64, types.int64), lower


@intrinsic
def load_atomic(typing_context, array, place):
    """Read an element of an int64 array as other threads have left it, and with it all that they wrote before."""

    def lower(context, builder, signature, arguments):
        pointer = _pointer(context, builder, signature.args[0], *arguments)
        return builder.load_atomic(pointer, "seq_cst", 8)

    return types.int64(array, types.int64), lower


def _pointer(context, builder, array_type, array, place):
    view = context.make_array(array_type)(context, builder, array)
    pointer = cgutils.gep_inbounds(builder, view.data, place)
    return builder.bitcast(pointer, ir.IntType(64).as_pointer())


@kernel
def meet(meeting, threads):
    """Wait until all `threads` are here. meeting : (48,) int64, zeros at first."""
    if threads == 1:
        return
    held = load_atomic(meeting, HELD)
    if add_atomic(meeting, COME, 1) == threads - 1:
        add_atomic(meeting, COME, -threads)
        add_atomic(meeting, HELD, 1)
        return
    spins = 0
    while load_atomic(meeting, HELD) == held:
        spins += 1
        if spins > SPINS:
            if load_atomic(meeting, ABANDONED) != 0:
                return
            give_way()
