"""Checks of a response against limits that the user states: segments, joints, deformation, each as a utilisation."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any, Literal

import numpy as np
import xarray as xr
from pydantic import Field, ValidationError, field_validator, model_validator

from structure.capacity import interaction, moment_utilisation, radial_utilisation
from structure.cracks import crack_width
from structure.inputs import Input, InputError, mistakes, refusal
from structure.resistance import bearing_resistance, shear_resistance
from structure.response import RESPONSE, SHOWN
from structure.ring import Ring
from structure.segment import SegmentSection

#: What a limit of the user's own may name: quantities of a response that people are shown.
OWN = tuple(name for name in RESPONSE if name in SHOWN and name != "joint_dislocation")
#: name: what it is, for figures and tables.
UTILISATIONS = {
    "section_utilisation": "axial force and moment in the segments",
    "shear_utilisation": "shear force in the segments",
    "crack_utilisation": "crack width of the segments",
    "bearing_utilisation": "bearing of the joints",
    "gasket_utilisation": "joint opening at the gasket",
    "joint_dislocation_utilisation": "joint dislocation",
    "convergence_utilisation": "convergence",
    **{f"{name}_utilisation": f"own limit of the {SHOWN[name].name}" for name in OWN},
}


class CapacityRule(Input):
    """How internal forces are set against what segments and joints carry; every value is the user's.

    Parameters
    ----------
    axial_force_factor, moment_factor : float
        Partial factors of actions: N_Ed over the computed N, M_Ed and V_Ed over the computed M and Q [-].
    minimum_eccentricity : float
        Least |M_Ed|/N_Ed of segments in compression [m]: EN 1992-1-1, 6.1(4) asks for max(h/30, 20 mm); 0 for none.
    utilisation : {"radial", "constant_axial_force"}
        "radial": how far N_Ed and M_Ed are on their way to the diagram when they grow in proportion.
        "constant_axial_force": |M_Ed| over the moment carried at the same N_Ed; infinite beyond the largest N.
    shear : bool
        Whether shear is checked, of segments without shear reinforcement: EN 1992-1-1, 6.2.2.
    """

    axial_force_factor: float = Field(gt=0)
    moment_factor: float = Field(gt=0)
    minimum_eccentricity: float = Field(ge=0)
    utilisation: Literal["radial", "constant_axial_force"]
    shear: bool


class Limits(Input):
    """Limits of a lining; those left out are not checked, none has a default value.

    Parameters
    ----------
    segment : SegmentSection, optional
        Concrete and bars of the segments, by class and code; with `capacity` or `crack_width`.
    capacity : CapacityRule, optional
        How the forces are set against it; with `segment`.
    joint_contact_height : float, optional
        Height of the zone over which the segments touch in a joint [m], whose bearing is checked; with `capacity`.
    crack_width : float, optional
        Largest w_k [m] under the computed forces, EN 1992-1-1, 7.3.1; with `segment` and `crack_duration`.
    crack_duration : {"short-term", "long-term"}, optional
        Of the load that opens the cracks.
    gasket_opening : float, optional
        Largest opening of a joint at its gasket [m].
    gasket_offset : float, optional
        Place of the gasket, from the centre line outward [m], negative on the inside; needed with `gasket_opening`.
    joint_dislocation : float, optional
        Largest step between the segments of a joint [m].
    convergence_per_mille : float, optional
        Largest change of the horizontal or vertical diameter over the outer diameter [per mille].
    own : dict
        Limits of your own: a quantity of :data:`structure.response.RESPONSE` to its largest size, in its unit there.
    """

    segment: SegmentSection | None = None
    capacity: CapacityRule | None = None
    joint_contact_height: float | None = Field(default=None, gt=0)
    crack_width: float | None = Field(default=None, gt=0)
    crack_duration: Literal["short-term", "long-term"] | None = None
    gasket_opening: float | None = Field(default=None, gt=0)
    gasket_offset: float | None = None
    joint_dislocation: float | None = Field(default=None, gt=0)
    convergence_per_mille: float | None = Field(default=None, gt=0)
    own: dict[str, float] = Field(default_factory=dict)

    @field_validator("own")
    @classmethod
    def _known_quantities(cls, own: dict[str, float]) -> dict[str, float]:
        for name, limit in own.items():
            if name not in OWN:
                raise ValueError(f"must name quantities of a response, got {name!r}; there are {', '.join(OWN)}")
            if limit <= 0:
                raise ValueError(f"{name} must be greater than 0, got {limit:g}; it is a largest size")
        return own

    @model_validator(mode="after")
    def _check(self) -> Limits:
        pairs = (
            ("gasket_opening", "gasket_offset"), ("gasket_offset", "gasket_opening"), ("capacity", "segment"),
            ("joint_contact_height", "capacity"), ("crack_width", "segment"), ("crack_width", "crack_duration"),
            ("crack_duration", "crack_width"),
        )  # fmt: skip
        for given, needed in pairs:
            if getattr(self, given) is not None and getattr(self, needed) is None:
                raise ValueError(f"{needed} must be given where {given} is, got none; state both or neither")
        if self.segment is not None and self.capacity is None and self.crack_width is None:
            raise ValueError("capacity or crack_width must be given where segment is, got none; state what is checked")
        if not self.model_dump(exclude_none=True, exclude_defaults=True):
            raise ValueError("limits must hold at least one limit, got none; state what is to be checked")
        return self

    def check_ring(self, ring: Ring) -> None:
        """Refuse limits that a ring cannot be held against. Raises ValueError."""
        if self.segment is not None:
            self.segment.check_thickness(ring.thickness)
        keys = ("gasket_opening", "joint_dislocation", "joint_contact_height")
        joints = [name for name in keys if getattr(self, name) is not None]
        joints += [name for name in self.own if name.startswith("joint_")]
        if joints and not ring.joint_angles:
            raise ValueError(
                f"{joints[0]} must be left out of a ring without joints, got a limit; or give joint_angles"
            )
        if self.gasket_offset is not None and abs(self.gasket_offset) > ring.thickness / 2:
            raise ValueError(
                f"gasket_offset must be at most half the thickness {ring.thickness:g} m, got {self.gasket_offset:g} m;"
                " it counts from the centre line"
            )
        height, touching = self.joint_contact_height, ring.joint_contact_height
        if height is not None and (height > ring.thickness or (touching is not None and height != touching)):
            largest = ring.thickness if touching is None else touching
            rule = "be at most the thickness" if touching is None else "be the joint_contact_height of the ring,"
            raise ValueError(
                f"joint_contact_height must {rule} {largest:g} m, got {height:g} m; correct one of the two"
            )

    @classmethod
    def from_toml(cls, path: str | Path) -> Limits:
        """Limits from a TOML file with the keys above, tables ``[segment]``, ``[capacity]``, ``[own]``; SI units.

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
        What :meth:`structure.LiningModel.respond` returned; its attribute `ring` gives thickness and diameters.
    limits : Limits

    Returns
    -------
    xarray.Dataset
        The response and, as far as limits are given: ``design_axial_force``, ``design_bending_moment``,
        ``design_shear_force``, ``shear_resistance``, ``section_utilisation``, ``shear_utilisation``, ``crack_width``,
        ``crack_utilisation`` (time, theta), ``capacity_axial_force``, ``capacity_bending_moment`` (capacity_point);
        ``bearing_resistance``, ``bearing_utilisation``, ``gasket_opening``, ``gasket_utilisation``,
        ``joint_dislocation_utilisation`` (time, joint); ``convergence_per_mille``, ``convergence_utilisation`` (time);
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
        variables |= _bearing_check(response, limits, ring.thickness)
    if limits.crack_width is not None:
        variables |= _crack_check(response, limits, ring.thickness)
    if limits.gasket_opening is not None:
        variables |= _gasket_check(response, limits)
    if limits.convergence_per_mille is not None:
        variables |= _convergence_check(response, limits.convergence_per_mille, ring.outer_diameter)
    dislocation = {} if limits.joint_dislocation is None else {"joint_dislocation": limits.joint_dislocation}
    for name, largest in (dislocation | limits.own).items():
        share = np.abs(response[name]) / largest
        variables[f"{name}_utilisation"] = _described(share, "1", f"size of the {SHOWN[name].name} over its limit")
    shares = [variables[name] for name in UTILISATIONS if name in variables]
    largest = xr.concat([share.max([d for d in share.dims if d != "time"]) for share in shares], "check").max("check")
    variables["largest_utilisation"] = _described(largest, "1", "largest utilisation of all limits")
    return response.assign(variables).assign_attrs(limits=limits.model_dump_json(exclude_none=True))


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
    share = axial.copy(data=measure(boundary, axial.values, moment.values))
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
        resisted = axial.copy(data=shear_resistance(limits.segment, thickness, axial.values, moment.values))
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


def _bearing_check(response, limits, thickness):
    rule = limits.capacity
    axial = rule.axial_force_factor * np.maximum(response["joint_axial_force"], 0.0)
    moment = rule.moment_factor * response["joint_bending_moment"]
    resisted = axial.copy(
        data=bearing_resistance(
            limits.segment, thickness, limits.joint_contact_height, axial.values, moment.values
        )
    )  # fmt: skip
    return {
        "bearing_resistance": _described(resisted, "N/m", "resistance of the concrete under the contact zone"),
        "bearing_utilisation": _described(_share(axial, resisted), "1", "axial force in the joint over the resistance"),
    }


def _crack_check(response, limits, thickness):
    axial, moment = response["axial_force"], response["bending_moment"]
    width = axial.copy(
        data=crack_width(limits.segment, thickness, axial.values, moment.values, limits.crack_duration)
    )  # fmt: skip
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
