"""The validated, immutable description of ground, tunnels, gate, discretisation and stages.

SI units; a string with a unit ("20 kN/m3", "37 deg") is converted. Angles are in degrees, those of
the lining from the crown, clockwise. The ground surface is y = 0, y points up and x = 0 is the
middle of the box. Numbers that decide the answer have no default, but for K0, which follows from gravity loading when
left out; numerical ones may have one.
"""

import math
from itertools import pairwise
from typing import Annotated, Any, Literal, Union

import psutil
from pydantic import Field, SerializeAsAny, WrapValidator, model_validator

from mpm.k0_procedure import check_k0, initial_stress
from mpm.laws.law import built_in_laws, soil_of_its_law
from mpm.memory import estimated_bytes, estimated_elements
from mpm.quantities import Acceleration, Angle, Density, Length, Mass, Part, Pressure, Time, in_unit
from mpm.walls.sides import SIDES

MOST_RECORDS = 1_000_000
#: Growth of the element size per metre above which neighbouring quadrilaterals are no longer near squares.
STEEPEST = 0.25
_HOUR = 3600.0
#: Smallest (outer - inner) / outer diameter: the channel through a thinner lining has no length to mesh.
MOST_SLENDER = 0.01


class Box(Part):
    """The ground modelled: width and depth below the surface, and empty mesh above it [m]."""

    width: Length = Field(gt=0, le=2000)
    depth: Length = Field(gt=0, le=2000)
    headroom: Length | None = Field(default=None, gt=0, le=2000)


class Water(Part):
    """Pore water; everything below the table is saturated, and so is what hangs above it. A dry scene has none.

    Parameters
    ----------
    table_depth : float
        Of the ground water below the surface [m].
    density, bulk_modulus : float
        [kg/m3], [Pa]
    drainage : str
        "two-phase": water has a velocity of its own, by drag and the conductivity of the soils. "undrained": it moves
        with the grains, the limit of a conductivity of zero; conductivities are not read.
    sides : str
        Left, right and bottom of the box: "closed", or "held", the ground beyond keeps the pore pressure of the start
        and water passes; a row of :data:`mpm.walls.sides.SIDES` each.
    """

    table_depth: Length = Field(ge=0)
    density: Density = Field(gt=500, lt=2000)
    bulk_modulus: Pressure = Field(ge=1e6, le=1e11)
    drainage: Literal["two-phase", "undrained"] = "two-phase"
    sides: Literal[tuple(SIDES)] = "closed"


#: A soil, of the class that its `model` names: one of these, or of a third party.
SoilOfItsLaw = Annotated[SerializeAsAny[Union[built_in_laws()]], WrapValidator(soil_of_its_law)]  # noqa: UP007
#: How a lining stands in the ground: held, rigid and free to move, a homogeneous elastic ring, or the segmental one.
Lining = Literal["fixed", "floating", "elastic", "jointed"]


