"""Whether answers belong to the planned trials (docs/method/protocols.md#order)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from tactileq.modeling import InputError
from tactileq.modeling.files.columns import shortened_hash
from tactileq.modeling.files.hashes import sha256_of
from tactileq.modeling.files.reading import read_text

Planned = Mapping[str, Any]


def planned_trials(
    manifest: Mapping[str, object], session: tuple[str, str, str], *, path: Path
) -> list[Planned]:
    """The trials of a session's manifest, which must be that of its own session.

    Parameters
    ----------
    manifest : mapping
        What the file holds.
    session : (str, str, str)
        Participant, session and task, as its folders and its name say.
    path : Path
        The file, for what is said of it.

    Raises
    ------
    InputError
        Where it holds no trials, or is the manifest of another session.
    """
    trials = manifest.get("trials")
    if not isinstance(trials, list) or not all(_is_numbered(trial) for trial in trials):
        raise InputError(f"expected a list of trials in {path}, found none; restore the file.")
    numbers = {"sub": manifest.get("subject"), "ses": manifest.get("session")}
    found = (
        *(_numbered(key, number) for key, number in numbers.items()),
        str(manifest.get("task")),
    )
    if found != session:
        raise InputError(
            f"expected the manifest of {' '.join(session)} in {path}, found that of "
            f"{' '.join(found)}; move the session's files back to their own participant's folder."
        )
    return trials


def _is_numbered(trial: object) -> bool:
    return isinstance(trial, Mapping) and isinstance(trial.get("trial"), int) and "phase" in trial


def check_manifest(
    manifest: Mapping[str, object], path: Path, *, sidecar: Mapping[str, Any]
) -> None:
    """Refuse a manifest that was changed since, or that is of another study than its answers.

    Parameters
    ----------
    manifest : mapping
        What the file holds.
    path : Path
        The file.
    sidecar : mapping
        Of the session's answers; it names study and manifest by SHA-256.

    Raises
    ------
    InputError
    """
    study = sidecar.get("StudySHA256")
    if study is not None and (found := manifest.get("study_sha256", study)) != study:
        raise InputError(
            f"expected the study {shortened_hash(str(study))} of the session's answers in {path}, "
            f"got {shortened_hash(str(found))}; restore the file."
        )
    sources = sidecar.get("DerivedFrom")
    named = sources.get("manifest") if isinstance(sources, Mapping) else None
    if named is not None and named != (
        found := sha256_of(read_text(path, "the manifest of a session"))
    ):
        raise InputError(
            f"expected the manifest {shortened_hash(str(named))} in {path}, as it was stored "
            f"before the session, got {shortened_hash(str(found))}; restore the file."
        )


def _numbered(key: str, number: object) -> str:
    return f"{key}-{number:02d}" if isinstance(number, int) else f"{key}-{number}"


def unordered_warnings(sessions: Sequence[str]) -> list[str]:
    """One sentence on sessions without a manifest; none where there are none."""
    if not sessions:
        return []
    if len(sessions) == 1:
        who = f"{sessions[0]} has no manifest with whose order its"
    else:
        several = f"{len(sessions)} sessions ({sessions[0]} and others)"
        who = f"{several} have no manifest with whose order their"
    return [f"{who} answers could be compared."]


def open_sessions_warning(table: pd.DataFrame, planned: Sequence[Planned]) -> str | None:
    """How many main trials were answered, where some were not; a failed one must be repeated.

    Parameters
    ----------
    table : DataFrame
        The answers of one session, checked, perhaps without rows and columns.
    planned : sequence of mapping
        The trials of the manifest.
    """
    main = [trial["trial"] for trial in planned if trial["phase"] == "main"]
    if table.columns.empty:
        return f"answered 0 of {len(main)} main trials (ended early)."
    rows = table[table["phase"] == "main"]
    first = rows["repeats"].isna()
    owed = len(main) + int((rows["valid"][first] == 0).sum())
    return (
        None if len(rows) == owed else f"answered {len(rows)} of {owed} main trials (ended early)."
    )


def check_order(table: pd.DataFrame, planned: Sequence[Planned] | None, *, path: Path) -> None:
    """Refuse answers that do not follow the order that was stored before the first trial.

    Planned trials are answered in their order; of the training ones the first few suffice. A main
    trial that was not valid is answered once more after all others. Training may begin again. What
    is answered again has the next free number, and names its trial under `repeats`.

    Parameters
    ----------
    table : DataFrame
        The answers of one session, checked, a row per trial in the order of the file.
    planned : sequence of mapping, optional
        The trials of the manifest: every column that a trial and its answer share. Nothing is
        compared without it.
    path : Path
        The file of the answers, for what is said of them.

    Raises
    ------
    InputError
        For the first row that is not the answer to a trial that could come in its place: another
        number, phase, texture, model, tray, first surface or layout.
    """
    if planned is None:
        return
    follow = _Following(planned)
    for place, row in enumerate(table.to_dict("records"), start=1):
        wrong = follow.wrong_in({str(name): value for name, value in row.items()})
        if wrong is not None:
            column, expected = wrong
            raise InputError(
                f"expected {column} {_shown(expected)} in answer {place} of {path}, as the "
                f"session's manifest says, but found {_shown(row[column])}; restore the file, "
                "or leave its session out."
            )


class _Following:
    """Follows the answers of a session, row by row."""

    def __init__(self, planned: Sequence[Planned]) -> None:
        self._planned = {trial["trial"]: trial for trial in planned}
        self._training = [trial["trial"] for trial in planned if trial["phase"] != "main"]
        self._main = [trial["trial"] for trial in planned if trial["phase"] == "main"]
        self._free = max(self._planned, default=0) + 1
        self._failed: list[int] = []
        self._run = 1.0

    def wrong_in(self, row: Mapping[str, Any]) -> tuple[str, object] | None:
        """The first column with another value than it had to have, and that value."""
        if row["run"] < self._run:
            return "run", self._run
        self._run = row["run"]
        wrong = self._wrong_first(row) if pd.isna(row["repeats"]) else self._wrong_again(row)
        if wrong is not None:
            return wrong
        number = row["trial"] if pd.isna(row["repeats"]) else row["repeats"]
        trial = {**self._planned[number], "trial": row["trial"]}
        for column, value in trial.items():
            if column in row and not _same(row[column], value):
                return column, value
        return None

    def _wrong_first(self, row: Mapping[str, Any]) -> tuple[str, object] | None:
        """Of an answer to a planned trial."""
        open_ = self._training if row["trial"] in self._training else self._main
        if not open_:  # all were answered
            return "repeats", self._failed[0] if self._failed else "the number of a planned trial"
        if row["trial"] != open_[0]:
            return "trial", open_[0]
        open_.pop(0)
        if open_ is self._main:
            self._training.clear()
            if row["valid"] == 0:
                self._failed.append(row["trial"])
        return None

    def _wrong_again(self, row: Mapping[str, Any]) -> tuple[str, object] | None:
        """Of an answer to a trial that was presented once more."""
        if row["trial"] != self._free:
            return "trial", self._free
        self._free += 1
        trial = self._planned.get(row["repeats"])
        if trial is None:
            return "repeats", None
        if trial["phase"] != "main":
            return None
        if self._main or row["repeats"] not in self._failed:
            return "repeats", self._failed[0] if self._failed and not self._main else None
        self._failed.remove(row["repeats"])
        return None


def _same(answered: Any, planned: object) -> bool:
    if planned is None:  # left open: an adaptive task draws it from the answers
        return True
    if planned in ("", "n/a"):
        return bool(pd.isna(answered))
    if isinstance(planned, list):  # a layout
        planned = "|".join(map(str, planned))
    return bool(answered == planned)


def _shown(value: Any) -> str:
    if isinstance(value, list):
        return "|".join(map(str, value))
    if value in (None, "", "n/a") or pd.isna(value):
        return "n/a"
    return f"{value:g}" if isinstance(value, float) else str(value)
