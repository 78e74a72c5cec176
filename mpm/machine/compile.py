"""The kernel decorator: one place for numba's options."""

import os
from functools import partial

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from mpm.machine.compile_options import compile_quickly
from mpm.machine.kernel_cache import KernelCache, kernel_folder, variant_name

# contract: fused multiply-add; nsz, arcp: harmless reordering. No "nnan" or "ninf": the
# non-finite check of the solver relies on NaN keeping its meaning.
FAST_MATH = {"contract", "nsz", "arcp"}
# Vectors of what is alike and side by side: velocities of both phases, what a point adds to a node. numba leaves this
# pass out by default; NUMBA_SLP_VECTORIZE in the environment decides where it is set.
if "NUMBA_SLP_VECTORIZE" not in os.environ:
    numba.config.SLP_VECTORIZE = 1
compile_quickly()
# forceinline: kernels that call others are one piece of machine code with them. Were the others code of their own, the
# process that compiles would call that, and those that load what it compiled the copies that come with the caller,
# which were optimised once more: other bits.
OPTIONS = {"nogil": True, "error_model": "numpy", "fastmath": FAST_MATH, "forceinline": True}
FOLDER = kernel_folder({**OPTIONS, "fastmath": sorted(FAST_MATH), "slp_vectorize": bool(numba.config.SLP_VECTORIZE)})


def kernel(function, **options):
    """Compile a function of arrays and numbers when it is first called, once for all processes."""
    compiled = _compiled(function, no_cfunc_wrapper=True, **options)
    if FOLDER is not None:
        compiled._cache = KernelCache(function, FOLDER)
    return compiled


def kernel_part(function, allocates=False):
    """A kernel that only other kernels call. It has no machine code of its own: called from Python it crashes.

    Arrays are not counted, as in :func:`step_kernel`.

    allocates : bool
        Whether it makes arrays of its own, which have to be counted.
    """
    return _compiled(function, no_cpython_wrapper=True, no_cfunc_wrapper=True, _nrt=allocates)


def step_kernel(function):
    """A kernel that makes no arrays. Those it is given are the caller's and live as long as it runs.

    So they are not counted: of every array taken out of a group numba would count the references, with atomic
    instructions that two threads wait for.
    """
    return kernel(function, _nrt=False)


allocating_part = partial(kernel_part, allocates=True)


def integer_kernel(function):
    """A kernel of whole numbers only: they are the same however it is compiled, so callers need no copy of it."""
    return kernel(function, forceinline=False)


def _compiled(function, **options):
    function.__qualname__ = variant_name(function)
    compiled = numba.njit(**{**OPTIONS, **options})(function)
    of_types = compiled.get_call_template

    def of_plain_types(args, kws):
        """numba would compile a kernel for the 0 that a counter begins with, and once more for the counter."""
        return of_types(tuple(map(types.unliteral, args)), {name: types.unliteral(kind) for name, kind in kws.items()})

    compiled.get_call_template = of_plain_types
    return compiled


def inline_kernel(function):
    """A kernel that is written out where others call it: parts that stand in one another are optimised once each."""
    return kernel(function, inline="always")


LINE = 64  # bytes of a cache line

# Of an index without sign numba knows that it does not count from the end: a tenth of a step is the test for that.
index = np.uint64


@intrinsic
def prefetch(typing_context, array, row):
    """Have a row of 128 bytes of an array brought into the cache; row : unsigned, in bounds."""

    def lower(context, builder, signature, arguments):
        view = context.make_array(signature.args[0])(context, builder, arguments[0])
        byte, number = ir.IntType(8).as_pointer(), ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [byte, number, number, number])
        fetch = cgutils.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0i8")
        first = builder.mul(cgutils.unpack_tuple(builder, view.strides)[0], arguments[1])
        for offset in (0, LINE):
            place = builder.gep(builder.bitcast(view.data, byte), [builder.add(first, ir.Constant(first.type, offset))])
            builder.call(fetch, [place, number(0), number(3), number(1)])  # to read, to keep, data
        return context.get_dummy_value()

    return types.void(array, types.uint64), lower
