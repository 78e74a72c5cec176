"""Measure a report of the docs and write its page, numbers and pictures.

    uv run python -m verification.reports PAGE [FOLDER]

PAGE is the name of a page, as `left-out`; what its report takes a folder for, and how long it takes, is said in its
module.
"""

import argparse
from importlib import import_module
from inspect import signature

from verification.pages import docs_page, made_by

#: Page to the module that measures it: `BLOCKS`, names of what `blocks` returns beside "made", and the scene it is of.
REPORTS = {
    "case-3": ("reports.case_3",), "case-3-sensitivity": ("sensitivity.inflow", "case-3"),
    "fit-coverage": ("reports.fit",), "inflow-sensitivity": ("sensitivity.inflow", "quick"),
    "left-out": ("reports.left_out",), "lining-in-mpm": ("reports.lining_in_mpm",),
    "lining-models": ("reports.lining_models",), "ring": ("reports.ring",), "rings-as-built": ("reports.as_built",),
    "two-way": ("reports.two_way",),
}  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("page", choices=tuple(REPORTS))
    parser.add_argument("folder", nargs="?", help="of runs, or of pictures alone; see the module of the report")
    options = parser.parse_args()
    module, *scene = REPORTS[options.page]
    report = import_module(f"verification.{module}")
    if options.folder and len(signature(report.blocks).parameters) == len(scene):
        parser.error(f"{options.page}: takes no folder, got {options.folder!r}; leave it out")
    page = docs_page(options.page, "made", *report.BLOCKS)
    filled = report.blocks(*scene, *([options.folder] if options.folder else ()))
    if filled:
        made = made_by(f"uv run python -m verification.reports {options.page}")
        print(page.fill({"made": made} | filled))


if __name__ == "__main__":
    main()