class Tunnel(Part):
    """A circular tunnel; `cover` is the depth of its outer crown.

    Parameters
    ----------
    lining : str or None
        "fixed", "floating" (rigid, moves under its weight, soil and water), "elastic" (homogeneous ring in plane
        strain) or "jointed" (segments and joints of the scene's ring); None: what the scene says for all tunnels.
    lining_density : float or None
        [kg/m3], needed where the lining moves.
    lining_modulus, lining_poissons_ratio : float or None
        Young's modulus [Pa] and Poisson's ratio, needed where it is elastic.
    lining_harmonics : int
        Fourier harmonics of the displacement of an elastic lining, 2 ovalises it; of a jointed one those of pressure
        and shear that its coordinates are exact for.
    lining_model : str
        Whose segments and joints a jointed one has: "beam-spring" or "continuum".
    """

    x: Length
    cover: Length = Field(gt=0)
    outer_diameter: Length = Field(ge=0.1)
    inner_diameter: Length = Field(gt=0)
    friction_coefficient: float = Field(ge=0, le=2)
    lining: Lining | None = None
    lining_density: Density | None = Field(default=None, ge=1, le=1e5)
    lining_modulus: Pressure | None = Field(default=None, ge=1e6, le=1e13)
    lining_poissons_ratio: float | None = Field(default=None, ge=0, lt=0.5)
    lining_harmonics: int = Field(default=8, ge=2, le=40)
    lining_model: Literal["beam-spring", "continuum"] = "beam-spring"

    @model_validator(mode="after")
    def _check(self):
        if self.inner_diameter >= self.outer_diameter:
            raise ValueError(
                f"tunnel: inner_diameter {self.inner_diameter:g} m must be smaller than outer_diameter "
                f"{self.outer_diameter:g} m; swap them if they were exchanged"
            )
        if self.outer_diameter - self.inner_diameter < MOST_SLENDER * self.outer_diameter:
            raise ValueError(
                f"tunnel: inner_diameter {self.inner_diameter:g} m must leave a lining of at least "
                f"{100 * MOST_SLENDER / 2:g} % of outer_diameter {self.outer_diameter:g} m; give the inner face"
            )
        return self

    @property
    def outer_radius(self) -> float:
        """[m]"""
        return self.outer_diameter / 2

    @property
    def inner_radius(self) -> float:
        """[m]"""
        return self.inner_diameter / 2

    @property
    def axis_depth(self) -> float:
        """Depth of the axis below the surface [m]."""
        return self.cover + self.outer_radius


class Gate(Part):
    """The gap through the lining: straight walls of the given distance, along the radius at `angle`.

    Parameters
    ----------
    corners : str
        What the nodes at the outer edges of the open gap do: "held", they stand still, so that nothing passes through
        the faces on either side of them; "slipping", they follow the channel's walls, and the face beside them leaks.
    """

    tunnel: int = Field(default=0, ge=0)
    angle: Angle = Field(ge=0, lt=360)
    width: Length = Field(ge=1e-3)  # through less no grain of sand goes
    corners: Literal["held", "slipping"] = "held"


