"""What the source does not state, varied one at a time: which runs and which rings, and what they say."""

from pathlib import Path
from typing import NamedTuple

from verification.published.evidence import RunEvidence

#: Angles that a pair of joints is moved by, outward and inward [degree]; shares of the springs' strength.
JOINTS_BY, STRENGTHS = 3.0, (0.5, 2.0)
GROUND, LINING, CONTACT = "permeability and dilatancy", "lining in the soil computation", "initial contact"
#: Parameter of the study of unknowns to what it stands for.
NAMES = {
    "soils.0.hydraulic_conductivity": GROUND,
    "soils.0.dilatancy_angle": GROUND,
    "soils.0": GROUND,
    "soils.0.loose_porosity": "loose porosity",
    "gate.corners": "corner of the gate",
    "gate.angle": "place of the gate",
    "discretisation": "mesh at the gate",
    "lining": LINING,
    "tunnels.0": LINING,
}


class CaseRun(NamedTuple):
    """A finished case of a study: what it changes, and the evidence of its run."""

    changes: dict
    evidence: RunEvidence


def finished(folder: str | Path) -> list[CaseRun]:
    """Finished cases of a study, in its order; none where there is no study.

    Raises coupling.studies.design.StudyError: a study that is damaged.
    """
    from coupling.studies.collect import stored_cases
    from coupling.studies.design import STUDY_FILE
    from coupling.studies.execute import case_file
    from coupling.studies.folder import RUN_FOLDER

    if not (Path(folder) / STUDY_FILE).is_file():
        return []
    _, cases, _ = stored_cases(folder)
    there = [(case, case_file(Path(folder), case)) for case in cases]
    there = [(case, file.parent / RUN_FOLDER) for case, file in there if file.is_file()]
    return [CaseRun(case.changes, RunEvidence(case.scene, run)) for case, run in there]


def told(changes: dict) -> str:
    """What a case changes, in a few words."""
    flat = {}
    for name, value in changes.items():
        flat |= value if isinstance(value, dict) else {name.rpartition(".")[2]: value}
    words = [f"{name.replace('_', ' ')} {value:g}" if isinstance(value, float) else f"{name.replace('_', ' ')} {value}"
             for name, value in flat.items()]  # fmt: skip
    return ", ".join(words) or "as it is"


def changed_rings(ring) -> dict[str, list]:
    """Rings that the source's statements allow as well, by what is not stated."""
    angles = list(ring.joint_angles)
    pairs = [(k, len(angles) - 1 - k) for k in range(len(angles) // 2)]
    moved = []
    for one, other in pairs:
        for by in (JOINTS_BY, -JOINTS_BY):
            there = list(angles)
            there[one], there[other] = angles[one] + by, angles[other] - by
            moved.append(_with(ring, joint_angles=there))
    from structure.springs import limit_pressures

    normal, tangential = limit_pressures(ring.ground)
    springs = [{"limit_pressure_normal": s * normal, "limit_pressure_tangential": s * tangential} for s in STRENGTHS]
    other_face = "outer_face" if ring.ground.slip_at == "centre_line" else "centre_line"
    return {
        "joint angles": moved,
        "uplift of the ring": [_with(ring, balance_uplift=not ring.balance_uplift)],
        "strength of soil springs": [_with(ring, ground=ring.ground.model_dump() | one) for one in springs],
        "where soil springs slip": [_with(ring, ground=ring.ground.model_dump() | {"slip_at": other_face})],
    }


def _with(ring, **changes):
    return type(ring).model_validate(ring.model_dump() | changes)


def moved_by(runs: list[CaseRun], measure) -> dict[str, list[tuple[dict, dict]]]:
    """Unknown to pairs of what a changed run and the unchanged one, which comes first, say.

    measure : function of :class:`RunEvidence` to a dict of :class:`verification.published.statements.Found`.
    """
    if not runs or runs[0].changes:
        return {}
    base, pairs = measure(runs[0].evidence), {}
    for changes, evidence in runs[1:]:
        pairs.setdefault(NAMES[next(iter(changes))], []).append((measure(evidence), base))
    return pairs


def moved_by_rings(case: RunEvidence, measure) -> dict[str, list[tuple[dict, dict]]]:
    """The same for rings and for the initial contact; measure: function of evidence and ring."""
    base, changed = measure(case, case.scene.ring), changed_rings(case.scene.ring)
    pairs = {name: [(measure(case, ring), base) for ring in rings] for name, rings in changed.items()}
    return pairs | {CONTACT: [(measure(RunEvidence(case.scene, case.folder), case.scene.ring), base)]}
