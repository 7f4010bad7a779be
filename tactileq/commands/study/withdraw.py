"""tactileq study withdraw and dropout: people who withdraw their data, or drop out."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tactileq.commands.study.status import print_made
from tactileq.modeling.errors import counted
from tactileq.options import Data

Subject = Annotated[int, typer.Argument(metavar="SUBJECT", min=1, help="Number of the person.")]
OfStudy = Annotated[
    Path | None,
    typer.Option("--study", help="Study file (TOML); the data of another study are refused."),
]
Yes = Annotated[bool, typer.Option("--yes", help="Do not ask for confirmation.")]


def study_withdraw(
    subject: Subject, data: Data = Path("data"), study: OfStudy = None, yes: Yes = False
) -> None:
    """Delete all data of a person; the number is not reused, the slot goes to a replacement.

    Example: tactileq study withdraw 7 --data data
    """
    from tactileq.experiments.sessions.store.withdrawing import files_of, withdraw

    _require(data, study)
    files = counted(len(files_of(data, subject)), "file")
    _confirm(f"Permanently delete {files} of subject {subject} in {data}?", yes=yes)
    made = withdraw(data, subject)
    print(f"withdrawn: subject {subject}; {files} deleted, the slot is free")
    print("Copies elsewhere, such as in backups and reports, you have to delete yourself.")
    print_made(made)


def study_dropout(
    subject: Subject, data: Data = Path("data"), study: OfStudy = None, yes: Yes = False
) -> None:
    """Record that a person dropped out: the data stay, the slot goes to a replacement.

    Example: tactileq study dropout 7 --data data
    """
    from tactileq.experiments.sessions.store.withdrawing import drop_out

    _require(data, study)
    _confirm(f"Give the slot of subject {subject} to somebody else?", yes=yes)
    made = drop_out(data, subject)
    print(f"dropped out: subject {subject}; the data stay, the slot is free")
    print_made(made)


def _require(data: Path, study: Path | None) -> None:
    """Refuse the data of another study than the one that is named."""
    from tactileq.experiments.sessions.kept.data_set import require_study
    from tactileq.experiments.study.study import Study

    if study is not None:
        require_study(data, Study.load(study))


def _confirm(question: str, *, yes: bool) -> None:
    if not (yes or typer.confirm(question)):
        raise ValueError("expected y to continue, got no; nothing was changed.")
