"""Two lining models under the same pressures: differences through the event, the largest ones with their cause."""

import time as clock
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from coupling.datasets.geometry import gate_of
from coupling.files.provenance import made_here
from coupling.refused import Refused
from coupling.responses.respond import respond_by_name
from structure.response import RESPONSE, SHOWN, Shown

TITLE = "differences between lining models"
#: Forces, displacements and joints.
QUANTITIES = tuple(name for name, (dimensions, _, _) in RESPONSE.items() if dimensions != ("time",))
#: What differs by the offset of the curved section, and the axial force that brings it.
OFFSETS = {
    "bending_moment": "axial_force",
    "joint_bending_moment": "joint_axial_force",
    "joint_rotation": "joint_axial_force",
}
CURVED_SECTION = "curved section: N t²/(12 R), less what joints release"


class Comparison(NamedTuple):
    """Responses by model name, their differences, the table, CPU seconds by model name.

    responses : dict of xarray.Dataset;  differences : xarray.Dataset, second less first;  rows : list of dict;
    cpu_seconds : dict.
    """

    responses: dict
    differences: object
    rows: list
    cpu_seconds: dict


def compare(source, first="beam-spring", second="continuum", open_gate=None):
    """Both models' responses to the same pressures, and how they differ.

    Parameters
    ----------
    source : coupling.responses.source.Source
    first, second : str
        Lining models, see :func:`structure.lining_model`; a class in a file goes by the name of the class.
    open_gate : float, optional
        Cut the gate out of the ring of "continuum" over this share of the tunnel's length; its angle and
        width come from the pressures' attributes.

    Returns
    -------
    Comparison
        `rows` has for every quantity, and once more for those that contain the known offset of a curved section
        without it: name, label, unit and scale (from SI to the unit), difference (second less first, SI), relative
        (to the largest size in the first model over the event), theta [degree] or joint (number), time [s],
        inflow_mass [kg/m] or None, cause.

    Raises
    ------
    Refused
        An unknown model, the same one twice, or one that refuses ring or pressures.
    structure.LiningFailure
    """
    places, (first, second) = (first, second), (model.rpartition(":")[2] for model in (first, second))
    if first == second:
        raise Refused(f"compare: models must differ, got {first!r} twice; choose another --first or --second")
    if source.moved is not None:
        raise Refused(
            f"compare: the lining has moved in the ground as {source.moved!r}, and under another model the ground"
            " would press otherwise; run the scene with each lining_model and compare the runs: gush compare RUN OTHER"
        )
    responses, seconds = {}, {}
    for place, name in zip(places, (first, second), strict=True):
        options = _gate_options(source, open_gate) if open_gate is not None and name == "continuum" else {}
        begin = clock.process_time()
        responses[name] = respond_by_name(source.ring, source.pressures, place, **options)
        seconds[name] = clock.process_time() - begin
    if open_gate is not None and "continuum" not in responses:
        raise Refused("compare: an open gate needs the continuum model, got none; choose it as --second")
    differences = _differences(responses[first], responses[second], source.ring)
    rows = []
    for name in QUANTITIES:
        if differences[name].size == 0:
            continue
        known = name in OFFSETS and {first, second} == {"beam-spring", "continuum"}
        told, reference = SHOWN[name], responses[first]
        rows.append(largest_difference(name, differences[name], reference, told, CURVED_SECTION if known else ""))
        if known:
            rest = differences[f"{name}_beyond_offset"]
            rows.append(largest_difference(name, rest, reference, told, suffix=", curved section apart"))
    return Comparison(responses, differences, rows, seconds)


def _gate_options(source, cut):
    gate = gate_of(source.pressures)
    if gate is None or gate.width is None:
        raise Refused(
            f"'{source.file}': an open gate needs the attributes gate_angle [degree] and gate_width [m] of the"
            " pressures, got none; leave --open-gate out"
        )
    return {"gate": (gate.angle, gate.width, cut)}


def _differences(first, second, ring):
    """Second less first, with the offset of the curved section and what is left without it."""
    from structure.theory import curved_section_moment

    missing = sorted(set(QUANTITIES) - set(first.data_vars) | set(QUANTITIES) - set(second.data_vars))
    if missing:
        raise Refused(f"compare: both models must give {', '.join(missing)}; see structure.response.RESPONSE")
    fields = {}
    for name in QUANTITIES:
        meaning = first[name].attrs
        fields[name] = (second[name] - first[name]).assign_attrs(
            units=meaning["units"], long_name=f"difference of the {meaning['long_name']}"
        )
    turning = ring.joint_springs[:, 2]
    for name, axial in OFFSETS.items():
        offset = curved_section_moment(first[axial], ring)
        if name == "joint_rotation":
            shares = np.divide(1.0, turning, out=np.zeros(len(turning)), where=turning > 0)
            offset = offset * xr.DataArray(shares, dims="joint")
        sign = 1 if second.attrs.get("model") == "continuum" else -1
        fields[f"{name}_beyond_offset"] = (fields[name] - sign * offset).assign_attrs(
            units=fields[name].attrs["units"],
            long_name=f"{fields[name].attrs['long_name']}, less the moment of the curved section",
        )
    dataset = xr.Dataset(fields)
    if "inflow_mass" in first:
        dataset["inflow_mass"] = first["inflow_mass"]
    models = f"{second.attrs.get('model', 'second')} less {first.attrs.get('model', 'first')}"
    return dataset.assign_attrs(made_here(f"{TITLE}: {models}", "lining models compared"))


def largest_difference(
    name: str, difference: xr.DataArray, reference: xr.Dataset, shown: Shown, cause: str = "", suffix: str = ""
) -> dict[str, Any]:
    """The largest difference of one quantity, where and when: a row of :class:`Comparison`.

    difference : (time or progress[, theta or joint]), known somewhere;  reference : what it is a difference to, with
    `name` in it and `time`, and `inflow_mass` where there is one.
    """
    values = difference.values
    record, *place = np.unravel_index(np.nanargmax(np.abs(values)), values.shape)
    at = dict(zip(difference.dims[1:], place, strict=True))
    extreme = float(np.nanmax(np.abs(reference[name].values)))
    largest = float(values[record, *place])
    return {
        "name": name,
        "label": shown.short + suffix,
        "unit": shown.unit,
        "scale": shown.scale,
        "difference": largest,
        "relative": abs(largest) / extreme if extreme else float(largest != 0),
        "theta": float(reference["theta"][at["theta"]]) if "theta" in at else None,
        "joint": int(reference["joint"][at["joint"]]) if "joint" in at else None,
        "time": float(reference["time"][record]),
        "inflow_mass": float(reference["inflow_mass"][record]) if "inflow_mass" in reference else None,
        "cause": cause,
    }


#: Over the cells of :func:`difference_cells`.
HEADS = ("quantity", "largest difference", "of the extreme", "where", "when")


def difference_cells(row: dict[str, Any]) -> tuple[str, ...]:
    """A row of :class:`Comparison` as people read it, under `HEADS`."""
    angle = "-" if row["theta"] is None else f"{row['theta']:.4g}°"
    mass = "" if row["inflow_mass"] is None else f", {row['inflow_mass']:.4g} kg/m"
    return (
        row["label"],
        f"{row['difference'] * row['scale']:+.3g} {row['unit']}",
        f"{100 * row['relative']:.2f} %",
        angle if row["joint"] is None else f"joint {row['joint']}",
        f"{row['time']:.3g} s{mass}",
    )
