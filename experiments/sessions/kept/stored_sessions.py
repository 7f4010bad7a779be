"""The sessions of a data set as they are read: those that can be, and those that are damaged.

What a session stored is checked here, once, before anything is made of it. Damage costs the session
whose file is damaged and no other one (docs/method/protocols.md#damage).
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tactileq.experiments.sessions.kept.files import SessionFiles, sessions_in
from tactileq.experiments.sessions.kept.log import Event
from tactileq.experiments.sessions.kept.manifest import SessionManifest
from tactileq.experiments.sessions.kept.state import SessionState, session_state
from tactileq.modeling import InputError
from tactileq.modeling.errors import shown
from tactileq.modeling.files.answer_tables import ANSWER_TABLES
from tactileq.modeling.files.reading import read_bytes


@dataclass(frozen=True, kw_only=True)
class StoredSession:
    """One session that there is: its files, its manifest, and how it stands."""

    files: SessionFiles
    manifest: SessionManifest
    state: SessionState

    @property
    def running(self) -> bool:
        """Whether a process runs it now."""
        return self.state.status == "running"


@dataclass(frozen=True, kw_only=True)
class Damaged:
    """One session whose manifest or log cannot be read, and why, in one sentence."""

    files: SessionFiles
    sentence: str


def held_session(files: SessionFiles) -> StoredSession:
    """Read one session.

    Raises
    ------
    InputError
        If its manifest or its log cannot be read, they do not belong together, or an answer
        cannot be one of its task.
    """
    # The log first: a session that begins meanwhile has its manifest by then.
    state = session_state(files.log)
    manifest = SessionManifest.load(files.manifest)
    _check_place(manifest, files)
    _check_logged(state.events, files)
    stored = read_bytes(files.manifest, "the manifest of a session")
    check_named(state.events, files, sha256=hashlib.sha256(stored).hexdigest())
    _check_sealed(manifest, state.events, files)
    _check_rows(state.events, files)
    return StoredSession(files=files, manifest=manifest, state=state)


def held_sessions(data_folder: str | Path) -> tuple[list[StoredSession], list[Damaged]]:
    """All sessions of a data set that have a manifest, by subject, session and task."""
    return held_of(sessions_in(data_folder))


def held_of(sessions: Iterable[SessionFiles]) -> tuple[list[StoredSession], list[Damaged]]:
    """These sessions, in their order."""
    held, damaged = [], []
    for files in sessions:
        try:
            held.append(held_session(files))
        except InputError as error:
            damaged.append(Damaged(files=files, sentence=str(error)))
    return held, damaged


def participants_of(sessions: Iterable[StoredSession | Damaged]) -> frozenset[str]:
    """Whose sessions these are, as sub-01."""
    return frozenset(one.files.participant for one in sessions)


def _check_logged(events: Sequence[Event], files: SessionFiles) -> None:
    """Refuse a session of which only the tables are left: begun again, it would replace them."""
    if not events and files.answers.is_file():
        raise InputError(
            f"expected the log of the answers in {files.answers} at {files.log}, got none; restore "
            "that file from a copy."
        )


def check_named(events: Sequence[Event], files: SessionFiles, *, sha256: str) -> None:
    """Refuse a manifest of this hash where the log did not begin with it."""
    if events and (named := events[0]["manifest_sha256"]) != sha256:
        raise InputError(
            f"expected the manifest {named[:8]}… that {files.log} names, got {sha256[:8]}… in "
            f"{files.manifest}; restore that file from a copy."
        )


def _check_sealed(manifest: SessionManifest, events: Sequence[Event], files: SessionFiles) -> None:
    """Refuse a log without seals where the program that began it wrote some."""
    if manifest.after is not None and events and "seal" not in events[0]:
        raise InputError(
            f"expected a log with seals, as that of every session whose manifest names the one "
            f"before, got none in {files.log}; restore that file from a copy."
        )


def _check_place(manifest: SessionManifest, files: SessionFiles) -> None:
    named = manifest.files(files.root)
    if named != files or files.task not in ANSWER_TABLES:
        raise InputError(
            f"expected the manifest of {files.stem}, a session of a task of "
            f"{', '.join(ANSWER_TABLES)}, in {files.manifest}, got that of {shown(named.stem)}; "
            "restore the file from a copy, or update tactileq if the session is newer."
        )


def _check_rows(events: Iterable[Event], files: SessionFiles) -> None:
    for event in events:
        if event["event"] == "answer" and (wrong := wrong_in(event["row"], files.task)):
            raise InputError(
                f"expected an answer to the task {files.task} in line {event['n']} of {files.log}, "
                f"got {wrong}; restore the file from a copy."
            )


def wrong_in(row: Mapping[str, Any], task: str) -> str:
    """The first invalid value of an answer to this task; empty where there is none."""
    for column in ANSWER_TABLES[task].columns:
        if not column.holds(value := row.get(column.name)):
            return f"{column.name} = {shown(value)}"
    return ""
