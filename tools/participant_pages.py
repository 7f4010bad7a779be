"""Renews the pictures of docs/participants.md: every page that a participant sees.

python tools/participant_pages.py        (with a screen, or under xvfb-run)
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).parents[1]
SCRIPT = ROOT / "tests/experiments/console/screens_of_all_pages.py"
PICTURES = ROOT / "docs/participants"
SCREEN = "en:1024x768"
SIZE = (640, 480)
COLORS = 24  # of a page: few, and the edges of letters


def main() -> None:
    """Show all pages, and keep each of them small."""
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(
            [sys.executable, str(SCRIPT), folder, SCREEN],
            check=True,
            stdout=subprocess.DEVNULL,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )
        for old in PICTURES.glob("*.png"):
            old.unlink()
        for page in sorted(Path(folder).glob("*.png")):
            small = Image.open(page).convert("RGB").resize(SIZE, Image.Resampling.LANCZOS)
            name = page.name.partition(" ")[0]
            # By what they cover: by the median, a colour that only a line of text has is lost.
            few = small.quantize(COLORS, method=Image.Quantize.MAXCOVERAGE)
            few.save(PICTURES / f"{name}.png", optimize=True)


if __name__ == "__main__":
    main()
