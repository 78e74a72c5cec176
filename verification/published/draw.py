"""All figures of the published study that the runs at hand have datasets for, as files."""

from pathlib import Path

from coupling.figures import GATE, NOW, RESOLUTION
from coupling.figures.picture import styled
from verification.published import case_figures as cases
from verification.published import ground_figures as ground
from verification.published import lining_figures as lining

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


#: Of one run, of the twin tunnels, and of all cases by scene: number of the published figure to what draws it.
OF_CASE = {
    "09": ground.inflow_and_stages, "10": ground.fields_around, "11": ground.stresses_along_axes,
    "12": ground.stress_variation_fields, "13": lining.pressures_by_inflow, "14": lining.pressure_ratios_by_inflow,
    "15": lining.forces_by_inflow, "15-ring": lining.deformation, "16": lining.extremes_over_inflow,
    "17": lining.joints_over_inflow,
}  # fmt: skip
OF_TWIN = {"06": ground.settlement_troughs, "07": lining.initial_pressures}
OF_CASES = {
    "19": cases.pressure_ratios, "20": cases.additional_axial_force, "21": cases.additional_bending_moment,
    "22": cases.deformation, "22-displacement": cases.displacement, "23": cases.joint_deformation,
}  # fmt: skip


def draw(figures, evidence, folder: str | Path) -> dict[str, Path]:
    """Draw figures of evidence into a folder, which is made when absent.

    figures : one of the dicts above;  evidence : what its functions take.

    Returns: number of the published figure to file.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    written = {}
    for number, picture in figures.items():
        written[number] = folder / (f"figure-{number}.png" if number[0].isdigit() else f"{number}.png")
        picture(evidence).savefig(written[number], dpi=RESOLUTION)
    return written


def draw_bands(verdicts, folder: str | Path) -> dict[str, Path]:
    """Our numbers over the published ones with their bands, of the statements that are numbers of one sign."""
    shown = [v for v in verdicts.values() if v.statement.stated[0] == v.statement.stated[1] and v.agrees
             and v.found.value / v.statement.stated[0] > 0 and v.statement.text != "joints that turn most"]  # fmt: skip
    return draw({"bands": bands} if shown else {}, shown, folder)


def bands(shown):
    """Figure of the bands of some verdicts."""
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
        written |= draw(OF_TWIN, runs["twin-tunnels"], folder)
    if "case-3" in runs:
        written |= draw(OF_CASE, runs["case-3"], folder) | draw(OF_CASES, runs, folder)
    if not written:
        raise StudyError(f"study '{study}': must hold a finished case-3 or twin-tunnels, got neither; run gush study")
    return written
