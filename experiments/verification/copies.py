"""Sessions that copy another's times: no two people press at the same microseconds.

docs/method/verification.md#copies
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

from tactileq.experiments.sessions.kept.stored_sessions import StoredSession

# As many steps from one event to the next, in µs, do not come twice by chance: simulated sessions,
# whose steps are a few tens of µs, share at most 9 in a row (docs/method/verification.md#copies).
STEPS = 24


def copied(sessions: Sequence[StoredSession]) -> Iterator[tuple[StoredSession, str]]:
    """Each session that has a stretch of another's times, and a sentence about both."""
    seen: dict[tuple[int, ...], StoredSession] = {}
    for one in sessions:
        other = None
        for stretch in _stretches(one):
            other = other or seen.get(stretch)
        if other is not None:
            name = other.files.log.name
            yield one, f"expected times of its own, got {STEPS} steps in a row as in {name}"
        for stretch in _stretches(one):
            seen.setdefault(stretch, one)


def _stretches(one: StoredSession) -> Iterator[tuple[int, ...]]:
    """Every stretch of steps within a start of the session; all of them where there are few."""
    for run in range(1, one.state.runs + 1):
        times = [round(e["t_s"] * 1e6) for e in one.state.events if e["run"] == run]
        steps = [later - earlier for earlier, later in pairwise(times)]
        for first in range(len(steps) - STEPS + 1):
            yield tuple(steps[first : first + STEPS])
