"""The kernel decorator: one place for numba's options."""

import os

import numba
import numpy as np

from mpm.kernel_cache import KernelCache, kernel_folder, variant_name

# contract: fused multiply-add; nsz, arcp: harmless reordering. No "nnan" or "ninf": the
# non-finite check of the solver relies on NaN keeping its meaning.
FAST_MATH = {"contract", "nsz", "arcp"}
# Vectors of what is alike and side by side: velocities of both phases, what a point adds to a node. numba leaves this
# pass out by default; NUMBA_SLP_VECTORIZE in the environment decides where it is set.
if "NUMBA_SLP_VECTORIZE" not in os.environ:
    numba.config.SLP_VECTORIZE = 1
# forceinline: kernels that call others are one piece of machine code with them. Were the others code of their own, the
# process that compiles would call that, and those that load what it compiled the copies that come with the caller,
# which were optimised once more: other bits.
OPTIONS = {"nogil": True, "error_model": "numpy", "fastmath": FAST_MATH, "forceinline": True}
FOLDER = kernel_folder({**OPTIONS, "fastmath": sorted(FAST_MATH), "slp_vectorize": bool(numba.config.SLP_VECTORIZE)})


def kernel(function, **options):
    """Compile a function of arrays and numbers when it is first called, once for all processes."""
    compiled = _compiled(function, **options)
    if FOLDER is not None:
        compiled._cache = KernelCache(function, FOLDER)
    return compiled


def kernel_part(function):
    """A kernel that only other kernels call. It has no machine code of its own: called from Python it crashes."""
    return _compiled(function, no_cpython_wrapper=True, no_cfunc_wrapper=True)


def _compiled(function, **options):
    function.__qualname__ = variant_name(function)
    return numba.njit(**OPTIONS, **options)(function)


def inline_kernel(function):
    """A kernel that is written out where others call it."""
    return kernel(function, inline="always")


# Of an index without sign numba knows that it does not count from the end: a tenth of a step is the test for that.
index = np.uint64
