"""The folder of a run: chosen, checked and locked before anything starts, so that nothing existing is lost."""

import contextlib
import os
import shlex
from pathlib import Path

import psutil
from filelock import FileLock, Timeout

from coupling.files.checkpoint import remove_checkpoints
from coupling.refused import Refused

RUN_FILE, MESH_FILE, SCENE_FILE, LOG_FILE, FIGURES = "run.nc", "mesh.vtu", "scene.toml", "run.log", "figures"
REPORT_FILE, REPORT_PDF, FIELDS, TABLES = "report.html", "report.pdf", "fields", "tables"
#: Files in the folders of a run that are its own.
OWN_KINDS = {
    FIGURES: (".png", ".svg", ".pdf"), FIELDS: (".vtu", ".pvd", ".xdmf", ".h5", ".gif"), TABLES: (".csv", ".xlsx"),
}  # fmt: skip
LOCK_FILE = ".lock"
SECONDS_FOR_A_LOOK = 0.1  # a look at the lock may hold it for an instant


def default_folder(scene_name):
    """`runs/<scene>` in the current folder, numbered when that one is taken: an earlier run is never replaced."""
    number, folder = 1, Path("runs") / scene_name
    while folder.exists() and _content(folder) != []:
        number += 1
        folder = Path("runs") / f"{scene_name}-{number}"
    return folder


def made(folder, what="output folder"):
    """The folder, made when absent. Raises Refused: it cannot be made."""
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        raise Refused(f"{what} '{folder}': it, or one above it, is a file; choose another --out") from None
    except OSError as error:
        raise Refused(f"{what} '{folder}': cannot be made: {error.strerror}; choose another --out") from None
    return folder


@contextlib.contextmanager
def claimed(folder, overwrite=False):
    """Hold a run folder for the time of a run; refuse before anything is touched.

    folder : str or path, made when absent;  overwrite : bool, replace an earlier run's own files; others are left
    alone.

    Raises Refused: not a folder, in use by another run, not writable, or not empty and `overwrite` not asked for.
    """
    folder = made(folder)
    with _locked(folder):
        content = _content(folder)
        if content and not overwrite:
            shown = ", ".join(content[:3]) + (", .." if len(content) > 3 else "")
            raise Refused(
                f"output folder '{folder}': not empty, it holds {shown}; choose another --out, "
                "ask for --overwrite (overwrite=True) to replace the run in it, or for --resume to continue it"
            )
        for name in (RUN_FILE, MESH_FILE, SCENE_FILE, LOG_FILE, REPORT_FILE, REPORT_PDF):
            (folder / name).unlink(missing_ok=True)
            (folder / f"{name}.journal").unlink(missing_ok=True)
        remove_checkpoints(folder)
        for name, kinds in OWN_KINDS.items():
            for file in (folder / name).glob("*"):
                if file.suffix in kinds:
                    file.unlink()
        yield folder


@contextlib.contextmanager
def reopened(folder):
    """Hold the folder of an earlier run to continue it; nothing in it is touched.

    Raises Refused: no run in it, in use by another run, or not writable.
    """
    folder = Path(folder)
    if not any((folder / name).is_file() for name in (RUN_FILE, SCENE_FILE)):
        raise Refused(
            f"output folder '{folder}': must hold the run to resume, there is neither {RUN_FILE} nor {SCENE_FILE}; "
            "give its folder as --out, or start a run with --overwrite instead"
        )
    with _locked(folder):
        yield folder


@contextlib.contextmanager
def _locked(folder):
    """Hold the lock, with this process's number in it; the system drops it when the process ends, however it ends."""
    path = folder / LOCK_FILE
    try:
        lock = FileLock(path, timeout=SECONDS_FOR_A_LOOK, thread_local=False)
        lock.acquire(poll_interval=0.02)
    except Timeout:
        raise Refused(
            f"output folder '{folder}': in use by another run (process {_holder(path) or 'unknown'}); "
            "wait for it or choose another --out"
        ) from None
    except OSError as error:
        raise Refused(
            f"output folder '{folder}': not writable: {error.strerror}; choose another --out or change its rights"
        ) from None
    try:
        with contextlib.suppress(OSError):  # Windows lets nobody write into a locked file
            path.write_text(f"{os.getpid()}\n")
        for left in folder.glob("*.tmp"):  # of a process that was killed, see `coupling.files.replace`
            left.unlink(missing_ok=True)
        yield
    finally:
        with contextlib.suppress(OSError):
            path.unlink()
        lock.release()


def _holder(path):
    """The number in a lock; None where there is none to read."""
    with contextlib.suppress(OSError, ValueError):
        return int(path.read_text())
    return None


def in_use(folder):
    """Whether a process holds the folder of a run: the system drops the lock of one that was killed."""
    path = Path(folder) / LOCK_FILE
    if not path.exists():
        return False
    try:
        with FileLock(path, timeout=0, thread_local=False):
            return False
    except Timeout:
        return True
    except OSError:  # no right to write here: ask for the process instead
        return psutil.pid_exists(_holder(path) or -1)


def how_to_go_on(folder):
    """The command that continues the run in a folder."""
    return f"gush run --resume --out {shlex.quote(str(folder))}"


def _content(folder):
    """Names in a folder besides the lock; a file in its place counts as content."""
    if not folder.is_dir():
        return [folder.name]
    return sorted(entry.name for entry in folder.iterdir() if entry.name != LOCK_FILE)
