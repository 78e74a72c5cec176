"""What the page about a run shows, collected from its datasets: a study of one case, with all that the run recorded."""

import xarray as xr

from coupling.datasets import RunFileError, identifier, opened, read_run
from coupling.datasets.geometry import gate_of, gate_tunnel, tunnels_beside
from coupling.datasets.tree import responses_of
from coupling.postprocess.limits import HEADS, limit_rows
from coupling.postprocess.mesh_ladder import read_ladder
from coupling.postprocess.summary import summarise_run
from coupling.refused import Refused, SceneError
from coupling.report.answer import answer_of_run
from coupling.report.curves import MOST_IN_DETAIL, MOST_STOPS, budget, entry, ring_series, run_states
from coupling.report.ground import field_snapshots, mesh_picture, section
from coupling.report.numbers import inflow_numbers, pressure_numbers, ring_numbers, shown
from coupling.report.packing import evenly
from coupling.report.trust import quality, run_warnings
from coupling.runs.progress_line import duration
from coupling.scenes.features import facts, features
from coupling.scenes.scene import parse_scene
from structure.passing import utilisations

MOST_RECORDS = 600
VERDICTS = {True: "as expected", False: "look at this", None: "–", "poor": "poor: look at this"}


def collect(run, model=None, ladder=None):
    """Everything that the page shows, names as `page.html` uses them.

    run : str or path;
    model : str, optional, lining model whose numbers lead; left out: that of the run itself, see
        :func:`structure.models.in_order`;
    ladder : path, optional, mesh ladder of the scene, see :func:`coupling.postprocess.mesh_ladder.read_ladder`.
    """
    with opened(run) as file:
        tree = _led_by(read_run(file), model)
        if "history" not in tree.children or "lining" not in tree.children:
            raise RunFileError(f"run file '{file.path}': it holds no run; give the folder that `gush run` wrote")
        if not min(tree["lining"].sizes["time"], tree["history"].sizes["time"]):
            raise RunFileError(f"run file '{file.path}': has no complete record yet; wait for the first one")
        summary = summarise_run(file)
    attributes = {name: _plain(value) for name, value in tree.attrs.items()}
    scene = read_scene(attributes)
    meshes = None if ladder is None else read_ladder(ladder, attributes.get("scene_name", ""))
    rows = quality(tree, summary, scene)
    fields = field_snapshots(tree["points"].to_dataset()) if "points" in tree.children else None
    kept = evenly(tree["history"].sizes["time"], MOST_RECORDS)
    rings = {number: run_states(tree, number, kept) for number in (None, *tunnels_beside(tree["lining"]))}
    answers = {number: ring_series(states) for number, states in rings.items()}
    step, records = budget(rings[None], len(rings), MOST_STOPS, len(rings) <= MOST_IN_DETAIL)
    wall = summary.get("wall_seconds")
    return {
        "title": f"Gushing into a tunnel: {attributes.get('scene_name', 'run')}",
        "lead": f"{shown(summary['inflow_mass'])} kg of grains per metre in {shown(summary['time'])} s"
                f"{'' if wall is None else f', computed in {duration(wall)}'}.",
        "status": (summary["status"], summary["status"]),
        "answer": answer_of_run(tree, meshes),
        "warnings": run_warnings(tree, attributes, rows),
        "notes": _thinned(len(kept), records, step, fields, scene, tree["history"].sizes["time"]),
        "attributes": attributes,
        "made": f"run of {attributes.get('created', 'unknown time')}",
        "cost": _cost(summary),
        "numbers": _numbers(tree, answers),
        "balances": [(what, value, VERDICTS.get(good, good), good in (False, "poor")) for what, value, good in rows],
        "limits": _limits(tree),
        "facts": [] if scene is None else facts(scene),
        "parts": [] if scene is None else left_out(scene),
        "ground_options": [(key, one["label"]) for key, one in (fields or {"fields": {}})["fields"].items()],
        "player": {
            "stops": _stops(rings[None], records),
            "theta": rings[None]["theta"].values[::step].tolist() if "theta" in rings[None].dims else [],
            "entries": [
                _entry(tree, number, entry(states, answers[number], records, step, len(rings) <= MOST_IN_DETAIL))
                for number, states in rings.items()
            ],
            "recorded": _recorded(tree, kept),
            "section": section(scene, tree["lining"].to_dataset()),
            "mesh": mesh_picture(tree["mesh"].to_dataset()) if "mesh" in tree.children else None,
            "fields": fields,
        },
    }  # fmt: skip


def read_scene(attributes):
    """The scene stored with a run; None where this version of the program no longer understands it."""
    try:
        return parse_scene(attributes["scene"], "scene of the run")
    except (KeyError, SceneError):
        return None


