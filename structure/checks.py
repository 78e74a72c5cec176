"""Checks of a response against limits that the user states: capacity, gaskets, convergence, each as a utilisation."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any, Literal

import numpy as np
import xarray as xr
from pydantic import Field, ValidationError, model_validator

from structure.capacity import SegmentSection, interaction, moment_utilisation, radial_utilisation
from structure.inputs import Input, InputError, mistakes, refusal

#: name: what it is, for figures and tables.
UTILISATIONS = {
    "section_utilisation": "axial force and moment in the segments",
    "gasket_utilisation": "joint opening at the gasket",
    "dislocation_utilisation": "joint dislocation",
    "convergence_utilisation": "convergence",
}


class CapacityRule(Input):
    """How internal forces are set against the capacity of the section; every value is the user's.

    Parameters
    ----------
    axial_force_factor, moment_factor : float
        Partial factors of actions: N_Ed and M_Ed over the computed N and M [-].
    minimum_eccentricity : float
        Least |M_Ed|/N_Ed in compression [m]: EN 1992-1-1, 6.1(4) asks for max(h/30, 20 mm); 0 for none.
    utilisation : {"radial", "constant_axial_force"}
        "radial": how far N_Ed and M_Ed are on their way to the diagram when they grow in proportion.
        "constant_axial_force": |M_Ed| over the moment carried at the same N_Ed; infinite beyond the largest N.
    """

    axial_force_factor: float = Field(gt=0)
    moment_factor: float = Field(gt=0)
    minimum_eccentricity: float = Field(ge=0)
    utilisation: Literal["radial", "constant_axial_force"]


class Limits(Input):
    """Limits of a lining; those left out are not checked, none has a default value.

    Parameters
    ----------
    segment : SegmentSection, optional
        Concrete and steel of the segments; with `capacity`.
    capacity : CapacityRule, optional
        How the forces are set against it; with `segment`.
    gasket_opening : float, optional
        Largest opening of a joint at its gasket [m].
    gasket_offset : float, optional
        Place of the gasket, from the centre line outward [m], negative on the inside; needed with `gasket_opening`.
    joint_dislocation : float, optional
        Largest step between the segments of a joint [m].
    convergence_per_mille : float, optional
        Largest change of the horizontal or vertical diameter over the outer diameter [per mille].
    """

    segment: SegmentSection | None = None
    capacity: CapacityRule | None = None
    gasket_opening: float | None = Field(default=None, gt=0)
    gasket_offset: float | None = None
    joint_dislocation: float | None = Field(default=None, gt=0)
    convergence_per_mille: float | None = Field(default=None, gt=0)

    @model_validator(mode="after")
    def _check(self) -> Limits:
        for one, other in (("segment", "capacity"), ("gasket_opening", "gasket_offset")):
            if (getattr(self, one) is None) != (getattr(self, other) is None):
                given, missing = (other, one) if getattr(self, one) is None else (one, other)
                raise ValueError(f"{missing} must be given where {given} is, got none; state both or neither")
        if not self.model_fields_set:
            raise ValueError("limits must hold at least one limit, got none; state what is to be checked")
        return self

    @classmethod
    def from_toml(cls, path: str | Path) -> Limits:
        """Limits from a TOML file with the keys above, tables ``[segment]`` and ``[capacity]``; SI units.

        Raises
        ------
        structure.InputError
            No TOML, or no limits: every mistake with key, rule, value and remedy.
        OSError
            Not readable.
        """
        who = f"limits '{path}'"
        try:
            data = tomllib.loads(Path(path).read_text(encoding="utf-8-sig"))
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as problem:
            raise InputError(f"{who}: must be valid TOML, got: {problem}; correct it there") from None
        try:
            return cls.model_validate(data)
        except ValidationError as error:
            raise InputError(refusal(who, mistakes(error, cls))) from None


def check(response: xr.Dataset, limits: Limits) -> xr.Dataset:
    """The response with what the limits make of it, a utilisation of 1 being the limit.

    Everything counts from the unloaded ring, the initial state included; for what an event adds, check
    :func:`structure.additional` of the response against limits of its own.

    Parameters
    ----------
    response : xarray.Dataset
        What :meth:`structure.LiningModel.respond` returned; its attribute `ring` gives the diameters.
    limits : Limits

    Returns
    -------
    xarray.Dataset
        The response and, as far as limits are given: ``design_axial_force``, ``design_bending_moment``,
        ``section_utilisation`` (time, theta), ``capacity_axial_force``, ``capacity_bending_moment`` (capacity_point);
        ``gasket_opening``, ``gasket_utilisation``, ``dislocation_utilisation`` (time, joint);
        ``convergence_per_mille``, ``convergence_utilisation`` (time); and ``largest_utilisation`` (time) of all.
        The attribute `limits` holds the limits as JSON.

    Raises
    ------
    ValueError
        The response lacks what a limit needs.
    """
    if "ring" not in response.attrs:
        raise ValueError("check: response must have the attribute 'ring' with the diameters, got none; take it as"
                         " respond() returned it")  # fmt: skip
    ring = json.loads(response.attrs["ring"])
    variables: dict[str, Any] = {}
    if limits.segment is not None:
        variables |= _capacity_check(response, limits, (ring["outer_diameter"] - ring["inner_diameter"]) / 2)
    if limits.gasket_opening is not None or limits.joint_dislocation is not None:
        variables |= _joint_checks(response, limits)
    if limits.convergence_per_mille is not None:
        variables |= _convergence_check(response, limits.convergence_per_mille, ring["outer_diameter"])
    shares = [variables[name] for name in UTILISATIONS if name in variables]
    largest = xr.concat([share.max([d for d in share.dims if d != "time"]) for share in shares], "check").max("check")
    variables["largest_utilisation"] = _described(largest, "1", "largest utilisation of all limits")
    return response.assign(variables).assign_attrs(limits=limits.model_dump_json(exclude_none=True))


def _described(variable, units, long_name):
    return variable.assign_attrs(units=units, long_name=long_name)


def _capacity_check(response, limits, thickness):
    rule = limits.capacity
    boundary = interaction(limits.segment, thickness)
    axial = rule.axial_force_factor * response["axial_force"]
    moment = rule.moment_factor * response["bending_moment"]
    least = rule.minimum_eccentricity * np.maximum(axial, 0.0)
    moment = xr.where(moment < 0, -1.0, 1.0) * np.maximum(np.abs(moment), least)
    measure = radial_utilisation if rule.utilisation == "radial" else moment_utilisation
    share = axial.copy(data=measure(boundary, axial.values, moment.values))
    closed = [np.append(values, values[0]) for values in boundary]
    return {
        "design_axial_force": _described(axial, "N/m", "design axial force, compression positive"),
        "design_bending_moment": _described(moment, "N m/m", "design bending moment, tension outside positive"),
        "section_utilisation": _described(share, "1", f"utilisation of the segments in N and M, {rule.utilisation}"),
        "capacity_axial_force": ("capacity_point", closed[0], _meaning("N/m", "axial force at capacity")),
        "capacity_bending_moment": ("capacity_point", closed[1], _meaning("N m/m", "bending moment at capacity")),
    }


def _meaning(units, long_name):
    return {"units": units, "long_name": long_name}


def _joint_checks(response, limits):
    if response.sizes.get("joint", 0) == 0:
        raise ValueError("check: limits of joints need a ring with joints, got none; leave gasket_opening and"
                         " joint_dislocation out")  # fmt: skip
    variables = {}
    if limits.gasket_opening is not None:
        # rotation opens the outside
        opening = response["joint_opening"] + limits.gasket_offset * response["joint_rotation"]
        share = np.maximum(opening, 0.0) / limits.gasket_opening
        variables["gasket_opening"] = _described(opening, "m", "joint opening at the gasket, gap positive")
        variables["gasket_utilisation"] = _described(share, "1", "joint opening at the gasket over its limit")
    if limits.joint_dislocation is not None:
        share = np.abs(response["joint_dislocation"]) / limits.joint_dislocation
        variables["dislocation_utilisation"] = _described(share, "1", "joint dislocation over its limit")
    return variables


def _convergence_check(response, limit, diameter):
    larger = np.maximum(np.abs(response["convergence_horizontal"]), np.abs(response["convergence_vertical"]))
    return {
        "convergence_per_mille": _described(
            1e3 * larger / diameter, "mm/m", "larger change of the two diameters over the outer diameter"
        ),
        "convergence_utilisation": _described(1e3 * larger / diameter / limit, "1", "convergence over its limit"),
    }
