"""Where a result comes from: scene, versions and revision as the root attributes of a run file."""

import hashlib
import subprocess
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path

PACKAGES = ("numpy", "numba", "scipy", "xarray", "h5netcdf", "gmsh")


def root_attributes(scene):
    """Root attributes of a run file: conventions, source, versions, revision, scene and its hash."""
    text = scene.source
    return {
        "Conventions": "CF-1.11",
        "title": f"water and soil gushing into a tunnel: {scene.name}",
        "source": f"gushing {_version('gushing')}",
        "revision": revision(),
        "versions": ", ".join(f"{name} {_version(name)}" for name in PACKAGES),
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "scene_name": scene.name,
        "scene": text,
        "scene_sha256": hashlib.sha256(text.encode()).hexdigest(),
    }


def _version(package):
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "not installed"


def revision():
    """Commit of the working copy this code runs from, '+changed' when files differ from it; '' outside of one."""
    home = Path(__file__).resolve().parent.parent
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
