"""A report as one file, of a run or of a study, told apart by what lies in the folder: made from `templates/page.html`.

Charts are drawn by Apache ECharts, which is part of the page as its numbers are: it opens offline.
"""

import contextlib
from importlib import resources
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup, escape

from coupling.datasets import RunFileError, run_file
from coupling.files.folder import REPORT_FILE, RUN_FILE
from coupling.files.replace import replace_file
from coupling.refused import Refused
from coupling.report import run_page, study_page
from coupling.report.charts import COLUMNS, JOINT_COLUMNS, charts_of
from coupling.report.numbers import shown as as_read
from coupling.report.numbers import shown_error
from coupling.report.packing import packed
from coupling.studies.collect import stored_cases
from coupling.studies.design import value_text
from coupling.studies.folder import DATA_FILE, RUN_FOLDER, STUDY_FILE, case_file
from coupling.studies.side_by_side import SideBySide

MARK = '<meta name="generator" content="gushing report">'
SCRIPTS = ("data.js", "charts.js", "ground.js", "tables.js", "player.js")


def write_report(
    path: str | Path, out: str | Path | None = None, model: str | None = None, ladder: str | Path | None = None
) -> Path:
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
    ladder : str or path, optional
        Of a run: the mesh ladder of its scene (`gush accuracy --scene`), from which forces get the error of the mesh.

    Returns
    -------
    pathlib.Path

    Raises
    ------
    RunFileError
        No run, or one without a record.
    Refused
        Neither a run nor a study; `out` exists and is no report, or its folder does not exist; no such model; `ladder`
        of a study, or of another scene.
    coupling.studies.design.StudyError
        A study whose definition cannot be read.
    """
    folder = study_folder(path)
    if folder is None:
        target = _checked_path(run_file(path).parent, out)
        shown = run_page.collect(path, model, ladder)
    else:
        if ladder is not None:
            raise Refused(f"--ladder: is of one run, '{path}' is a study; leave --ladder out")
        target = _checked_path(folder, out)
        shown = study_page.collect(folder, target.parent, model)
    replace_file(target, rendered(shown))
    return target


def write_runs_report(compared: SideBySide, out: str | Path) -> Path:
    """Write the page about runs side by side.

    out : the HTML file; an earlier report is replaced, nothing else.

    Raises Refused: as :func:`write_report`.
    """
    target = _checked_path(Path(out).parent, out)
    replace_file(target, rendered(study_page.collect_runs(compared, target.parent)))
    return target


def rendered(shown: dict[str, Any]) -> str:
    """The page as HTML.

    shown : dict from :func:`coupling.report.run_page.collect` or :func:`coupling.report.study_page.collect`.
    """

    def worded(value):
        number = isinstance(value, int | float) and not isinstance(value, bool)
        return as_read(value) if number or value is None else value_text(value)

    def coded(text):  # commands stand between backticks
        parts = [escape(part) for part in text.split("`")]
        return Markup("").join(
            Markup("<code>{}</code>").format(part) if k % 2 else part for k, part in enumerate(parts)
        )

    def source(name):
        return Markup((resources.files("coupling.report") / "templates" / name).read_text(encoding="utf-8"))

    entries = shown["player"]["entries"]
    charts, answers = charts_of(entries), [one["models"] for one in entries]
    player = shown["player"] | {
        "charts": [chart._asdict() for group in charts.values() for chart in group],
        "columns": COLUMNS,
        "joint_columns": JOINT_COLUMNS,
    }
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("coupling.report"), autoescape=True, trim_blocks=True, lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )  # fmt: skip
    environment.filters |= {"shown": as_read, "shown_error": shown_error, "worded": worded, "coded": coded}
    return environment.get_template("page.html").render(
        **shown, mark=Markup(MARK), source=source, scripts=SCRIPTS, charts=charts, packed=packed(player),
        models=[model["name"] for model in max(answers, key=len, default=[])],
        with_joints=any(model["joints"] for models in answers for model in models),
    )  # fmt: skip


def write_run_reports(folder: str | Path) -> list[Path]:
    """Write the pages of all runs of a study beside them; a run without a record gets none. Returns their paths."""
    written = []
    for case in stored_cases(folder)[1]:
        run = case_file(Path(folder), case).parent / RUN_FOLDER
        if (run / RUN_FILE).is_file():
            with contextlib.suppress(RunFileError):
                written.append(write_report(run))
    return written


def study_folder(path: str | Path) -> Path | None:
    """The folder of a study that a path names; None where it can only be a run.

    Raises Refused: a folder that holds neither or both.
    """
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


__all__ = ["is_report", "rendered", "study_folder", "write_report", "write_run_reports", "write_runs_report"]
