"""Where compiled kernels are kept between processes: one file a variant, keyed by all that decides its machine code.

numba's own cache goes stale when another module is edited, hashes what a kernel closes over with random numbers in it
(a kernel that calls another variant is then compiled anew by every process), numbers the variants of a function so
that two processes which compile at once can give one the other's code, and fails on a full disk. So: a folder keyed by
the hash of all kernel sources, options and versions; one index a variant; data named after its signature and written
before the index, both by renaming. Whoever writes last writes the same.
"""

import hashlib
import os
import shutil
import tempfile
import time as clock
from pathlib import Path

import llvmlite
import numba
import platformdirs
from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile

UNUSED_SECONDS = 30 * 86400.0  # after which the kernels of another version are removed
#: Settings of numba that change the machine code; the processor stands in every index.
SETTINGS = ("BOUNDSCHECK", "OPT", "LOOP_VECTORIZE", "SLP_VECTORIZE", "DISABLE_INTEL_SVML", "DEBUGINFO_DEFAULT")


def source_key(options):
    """Hash of all kernel sources, the compiler's options and the versions [str]."""
    settings = [f"{name}={getattr(numba.config, name, None)}" for name in SETTINGS]
    digest = hashlib.sha256(f"{numba.__version__} {llvmlite.__version__} {options} {settings}".encode())
    for source in sorted(Path(__file__).parent.parent.rglob("*.py")):
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


def kernel_folder(options):
    """Return a private writable folder for compiled kernels [Path], or None: then each process compiles for itself.

    That of numba's setting NUMBA_CACHE_DIR, the user's cache, or else the folder for temporary files.
    """
    key = source_key(options)
    bases = [Path(platformdirs.user_cache_dir("gushing")), Path(tempfile.gettempdir()) / f"gushing-{os.getuid()}"]
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    for base in [Path(chosen)] if chosen else bases:
        folder = base / "kernels" / key
        try:
            new = not folder.exists()
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            # code is loaded from here: nobody else may put any there
            if folder.stat().st_uid != os.getuid() or folder.stat().st_mode & 0o022 or not os.access(folder, os.W_OK):
                continue
            os.utime(folder)
        except OSError:
            continue
        if new:
            _remove_unused(folder.parent)
        return folder
    return None


def _remove_unused(kernels):
    for folder in kernels.iterdir():
        try:
            if clock.time() - folder.stat().st_mtime > UNUSED_SECONDS:
                shutil.rmtree(folder, ignore_errors=True)
        except OSError:  # another process was faster
            continue


def variant_name(function):
    """Qualified name of a kernel, with a hash of what it closes over: numbers, strings and other kernels.

    Raises
    ------
    TypeError
        For a kernel that closes over anything else, whose value a name cannot tell.
    """
    cells = []
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        value = cell.cell_contents
        if hasattr(value, "py_func"):
            value = f"{value.py_func.__module__}.{value.py_func.__qualname__}"
        elif not isinstance(value, bool | int | float | str | None):
            raise TypeError(
                f"kernel '{function.__qualname__}': may close over numbers, strings and kernels, not {name}"
            )
        cells.append(f"{name}={value!r}")
    if not cells:
        return function.__qualname__
    return f"{function.__qualname__}_{hashlib.sha256(' '.join(cells).encode()).hexdigest()[:8]}"


class KernelCache(FunctionCache):
    """Cache of one kernel variant, whose qualified name is :func:`variant_name`.

    Parameters
    ----------
    function : function
    folder : Path
    """

    def __init__(self, function, folder):
        class Locator:
            """What numba asks a place for."""

            def get_cache_path(self):
                return str(folder / function.__module__)

            def ensure_cache_path(self):
                os.makedirs(self.get_cache_path(), mode=0o700, exist_ok=True)

            def get_source_stamp(self):
                return hashlib.sha256(Path(function.__code__.co_filename).read_bytes()).hexdigest()

            def get_disambiguator(self):
                return None

            @classmethod
            def from_function(cls, function, path):
                return cls()

        class Impl(CompileResultCacheImpl):
            _locator_classes = (Locator,)

        self._impl_class = Impl
        super().__init__(function)
        self._cache_file = KernelFile(self._cache_path, self._impl.filename_base, Locator().get_source_stamp())

    def _index_key(self, sig, codegen):
        return sig, codegen.magic_tuple()

    def load_overload(self, sig, target_context):
        """The compiled kernel, or None where there is none, or only a damaged file."""
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # unpickling what a full disk or a power cut left may raise anything
            return None

    def save_overload(self, sig, data):
        """Store a compiled kernel where that is possible; it works without."""
        try:
            super().save_overload(sig, data)
        except OSError:
            self.disable()


class KernelFile(IndexDataCacheFile):
    """Index and data of one variant, in files whose names do not depend on who writes first."""

    def save(self, key, data):
        """Store a new entry: its data first, since an index must not promise what is not there."""
        try:
            entries = self._load_index()
        except Exception:  # damaged: begin again
            entries = {}
        name = self._index_name.removesuffix("nbi") + hashlib.sha256(repr(key).encode()).hexdigest()[:16] + ".nbc"
        self._save_data(name, data)
        self._save_index({**entries, key: name})
