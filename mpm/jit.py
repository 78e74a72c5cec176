"""The kernel decorator: one place for numba's options."""

import numba

from mpm.kernel_cache import KernelCache, kernel_folder, variant_name

# contract: fused multiply-add; nsz, arcp: harmless reordering. No "nnan" or "ninf": the
# non-finite check of the solver relies on NaN keeping its meaning.
FAST_MATH = {"contract", "nsz", "arcp"}
OPTIONS = {"nogil": True, "error_model": "numpy", "fastmath": FAST_MATH}
FOLDER = kernel_folder({**OPTIONS, "fastmath": sorted(FAST_MATH)})


def kernel(function, **options):
    """Compile a function of arrays and numbers when it is first called, once for all processes."""
    function.__qualname__ = variant_name(function)
    compiled = numba.njit(**OPTIONS, **options)(function)
    if FOLDER is not None:
        compiled._cache = KernelCache(function, FOLDER)
    return compiled


def inline_kernel(function):
    """A kernel that is written out where others call it."""
    return kernel(function, inline="always")
