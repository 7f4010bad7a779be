"""tactileq study init: a study file to begin with."""

from __future__ import annotations

import os
import secrets
from pathlib import Path
from typing import Annotated

import typer

HIGHEST_SEED = 2**53  # what every reader of numbers holds exactly


def study_init(
    path: Annotated[Path, typer.Argument(metavar="PATH", help="The study file (TOML) to write.")],
) -> None:
    """Write a commented study file, the paper's design with a freshly drawn seed.

    Example: tactileq study init study.toml
    """
    from experiments.study.study import SHIPPED_STUDY, Study
    from modeling.files.writing import write_text

    if os.path.lexists(path):
        raise ValueError(
            f"expected a new file at {path}, got one that is there already; choose another name."
        )
    if path.suffix != ".toml":
        raise ValueError(f"expected a name that ends in .toml, got {path}; rename it.")
    shipped = SHIPPED_STUDY.read_text(encoding="utf-8")
    text = shipped.replace("\nseed = 1 ", f"\nseed = {secrets.randbelow(HIGHEST_SEED)} ")
    write_text(path, text)
    Study.load(path)
    print(f"study file: {path}")
    print("Name your textures, trays, models and people in it, then: tactileq study check", path)
