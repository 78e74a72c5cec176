"""What lies where in the folder of a study."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from coupling.studies.cases import Case

STUDY_FILE, STATUS_FILE, DATA_FILE, CASES = "study.json", "status.json", "study.nc", "cases"
#: In a case's folder: what of it goes into the study's dataset, written last, so it exists only when all is done.
CASE_FILE = "case.nc"
RUN_FOLDER, PROGRESS_FILE = "run", "progress.json"


def case_file(folder: Path, case: Case) -> Path:
    """Where the results of a case are once it is done."""
    return folder / CASES / case.key / CASE_FILE
