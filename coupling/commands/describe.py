"""What a file or folder is, for somebody who finds it: kind, content, and what to do with it."""

import json
import tomllib
from pathlib import Path
from typing import Any

from coupling.datasets import opened, read_attributes, read_history
from coupling.files.folder import RUN_FILE, how_to_go_on
from coupling.refused import Refused, SceneError
from coupling.studies.folder import STUDY_FILE, case_file

SIGNATURES = {b"\x89HDF\r\n\x1a\n": "netcdf", b"\x89PNG\r\n\x1a\n": "picture (PNG)", b"GIF8": "picture (GIF)"}


def describe(path: str | Path) -> dict[str, Any]:
    """What a path is.

    Returns: path; kind; bytes (of a file); facts: dict of texts and numbers; next: list of commands that take it.

    Raises Refused: nothing is there; RunFileError, coupling.studies.design.StudyError: a netCDF file or a study that
    cannot be read.
    """
    path = Path(path)
    if not path.exists():
        raise Refused(f"'{path}': there is no such file or folder")
    found = _folder(path) if path.is_dir() else _file(path)
    size = {} if path.is_dir() else {"bytes": path.stat().st_size}
    return {"path": str(path), "facts": {}, "next": [], **found, **size}


def _folder(path):
    if (path / RUN_FILE).is_file():
        facts = _run_facts(path / RUN_FILE)
        others = sorted(entry.name for entry in path.iterdir() if entry.name not in (RUN_FILE, ".lock"))
        return {"kind": "run folder", "facts": facts | {"beside run.nc": ", ".join(others) or "nothing"},
                "next": _run_commands(path, facts)}  # fmt: skip
    if (path / STUDY_FILE).is_file():
        return _study(path)
    runs = sorted(entry.parent.name for entry in path.glob(f"*/{RUN_FILE}"))
    if runs:
        return {"kind": "folder of runs", "facts": {"runs": ", ".join(runs)}, "next": [f"gush info {path / runs[0]}"]}
    return {"kind": "folder without a run", "facts": {"entries": sum(1 for _ in path.iterdir())}}


def _study(path):
    from coupling.studies.collect import stored_cases

    plan, cases, failures = stored_cases(path)
    finished = sum(case_file(path, case).is_file() for case in cases)
    go_on = [f"gush study {path}"] if finished < len(cases) else []
    facts = {
        "name": plan.name,
        "scene": plan.scene,
        "parameters": ", ".join(plan.parameters),
        "cases": len(cases),
        "finished": finished,
        "failed": len(failures),
        "lining models": ", ".join(plan.backends),
    }
    return {"kind": "study folder", "facts": facts, "next": [*go_on, f"gush report {path}"]}


def _file(path):
    with open(path, "rb") as stream:
        start = stream.read(1000)
    kind = next((name for signature, name in SIGNATURES.items() if start.startswith(signature)), "")
    if kind == "netcdf":
        return _netcdf(path)
    if kind:
        return {"kind": kind}
    if b"gushing report" in start:
        return {"kind": "report of a run or a study", "next": ["open it in a browser"]}
    if b"<VTKFile" in start or b"<Xdmf" in start:
        return {"kind": "mesh or fields for ParaView", "next": ["open it in ParaView"]}
    if path.suffix == ".toml":
        return _scene(path)
    if start.lstrip().startswith(b"{"):
        return _json(path)
    return {"kind": "not a file of this program"}


def _netcdf(path):
    with opened(path) as file:
        groups, content = file.names(), file.group(None)
    if {"lining", "history"} <= set(groups):
        facts = _run_facts(path)
        return {"kind": "run file", "facts": facts, "next": _run_commands(path, facts)}
    names = list(content.variables)
    kind = "pressures on a lining" if {"soil_pressure", "water_pressure"} <= set(names) else (
        "response of a lining" if "bending_moment" in names else "netCDF-4 file"
    )  # fmt: skip
    title = str(content.attrs.get("title", ""))
    return {"kind": kind, "facts": {"title": title, "variables": ", ".join(names), "groups": ", ".join(groups)}}


def _run_facts(file):
    from coupling.postprocess.quality import poor_errors, quality_line, stored_quality

    with opened(file) as run:  # sizes only of the points: those of a long run are many
        attributes, history, models = read_attributes(run), read_history(run), list(run.models())
        sizes = {"snapshots of the points": run.size("points", "time"), "triangles": run.size("mesh", "element")}
    facts = {
        "scene": attributes.get("scene_name", "unknown"),
        "status": " ".join(filter(None, (attributes.get("status", ""), attributes.get("status_message", "")))),
        "made": f"{attributes.get('created', '')} by {attributes.get('source', '')} {attributes.get('revision', '')}",
        "records": int(history.sizes["time"]),
    }
    if facts["records"]:
        last = history.isel(time=-1)
        facts |= {"time [s]": float(last["time"]), "inflow mass [kg/m]": float(last["inflow_mass"])}
    facts |= {name: size for name, size in sizes.items() if size is not None}
    facts["lining models"] = ", ".join(models) or "none"
    errors = stored_quality(attributes)
    facts |= {"errors": quality_line(errors)} if errors else {}
    return facts | {f"warning {k}": text for k, text in enumerate(poor_errors(errors), start=1)}


def _run_commands(path, facts):
    folder = path.parent if path.name == RUN_FILE else path
    stopped = facts["status"].startswith("interrupted") and (folder / RUN_FILE).is_file()
    resume = [how_to_go_on(folder)] if stopped else []
    return [*resume, f"gush report {path}", f"gush export {path}", f"gush respond {path}"]


def _scene(path):
    from coupling.scenes.features import facts as scene_facts
    from coupling.scenes.scene import load_scene

    try:
        scene = load_scene(path)
    except SceneError as error:
        try:
            tomllib.loads(path.read_text(encoding="utf-8-sig"))
        except (tomllib.TOMLDecodeError, UnicodeDecodeError):
            return {"kind": "not a file of this program", "facts": {"why": "no valid TOML"}}
        return {"kind": "TOML file that is no valid scene", "facts": {"why": str(error)}}
    facts = {"name": scene.name, **dict(scene_facts(scene))}
    return {"kind": "scene", "facts": facts, "next": [f"gush plan {path}", f"gush run {path}"]}


def _json(path):
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        return {"kind": "not a file of this program", "facts": {"why": "no valid JSON"}}
    facts = {name: data[name] for name in ("scene", "run", "status") if name in data}
    return {"kind": "JSON result" if facts else "JSON file", "facts": facts | {"keys": ", ".join(map(str, data))}}
