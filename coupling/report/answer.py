"""What a page begins with: the governing check, the largest forces and what is known of their error, inflow, trough."""

from typing import Any

import numpy as np
import xarray as xr

from coupling.datasets.geometry import gate_of, gate_tunnel, has_tunnels, joints_of, tunnel_list, tunnels_beside
from coupling.datasets.tree import responses_of
from coupling.postprocess.answer import Answer, answers, settled
from coupling.postprocess.limits import place_text, utilisation_text
from coupling.postprocess.mesh_ladder import mesh_error
from coupling.report.numbers import inflow_rate, shown
from coupling.report.ring_drawing import ring_drawing
from structure.limits import UTILISATIONS
from structure.response import SHOWN

NO_LIMITS = (
    "No limits are stated, so nothing says whether the ring bears this: give the scene a table [limits], or run "
    "`gush respond RUN --limits limits.toml`."
)


def answer_of_run(tree: xr.DataTree, ladder: xr.Dataset | None = None) -> dict[str, Any]:
    """What `answer.html` shows of a run.

    tree : of a run, at least one record;  ladder : of :func:`coupling.postprocess.mesh_ladder.read_ladder`, for the
    error of the mesh.

    Returns: rings: list of {title, governing, bad, model, rows, bases, drawing}; facts: list of (what, text); tables:
    list of (title, headings, rows).
    """
    found, lining = answers(tree), tree["lining"].to_dataset()
    several = bool(tunnels_beside(lining))
    rings = []
    for tunnel in (None, *tunnels_beside(lining)) if has_tunnels(lining) else ():
        number = gate_tunnel(lining) if tunnel is None else tunnel
        one = found.get(tunnel)
        governing, bad = governing_text(one)
        joints = next((joints_of(response).tolist() for response in responses_of(tree, tunnel).values()), [])
        rings.append({
            "title": f"Tunnel {number}{', with the gate' if tunnel is None else ''}" if several else "The ring",
            "governing": governing,
            "bad": bad,
            "model": None if one is None else one.model,
            "rows": [] if one is None else [_row(extreme, ladder) for extreme in one.forces],
            "bases": [] if one is None else _bases(one, ladder),
            "drawing": ring_drawing(
                tunnel_list(lining)[number], joints, gate_of(lining) if tunnel is None else None
            ),
        })  # fmt: skip
    return {"rings": rings, "facts": [*_inflow(tree), *_trough(tree)], "tables": []}


def governing_text(answer: Answer | None) -> tuple[str, bool | None]:
    """The governing check in a sentence, and whether it is passed, None where that is not known."""
    if answer is None:
        return "No lining model has answered: run `gush respond RUN`.", None
    if answer.governing is None:
        return NO_LIMITS, None
    one = answer.limits[answer.governing]
    text = (
        f"{UTILISATIONS[answer.governing]}: utilisation {utilisation_text(one['largest'])} at {place_text(one['at'])}"
    )
    passes = "never passes 1" if one["passes"] is None else f"passes 1 at {place_text(one['passes'])}"
    return f"{text[:1].upper()}{text[1:]}; {passes}.", one["largest"] > 1


def _row(extreme, ladder):
    scale, unit = SHOWN[extreme.name].scale, SHOWN[extreme.name].unit
    mesh = None if ladder is None else mesh_error(ladder, extreme)
    two_digits = lambda value: shown(float(f"{value * scale:.2g}"))  # noqa: E731
    return {
        "name": extreme.label,
        "unit": unit,
        "value": shown(extreme.value * scale),
        "at": place_text(extreme.at),
        "apart": None if extreme.apart is None else f"{'+' if extreme.apart > 0 else ''}{two_digits(extreme.apart)}",
        "mesh": None if mesh is None else f"± {two_digits(mesh)}",
    }


def _bases(answer, ladder):
    """What the two columns of errors are, or that they are not known."""
    if answer.others:
        models = (
            f"Models: the same extreme of {', '.join(answer.others)} less that of {answer.model}; it shows how much "
            "the lining model decides, and is no error of either."
        )
    elif answer.moved:
        models = (
            f"Models: not known; the ring has moved in the ground as {answer.model}. Run the scene with another "
            "lining_model, then `gush compare RUN OTHER`."
        )
    else:
        models = (
            f"Models: not known, only {answer.model} has answered; `gush respond RUN --backend continuum` adds the"
            " other."
        )
    if ladder is None:
        return [models, "Mesh: not known of this run; `gush accuracy --scene SCENE` makes a ladder of meshes, "
                "`gush report RUN --ladder SCENE-ladder.nc` puts it here."]  # fmt: skip
    masses = ", ".join(f"{mass:g}" for mass in ladder["inflow_mass"].values)
    return [models, f"Mesh: how far the scene's mesh is from size zero, and the error bar of that, at the nearest of "
            f"{masses} kg/m of the ladder of {ladder.sizes['mesh']} meshes."]  # fmt: skip


def _inflow(tree):
    history = tree["history"].to_dataset()
    last, rate = history.isel(time=-1), inflow_rate(history)
    told = f"{shown(float(last['inflow_mass']))} kg of grains per metre of tunnel in {shown(float(last['time']))} s"
    if rate is not None:
        told += f", lately {shown(rate[0])} ± {shown(float(f'{rate[1]:.2g}'))} kg/m/s (scatter between four parts)"
    zones = f"flow zone {shown(float(last['flow_zone_area']))} m² (moved over 50 mm)"
    return [("Inflow", f"{told}; {zones}.")]


def _trough(tree):
    found = settled(tree["points"].to_dataset().isel(time=slice(-1, None))) if "points" in tree.children else None
    if found is None:
        return [("Settlement of the surface", "Not known: no points of the surface are stored.")]
    last = {name: float(found[1][name][-1]) for name in found[1].data_vars}
    told = f"{shown(1e3 * last['largest'])} mm at most after {shown(float(found[1]['time'][-1]))} s, "
    told += f"volume loss {shown(100 * last['volume_loss'])} %"
    if np.isfinite(last["width"]):
        told += (f"; Gauss curve of Peck (1969): width i {shown(last['width'])} m, "
                 f"{shown(last['width_over_depth'])} of the axis' depth, off by {shown(1e3 * last['error'])} mm (rms), "
                 f"R² {last['r_squared']:.2f}")  # fmt: skip
    return [("Settlement of the surface", f"{told}.")]
