"""What `gush stability` tries: runs at the edge of what a scene can ask for."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from typing import Any

from coupling.refused import SceneError
from verification.stability.small_scenes import collapse, filled_tunnel, gate, jet, one_point, slurry


@dataclass(frozen=True)
class Case:
    """One extreme.

    name : str;  title : str, what is extreme about it;  run : callable, run(**settings) -> (faults, measures), of
    `verification.monitor.Monitor`;  settings : dict;  representative : bool, one of those that the tests run.
    """

    name: str
    title: str
    run: Callable[..., tuple[list[str], dict[str, float]]]
    settings: dict[str, Any] = field(default_factory=dict)
    representative: bool = False


class CaseUnknown(SceneError):
    """A name that is no case of `gush stability`."""


def chosen(names):
    """Cases of these names; `*` stands for any ending, no name for all.

    Raises CaseUnknown.
    """
    known, found = cases(), []
    for name in names or known:
        some = [c for k, c in known.items() if k == name or (name.endswith("*") and k.startswith(name[:-1]))]
        if not some:
            raise CaseUnknown(f"case '{name}': must be one of {', '.join(known)}; or a beginning of one followed by *")
        found += [case for case in some if case not in found]
    return found


@cache
def cases():
    """All cases by name: dict of str to `Case`."""
    listed = {}
    for case in (*_boxes(), *_tunnels(), *_motions()):
        if case.name in listed:
            raise ValueError(f"stability case '{case.name}' is listed twice")
        listed[case.name] = case
    return listed


def _boxes():
    """Material numbers, on the collapse of a block in a closed box."""
    chosen = {"K_w=2.2e+09", "k=1e-12", "k=1e+01", "E=1e+05", "phi=50,psi=50", "dry"}

    def case(name, title, **settings):
        return Case(name, title, collapse, settings, name in chosen)

    for value in (1e6, 8e7, 2.2e9, 1e10, 1e11, 1e12):
        yield case(f"K_w={value:.2g}", "bulk modulus of the water [Pa]", bulk_modulus=value)
    for value in [*(10.0**k for k in range(-12, 2)), 0.0, 100.0]:
        yield case(f"k={value:.0e}", "hydraulic conductivity [m/s]", hydraulic_conductivity=value)
    for value in (0.0, 10.0, 30.0, 50.0, 59.0, 60.0):
        yield case(f"phi={value:g}", "friction angle [degree], c = 0.5 kPa", friction_angle=value, cohesion=5e2)
    for value in (0.0, 1e3, 1e5, 1e6):
        yield case(f"c={value:g}", "cohesion [Pa]", cohesion=value)
    for value in (2.0, 5.0, 15.0, 30.0):
        yield case(f"psi={value:g}", "dilatancy angle [degree], phi = 25", dilatancy_angle=value)
    for value in (10.0, 25.0):
        title = "the same, stress not ahead"
        yield case(f"psi={value:g},damping=0", title, dilatancy_angle=value, stress_damping=0.0)
    yield case("phi=0,c=0", "no strength at all", friction_angle=0.0, cohesion=0.0)
    yield case("phi=50,psi=10", "dilatant", friction_angle=50.0, dilatancy_angle=10.0)
    yield case("phi=50,psi=50", "associated flow at 50 degrees", friction_angle=50.0, dilatancy_angle=50.0)
    yield case("tension=1e5", "tensile strength beyond the apex", tensile_strength=1e5)
    for value in [*(10.0**k for k in range(5, 11)), 1e3]:
        yield case(f"E={value:.0e}", "Young's modulus [Pa]", youngs_modulus=value)
    for value in (0.0, 0.45, 0.49, 0.499, 0.5):
        yield case(f"nu={value:g}", "Poisson's ratio [-]", poissons_ratio=value)
    for value in (0.05, 0.0501, 0.2, 0.7, 0.89, 0.9):
        loose = min(value + 0.1, 0.9)
        yield case(f"n={value:g}", "porosity [-]", porosity=value, loose_porosity=loose)
    yield case("dry", "no water", bulk_modulus=None)
    yield case("undrained", "water moves with the grains", drainage="undrained")
    yield case("undrained,K_w=1e+11", "the same, stiff water", drainage="undrained", bulk_modulus=1e11)
    yield case("dry,E=1e+10", "no water, stiff", bulk_modulus=None, youngs_modulus=1e10)
    yield case("no gravity", "gravity 0: nothing must move", gravity=0.0)
    yield case("gravity=100", "centrifuge, 10 g", gravity=100.0)
    yield case("table below", "water table 1 m below the surface", table_depth=1.0)
    for value in (1, 2, 3, 4, 6, 9, 12, 16, 25):
        yield case(f"points={value}", "points per element", points=value)
    for place in ("vertices", "edges", "random"):
        for points in (1, 3):
            yield case(f"{place},{points}", "points exactly there at the start", points=points, positions=place)
    yield case("courant=1", "the critical step itself", courant=1.0)
    yield case("courant=1,vertices", "the same, points on vertices", courant=1.0, positions="vertices")
    yield case("courant=0.01", "a hundredth of it", courant=0.01, seconds=0.05)
    yield case("filter=0", "no pressure filter", pressure_filter=0.0)
    yield case("filter=1", "full pressure filter", pressure_filter=1.0)
    yield case("pic=0", "pure FLIP", pic_rate=0.0)
    yield case("pic=1e6", "pure PIC", pic_rate=1e6)
    yield case("damping=0", "stress not ahead", stress_damping=0.0)
    yield case("damping=2", "stress ahead by two steps", stress_damping=2.0)
    yield case("E=1e+10,K_w=1e+06", "stiff skeleton, soft water", youngs_modulus=1e10, bulk_modulus=1e6)
    yield case("E=1e+05,K_w=1e+11", "soft skeleton, stiff water", youngs_modulus=1e5, bulk_modulus=1e11)
    yield case("size=1mm", "elements of 1 mm", size=1e-3, seconds=0.02)
    yield case("size=10m", "elements of 10 m", size=10.0, seconds=10.0)


def _tunnels():
    """Geometry and flow, on a coarse tunnel with a gate."""

    def case(name, title, run=gate, representative=False, **settings):
        return Case(name, title, run, settings, representative)

    yield case("gate", "the coarse tunnel as it is")
    yield case("K_w=2.2e9,gate", "real water", bulk_modulus=2.2e9, seconds=0.1)
    yield case("k=1e-12,gate", "clay", hydraulic_conductivity=1e-12)
    yield case("k=10,gate", "open gravel", hydraulic_conductivity=10.0)
    yield case("E=1e5,gate", "mud", youngs_modulus=1e5)
    yield case("E=1e10,gate", "rock", youngs_modulus=1e10, seconds=0.05)
    yield case("c=1e6,gate", "cemented: nothing comes in", cohesion=1e6, model="mohr-coulomb")
    yield case("phi=50,psi=10,gate", "dilatant", friction_angle=50.0, dilatancy_angle=10.0)
    yield case("phi=50,psi=50,gate", "associated", friction_angle=50.0, dilatancy_angle=50.0)
    yield case("dry,gate", "no water", water=False)
    yield case("undrained,gate", "water moves with the grains", drainage="undrained")
    yield case("no gravity,gate", "gravity 0", gravity=0.0)
    for ratio in (0.3, 1.0, 5.0, 20.0):
        yield case(f"cover={ratio:g}D", "cover over the outer diameter", cover=ratio, representative=ratio == 0.3)
    yield case("cover=0", "no cover", cover=0.0)
    for width in (0.02, 0.05, 1.0, 2.0):
        yield case(f"channel={width:g}m", "width of the gate", width=width)
    for angle in (0.0, 45.0, 180.0):
        yield case(f"gate at {angle:g}", "angle of the gate [degree]", angle=angle)
    yield case("sink", "material taken out behind the gate", interior="sink")
    yield case("full", "tunnel filled to the crown, gate open: rest", filled_tunnel, True)
    yield case(
        "filling", "a small tunnel until nothing more fits", gate, diameter=1.0, width=0.2, cover=3.0, seconds=3.0
    )
    yield case("closed again", "gate open for 0.1 s, closed, 0.1 s", representative=True, close_at=0.1, seconds=0.2)
    yield case("reopened", "open, closed, open", close_at=0.05, reopen_at=0.1, seconds=0.2)
    yield case("ten times", "ten times the run", seconds=3.0)


def _motions():
    """Fast and sparse material."""
    yield Case("one point", "one point alone falls, lands, rests", one_point, {}, True)
    yield Case("one point dry", "the same without water", one_point, {"bulk_modulus": None})
    yield Case("jet 30 m/s", "a lump of soil and water at 30 m/s against a wall", jet, {}, True)
    yield Case("jet 30 m/s,K_w=2.2e9", "with real water", jet, {"bulk_modulus": 2.2e9, "seconds": 0.1})
    yield Case("jet 30 m/s,dry", "without water", jet, {"bulk_modulus": None})
    yield Case("jet 30 m/s,undrained", "water moves with the grains", jet, {"drainage": "undrained"})
    yield Case("jet 300 m/s", "near the wave speed", jet, {"speed": 300.0, "seconds": 0.05})
    yield Case("water only", "grains do not touch: a dam of slurry breaks", slurry, {}, True)
    yield Case("water only,k=10", "and hardly hold the water", slurry, {"hydraulic_conductivity": 10.0})
    yield Case("collapse,ten times", "a block's collapse for ten times as long", collapse, {"seconds": 5.0})
