"""Checks of a response against limits: segments, joints, deformation, each as a utilisation."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from structure.capacity import interaction, moment_utilisation, radial_utilisation
from structure.cracks import crack_width
from structure.limits import CHECK_VARIABLES, UTILISATIONS, Limits
from structure.resistance import bearing_resistance, shear_resistance
from structure.response import SHOWN
from structure.ring import Ring
from structure.stability import stability_checks


def check(response: xr.Dataset, limits: Limits) -> xr.Dataset:
    """The response with what the limits make of it, a utilisation of 1 being the limit.

    Everything counts from the unloaded ring, the initial state included; for what an event adds, check
    :func:`structure.additional` of the response against limits of its own.

    Parameters
    ----------
    response : xarray.Dataset
        What :meth:`structure.LiningModel.respond` returned; its attribute `ring` gives thickness and diameters.
    limits : Limits

    Returns
    -------
    xarray.Dataset
        The response, without what earlier limits made of it, and, as far as limits are given:
        ``design_axial_force``, ``design_bending_moment``, ``design_shear_force``, ``shear_resistance``,
        ``section_utilisation``, ``shear_utilisation``, ``crack_width``,
        ``crack_utilisation`` (time, theta), ``capacity_axial_force``, ``capacity_bending_moment`` (capacity_point);
        ``bearing_resistance``, ``bearing_utilisation``, ``gasket_opening``, ``gasket_utilisation``,
        ``joint_dislocation_utilisation`` (time, joint); ``convergence_per_mille``, ``convergence_utilisation``,
        ``flotation_utilisation``, ``ground_bearing_utilisation`` (time);
        ``<quantity>_utilisation`` of own limits; and ``largest_utilisation`` (time) of all. The attribute `limits`
        holds the limits as JSON. When and where each passes 1: :func:`structure.utilisations`.

    Raises
    ------
    ValueError
        The response lacks what a limit needs.
    """
    if "ring" not in response.attrs:
        raise ValueError("check: response must have the attribute 'ring' with the diameters, got none; take it as"
                         " respond() returned it")  # fmt: skip
    ring = Ring.model_validate_json(response.attrs["ring"])
    limits.check_ring(ring)
    variables: dict[str, Any] = {}
    if limits.capacity is not None:
        variables |= _segment_checks(response, limits, ring.thickness)
    if limits.joint_contact_height is not None:
        variables |= _bearing_check(response, limits, ring)
    if limits.crack_width is not None:
        variables |= _crack_check(response, limits, ring.thickness)
    if limits.gasket_opening is not None:
        variables |= _gasket_check(response, limits)
    if limits.convergence_per_mille is not None:
        variables |= _convergence_check(response, limits.convergence_per_mille, ring.outer_diameter)
    if limits.stability is not None:
        variables |= stability_checks(response, limits.stability, ring)
    dislocation = {} if limits.joint_dislocation is None else {"joint_dislocation": limits.joint_dislocation}
    for name, largest in (dislocation | limits.own).items():
        share = np.abs(response[name]) / largest
        variables[f"{name}_utilisation"] = _described(share, "1", f"size of the {SHOWN[name].name} over its limit")
    shares = [variables[name] for name in UTILISATIONS if name in variables]
    largest = xr.concat([share.max([d for d in share.dims if d != "time"]) for share in shares], "check").max("check")
    variables["largest_utilisation"] = _described(largest, "1", "largest utilisation of all limits")
    plain = response.drop_vars(CHECK_VARIABLES, errors="ignore")
    return plain.assign(variables).assign_attrs(limits=limits.model_dump_json(exclude_none=True))


def _described(variable, units, long_name):
    return variable.assign_attrs(units=units, long_name=long_name)


def _segment_checks(response, limits, thickness):
    rule = limits.capacity
    boundary = interaction(limits.segment, thickness)
    axial = rule.axial_force_factor * response["axial_force"]
    moment = rule.moment_factor * response["bending_moment"]
    least = rule.minimum_eccentricity * np.maximum(axial, 0.0)
    moment = xr.where(moment < 0, -1.0, 1.0) * np.maximum(np.abs(moment), least)
    measure = radial_utilisation if rule.utilisation == "radial" else moment_utilisation
    share = xr.apply_ufunc(partial(measure, boundary), axial, moment)
    closed = [np.append(values, values[0]) for values in boundary]
    found = {
        "design_axial_force": _described(axial, "N/m", "design axial force, compression positive"),
        "design_bending_moment": _described(moment, "N m/m", "design bending moment, tension outside positive"),
        "section_utilisation": _described(share, "1", f"utilisation of the segments in N and M, {rule.utilisation}"),
        "capacity_axial_force": ("capacity_point", closed[0], _meaning("N/m", "axial force at capacity")),
        "capacity_bending_moment": ("capacity_point", closed[1], _meaning("N m/m", "bending moment at capacity")),
    }
    if rule.shear:
        shear = rule.moment_factor * response["shear_force"]
        resisted = xr.apply_ufunc(partial(shear_resistance, limits.segment, thickness), axial, moment)
        found |= {
            "design_shear_force": _described(shear, "N/m", "design shear force, Q = -dM/ds"),
            "shear_resistance": _described(resisted, "N/m", "shear resistance without shear reinforcement"),
            "shear_utilisation": _described(_share(shear, resisted), "1", "shear force over the shear resistance"),
        }
    return found


def _share(force, resistance):
    """Size of a force over its resistance: 0 without a force, infinite where a force meets no resistance."""
    size = np.abs(force.values)
    with np.errstate(divide="ignore", invalid="ignore"):
        return force.copy(data=np.where(size == 0, 0.0, size / resistance.values))


def _meaning(units, long_name):
    return {"units": units, "long_name": long_name}


def _bearing_check(response, limits, ring):
    rule, thickness = limits.capacity, ring.thickness
    pressed, turned = response["joint_axial_force"], response["joint_bending_moment"]
    if "joint_bolt_force" in response:  # what bolts pull presses the faces together
        pull, offset = response["joint_bolt_force"], np.array([bolts.offset for bolts in ring.bolts])
        pressed, turned = pressed + pull, turned - pull * offset
    axial = rule.axial_force_factor * np.maximum(pressed, 0.0)
    moment = rule.moment_factor * turned
    resistance = partial(bearing_resistance, limits.segment, thickness, limits.joint_contact_height)
    resisted = xr.apply_ufunc(resistance, axial, moment)
    return {
        "bearing_resistance": _described(resisted, "N/m", "resistance of the concrete under the contact zone"),
        "bearing_utilisation": _described(_share(axial, resisted), "1", "axial force in the joint over the resistance"),
    }


def _crack_check(response, limits, thickness):
    axial, moment = response["axial_force"], response["bending_moment"]
    opening = partial(crack_width, limits.segment, thickness, duration=limits.crack_duration)
    width = xr.apply_ufunc(opening, axial, moment)
    return {
        "crack_width": _described(width, "m", f"crack width, {limits.crack_duration} load"),
        "crack_utilisation": _described(width / limits.crack_width, "1", "crack width over its limit"),
    }


def _gasket_check(response, limits):
    # rotation opens the outside
    opening = response["joint_opening"] + limits.gasket_offset * response["joint_rotation"]
    share = np.maximum(opening, 0.0) / limits.gasket_opening
    return {
        "gasket_opening": _described(opening, "m", "joint opening at the gasket, gap positive"),
        "gasket_utilisation": _described(share, "1", "joint opening at the gasket over its limit"),
    }


def _convergence_check(response, limit, diameter):
    larger = np.maximum(np.abs(response["convergence_horizontal"]), np.abs(response["convergence_vertical"]))
    return {
        "convergence_per_mille": _described(
            1e3 * larger / diameter, "mm/m", "larger change of the two diameters over the outer diameter"
        ),
        "convergence_utilisation": _described(1e3 * larger / diameter / limit, "1", "convergence over its limit"),
    }
