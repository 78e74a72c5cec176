"""All figures of the published study that the studies at hand have datasets for, as files."""

from __future__ import annotations

from pathlib import Path

from coupling import postprocess
from coupling.figures import RESOLUTION, common_tops, deformed_ring, fields_around_tunnel
from verification.published import case_figures, ground_figures, lining_figures


def draw_case(case, folder: str | Path) -> dict[str, Path]:
    """Figures 9 to 17 of one run.

    Parameters
    ----------
    case : verification.published.evidence.RunEvidence
    folder : str or path
        Made when absent.

    Returns
    -------
    dict of str to Path
        Number of the published figure to file.
    """
    import numpy as np

    response, pressures, masses = case.responses["beam-spring"], case.of_gate, case.masses
    snapshots = postprocess.with_inflow(case.points, case.history)
    at_half = int(np.abs(snapshots["inflow_mass"].values - case.half).argmin())
    fields = postprocess.with_inflow(postprocess.element_fields(case.points, case.mesh), case.history)
    record = int(np.abs(response["inflow_mass"].values - case.half).argmin())
    return _saved(
        folder,
        {
            "09": lambda: ground_figures.inflow_and_stages(case.history, postprocess.flow_zone_stages(case.history)),
            "10": lambda: fields_around_tunnel(case.points.isel(time=at_half), tops=common_tops(case.points)),
            "11": lambda: ground_figures.stresses_along_axes(case.horizontal, case.vertical, masses),
            "12": lambda: ground_figures.stress_variation_fields(fields, case.mesh, masses[-2:]),
            "13": lambda: lining_figures.pressures_by_inflow(pressures, masses),
            "14": lambda: lining_figures.pressure_ratios_by_inflow(pressures, masses),
            "15": lambda: lining_figures.forces_by_inflow(response, masses),
            "15-ring": lambda: deformed_ring(response, record),
            "16": lambda: lining_figures.extremes_over_inflow(case.responses),
            "17": lambda: lining_figures.joints_over_inflow(response),
        },
    )


def draw_twin(twin, folder: str | Path) -> dict[str, Path]:
    """Figures 6 and 7 of the twin tunnels; parameters as :func:`draw_case`."""
    return _saved(
        folder,
        {
            "06": lambda: ground_figures.settlement_troughs(twin.settlement, twin.masses),
            "07": lambda: lining_figures.initial_pressures(twin.pressures, twin.theory),
        },
    )


def draw_cases(study, inflow_mass: float, folder: str | Path) -> dict[str, Path]:
    """Figures 19 to 23 of the study `table-2` at an inflow mass [kg/m]."""
    one, at = case_figures, inflow_mass
    axial, moment = "additional axial force [kN/m]", "additional bending moment [kN m/m]"
    return _saved(
        folder,
        {
            "19": lambda: one.pressure_ratios(study, at),
            "20": lambda: one.additional_forces(study, at, "axial_force", axial),
            "21": lambda: one.additional_forces(study, at, "bending_moment", moment),
            "22": lambda: one.deformation(study, at),
            "23": lambda: one.joint_deformation(study, at),
        },
    )


def _saved(folder, figures):
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    written = {}
    for number, draw in figures.items():
        written[number] = folder / f"figure-{number}.png"
        draw().savefig(written[number], dpi=RESOLUTION)
    return written


def draw_study(study: str | Path, folder: str | Path) -> dict[str, Path]:
    """Draw what the finished cases of a study allow: twin tunnels, case 3, and all scenes beside each other.

    Raises
    ------
    coupling.studies.design.StudyError
        No study there, or none of those scenes in it is finished.
    """
    from coupling.studies.collect import read_study
    from coupling.studies.design import StudyError
    from verification.published.evidence import evidence
    from verification.published.sources import case_runs, run_of_scene

    runs = case_runs(study)
    case, twin = run_of_scene(runs, "case-3"), run_of_scene(runs, "twin-tunnels")
    written = {}
    if twin is not None:
        written |= draw_twin(evidence(twin), folder)
    if case is not None:
        written |= draw_case(evidence(case), folder)
        data = read_study(study).load()
        if "scene" in data.coords:
            written |= draw_cases(data, 0.5 * case.last_mass, folder)
    if not written:
        raise StudyError(f"study '{study}': must hold a finished case-3 or twin-tunnels, got neither; run gush study")
    return written
