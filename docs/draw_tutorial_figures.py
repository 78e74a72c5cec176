"""Make the pictures of docs/tutorial.md with the program itself: python docs/draw_tutorial_figures.py [folder]."""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

import coupling
from coupling.report.page import write_report

FIGURES = ("fields", "pressures", "internal_forces")
WIDTH, COLOURS = 1100, 128  # pixels, and colours enough for flat areas and lines
#: The report shows its player alone, moved to the end.
ONLY_PLAYER = """<style>main > section:not(#player) { display: none }</style>
<script>addEventListener("load", () => {
  const time = document.getElementById("time");
  time.value = time.max;
  time.dispatchEvent(new Event("input", {bubbles: true}));
})</script>"""


def shrink(source, target):
    """Write a picture smaller, with a palette."""
    picture = Image.open(source).convert("RGB")
    if picture.width > WIDTH:
        picture = picture.resize((WIDTH, round(picture.height * WIDTH / picture.width)), Image.Resampling.LANCZOS)
    picture.quantize(COLOURS).save(target, optimize=True)


def main(target):
    """Run the scene of the tutorial and draw what it shows; the report needs a Chromium."""
    target.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        run = Path(folder) / "run"
        coupling.run(coupling.load_scene("quick"), out=run, figures=True)
        for name in FIGURES:
            shrink(run / "figures" / f"{name}.png", target / f"{name}.png")
        browser = shutil.which("chromium") or shutil.which("google-chrome")
        if browser is None:
            sys.exit("report.png: needs chromium, found none; install it and draw again")
        shot = Path(folder) / "report.png"
        options = ["--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--virtual-time-budget=5000"]
        page = write_report(run)
        page.write_text(page.read_text(encoding="utf-8").replace("</body>", f"{ONLY_PLAYER}</body>"), encoding="utf-8")
        options += ["--window-size=1200,1500", f"--screenshot={shot}"]
        subprocess.run([browser, *options, page.absolute().as_uri()], check=True)
        shrink(shot, target / "report.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "images" / "tutorial")
