"""The kernel decorator: one place for numba's options and for where compiled kernels are kept.

numba's own cache ignores edits in other modules and its compile options, so the cache folder is
keyed by a hash of every kernel source of this package, of the options and of numba's version.
"""

import hashlib
import os
import tempfile
from pathlib import Path

import numba
import numpy as np
import platformdirs

# contract: fused multiply-add; nsz, arcp: harmless reordering. No "nnan" or "ninf": the
# non-finite check of the solver relies on NaN keeping its meaning.
FAST_MATH = {"contract", "nsz", "arcp"}
# Vectors of what is alike and side by side: velocities of both phases, what a point adds to a node. numba leaves this
# pass out by default; NUMBA_SLP_VECTORIZE in the environment decides where it is set.
if "NUMBA_SLP_VECTORIZE" not in os.environ:
    numba.config.SLP_VECTORIZE = 1
OPTIONS = {"nogil": True, "error_model": "numpy", "fastmath": FAST_MATH, "cache": True}


def kernel_cache_folder():
    """Return a writable folder for compiled kernels, keyed by the kernel sources [Path]."""
    digest = hashlib.sha256(f"{numba.__version__} {sorted(FAST_MATH)} {numba.config.SLP_VECTORIZE}".encode())
    for source in sorted(Path(__file__).parent.rglob("*.py")):
        digest.update(source.read_bytes())
    key = digest.hexdigest()[:16]
    for base in (Path(platformdirs.user_cache_dir("gushing")), Path(tempfile.gettempdir()) / f"gushing-{os.getuid()}"):
        folder = base / "kernels" / key
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder, os.W_OK):
            return folder
    return None


_folder = kernel_cache_folder()
if _folder is None:
    OPTIONS["cache"] = False  # nowhere to write: compile in memory each time
elif not os.environ.get("NUMBA_CACHE_DIR"):
    numba.config.CACHE_DIR = str(_folder)

kernel = numba.njit(**OPTIONS)
inline_kernel = numba.njit(inline="always", **OPTIONS)

# Of an index without sign numba knows that it does not count from the end: a tenth of a step is the test for that.
index = np.uint64
