"""What is left to do in a session that was aborted or interrupted.

docs/method/protocols.md#resuming
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from tactileq.experiments.sessions.kept.log import Event, now_utc
from tactileq.experiments.sessions.kept.manifest import SessionManifest
from tactileq.experiments.sessions.kept.state import SessionState

Planned = Mapping[str, Any]

# That somebody starts a session again ends no break: what the participant does there ends it.
_ACTIVE = ("presented", "slider", "chosen", "answer")


@dataclass(frozen=True, kw_only=True)
class Resumption:
    """What is left to do.

    Parameters
    ----------
    next_trials : tuple of mapping
        The planned trials that have no answer yet, in their order, as the manifest holds them. No
        training trials once training was over, or where it is due again.
    to_repeat : tuple of mapping
        The planned trials that the rig failed in, and that were not repeated yet.
    next_number : int
        The next free number for a trial that is not planned.
    run : int
        The number of the run that begins now.
    training_due : bool
        Whether training comes first again: the break was long, or training that was begun for that
        reason is not over. Its rows get free numbers and name the planned trial under `repeats`.
    rows : tuple of mapping
        The answers so far.
    """

    next_trials: tuple[Planned, ...]
    to_repeat: tuple[Planned, ...]
    next_number: int
    run: int
    training_due: bool
    rows: tuple[Mapping[str, Any], ...]


def resumption(
    manifest: SessionManifest,
    state: SessionState,
    *,
    longest_gap_min: float,
    now: datetime | None = None,
) -> Resumption:
    """What is left to do in a session.

    Parameters
    ----------
    state : SessionState
        Before the run that begins now.
    longest_gap_min : float
        > 0; after a longer break training is due again (min).
    now : datetime, optional
        With its time zone; the present moment without it.
    """
    answered = {row["trial"]: row for row in state.rows}
    main = [trial for trial in manifest.trials if trial["phase"] != "training"]
    begun_main = any(trial["trial"] in answered for trial in main)
    over = begun_main or _said(state.events, "training_over")
    gap = _is_long(_last_active(state.events), now or now_utc(), longest_gap_min)
    again = gap or _broke_off(state.events)
    open_ = main if over or (again and answered) else manifest.trials
    next_trials = tuple(trial for trial in open_ if trial["trial"] not in answered)
    to_repeat = _owed(open_, state.rows)
    has_training = len(main) < len(manifest.trials)
    left = bool(next_trials or to_repeat)
    return Resumption(
        next_trials=next_trials,
        to_repeat=to_repeat,
        next_number=max([len(manifest.trials), *answered]) + 1,
        run=state.runs + 1,
        training_due=bool(answered) and has_training and again and left,
        rows=state.rows,
    )


def _owed(trials: Sequence[Planned], rows: Sequence[Mapping[str, Any]]) -> tuple[Planned, ...]:
    """Of these trials those whose answer is not valid and was not repeated."""
    failed = {row["trial"] for row in rows if not row["valid"]}
    repeated = {row.get("repeats") for row in rows}
    return tuple(trial for trial in trials if trial["trial"] in failed - repeated)


def _said(events: Sequence[Event], name: str) -> bool:
    return any(event["event"] == name for event in events)


def _broke_off(events: Sequence[Event]) -> bool:
    """Whether training was begun again and is not over yet."""
    for event in reversed(events):
        if event["event"] == "training_over":
            return False
        if event["event"] == "phase":
            return event.get("phase") == "training" and bool(event.get("again"))
    return False


def _last_active(events: Sequence[Event]) -> str:
    """When the participant last felt or did something; empty before."""
    return next((e["utc"] for e in reversed(events) if e["event"] in _ACTIVE), "")


def _is_long(last_utc: str, now: datetime, longest_gap_min: float) -> bool:
    """Whether a break was long, or cannot be known, since the clock was set back meanwhile."""
    if not last_utc:
        return False
    gap_min = (now - datetime.fromisoformat(last_utc)).total_seconds() / 60
    return gap_min > longest_gap_min or gap_min < 0
