"""The state of a session, according to its log."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from tactileq.experiments.sessions.kept.files import lock_of
from tactileq.experiments.sessions.kept.log import Event, Log, read_log
from tactileq.modeling.files.locks import is_held

Status = Literal["running", "complete", "aborted", "crashed"]


@dataclass(frozen=True, kw_only=True)
class SessionState:
    """How a session stands.

    Parameters
    ----------
    status : {"running", "complete", "aborted", "crashed"}
        Crashed if no process runs it and its last start has no recorded end.
    events : tuple of dict
        All of the log's.
    rows : tuple of dict
        Of the answers, in the order in which they were given.
    runs : int
        How often it was begun or taken up again.
    begun_utc, last_utc : str
        When its first and its last event happened; empty before the first.
    reason, by : str
        Of its end: why, and by whom; empty where there is none on record.
    cut : bool
        Whether the log ends with half a line, which counts as not written.
    """

    status: Status
    events: tuple[Event, ...]
    rows: tuple[dict[str, Any], ...]
    runs: int
    begun_utc: str
    last_utc: str
    reason: str
    by: str
    cut: bool


def session_state(log_path: str | Path) -> SessionState:
    """How the session with this log stands; crashed where it was killed before it had a log.

    Raises
    ------
    InputError
        If the log cannot be read.
    """
    path = Path(log_path)
    if not os.path.lexists(path):
        return state_of(Log(()), running=False)
    # Asked first: a session that ends meanwhile is then read with its end.
    running = is_running(path)
    return state_of(read_log(path), running=running)


def state_of(log: Log, *, running: bool) -> SessionState:
    """How a session with these events stands, if somebody is or is not running it."""
    runs = [event for event in log.events if event["event"] == "opened"]
    last_run = runs[-1]["n"] if runs else 0
    ended = [e for e in log.events if e["event"] == "ended" and e["n"] > last_run]
    end = ended[-1] if ended else {}
    return SessionState(
        status=end.get("status", "running" if running else "crashed"),
        events=log.events,
        rows=tuple(event["row"] for event in log.events if event["event"] == "answer"),
        runs=len(runs),
        begun_utc=log.events[0]["utc"] if log.events else "",
        last_utc=log.events[-1]["utc"] if log.events else "",
        reason=str(end.get("reason", "")),
        by=str(end.get("by", "")),
        cut=bool(log.cut),
    )


def is_running(log_path: Path) -> bool:
    """Whether a process holds the lock of a session."""
    lock = lock_of(log_path)
    for _ in range(5):
        if not is_held(lock):
            return False
        time.sleep(0.01)  # another one may only have asked the same
    return True
