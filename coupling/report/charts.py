"""Which charts and columns a page has: the quantity of each, its words, its unit."""

from typing import NamedTuple

from coupling.postprocess.extremes import shown_extreme
from structure.limits import UTILISATIONS
from structure.response import FORCES, PRESSURES, SHOWN


class Chart(NamedTuple):
    """A chart.

    kind : "ring", "time" or "progress" (over time or inflow mass);  keys : quantities in one frame;
    of_model : whether a lining model answers them;  unit, factor : how they are shown, and to it from SI.
    """

    name: str
    title: str
    unit: str
    factor: float
    kind: str
    keys: tuple[str, ...]
    of_model: bool = False


def _capital(text):
    return text[:1].upper() + text[1:]


def _extremes(name, title, *keys):
    return Chart(name, title, SHOWN[keys[0].removesuffix("_max")].unit, SHOWN[keys[0].removesuffix("_max")].scale,
                 "progress", keys, True)  # fmt: skip


GUSHING = (
    Chart("inflow_mass", "Inflow mass", "kg/m", 1.0, "time", ("inflow_mass",)),
    Chart("flow_zone", "Flow zone, moved over 50 mm", "m²", 1.0, "progress", ("flow_zone_area",)),
    Chart("disturbed_zone", "Disturbed zone, moved 10 to 50 mm", "m²", 1.0, "progress", ("disturbed_area",)),
    Chart("velocity", "Largest velocity of the grains", "m/s", 1.0, "progress", ("max_velocity",)),
)
AROUND = tuple(
    Chart(name, _capital(SHOWN[name].name), SHOWN[name].unit, SHOWN[name].scale, "ring", (name,), name in FORCES)
    for name in (*PRESSURES, *FORCES)
)
DEFORMED = Chart("deformation", "Deformation: radial displacement, outward positive", SHOWN["displacement_radial"].unit,
                 SHOWN["displacement_radial"].scale, "ring", ("displacement_radial",), True)  # fmt: skip
OF_RING = (
    *(_extremes(f"{name}_extremes", f"Largest and smallest {SHOWN[name].short}", f"{name}_max", f"{name}_min")
      for name in FORCES),
    _extremes("opening", f"Largest {SHOWN['joint_opening'].name}", "joint_opening_max"),
    _extremes("dislocation", "Largest size of joint dislocation", "joint_dislocation_max"),
    _extremes("rotation", "Largest size of joint rotation", "joint_rotation_max"),
    *(_extremes(name, _capital(SHOWN[name].name), name)
      for name in ("convergence_vertical", "convergence_horizontal", "settlement")),
    *(Chart(name, f"Utilisation, 1 is the limit: {what}", "", 1.0, "progress", (name,), True)
      for name, what in UTILISATIONS.items()),
)  # fmt: skip
#: Of the table at the slider: (key, heading, unit, factor, of a lining model).
COLUMNS = (
    ("time", "time", "s", 1.0, False),
    ("inflow_mass", "inflow mass", "kg/m", 1.0, False),
    ("flow_zone_area", "flow zone", "m²", 1.0, False),
    *((f"{name}_max", f"largest {SHOWN[name].short}", SHOWN[name].unit, SHOWN[name].scale, False)
      for name in PRESSURES[:2]),
    *((f"{name}_{end}", f"{word} {SHOWN[name].short}", SHOWN[name].unit, SHOWN[name].scale, True)
      for name in FORCES for end, word in (("max", "largest"), ("min", "smallest"))),
    *((key, word or shown_extreme(key)[0], *shown_extreme(key)[1:], True)
      for key, word in (("joint_opening_max", ""), ("joint_dislocation_max", "joint dislocation, largest size"),
                        ("joint_rotation_max", ""), ("convergence_vertical", ""), ("convergence_horizontal", ""),
                        ("settlement", ""))),
)  # fmt: skip
#: Of the table of joints: (key, heading, unit, factor).
JOINT_COLUMNS = tuple(
    (f"joint_{key}", word, SHOWN[f"joint_{key}"].unit, SHOWN[f"joint_{key}"].scale)
    for key, word in (("axial_force", "N"), ("shear_force", "Q"), ("bending_moment", "M"),
                      ("opening", SHOWN["joint_opening"].name.removeprefix("joint ")),
                      ("dislocation", "dislocation"), ("rotation", "rotation"))
)  # fmt: skip


def charts_of(entries):
    """The charts that entries of :func:`coupling.report.curves.entry` have data for: {group: tuple of Chart}."""

    def of_any(pick):
        return set().union(*(set(pick(one)) for one in entries))

    series, curves = of_any(lambda one: one["series"]), of_any(lambda one: one["curves"])
    answered = [model for one in entries for model in one["models"]]
    of_models = set().union(*({*model["series"], *model["curves"]} for model in answered))
    there = lambda chart: set(chart.keys) & (of_models if chart.of_model else series | curves)  # noqa: E731
    groups = {"gushing": GUSHING, "around": AROUND, "ring": (DEFORMED, *OF_RING)}
    return {name: tuple(filter(there, charts)) for name, charts in groups.items()}