def left_out(scene):
    """What was active and what was left out: rows of :func:`coupling.scenes.features.features`."""
    # the number of threads is no part of the scene and changes no result
    return [row for row in features(scene, 1) if row["feature"] != "several threads"]


def _led_by(tree, model):
    """The tree with the responses of a model before those of the others; as it is for None."""
    if model is None:
        return tree
    known = responses_of(tree)
    if model not in known:
        raise Refused(
            f"--model: must be a lining model that has answered, got {model!r}; there are "
            f"{', '.join(known) or 'none'}: run gush respond first"
        )
    groups = tree.to_dict()
    first = {path: groups[path] for path in groups if path.rpartition("/")[2] == identifier(model) or path == "/"}
    return xr.DataTree.from_dict(first | groups)


def _cost(summary):
    rows = [("wall time", summary.get("wall_seconds"), "s"), ("processor time", summary.get("cpu_seconds"), "s"),
            ("simulated time", summary["time"], "s"), ("time steps", summary["steps"], ""),
            ("mean time step", 1e6 * summary["mean_dt"], "µs"),
            ("point updates per processor second", summary["point_steps_per_cpu_second"] / 1e6, "million")]  # fmt: skip
    return [(name, value, unit) for name, value, unit in rows if value is not None]


def _numbers(tree, answers):
    """Title of a group of key numbers to its list of Number; groups without numbers are left out."""
    groups = {"Gushing": inflow_numbers(tree)}
    for tunnel, found in answers.items():
        of, key = ("", "") if tunnel is None else (f" of tunnel {tunnel}", f"tunnel_{tunnel}_")
        groups[f"Pressures on the lining{of}"] = pressure_numbers(tree["lining"].to_dataset(), tunnel)
        names = list(responses_of(tree, tunnel))
        groups[", ".join([f"Forces and deformation of the ring{of}", *names[:1]])] = ring_numbers(names, found, key)
    return {title: numbers for title, numbers in groups.items() if numbers}


def _limits(tree):
    """Utilisations of the first lining model of every tunnel as a table; no rows without limits."""
    rows = []
    for tunnel in (None, *tunnels_beside(tree["lining"])):
        of = "" if tunnel is None else f", tunnel {tunnel}"
        found = next((utilisations(response) for response in responses_of(tree, tunnel).values()), {})
        for (name, *cells), one in zip(limit_rows(found), found.values(), strict=True):
            rows.append(((f"{name}{of}", *cells), one["largest"] > 1))
    about = "Utilisations over all records, 1 is the limit; between records they are taken as linear in time."
    return {"heads": HEADS, "rows": rows, "about": about}


def _stops(states, records):
    times, masses = states["time"].values[records], states["inflow_mass"].values[records]
    return {
        "along": "time",
        "values": times,
        "told": [f"{shown(float(t))} s, {shown(float(m))} kg/m" for t, m in zip(times, masses, strict=True)],
    }


def _entry(tree, tunnel, made):
    gate, home = gate_of(tree["lining"].to_dataset()), gate_tunnel(tree["lining"])
    return {
        "number": home if tunnel is None else tunnel,
        "label": f"tunnel {home if tunnel is None else tunnel}",
        "gate": None if gate is None or tunnel is not None else gate.angle,
        "at": list(range(len(made["records"]))),
        **made,
    }


def _recorded(tree, kept):
    """Every variable of `/history` over time: {name: {title, values}}."""
    history = tree["history"].to_dataset().isel(time=kept)
    return {
        name: {
            "title": variable.attrs.get("long_name", name),
            "unit": variable.attrs.get("units", "").removesuffix("1").replace("^2", "²"),
            "values": variable.values,
        }
        for name, variable in {**history.data_vars, **history.coords}.items()
        if name not in ("time", "dt_limit") and variable.dims == ("time",)
    }


def _thinned(kept, records, step, fields, scene, available):
    """What the page leaves out of the datasets, as sentences."""
    told = []
    if len(records) < available:
        told.append(f"The slider stops at {len(records)} of {available} records; run.nc holds them all.")
    if step > 1:
        told.append(f"Curves around the ring show every {step}. value; extremes are taken from all of them.")
    if fields is not None:
        drawn, shares = len(fields["snapshots"]), [s["drawn"] / max(s["present"], 1) for s in fields["snapshots"]]
        if drawn < fields["available"]:
            told.append(f"The fields are shown at {drawn} of {fields['available']} stored times.")
        if min(shares) < 1:
            told.append(f"The fields show {min(shares):.0%} of the points in view, drawn larger.")
    if scene is None:
        told.append("This version of the program does not understand the run's scene; only its text is shown.")
    return told


def _plain(value):
    return value.item() if hasattr(value, "item") and getattr(value, "size", 1) == 1 else value
