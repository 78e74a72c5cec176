"""The scene of a run, read again from its text: its section through the ground, and what was left out."""

from coupling.datasets.geometry import gate_of, has_tunnels, tunnel_list
from coupling.refused import SceneError
from coupling.scenes.scene import parse_scene


def read_scene(attributes):
    """The scene stored with a run; None where this version of the program no longer understands it."""
    try:
        return parse_scene(attributes["scene"], "scene of the run")
    except (KeyError, SceneError):
        return None


def left_out(scene):
    """What was active and what was left out: rows of :func:`coupling.scenes.features.features`."""
    from coupling.scenes.features import features

    # the number of threads is no part of the scene and changes no result
    return [row for row in features(scene, 1) if row["feature"] != "several threads"]


def section(scene, lining):
    """What the page needs to draw the ground in section.

    Parameters
    ----------
    scene : coupling.Scene or None
    lining : xarray.Dataset
        `/lining`, whose attributes are tunnels and gate.

    Returns
    -------
    dict
        tunnels: list of {x, y, outer, inner} [m]; gate: {tunnel, angle [degree], width [m]} or None; box: {width,
        depth} or None; water_table: depth [m] or None; soils: list of {name, top}.
    """
    gate = gate_of(lining)
    return {
        "tunnels": [tunnel._asdict() for tunnel in (tunnel_list(lining) if has_tunnels(lining) else ())],
        "gate": None if gate is None else gate._asdict(),
        "box": None if scene is None else {"width": scene.box.width, "depth": scene.box.depth},
        "water_table": None if scene is None or scene.water is None else scene.water.table_depth,
        "soils": [] if scene is None else [{"name": s.name, "top": s.top_depth} for s in scene.soils],
    }
