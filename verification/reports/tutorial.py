"""Make the pictures of docs/tutorial.md and of the page of a study with the program itself.

uv run python -m verification.reports.tutorial [tutorial | study]
"""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

import coupling
from coupling.report.page import write_report
from verification.pages import DOCS, docs_page

FIGURES = ("fields", "pressures", "internal_forces")
WIDTH, COLOURS = 1100, 128  # pixels, and colours enough for flat areas and lines
STUDY = {
    "name": "gates", "scene": "quick", "backends": ["beam-spring", "continuum"], "fixed": {"stop.inflow_mass": 60.0},
    "parameters": {"gate.angle": [90.0, 135.0], "soils.0.friction_angle": [25.0, 35.0]},
}  # fmt: skip
#: The report shows its player alone, moved to the end.
ONLY_PLAYER = """<style>main > section:not(#player) { display: none }</style>
<script>addEventListener("load", () => {
  const slider = document.getElementById("slider");
  slider.value = slider.max;
  slider.dispatchEvent(new Event("input", {bubbles: true}));
})</script>"""


def shrink(source, target):
    """Write a picture smaller, with a palette."""
    picture = Image.open(source).convert("RGB")
    if picture.width > WIDTH:
        picture = picture.resize((WIDTH, round(picture.height * WIDTH / picture.width)), Image.Resampling.LANCZOS)
    picture.quantize(COLOURS).save(target, optimize=True)


def shoot(page, target, size):
    """Picture of a report's player, moved to the end; needs a Chromium."""
    browser = next(filter(None, map(shutil.which, ("chromium-headless-shell", "chromium", "google-chrome"))), None)
    if browser is None:
        sys.exit(f"{target.name}: needs chromium, found none; install it and draw again")
    page.write_text(page.read_text(encoding="utf-8").replace("</body>", f"{ONLY_PLAYER}</body>"), encoding="utf-8")
    shot = page.with_suffix(".png")
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--virtual-time-budget=5000"]
    options += [f"--window-size={size}", f"--screenshot={shot}"]
    subprocess.run([browser, *options, page.absolute().as_uri()], check=True)
    shrink(shot, target)


def draw_tutorial(folder, target):
    """Run the scene of the tutorial and draw what it shows."""
    target.mkdir(parents=True, exist_ok=True)
    run = folder / "run"
    coupling.run(coupling.load_scene("quick"), out=run, figures=True)
    for name in FIGURES:
        shrink(run / "figures" / f"{name}.png", target / f"{name}.png")
    shoot(write_report(run), target / "report.png", "1200,1500")


def draw_study(folder, target):
    """Run a study of two gates and two soils and draw the charts of its page."""
    coupling.study(STUDY, folder / "study", workers=0)
    shoot(write_report(folder / "study"), target / "study-report.png", "1400,2150")


def main(what):
    """Draw one group of pictures, or all."""
    docs_page("tutorial")
    images = DOCS / "images"
    with tempfile.TemporaryDirectory() as folder:
        if what in ("", "tutorial"):
            draw_tutorial(Path(folder), images / "tutorial")
        if what in ("", "study"):
            draw_study(Path(folder), images)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "")
