"""tactileq study plan: the page to preregister."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tactileq.commands.study.check import loaded
from tactileq.options import StudyArgument
from tactileq.results import CommandRun, FileResults


def study_plan(
    path: StudyArgument,
    out: Annotated[Path, typer.Option("--out", help="File for the page (Markdown).")] = Path(
        "plan.md"
    ),
) -> None:
    """Write the page to preregister: question, design, models, claims, exclusions.

    Its SHA-256 is stored in the description of every session.

    Example: tactileq study plan study.toml --out plan.md
    """
    from tactileq.experiments.study.study import plan_sha256
    from tactileq.experiments.tasks.page import plan_page

    if out.suffix.lower() != ".md":
        raise ValueError(f"expected a name that ends in .md, got {out}; rename it.")
    ran = CommandRun("study plan")
    results = FileResults([out], ran.command)
    plan, sets = loaded(path, ran.reads)
    sha256 = plan_sha256(plan, sets.sha256(plan.textures))
    settings = {"study_sha256": plan.sha256, "plan_sha256": sha256}
    results.write({out: plan_page(plan, sets).encode()}, ran.provenance(settings))
    print(f"plan {sha256[:12]}…: {out}")
