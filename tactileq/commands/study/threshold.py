"""tactileq threshold: from answers to a table of detection thresholds."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tactileq.modeling.errors import counted
from tactileq.options import Data
from tactileq.results import CommandRun, FileResults


def threshold(
    data: Data,
    out: Annotated[Path, typer.Option("--out", help="File for the table (TSV).")] = Path(
        "threshold.tsv"
    ),
    subject: Annotated[
        int | None, typer.Option(min=1, help="One participant; by default the mean of all.")
    ] = None,
) -> None:
    """Estimate detection thresholds from the answers to tactileq session --task threshold.

    The table gives the amplitude (peak, g) at which 75 % of the answers are correct, lapses
    excluded, with a 95 % interval: for one participant, or for the mean (in dB) over all. Where a
    threshold is above the highest amplitude that the rig may present, the table gives that
    amplitude and says so.

    Example: tactileq threshold --data data --subject 1 --out mine.tsv, then tactileq simplify
    models/canvas.json --threshold mine.tsv
    """
    from tactileq.experiments.sessions.bids.export import require_tables
    from tactileq.experiments.tasks.threshold_table import (
        answer_files,
        mean_thresholds,
        read_answers,
        threshold_text,
    )

    if out.suffix != ".tsv":
        raise ValueError(f"expected a file that ends with .tsv, got {out}; rename it.")
    ran = CommandRun("threshold")
    results = FileResults([out], ran.command)
    require_tables(
        data,
        task="threshold",
        subject=subject,
        otherwise="name another participant with --subject",
    )
    ran.reads(*answer_files(data, subject=subject))
    answered = read_answers(data, subject=subject)
    means = mean_thresholds(answered.estimates)
    people = len(answered.estimates)
    text = threshold_text(means, people=people, simulated=answered.simulated)
    settings: dict[str, object] = {"subject": subject, "people": sorted(answered.estimates)}
    results.write({out: text.encode()}, ran.provenance(settings))
    for one in means:
        within = "" if one.interval_db is None else "{:+.1f} to {:+.1f}, ".format(*one.interval_db)
        note_on = f" ({one.note})" if one.note else ""
        print(
            f"{one.frequency_hz:g} Hz: {one.level_db:+.1f} dB re 1 g "
            f"({within}{counted(one.trials, 'trial')}){note_on}"
        )
    simulated = " (simulated)" if answered.simulated else ""
    print(f"threshold of {counted(people, 'person', 'people')}{simulated}: {out}")
