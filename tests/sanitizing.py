"""What compilers check at run time of what C leaves undefined: memory, overflow, conversions."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
# The third is in none of the others: a float that no integer of the wanted type can hold.
SANITIZERS = (
    "-fsanitize=address,undefined,float-cast-overflow",
    "-fno-sanitize-recover=all",
)
# Loaded by each Python that begins with its folder on the path: the checked parts take the place
# of the installed ones, in processes that tests start, too.
_IN_PLACE = """
import importlib.abc, importlib.util, pathlib, sys

class Checked(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        place = pathlib.Path(__file__).parent.joinpath(*name.split("."))
        files = place.parent.glob(f"{place.name}.*")
        return next((importlib.util.spec_from_file_location(name, file) for file in files), None)

sys.meta_path.insert(0, Checked())
"""


def checked_parts(folder: Path) -> Path:
    """The C parts with everything checked, as `with_checked_parts` wants them."""
    compiler = folder / "checked-gcc"
    compiler.write_text(f'#!/bin/sh\nexec gcc "$@" -O1 {" ".join(SANITIZERS)}\n', encoding="utf-8")
    compiler.chmod(0o755)
    built = folder / "built"
    places = ["--build-temp", folder / "temp", "--build-lib", built]
    subprocess.run(
        [sys.executable, "setup.py", "-q", "build_ext", *places],
        cwd=ROOT,
        env={**os.environ, "CC": str(compiler)},
        check=True,
        capture_output=True,
    )
    (built / "sitecustomize.py").write_text(_IN_PLACE, encoding="utf-8")
    return built


def with_checked_parts(built: Path) -> dict[str, str]:
    """The environment of a Python that uses them; what it forgets itself is not counted."""
    found = subprocess.run(
        ["gcc", "-print-file-name=libasan.so"], check=True, capture_output=True, text=True
    )
    return {
        **os.environ,
        "PYTHONPATH": str(built),
        "LD_PRELOAD": found.stdout.strip(),
        "ASAN_OPTIONS": "detect_leaks=0",
        "PYTHONMALLOC": "malloc",  # what C is given then has bounds, too
    }
