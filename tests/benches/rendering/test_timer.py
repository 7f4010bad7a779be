"""The one timer of all benches, on a clock that is set by hand."""

from __future__ import annotations

import pytest

from tactileq.benches.rendering.timer import Turn, turn_ns


def test_turns_are_timed_one_by_one_and_the_best_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Five blocks of a slow filter are five measurements, not one of five times the length."""
    taken = iter([3.0, 2.0, 4.0, 10.0] * 2)  # seconds that each run takes
    now = [0.0]
    monkeypatch.setattr("tactileq.benches.rendering.timer.perf_counter", lambda: now[0])

    def run() -> None:
        now[0] += next(taken)

    for _ in range(2):
        found = turn_ns({"slow": Turn(run, 2, repeats=3), "fast": Turn(run, 100)})
        assert found == {"slow": pytest.approx(1e9), "fast": pytest.approx(1e8)}
