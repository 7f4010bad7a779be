"""Enrols somebody as a session does, without the session."""

from __future__ import annotations

from typing import Any

from tactileq.experiments.sessions.kept.roster import Roster, RosterEntry


def enrolled(roster: Roster, subject: int | None, participants: int, **kind: Any) -> RosterEntry:
    with roster.enrolling(subject, participants, **kind) as person:
        return person
