"""Whether answers are those to the trials that were planned."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import pandas as pd

from modeling import InputError
from modeling.files.hashes import sha256_of
from modeling.files.reading import read_text


def planned_trials(
    stored: Mapping[str, object], session: tuple[str, str, str], *, path: Path
) -> list[Mapping[str, object]]:
    """The trials of a stored order, which must be that of its own session.

    Parameters
    ----------
    stored : mapping
        What the file of the order holds.
    session : (str, str, str)
        Participant, session and task, as its folders and its name say.
    path : Path
        The file, for what is said of it.

    Raises
    ------
    InputError
        Where it holds no trials, or is the order of another session.
    """
    trials = stored.get("trials")
    if not isinstance(trials, list) or not all(isinstance(trial, Mapping) for trial in trials):
        raise InputError(f"expected a list of trials in {path}, found none; restore the file.")
    numbers = {"sub": stored.get("subject"), "ses": stored.get("session")}
    found = (*(_numbered(key, number) for key, number in numbers.items()), str(stored.get("task")))
    if found != session:
        raise InputError(
            f"expected the order of {' '.join(session)} in {path}, found that of "
            f"{' '.join(found)}; move the session's files back to their own participant's folder."
        )
    return trials


def check_stored(
    stored: Mapping[str, object], path: Path, *, sidecar: Mapping[str, object], study: object
) -> None:
    """Refuse an order that was changed since, or that is of another study than the data set.

    Parameters
    ----------
    stored : mapping
        What the file of the order holds.
    path : Path
        The file.
    sidecar : mapping
        Of the session's answers; it names the order by its SHA-256.
    study : object
        SHA-256 of the data set's study, None where it is not stated.

    Raises
    ------
    InputError
    """
    if study is not None and stored.get("study_sha256", study) != study:
        raise InputError(
            f"expected an order of the data set's study in {path}, found that of another; restore "
            "the file."
        )
    named = sidecar.get("OrderSHA256")
    if named is not None and named != sha256_of(read_text(path, "the order of a session")):
        raise InputError(
            f"expected the order in {path} as it was stored before the session, found a changed "
            "one; restore the file."
        )


def _numbered(key: str, number: object) -> str:
    return f"{key}-{number:02d}" if isinstance(number, int) else f"{key}-{number}"


def told_of_unordered(sessions: Sequence[str]) -> list[str]:
    """One sentence on sessions without a stored order; none where there are none."""
    if not sessions:
        return []
    if len(sessions) == 1:
        who = f"{sessions[0]} has no stored order with which its"
    else:
        several = f"{len(sessions)} sessions ({sessions[0]} and others)"
        who = f"{several} have no stored order with which their"
    return [f"{who} answers could be compared."]


def with_repeats(
    table: pd.DataFrame, planned: Sequence[Mapping[str, object]]
) -> list[Mapping[str, object]]:
    """The trials that a session had to have, given which of its answers are not valid.

    Each invalid trial is repeated once, with the next free number, at the end of its phase.

    Parameters
    ----------
    table : DataFrame
        The answers of one session, checked, in the order of the file.
    planned : sequence of mapping
        The trials of the stored order.
    """
    valid = table["valid"].tolist()
    expected: list[Mapping[str, object]] = []
    number = len(planned)
    for _, phase in groupby(planned, key=lambda trial: trial.get("phase")):
        failed = []
        for trial in phase:
            if len(expected) < len(valid) and valid[len(expected)] == 0:
                failed.append(trial)
            expected.append({**trial, "repeats": None})
        for trial in failed:
            number += 1
            expected.append({**trial, "trial": number, "repeats": trial.get("trial")})
    return expected


def check_order(
    table: pd.DataFrame, planned: Sequence[Mapping[str, object]] | None, *, path: Path
) -> None:
    """Refuse answers that do not follow the order that was stored before the first trial.

    Parameters
    ----------
    table : DataFrame
        The answers of one session, checked, a row per trial in the order of the file.
    planned : sequence of mapping, optional
        The trials of the stored order with those that were to be repeated (`with_repeats`): every
        column that a trial and its answer share. Nothing is compared without it.
    path : Path
        The file of the answers, for what is said of them.

    Raises
    ------
    InputError
        For more answers than trials, and for the first row that is not the answer to the trial
        in its place: another number, phase, texture, model, tray, first surface or layout, or
        another trial that it repeats.
    """
    if planned is None:
        return
    if len(table) > len(planned):
        raise InputError(
            f"expected at most {len(planned)} answers in {path}, as the session's stored order "
            f"has trials, repeated ones included, but found {len(table)}; restore the file."
        )
    rows = table.to_dict("records")
    for number, (row, trial) in enumerate(zip(rows, planned, strict=False), start=1):
        for column, value in trial.items():
            if column in row and not _same(row[column], value):
                raise InputError(
                    f"expected {column} {_shown(value)} in answer {number} of {path}, as the "
                    f"session's stored order says, but found {_shown(row[column])}; restore the "
                    "file, or leave its session out."
                )


def _same(answered: Any, planned: object) -> bool:
    if planned is None:
        return bool(pd.isna(answered))
    if isinstance(planned, list):  # a layout
        planned = "|".join(map(str, planned))
    return bool(answered == planned)


def _shown(value: Any) -> str:
    if isinstance(value, list):
        return "|".join(map(str, value))
    if value is None or pd.isna(value):
        return "n/a"
    return f"{value:g}" if isinstance(value, float) else str(value)
