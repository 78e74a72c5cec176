"""Case 3 with a lining that is held, elastic or jointed in the ground, over the whole event: docs/two-way.md.

uv run python -m verification.reports two-way [RUNS]    # runs into the folder RUNS, or goes on with them; minutes
"""

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np

import coupling
from coupling.datasets import read_response
from coupling.figures import GATE
from coupling.figures.picture import legend_outside
from coupling.postprocess import at_inflow
from structure.response import FORCES
from verification.pages import DOCS, picture, table
from verification.sensitivity.variants import meshes

BLOCKS = ("states", "meshes")
OPEN = {"joint_contact_only": True, "joint_contact_height": 0.35, "joint_friction_coefficient": 0.5}
#: What the ground is computed with: changes of case 3, and whether the forces are those of the ring in soil springs
#: under the pressures that result, or of the ring in the ground.
LININGS = {
    "held, then ring in springs": ({"lining": "fixed"}, "springs"),
    "elastic": ({"lining": "elastic"}, "own"),
    "jointed": ({"lining": "jointed"}, "own"),
    "jointed, joints gape and slide": ({"lining": "jointed", "ring": OPEN}, "own"),
}
MESHES = {"finer": 1.0, "coarse": 1.4}  # times the sizes of case 3
MASSES = (0.0, 100.0, 300.0, 1000.0)  # kg/m
ENDS = (MASSES[0], MASSES[-1])
COLOURS = ("#0072b2", "#e69f00", "#009e73", "#cc79a7")


def run_case(folder, factor, changes):
    """Run case 3 to the last mass with a lining, or go on with what is there; the folder."""
    scene = coupling.load_scene(
        "case-3", **meshes(coupling.load_scene("case-3"), factor), stop={"inflow_mass": MASSES[-1], "time": 12.0},
        output={"interval": 0.02, "snapshot_interval": 1.0, "points": False}, **changes,
    )  # fmt: skip
    there = (folder / "run.nc").is_file()
    if not there or coupling.read_run(folder).attrs["status"] != "finished":
        coupling.run(scene, folder, threads=1, resume=there, response=True, warn=lambda _: None)
    return folder


def states_of(folder, forces_from):
    """Forces and movements of the joints over time, with the inflow mass, and the pressures."""
    run = coupling.read_run(folder)
    pressures = run["lining"].to_dataset()
    if forces_from == "own":
        return pressures, pressures
    return pressures, read_response(folder, "beam-spring")


def rows_of(name, pressures, ring):
    """What a lining came to at every mass."""
    for mass in MASSES:
        outside, inside = at_inflow(pressures, mass), at_inflow(ring, mass)
        axial, shear, moment = (inside[force].values / 1e3 for force in FORCES)
        joint = inside if "joint_rotation" in inside else None
        yield (
            mass,
            {
                "lining": name,
                "time s": f"{float(outside.time):.3f}",
                "soil crown, waist opposite, invert": places(outside.soil_pressure),
                "water the same": places(outside.water_pressure),
                "N": f"{axial.min():.0f} .. {axial.max():.0f}",
                "Q": f"{np.abs(shear).max():.0f}",
                "M": f"{moment.min():.0f} .. {moment.max():.0f}",
                "turn of joints 1, 2, 3 mrad": "" if joint is None else each(joint.joint_rotation, 3),
                "largest slip mm": "" if joint is None else f"{1e3 * np.abs(joint.joint_dislocation.values).max():.2f}",
            },
        )


def places(pressure):
    """Pressure at crown, waist away from the gate and invert [kPa]."""
    return ", ".join(f"{float(pressure.sel(theta=a)) / 1e3:.0f}" for a in (0, 270, 180))


def each(values, count):
    """First values of the joints, in thousandths."""
    return ", ".join(f"{1e3 * float(value):.2f}" for value in values.values[:count])


def draw(path, found):
    """Bending moment at the first and the last mass, and over the inflow."""
    with picture(path, 9.0, 3.6) as figure:
        axes = figure.subplots(1, 3, sharey=True, width_ratios=(1, 1, 1))
        for (name, (_, ring)), colour in zip(found.items(), COLOURS, strict=True):
            for ax, mass in zip(axes, ENDS, strict=False):
                moment = at_inflow(ring, mass).bending_moment / 1e3
                ax.plot(moment.theta, moment, color=colour, label=name)
            for extreme in ("max", "min"):
                line = getattr(ring.bending_moment, extreme)("theta") / 1e3
                axes[2].plot(ring.inflow_mass, line, color=colour)
        for ax, mass in zip(axes, ENDS, strict=False):
            ax.set(title=f"{mass:g} kg/m", xlabel="angle from the crown [°]", xticks=range(0, 361, 90))
            ax.axvline(90.0, color=GATE, lw=1, ls=":")
        axes[0].set_ylabel("bending moment [kN m/m]")
        axes[2].set(title="largest and smallest", xlabel="inflow [kg/m]")
        legend_outside(figure, axes[0], columns=2)


def blocks(runs="runs/two-way"):
    """The tables of both meshes, and the picture."""
    names = {lining: "-".join(lining.replace(",", "").split()) for lining in LININGS}
    jobs = {(m, k): (Path(runs) / m / names[k], MESHES[m], LININGS[k][0]) for m in MESHES for k in LININGS}
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        folders = dict(zip(jobs, pool.map(run_case, *zip(*jobs.values(), strict=True)), strict=True))
    tables = {}
    for mesh in MESHES:
        found = {k: states_of(folders[mesh, k], LININGS[k][1]) for k in LININGS}
        rows = [(mass, row) for name, states in found.items() for mass, row in rows_of(name, *states)]
        lines = tables[mesh] = []
        for mass in MASSES:
            here = [row for at, row in rows if at == mass]
            lines += [f"**{mass:g} kg/m**", "", *table(tuple(here[0]), (tuple(row.values()) for row in here)), ""]
        if mesh == "finer":
            draw(DOCS / "images" / "two-way.png", found)
    return {"states": tables["finer"], "meshes": tables["coarse"]}
