"""Compiled kernels are kept for other processes, are never another variant's, and are not needed."""

import gc
import os
import subprocess
import sys
from pathlib import Path

import numba
import pytest
from numba.core import event

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
VARIANTS = """
import sys
from mpm.machine.compile import kernel
def scaled(factor):
    @kernel
    def inner(x):
        return factor * x
    @kernel
    def scale(x):
        return 2.0 * inner(x)
    return scale
for factor in map(float, sys.argv[1:]):
    scale = scaled(factor)
    assert scale(1.0) == 2.0 * factor, scale(1.0)
    print("compiled" if scale.stats.cache_misses else "kept")
"""
EVENT = """
import hashlib, inspect
import mpm
import mpm.machine.team, mpm.time_step.krylov, mpm.points, mpm.relaxation
import sys; sys.path.insert(0, "tests")
from verification.small_event import small_scene
scene = small_scene()
solver = mpm.Solver(scene, mpm.build_mesh(scene), threads=1)
solver.relax()
solver.open_gate()
for _ in range(40):
    solver.step()
modules = mpm.machine.team, mpm.time_step.krylov, mpm.points, mpm.relaxation
kernels = [v for m in modules for v in vars(m).values()]
kernels += [solver._long_step, *inspect.getclosurevars(solver._long_step.py_func).nonlocals.values()]
kernels += [mpm.time_step.krylov.krylov_kernel(solver.needs)]
kernels = {k.py_func.__qualname__: k for k in kernels if hasattr(k, "py_func")}
print(len(kernels), max(len(k.signatures) for k in kernels.values()),
      *(name for name, k in kernels.items() if k.stats.cache_misses))
"""


@pytest.fixture
def program(tmp_path):
    """Starts a process whose kernels are kept in a folder of the test; the code stands in a file, as kernels do."""
    path = tmp_path / "variants.py"
    path.write_text(VARIANTS)

    def start(*arguments, cache=tmp_path / "cache", **environment):
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(cache), **environment}
        return subprocess.Popen(
            [sys.executable, path, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            env={name: value for name, value in environment.items() if value},
        )  # fmt: skip

    return start


def printed(process):
    out, error = process.communicate()
    assert process.returncode == 0, error
    return out.split()


def test_processes_that_compile_at_once_get_their_own_variant(program, tmp_path):
    for process in [program("3"), program("5")]:
        printed(process)
    assert printed(program("5", "3")) == ["kept", "kept"]
    assert len(list((tmp_path / "cache").rglob("*scale_*.nbc"))) == 2


def test_damaged_kernels_are_compiled_again(program, tmp_path):
    printed(program("3"))
    for file in (tmp_path / "cache").rglob("*.nb?"):
        file.write_bytes(file.read_bytes()[:40])
    assert printed(program("3")) == ["compiled"]
    assert printed(program("3")) == ["kept"]


def test_home_that_cannot_be_written_is_not_needed(program, tmp_path):
    (tmp_path / "file").write_text("")
    blocked = str(tmp_path / "file" / "home")
    (tmp_path / "temporary").mkdir()
    elsewhere = {"cache": "", "HOME": blocked, "XDG_CACHE_HOME": blocked, "TMPDIR": str(tmp_path / "temporary")}
    assert printed(program("3", **elsewhere)) == ["compiled"]
    assert printed(program("3", **elsewhere)) == ["kept"]  # in the folder for temporary files
    assert printed(program("3", cache=blocked)) == ["compiled"]  # in memory only


def test_every_kernel_is_compiled_once_for_all_processes_and_for_one_signature():
    """A kernel for two signatures costs a user seconds more, and one that is not found again every run as many."""
    for _ in range(2):
        run = subprocess.run([sys.executable, "-c", EVENT], cwd=ROOT, capture_output=True, text=True, check=True)
        count, signatures, *compiled = run.stdout.split()
    assert compiled == []
    assert int(count) > 10
    assert int(signatures) == 1


def test_kernels_that_kernels_call_are_one_piece_of_machine_code_with_them(program, tmp_path):
    # As code of their own they would run as first optimised in the process that compiles them, and as optimised once
    # more with their caller in those that load it: other bits. This one is too long to be written out unasked.
    terms = "\n        ".join(f"x = factor * x + {k}.0 / (x * x + {k + 1}.0)" for k in range(150))
    (tmp_path / "variants.py").write_text(f"""
from mpm.machine.compile import kernel
def kernels(factor):
    @kernel
    def inner(x):
        {terms}
        return x
    @kernel
    def outer(x):
        return inner(x) + inner(x + 1.0)
    return outer
outer = kernels(0.5)
outer(1.0)
code = outer.inspect_llvm(outer.signatures[0])
assert "outer" in code
print("calls" if any(" call " in line and "inner" in line for line in code.splitlines()) else "alone")
""")
    assert printed(program()) == ["alone"]


def test_options_of_kernels_are_compared_and_hashed_as_numba_does():
    from numba.core.compiler import Flags

    from mpm.machine import compile_options

    plain, named, other = Flags(), Flags(), Flags()
    named.nrt, other.forceinline = plain.nrt, True  # the same by default, and another
    for one in (plain, named, other):
        for two in (plain, named, other):
            assert compile_options.equal(one, two) == (one.values() == two.values())
        assert compile_options.hash_of(one) == compile_options._hash(one)
    assert plain == named != other and Flags.__eq__ is compile_options.equal


def test_the_garbage_collector_rests_while_numba_compiles_and_no_longer():
    import mpm.machine.compile  # noqa: F401, sees to it

    at_start = []

    class Look(event.Listener):
        """Notes whether the collector runs when a kernel begins."""

        def on_start(self, event):
            at_start.append(gc.isenabled())

        def on_end(self, event):
            pass

    def good(number):
        return number + 1

    def bad(number):
        return number + "text"

    look = Look()
    event.register("numba:compile", look)
    try:
        assert numba.njit(good)(1) == 2 and gc.isenabled()
        with pytest.raises(numba.TypingError):
            numba.njit(bad)(1)
        assert gc.isenabled()
    finally:
        event.unregister("numba:compile", look)
    assert at_start == [False, False]
