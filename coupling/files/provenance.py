"""Where a result comes from: scene, versions and revision as the root attributes of a run file."""

import hashlib
import platform
import subprocess
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path

import mpm

PACKAGES = ("numpy", "numba", "llvmlite", "scipy", "xarray", "h5py", "h5netcdf", "gmsh")
#: Root attributes, and packages of `versions`, that the bits of a simulation depend on, the processor apart.
DECISIVE = ("scene", "source", "solver_sha256", "numpy", "numba", "llvmlite")


def root_attributes(scene):
    """Root attributes of a run file: conventions, source, versions, revision, scene and its hash."""
    text = scene.source
    return {
        "Conventions": "CF-1.11",
        "title": f"water and soil gushing into a tunnel: {scene.name}",
        **origin(),
        "solver_sha256": solver_sha256(),
        "python": platform.python_version(),
        "processor": _processor(),
        "random_numbers": "none: neither mesh nor simulation draws any",
        "history": with_history("", "simulation begun"),
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "scene_name": scene.name,
        "scene": text,
        "scene_sha256": hashlib.sha256(text.encode()).hexdigest(),
    }


def origin():
    """What computes here: attributes source, revision and versions."""
    return {
        "source": f"gushing {_version('gushing')}",
        "revision": revision(),
        "versions": ", ".join(f"{name} {_version(name)}" for name in PACKAGES),
    }


def made_here(title, event):
    """Attributes of a dataset that is computed here: conventions, title, :func:`origin`, the event as its history."""
    return {**origin(), "Conventions": "CF-1.11", "title": title, "history": with_history("", event)}


def with_history(history, event):
    """The CF attribute `history` with one more line: when, by which version, what."""
    line = f"{datetime.now(UTC).isoformat(timespec='seconds')} gushing {_version('gushing')}: {event}"
    return "\n".join(filter(None, (history, line)))


def solver_sha256():
    """Hash of all sources of the package `mpm`, which compute the mesh and the simulation."""
    digest = hashlib.sha256()
    home = Path(mpm.__file__).parent
    for file in sorted(home.rglob("*.py")):
        digest.update(f"{file.relative_to(home).as_posix()} {file.stat().st_size}\n".encode() + file.read_bytes())
    return digest.hexdigest()


def differences(stored, now, names=DECISIVE):
    """Names among `names` whose values differ between two sets of root attributes, with both values.

    Returns dict of str to (str, str): name to the stored and the present value; "unknown" for what is not stored.
    """
    stored, now = ({**attributes, **_by_package(attributes.get("versions", ""))} for attributes in (stored, now))
    pairs = {name: (str(stored.get(name, "unknown")), str(now.get(name, "unknown"))) for name in names}
    return {name: pair for name, pair in pairs.items() if pair[0] != pair[1]}


def _by_package(versions):
    return dict(entry.split(" ", 1) for entry in versions.split(", ") if " " in entry)


def _processor():
    """The processor as the compiler of the kernels names it: the machine code depends on it."""
    import llvmlite.binding

    return f"{platform.machine()} {llvmlite.binding.get_host_cpu_name()}"


def _version(package):
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "not installed"


def revision():
    """Commit of the working copy this code runs from, '+changed' when files differ from it; '' outside of one."""
    home = Path(mpm.__file__).resolve().parents[1]
    if not (home / ".git").exists():
        return ""
    try:
        done = subprocess.run(
            ["git", "-C", str(home), "describe", "--always", "--abbrev=12", "--dirty=+changed"],
            capture_output=True,
            text=True,
            timeout=5,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.strip()
