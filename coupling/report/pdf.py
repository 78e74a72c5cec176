"""A page as PDF, printed by an installed Chromium or Chrome without a window."""

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from coupling.refused import Refused

NAMES = (
    "chromium-headless-shell", "chrome-headless-shell", "chromium", "chromium-browser", "google-chrome",
    "google-chrome-stable", "microsoft-edge",
)  # fmt: skip
ON_MACOS = "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome"
SECONDS = 180.0  # the page is drawn within a few on a free machine
TITLE = "Gushing into a tunnel"  # every page's title begins so


def find_browser() -> str:
    """Path of a browser that prints.

    Raises Refused: none is installed.
    """
    found = next((path for name in (*NAMES, ON_MACOS) if (path := shutil.which(name))), None)
    if found is None:
        raise Refused(
            "report --pdf: needs Chromium or Chrome, none is on the PATH; install one (Debian: apt-get install "
            "chromium-headless-shell), or open the page in a browser and print it there"
        )
    return found


def print_page(page: Path, browser: str) -> Path:
    """Print a report as PDF beside it, of the same name; returns its path.

    Raises Refused: there is a file of that name that is no printed report, or the browser prints nothing.
    """
    pdf = page.with_suffix(".pdf")
    if pdf.exists() and not _is_printed(pdf):
        raise Refused(f"report '{pdf}': exists and is no report of this program; choose another --out")
    with tempfile.TemporaryDirectory(prefix="gush-browser-") as folder:
        printed = Path(folder) / "page.pdf"
        command = [
            browser, "--headless", "--disable-gpu", "--disable-dev-shm-usage", "--disable-background-networking",
            # the sandbox of the browser does not start for root; the page asks for nothing but itself
            *(["--no-sandbox"] if getattr(os, "geteuid", lambda: 1)() == 0 else []), f"--user-data-dir={folder}",
            "--virtual-time-budget=20000", "--no-pdf-header-footer", f"--print-to-pdf={printed}",
            page.absolute().as_uri(),
        ]  # fmt: skip
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=SECONDS, check=False)
            why = done.stderr.strip().splitlines()[-1:] or [f"exit code {done.returncode}"]
        except subprocess.TimeoutExpired:
            why = [f"no answer within {SECONDS:g} s"]
        if not printed.is_file():
            raise Refused(f"report --pdf: {browser} printed nothing ({why[0]}); open the page and print it there")
        shutil.move(printed, pdf)
    return pdf


def _is_printed(pdf):
    content = pdf.read_bytes()
    return TITLE.encode() in content or TITLE.encode("utf-16-be").hex().upper().encode() in content
