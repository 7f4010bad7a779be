"""tactileq rig check: what is connected, known and missing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tactileq.options import RigPath

if TYPE_CHECKING:
    import datetime

    from rich.console import Console

    from tactileq.rig.desk.inventory import Finding
    from tactileq.rig.shared.setup.rig_file import RigFile

_MARKS = {"ok": "", "note": "note", "fault": "fault"}
_STYLES = {"ok": "", "note": "yellow", "fault": "bold red"}


def rig_check(
    rig: RigPath = Path("rig.toml"),
    study: Annotated[
        Path | None,
        typer.Option(
            "--study",
            help="Study file (TOML) whose sessions are to run; by default one that says nothing of "
            "rigs, and whose models fit.",
        ),
    ] = None,
) -> None:
    """Show what is connected, each figure of the rig file, and what is missing for a study.

    Nothing is played. The rig is judged as a session without --override judges it. If no study can
    run, the exit code is 1 and the last lines say why.

    Example: tactileq rig check --rig rig.toml

    Example: tactileq rig check --rig rig.toml --study study.toml
    """
    import datetime
    from functools import partial

    from rich.console import Console

    from tactileq.rig.desk.inventory import (
        connected_input,
        connected_sound,
        of_rig,
        remedies,
        versions,
    )

    console = Console()
    today = datetime.date.today()
    refused_by = None if study is None else partial(_refused_by, study, today=today)
    loaded, of_file = of_rig(rig, today=today, refused_by=refused_by)
    parts = {
        "Versions": versions(),
        "Sound devices": connected_sound(),
        "Hand": connected_input(),
        f"Rig ({rig})": of_file,
    }
    for title, findings in parts.items():
        _show(console, title, findings)
    if loaded is not None:
        _show_figures(console, loaded)
    every = [finding for findings in parts.values() for finding in findings]
    faults = [finding for finding in every if finding.state == "fault"]
    console.print(f"Judged by {_judged_by(study)}.", markup=False)
    for fault in faults:
        console.print(
            f"no study can run: {fault.name}: {fault.sentence}", style="red", markup=False
        )
    for line in remedies(every):
        console.print(f"    {line}", markup=False, soft_wrap=True)
    if faults:
        raise typer.Exit(1)
    console.print("A study can run on this rig.")


def _refused_by(study: Path, rig: RigFile, *, today: datetime.date) -> Mapping[str, str]:
    """Why sessions of this study refuse a rig."""
    from tactileq.experiments.study.models import ModelSets, load_model_sets
    from tactileq.experiments.study.rigs import refusals_of
    from tactileq.experiments.study.study import Study
    from tactileq.modeling import InputError

    try:
        plan = Study.load(study)
    except InputError as error:
        return {"study": str(error)}
    try:
        models = load_model_sets(plan, study.parent)
        models.require(plan)
    except InputError as error:
        refused = refusals_of(plan, ModelSets(sets={}), rig, today=today)
        return {**refused, "models": str(error)}
    return refusals_of(plan, models, rig, today=today)


def _judged_by(study: Path | None) -> str:
    from tactileq.rig.desk.checks import Requirements

    if study is not None:
        return f"what {study} requires, and by its models"
    usual = Requirements()
    return (
        f"the defaults of a study: a calibration of the last {usual.calibration_days:g} days, "
        "force measured or assumed, models that fit; --study judges by yours"
    )


def _show(console: Console, title: str, findings: Sequence[Finding]) -> None:
    from rich.table import Table
    from rich.text import Text

    table = Table(
        title=Text(title), title_justify="left", box=None, show_header=False, pad_edge=False
    )
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    table.add_column(justify="right", no_wrap=True)
    for finding in findings:
        style = _STYLES[finding.state]
        table.add_row(
            Text(finding.name),
            # Faults are listed below, in full.
            Text("" if finding.state == "fault" else finding.sentence, style=style),
            Text(_MARKS[finding.state], style=style),
        )
    if not findings:
        table.add_row("none", "", "")
    console.print(table)
    console.print()


def _show_figures(console: Console, rig: RigFile) -> None:
    from rich.table import Table
    from rich.text import Text

    from tactileq.rig.shared.setup.figures import Curve

    table = Table(title="Figures", title_justify="left", box=None, pad_edge=False)
    table.add_column("figure", no_wrap=True)
    table.add_column("value", justify="right", no_wrap=True)
    table.add_column("unit", no_wrap=True)
    table.add_column("", no_wrap=True)
    table.add_column("source", overflow="fold")
    for name, figure in rig.figures().items():
        value = (
            f"{figure.points[0][1]:g}–{figure.points[-1][1]:g}"
            if isinstance(figure, Curve)
            else f"{figure.value:.4g}"
        )
        known = Text("assumed", style="yellow") if figure.assumed else Text("measured")
        table.add_row(name, value, figure.unit, known, Text(figure.source))
    console.print(table)
    console.print()
