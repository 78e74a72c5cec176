"""A report as one file: of a run or of a study, told apart by what lies in the folder, put together and written."""

from __future__ import annotations

import contextlib
from importlib import resources
from pathlib import Path

from coupling.datasets import run_file
from coupling.files.folder import REPORT_FILE, RUN_FILE
from coupling.files.replace import replace_file
from coupling.refused import Refused
from coupling.report.frame import document
from structure.response import SHOWN

QUANTITIES = {name: (shown.unit, shown.scale) for name, shown in SHOWN.items()}
MARK = '<meta name="generator" content="gushing report">'


def write_report(path: str | Path, out: str | Path | None = None, model: str | None = None) -> Path:
    """Write the page about a run or a study.

    Parameters
    ----------
    path : str or path
        Folder of a run or its file, of a study or its `study.json`; what still goes on or was interrupted shows what
        it has.
    out : str or path, optional
        The HTML file, or the folder for it; `report.html` in the folder of the run or study when left out. An earlier
        report is replaced, nothing else.
    model : str, optional
        Lining model whose numbers lead; left out: the run's own, or the first of the study.

    Returns
    -------
    pathlib.Path

    Raises
    ------
    RunFileError
        No run, or one without a record.
    Refused
        Neither a run nor a study; `out` exists and is no report, or its folder does not exist; no such model.
    coupling.studies.design.StudyError
        A study whose definition cannot be read.
    """
    folder = study_folder(path)
    if folder is None:
        from coupling.report import run_markup, run_page

        target = _checked_path(run_file(path).parent, out)
        data, parts, scripts = run_page.collect(path, model), run_markup.parts, run_page.SCRIPTS
    else:
        from coupling.report import study_markup, study_page

        target = _checked_path(folder, out)
        data, parts, scripts = study_page.collect(folder, target.parent, model), study_markup.parts, study_page.SCRIPTS
    text = document(
        *parts(data),
        data["player"] | {"quantities": QUANTITIES},
        _file("page.css"),
        "\n".join(map(_file, scripts)),
        MARK,
    )
    replace_file(target, text)
    return target


def write_run_reports(folder: str | Path) -> list[Path]:
    """Write the pages of all runs of a study beside them; a run without a record gets none. Returns their paths."""
    from coupling.datasets import RunFileError
    from coupling.studies.case import RUN_FOLDER
    from coupling.studies.collect import stored_cases
    from coupling.studies.execute import case_file

    written = []
    for case in stored_cases(folder)[1]:
        run = case_file(Path(folder), case).parent / RUN_FOLDER
        if (run / RUN_FILE).is_file():
            with contextlib.suppress(RunFileError):
                written.append(write_report(run))
    return written


def study_folder(path: str | Path) -> Path | None:
    """The folder of a study that a path names; None where it can only be a run.

    Raises
    ------
    Refused
        A folder that holds neither or both.
    """
    from coupling.studies.folder import DATA_FILE, STUDY_FILE

    path = Path(path)
    if not path.is_dir():
        return path.parent if path.is_file() and path.name in (STUDY_FILE, DATA_FILE) else None
    run, study = (path / RUN_FILE).exists(), (path / STUDY_FILE).exists()
    if run and study:
        raise Refused(f"'{path}': holds a run ({RUN_FILE}) and a study ({STUDY_FILE}); name one of these files")
    if not run and not study:
        inner = sorted(file.parent.name for name in (RUN_FILE, STUDY_FILE) for file in path.glob(f"*/{name}"))
        hint = f", for instance {path / inner[0]}" if inner else ""
        raise Refused(
            f"'{path}': must be the folder of a run (with {RUN_FILE}) or of a study (with {STUDY_FILE}), it holds "
            f"neither; give the one that `gush run` or `gush study` wrote{hint}"
        )
    return path if study else None


def _checked_path(folder, out):
    path = folder / REPORT_FILE if out is None else Path(out)
    if path.is_dir():
        path = path / REPORT_FILE
    if not path.absolute().parent.is_dir():
        raise Refused(f"report '{path}': its folder does not exist; make it or choose another --out")
    if path.exists() and not is_report(path):
        raise Refused(f"report '{path}': exists and is no report of this program; choose another --out")
    return path


def is_report(path: str | Path) -> bool:
    """Whether a file is a page that :func:`write_report` wrote."""
    with open(path, "rb") as stream:
        return MARK.encode() in stream.read(1000)


def _file(name):
    return (resources.files("coupling.report") / name).read_text(encoding="utf-8")


__all__ = ["is_report", "study_folder", "write_report", "write_run_reports"]