class Discretisation(Part):
    """Edges of the cells [m] and points per element; a cell has four elements, cut by its diagonals.

    The size grows by `size_growth` per metre away from a feature, by at most 0.25.
    """

    element_size: Length = Field(ge=1e-3, le=2000)
    element_size_lining: Length = Field(ge=1e-3, le=2000)
    element_size_interior: Length = Field(ge=1e-3, le=2000)
    elements_across_gate: int = Field(default=4, ge=2, le=40)
    gate_radius: Length = Field(gt=0)
    size_growth: float = Field(default=0.12, ge=0.01, le=1)
    points_per_element: int = Field(default=3, le=400)
    points_per_element_gate: int = Field(default=12, le=400)

    @property
    def growth(self):
        """Growth of the size per metre that quadrilaterals follow [-]."""
        return min(self.size_growth, STEEPEST)

    @model_validator(mode="after")
    def _check(self):
        for name in ("points_per_element", "points_per_element_gate"):
            n = getattr(self, name)
            if n < 1 or not (n == 6 or math.isqrt(n) ** 2 == n or (n % 3 == 0 and math.isqrt(n // 3) ** 2 == n // 3)):
                raise ValueError(f"{name} must be 6, k^2 or 3 k^2 (1, 3, 4, 9, 12, 16, 25, ..), got {n}; use 3 or 12")
        return self


class Numerics(Part):
    """Numerical choices, none of which should decide the answer.

    Parameters
    ----------
    courant : float
        Time step over the critical one [-].
    pic_rate : float
        Rate at which point velocities are drawn to those of the grid [1/s]; 0 is pure FLIP. A share per
        second, not per step: the viscosity that it adds falls with the square of the mesh size.
    pressure_filter : float
        Share that is taken in each step of the part of the pore pressure that no node feels: what points of an element
        differ in beyond the slope of its quadrilateral [-]. 0 is off. Nodes, forces and water balance of an element are
        the same before and after.
    stress_damping : float
        How far the stress that acts runs ahead of that of the points, in steps of the element [-]; 0 is off. A
        Kelvin-Voigt viscosity whose time vanishes with the mesh, within the strength of the soil: it damps the elastic
        waves that flow without dilatancy feeds.
    critical_step : str
        Where the critical time step comes from: "altitude" of the elements over the wave speed, or "spectral", the
        largest eigenvalue of the points on their mesh, renewed now and then (`mpm.time_step.spectrum`).
    local_time_stepping : bool
        Groups of elements take steps of their own, powers of two times the smallest (`mpm.time_step.levels`).
    """

    courant: float = Field(default=0.8, gt=0, le=1)
    pic_rate: Annotated[float, in_unit("1/s")] = Field(default=1.0, ge=0)
    pressure_filter: float = Field(default=0.4, ge=0, le=1)
    stress_damping: float = Field(default=0.25, ge=0, le=2)
    critical_step: Literal["altitude", "spectral"] = "spectral"
    local_time_stepping: bool = True
    relaxation_tolerance: float = Field(default=1e-5, gt=0, lt=1)
    max_relaxation_steps: int = Field(default=20000, ge=1, le=10_000_000)


class Stop(Part):
    """Where a run ends: at a time [s], with the step that passes an inflow mass [kg/m], or whichever comes first."""

    time: Time | None = Field(default=None, gt=0, le=1e7)
    inflow_mass: Mass | None = Field(default=None, gt=0, le=1e9)

    @model_validator(mode="after")
    def _check(self):
        if self.time is None and self.inflow_mass is None:
            raise ValueError(
                "time or inflow_mass must be given, got neither; without them the run never ends: give one or both"
            )
        return self


class Output(Part):
    """Interval of the records and of the snapshots of all points [s].

    Parameters
    ----------
    points : bool
        Whether snapshots of the points are kept, the first and the last also without an interval. False: none,
        whatever the interval says; pressures and history are all that is wanted.
    """

    interval: Time = Field(gt=0, le=1e7)
    snapshot_interval: Time | None = Field(default=None, gt=0)
    points: bool = True


class Scene(Part):
    """Everything that the material point method needs to know.

    Parameters
    ----------
    symmetry : str
        "half" computes x >= 0 only and gives the results of the whole, "whole" computes both sides, "auto" is "half"
        where `asymmetry` finds nothing that forbids it. The rest are the tables of a scene file.
    initial_contact : str
        "bonded" begins with ground that sticks to the lining; where friction does not bear the shear of that, the
        ground slips, drained, before the gate opens. "frictional" settles with friction at once: the same state, but
        for a lining that moves.
    """

    name: str = Field(min_length=1, max_length=80, pattern=r"^\w[\w.-]*$")  # a folder's name
    gravity: Acceleration = Field(default=9.81, ge=0, le=100)
    box: Box
    water: Water | None = None
    soils: tuple[SoilOfItsLaw, ...] = Field(min_length=1, max_length=100)
    tunnels: tuple[Tunnel, ...] = Field(default=(), max_length=16)
    gate: Gate | None = None
    lining: Lining = "fixed"
    initial_contact: Literal["bonded", "frictional"] = "bonded"
    interior: Literal["resolved", "sink"] = "resolved"
    symmetry: Literal["auto", "whole", "half"] = "auto"
    discretisation: Discretisation
    numerics: Numerics = Numerics()
    stop: Stop
    output: Output

    @model_validator(mode="after")
    def _check(self):
        self._check_soils()
        self._check_water()
        for k, tunnel in enumerate(self.tunnels):
            self._check_lining(k, tunnel)
            self._check_place(k, tunnel)
        if self.gate is not None:
            self._check_gate(self.gate)
        if self.symmetry == "half" and self.asymmetry is not None:
            raise ValueError(
                f"symmetry: 'half' must mirror the scene in x = 0, got {self.asymmetry}; write symmetry = 'auto'"
            )
        self._check_length()
        needed, available = estimated_bytes(self), psutil.virtual_memory().total
        if needed > available:
            raise ValueError(
                f"discretisation: must fit in memory ({available / 1e9:.3g} GB), got about {needed / 1e9:.3g} GB for "
                f"{estimated_elements(self):.2g} elements; raise element_size, element_size_lining or size_growth"
            )
        return self

    def _check_soils(self):
        tops = [soil.top_depth for soil in self.soils]
        if tops[0] != 0 or any(b <= a for a, b in pairwise(tops)):
            raise ValueError(f"soils: top_depth must start at 0 and increase, got {tops}; list the layers downward")
        if tops[-1] >= self.box.depth:
            raise ValueError(
                f"soils: top_depth {tops[-1]:g} m must lie in the box of depth {self.box.depth:g} m; leave "
                "the layer out, or deepen the box"
            )
        check_k0(self)
        if self.is_two_phase:
            unknown = [soil.name for soil in self.soils if soil.hydraulic_conductivity is None]
            if unknown:
                raise ValueError(
                    f"soil '{unknown[0]}': hydraulic_conductivity must be given where there is water, got none; give "
                    "the Darcy conductivity in m/s, sand about 1e-4, or leave [water] out for a dry scene"
                )

    def _check_water(self):
        moving = [k for k, tunnel in enumerate(self.tunnels) if self.lining_of(tunnel) != "fixed"]
        if self.is_undrained and moving:
            raise ValueError(
                f"water: drainage = 'undrained' needs linings that are held, got lining = "
                f"'{self.lining_of(self.tunnels[moving[0]])}' of tunnel {moving[0]}, whose motion is solved with the "
                "momentum of the water; leave drainage out and give a small hydraulic_conductivity"
            )
        if self.is_undrained and SIDES[self.water.sides] is not None:
            raise ValueError(
                f"water: sides = '{self.water.sides}' needs water with a velocity of its own, got drainage = "
                "'undrained'; leave one of them out"
            )
        if self.water is not None and self.water.table_depth >= self.box.depth:
            raise ValueError(
                f"water: table_depth {self.water.table_depth:g} m must lie in the box of depth {self.box.depth:g} m; "
                "leave [water] out for a dry scene"
            )

    def _check_place(self, k, t):
        size = self.discretisation.element_size
        sides = (
            self.box.width / 2 - abs(t.x) - t.outer_radius,
            self.box.depth - t.axis_depth - t.outer_radius,
        )
        if min(sides) < size:
            raise ValueError(
                f"tunnel {k}: outside the box or closer to its edge than one element: it spans x = "
                f"{t.x - t.outer_radius:g} .. {t.x + t.outer_radius:g} m and reaches depth "
                f"{t.axis_depth + t.outer_radius:g} m in a box of width {self.box.width:g} m and depth "
                f"{self.box.depth:g} m; move the tunnel or enlarge the box"
            )
        for j, other in enumerate(self.tunnels[:k]):
            gap = math.hypot(t.x - other.x, t.axis_depth - other.axis_depth) - t.outer_radius - other.outer_radius
            if gap <= 0:
                raise ValueError(
                    f"tunnels: {j} and {k} must lie apart, got an overlap by {-gap:g} m; increase the axis spacing"
                )

    def _check_gate(self, gate):
        if gate.tunnel >= len(self.tunnels):
            raise ValueError(
                f"gate: tunnel {gate.tunnel} must be one of the {len(self.tunnels)}, counted from 0; give its number"
            )
        t = self.tunnels[gate.tunnel]
        if gate.width > 0.5 * t.inner_radius:
            raise ValueError(
                f"gate: width {gate.width:g} m is wider than a segment can lose: at most a quarter of the "
                f"inner diameter, {0.5 * t.inner_radius:g} m; check the unit (metres)"
            )

    def _check_length(self):
        if self.gate is None and self.stop.inflow_mass is not None and self.stop.time is None:
            raise ValueError(
                "stop: must have a time, got inflow_mass alone, never reached without a gate; give stop.time or a gate"
            )
        if self.stop.time is None and self.gravity == 0:
            raise ValueError("stop: inflow_mass is never reached without gravity, got 0; give stop.time")
        longest = self.stop.time if self.stop.time is not None else _HOUR
        if longest / self.output.interval > MOST_RECORDS:
            raise ValueError(
                f"output: interval must give at most {MOST_RECORDS:.0e} records in {longest:g} s, got "
                f"{self.output.interval:g} s; give e.g. {longest / 1000:g}"
            )

    def vertical_stress(self, depth: float) -> float:
        """Vertical effective stress of the level ground at a depth [m], compression positive [Pa]."""
        return float(initial_stress(self, depth)[0])

    @property
    def asymmetry(self) -> str | None:
        """What forbids to compute the half x >= 0 only, in words; None where the scene is its own mirror image."""
        if len(self.tunnels) != 1:
            return f"{len(self.tunnels)} tunnels, a half model has one at x = 0"
        if self.tunnels[0].x != 0:
            return f"a tunnel at x = {self.tunnels[0].x:g} m, a half model has it at x = 0"
        if self.gate is not None and self.gate.angle not in (0, 180):
            return f"a gate at {self.gate.angle:g} degrees, a half model has it at 0 or 180"
        across = self.discretisation.elements_across_gate
        if self.gate is not None and across % 2:
            return f"{across} elements across the gate, a half model needs an even number"
        if self.lining_of(self.tunnels[0]) != "fixed":
            return "a lining that moves"
        return None

    @property
    def is_two_phase(self) -> bool:
        """Whether there is water with a velocity of its own."""
        return self.water is not None and self.water.drainage == "two-phase"

    @property
    def is_undrained(self) -> bool:
        """Whether there is water that moves with the grains."""
        return self.water is not None and self.water.drainage == "undrained"

    @property
    def is_half(self) -> bool:
        """Whether only x >= 0 is computed."""
        return self.symmetry == "half" or (self.symmetry == "auto" and self.asymmetry is None)

    def lining_of(self, tunnel: Tunnel) -> str:
        """How a tunnel's lining stands in the ground: its own choice, else that of the scene."""
        return tunnel.lining or self.lining

    def jointed_ring(self, tunnel: Tunnel) -> Any:
        """The ring that moves as a jointed lining, as of :class:`mpm.walls.rings.LiningRing`; scenes with a ring know.

        Raises
        ------
        ValueError
        """
        raise ValueError(
            f"lining: 'jointed' of {tunnel!r} needs a ring, which mpm.Scene has not; give a coupling.Scene"
        )

    def _check_lining(self, k, tunnel):
        kind = self.lining_of(tunnel)
        needed = {"fixed": (), "elastic": ("lining_density", "lining_modulus", "lining_poissons_ratio")}.get(
            kind, ("lining_density",)
        )
        for name in needed:
            if getattr(tunnel, name) is None:
                raise ValueError(
                    f"tunnel {k}: {name} must be given where its lining is '{kind}', got none; concrete: "
                    "lining_density = 2500 kg/m3, lining_modulus = 34.5e9 Pa, lining_poissons_ratio = 0.2"
                )
        most = math.floor(math.pi * tunnel.outer_radius / self.discretisation.element_size_lining)
        if kind in ("elastic", "jointed") and tunnel.lining_harmonics > most:
            raise ValueError(
                f"tunnel {k}: lining_harmonics must not exceed {most}, two elements of the lining a wave, got "
                f"{tunnel.lining_harmonics}; lower it, or discretisation.element_size_lining"
            )


def check_scene(scene: object) -> None:
    """Refuse what is no scene.

    Raises
    ------
    ValueError
    """
    if not isinstance(scene, Scene):
        raise ValueError(
            f"scene: must be an mpm.Scene, got a {type(scene).__name__}; coupling.load_scene('quick') is one"
        )
