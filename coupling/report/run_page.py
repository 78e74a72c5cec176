"""What the page about a run shows, collected from its datasets."""

import xarray as xr

from coupling.datasets import RunFileError, identifier, opened, read_run, structure_group
from coupling.datasets.geometry import tunnels_beside
from coupling.datasets.tree import model_names
from coupling.postprocess.summary import summarise_run
from coupling.refused import Refused
from coupling.report.fields import field_snapshots, mesh_picture
from coupling.report.numbers import key_numbers, quality, warnings
from coupling.report.packing import packed
from coupling.report.scene_facts import left_out, read_scene, section
from coupling.report.series import choose_frames, history_series, lining_series, model_series
from coupling.scenes.features import facts

SCRIPTS = (
    "unpack.js", "run_data.js", "charts.js", "tables.js", "slider.js", "ring_views.js", "history_views.js",
    "field_views.js", "run_player.js",
)  # fmt: skip


def collect(run, model=None):
    """Everything that the page shows.

    Parameters
    ----------
    run : str or path
    model : str, optional
        Lining model whose numbers lead; left out: that of the run itself, see :func:`structure.models.in_order`.

    Returns
    -------
    dict
        attributes, summary, numbers, quality, warnings, notes, facts, left_out: for the text; player: what the script
        draws, JSON.
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
    quality_rows = quality(tree, summary, scene)
    frames = choose_frames(tree)
    fields = field_snapshots(tree["points"].to_dataset()) if "points" in tree.children else None
    return {
        "attributes": attributes,
        "summary": summary,
        "numbers": key_numbers(tree),
        "quality": quality_rows,
        "warnings": warnings(tree, attributes, quality_rows),
        "notes": _thinned(tree, frames, fields, scene),
        "facts": [] if scene is None else facts(scene),
        "left_out": [] if scene is None else left_out(scene),
        "player": _player(tree, scene, frames, fields),
    }


def _led_by(tree, model):
    """The tree with the responses of a model before those of the others; as it is for None."""
    if model is None:
        return tree
    if model not in model_names(tree):
        raise Refused(
            f"--model: must be a lining model that has answered, got {model!r}; there are "
            f"{', '.join(model_names(tree)) or 'none'}: run gush respond first"
        )
    groups = tree.to_dict()
    first = {path: groups[path] for path in groups if path.rpartition("/")[2] == identifier(model) or path == "/"}
    return xr.DataTree.from_dict(first | groups)


def _player(tree, scene, frames, fields):
    lining = tree["lining"].to_dataset()
    times = lining["time"].values[frames]
    return {
        "time": packed(times),
        "inflow_mass": packed(lining["inflow_mass"].values[frames]),
        "section": section(scene, lining),
        "lining": lining_series(tree, frames),
        "models": _models(tree, None, times),
        "models_beside": {k: _models(tree, k, times) for k in tunnels_beside(tree["lining"])},
        "history": history_series(tree),
        "mesh": mesh_picture(tree["mesh"].to_dataset()) if "mesh" in tree.children else None,
        "fields": fields,
    }


def _models(tree, tunnel, times):
    return [
        model_series(name, tree[structure_group(name, tunnel)].to_dataset(), times)
        for name in model_names(tree, tunnel)
    ]


def _thinned(tree, frames, fields, scene):
    """What the page leaves out of the datasets, as sentences."""
    told, records = [], tree["lining"].sizes["time"]
    if len(frames) < records:
        told.append(f"The slider stops at {len(frames)} of {records} records; run.nc holds them all.")
    if fields is not None:
        shown, shares = len(fields["snapshots"]), [s["drawn"] / max(s["present"], 1) for s in fields["snapshots"]]
        if shown < fields["available"]:
            told.append(f"The fields are shown at {shown} of {fields['available']} stored times.")
        if min(shares) < 1:
            told.append(f"The fields show {min(shares):.0%} of the points in view, drawn larger.")
    if scene is None:
        told.append("This version of the program does not understand the run's scene; only its text is shown.")
    return told


def _plain(value):
    return value.item() if hasattr(value, "item") and getattr(value, "size", 1) == 1 else value
