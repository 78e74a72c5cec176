"""All figures of the published study that the runs at hand have datasets for, as files."""

from pathlib import Path

import numpy as np

from coupling import postprocess
from coupling.figures import GATE, NOW, RESOLUTION, deformed_ring
from coupling.figures.picture import styled
from verification.published import case_figures, ground_figures, lining_figures
from verification.published.evidence import initial_theory

#: Pictures that the page shows, by their numbers in the source; all others are drawn beside them.
CAPTIONS = {
    "bands": "our numbers over the published ones, with their bands; those that are one number, and of one sign",
    "06": "settlement troughs by inflow mass, twin tunnels",
    "09": "inflow mass and flow zone over time, with its stages",
    "10": "displacement with the flow zone, deviatoric strain, pore pressure, effective stress",
    "11": "soil stress and pore pressure along both axes through the gate",
    "13": "pressures on the lining; gate in red, joints in grey",
    "15": "axial force, shear force, bending moment; gate in red, joints in grey",
    "23": "joint deformation across cases",
}


def draw_case(case, folder: str | Path) -> dict[str, Path]:
    """Figures 9 to 17 of one run.

    case : verification.published.evidence.RunEvidence;  folder : made when absent.

    Returns: number of the published figure to file.
    """
    response, pressures, masses = case.responses["beam-spring"], case.of_gate, case.masses
    fields = postprocess.with_inflow(postprocess.element_fields(case.points, case.mesh), case.history)
    record = int(np.abs(response["inflow_mass"].values - case.compared).argmin())
    gate, joints = float(case.scene.gate.angle), response["joint_angle"].values
    ground, lining = ground_figures, lining_figures
    return _saved(
        folder,
        {
            "09": lambda: ground.inflow_and_stages(case.history),
            "10": lambda: ground.fields_around(fields, case.mesh, case.compared),
            "11": lambda: ground.stresses_along_axes(case.horizontal, case.vertical, masses),
            "12": lambda: ground.stress_variation_fields(fields, case.mesh, masses[-2:]),
            "13": lambda: lining.pressures_by_inflow(pressures, masses, joints),
            "14": lambda: lining.pressure_ratios_by_inflow(pressures, masses, joints),
            "15": lambda: lining.forces_by_inflow(response, masses, gate),
            "15-ring": lambda: deformed_ring(response, record),
            "16": lambda: lining.extremes_over_inflow(case.responses),
            "17": lambda: lining.joints_over_inflow(response),
        },
    )


def draw_twin(twin, folder: str | Path) -> dict[str, Path]:
    """Figures 6 and 7 of the twin tunnels; parameters as :func:`draw_case`."""
    theory = [initial_theory(twin.scene, tunnel) for tunnel in twin.scene.tunnels]
    first = twin.at_rest if twin.at_rest is not None else twin.pressures
    return _saved(
        folder,
        {
            "06": lambda: ground_figures.settlement_troughs(twin.settlement, twin.masses),
            "07": lambda: lining_figures.initial_pressures(first, theory),
        },
    )


def draw_cases(cases, folder: str | Path) -> dict[str, Path]:
    """Figures 19 to 23 of all cases at 1000 kg/m; cases: evidence by scene."""
    one = case_figures
    return _saved(
        folder,
        {
            "19": lambda: one.pressure_ratios(cases),
            "20": lambda: one.additional_force(cases, "axial_force", "additional axial force [kN/m]"),
            "21": lambda: one.additional_force(cases, "bending_moment", "additional bending moment [kN m/m]"),
            "22": lambda: one.deformation(cases),
            "22-displacement": lambda: one.displacement(cases),
            "23": lambda: one.joint_deformation(cases),
        },
    )


def draw_bands(verdicts, folder: str | Path) -> dict[str, Path]:
    """Our numbers over the published ones with their bands, of the statements that are numbers of one sign."""
    shown = [v for v in verdicts.values() if v.statement.stated[0] == v.statement.stated[1] and v.agrees
             and v.found.value / v.statement.stated[0] > 0 and v.statement.text != "joints that turn most"]  # fmt: skip

    def draw():
        with styled(6.2, 0.8 + 0.2 * len(shown)) as figure:
            axis = figure.subplots()
            for row, v in enumerate(reversed(shown)):
                theirs, colour = v.statement.stated[0], GATE if v.agrees == "no" else NOW
                ends = sorted(max(end / theirs, 1e-2) for end in (v.low, v.high))
                axis.plot(ends, [row, row], color=colour, lw=3, alpha=0.35, solid_capstyle="butt")
                axis.plot(v.found.value / theirs, row, "o", ms=4, color=colour)
            axis.axvline(1.0, color="0.2", lw=0.8)
            axis.set_xscale("log")
            axis.set_yticks(range(len(shown)), [v.statement.text for v in reversed(shown)])
            axis.set_xlabel("ours over published; bar: band of what is not stated; red: disagrees")
            axis.grid(True, axis="x")
        return figure

    return _saved(folder, {"bands": draw} if shown else {})


def _saved(folder, figures):
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    written = {}
    for number, draw in figures.items():
        written[number] = folder / (f"figure-{number}.png" if number[0].isdigit() else f"{number}.png")
        draw().savefig(written[number], dpi=RESOLUTION)
    return written


def draw_study(study: str | Path, folder: str | Path) -> dict[str, Path]:
    """Draw what the finished cases of a study allow: twin tunnels, case 3, and all scenes beside each other.

    Raises coupling.studies.design.StudyError: no study there, or none of those scenes in it is finished.
    """
    from coupling.studies.collect import stored_cases
    from coupling.studies.design import StudyError
    from verification.published.unknowns import finished

    stored_cases(study)  # says what is wrong where there is no study
    runs = {run.evidence.scene.name: run.evidence for run in finished(study)}
    written = {}
    if "twin-tunnels" in runs:
        written |= draw_twin(runs["twin-tunnels"], folder)
    if "case-3" in runs:
        written |= draw_case(runs["case-3"], folder) | draw_cases(runs, folder)
    if not written:
        raise StudyError(f"study '{study}': must hold a finished case-3 or twin-tunnels, got neither; run gush study")
    return written
