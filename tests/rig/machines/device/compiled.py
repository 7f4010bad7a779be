"""The walks of walks.c, compiled."""

from __future__ import annotations

import subprocess
from pathlib import Path

from tests.sanitizing import SANITIZERS

ROOT = Path(__file__).parents[4]
CHECKED = ("-O0", *SANITIZERS)
STRICT = ("-Wall", "-Wextra", "-Werror", "-Wno-unused-function")


def compiled_walks(folder: Path, *, checked: bool = False) -> Path:
    """The program; `checked` for every access and overflow."""
    program = folder / "walks"
    folders = [f"rig/machines/{name}" for name in ("device", "board", "force")]
    folders += ["rig/shared/live", "modeling/rendering"]
    command = ["gcc", "-D_GNU_SOURCE", "-std=c99", "-ffp-contract=off", *STRICT]
    command += [*(CHECKED if checked else ("-O2",)), *(f"-I{ROOT / folder}" for folder in folders)]
    source = Path(__file__).with_name("walks.c")
    subprocess.run([*command, str(source), "-o", str(program), "-lm"], check=True)
    return program
