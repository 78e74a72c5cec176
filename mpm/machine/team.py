"""How the threads of a compiled kernel share its stages: a few atomic instructions, no lock and no interpreter.

A kernel is a row of stages, each of some parts. A thread does what parts of a stage it can get, the first or the last
ones first, and goes on when all are done, by whomever: where the machine has other work and a thread is not running,
the others do its parts. They wait only for a part that is begun, some eighty microseconds at once and then asleep.
Stages are numbered by the parts of all stages before them.
"""

from typing import NamedTuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from mpm.machine.compile import kernel_part

SPINS = 300_000  # some eighty microseconds, about as long as one thread repairs the list of points
PAUSE = 50  # microseconds
LINE = 16  # numbers from one counter to the next, so that each is in a cache line of its own

fall_asleep = types.ExternalFunction("usleep", types.int32(types.uint32))  # POSIX


def meeting_width(most_parts):
    """Length of the int64 array, zeros at first, in which threads agree on stages of up to so many parts.

    One counter a part, above the number of the last stage in which it was begun; then that of parts done.
    """
    return LINE * (most_parts + 1)


def stage_at_hand(meeting):
    """Number of the stage that comes next, when no thread is in one."""
    return int(meeting[-LINE])


@intrinsic
def add_atomic(typing_context, array, place, value):
    """Add to an element of an int64 array; who sees it sees all that was written before."""

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


@intrinsic
def exchange_atomic(typing_context, array, place, old, new):
    """Set an element of an int64 array to `new` if it is `old`; whether it was."""

    def lower(context, builder, signature, arguments):
        pointer = _pointer(context, builder, signature.args[0], *arguments[:2])
        return builder.extract_value(builder.cmpxchg(pointer, *arguments[2:], "seq_cst", "seq_cst"), 1)

    return types.boolean(array, types.int64, types.int64, types.int64), lower


def _pointer(context, builder, array_type, array, place):
    view = context.make_array(array_type)(context, builder, array)
    pointer = cgutils.gep_inbounds(builder, view.data, place)
    return builder.bitcast(pointer, ir.IntType(64).as_pointer())


@kernel_part
def take_part(meeting, stage, thread, parts):
    """A part of the stage that nobody has begun, or -1; threads of odd number look from the last one on."""
    for k in range(parts):
        part = parts - 1 - k if thread % 2 else k
        begun = load_atomic(meeting, LINE * part)
        if begun <= stage and exchange_atomic(meeting, LINE * part, begun, stage + 1):
            return part
    return -1


@kernel_part
def next_part(meeting, stage, thread, parts):
    """Say that a part is done, and take another one as `take_part`."""
    add_atomic(meeting, meeting.size - LINE, 1)
    return take_part(meeting, stage, thread, parts)


@kernel_part
def next_stage(meeting, stage, parts):
    """Wait until all parts of the stage are done; returns the number of the stage that follows."""
    spins = 0
    while load_atomic(meeting, meeting.size - LINE) < stage + parts:
        spins += 1
        if spins > SPINS:
            fall_asleep(PAUSE)
    return stage + parts


class Team(NamedTuple):
    """A thread among those that share the stages of a kernel."""

    thread: int
    meeting: np.ndarray
    at: np.ndarray  # (1,) int64, number of the stage at hand


@kernel_part
def shared(team, parts):
    """Parts of a stage that this thread gets, one after the other; ends when all are done, by whomever."""
    part = take_part(team.meeting, team.at[0], team.thread, parts)
    while part >= 0:
        yield part
        part = next_part(team.meeting, team.at[0], team.thread, parts)
    team.at[0] = next_stage(team.meeting, team.at[0], parts)
