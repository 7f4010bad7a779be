"""What is left of a session: nothing twice, nothing left out, training again after a long break."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactileq.experiments.sessions.kept.log import Log, utc_text
from tactileq.experiments.sessions.kept.manifest import SessionManifest
from tactileq.experiments.sessions.kept.program import program_facts
from tactileq.experiments.sessions.kept.resume import Resumption, resumption
from tactileq.experiments.sessions.kept.state import SessionState, state_of
from tactileq.modeling.files.hashes import sha256_of_values

ManifestOf = Callable[..., SessionManifest]
BEGUN = datetime(2026, 11, 22, 9, 0, tzinfo=UTC)
NUMBERS = range(1, 7)  # of the planned trials, of which 1 and 2 are training
GAP_MIN = 30.0

Told = tuple[str, dict[str, Any]]


def answer(trial: int, *, valid: bool = True, repeats: int | None = None, phase: str = "") -> Told:
    phase = phase or ("training" if trial <= 2 else "main")
    row = {"trial": trial, "phase": phase, "valid": valid, "repeats": repeats}
    return "answer", {"trial": trial, "row": row}


def state(*told: Told | float) -> SessionState:
    """A log of these events, a second apart; a number is a pause in minutes."""
    events: list[dict[str, Any]] = []
    moment, run = BEGUN, 0
    for item in (("opened", {}), *told):
        if isinstance(item, float):
            moment += timedelta(minutes=item)
            continue
        run += item[0] == "opened"
        moment += timedelta(seconds=1)
        stamp = {"n": len(events) + 1, "utc": utc_text(moment), "t_s": 0.0, "run": run}
        events.append({**stamp, "event": item[0], **item[1]})
    return state_of(Log(tuple(events)), running=False)


def left(manifest: SessionManifest, stood: SessionState, *, after_min: float = 1.0) -> Resumption:
    last = datetime.fromisoformat(stood.last_utc) if stood.last_utc else BEGUN
    return resumption(
        manifest, stood, longest_gap_min=GAP_MIN, now=last + timedelta(minutes=after_min)
    )


def numbers(trials: object) -> list[int]:
    return [trial["trial"] for trial in trials]  # type: ignore[attr-defined]


def test_of_a_session_without_a_log_everything_is_left(manifest_of: ManifestOf) -> None:
    left_ = left(manifest_of(), state_of(Log(()), running=False), after_min=1e6)
    assert numbers(left_.next_trials) == list(NUMBERS)
    assert (left_.run, left_.next_number, left_.training_due) == (1, 7, False)


@pytest.mark.parametrize("done", range(7))
def test_it_goes_on_at_the_next_open_trial(manifest_of: ManifestOf, done: int) -> None:
    partial = ("presented", {"trial": done + 1})
    left_ = left(manifest_of(), state(*(answer(n) for n in range(1, done + 1)), partial))
    assert numbers(left_.next_trials) == list(range(done + 1, 7))
    assert left_.to_repeat == ()
    assert (left_.run, left_.next_number, left_.training_due) == (2, 7, False)
    assert numbers(left_.rows) == list(range(1, done + 1))
    assert [dict(trial) for trial in left_.next_trials] == list(manifest_of().trials)[done:]


def test_trials_in_which_the_rig_failed_are_owed_once(manifest_of: ManifestOf) -> None:
    done = [answer(n, valid=n not in (3, 5)) for n in NUMBERS]
    left_ = left(manifest_of(), state(*done))
    assert (left_.next_trials, numbers(left_.to_repeat)) == ((), [3, 5])
    assert left_.next_number == 7
    done.append(answer(7, repeats=3, phase="main", valid=False))
    left_ = left(manifest_of(), state(*done))
    assert (numbers(left_.to_repeat), left_.next_number) == ([5], 8)
    done.append(answer(8, repeats=5, phase="main"))
    left_ = left(manifest_of(), state(*done), after_min=1000.0)
    assert (left_.next_trials, left_.to_repeat, left_.training_due) == ((), (), False)


def test_training_that_was_over_leaves_none_of_it(manifest_of: ManifestOf) -> None:
    over = ("training_over", {})
    left_ = left(manifest_of(), state(answer(1, valid=False), over))
    assert numbers(left_.next_trials) == [3, 4, 5, 6]
    assert left_.to_repeat == ()
    assert numbers(left(manifest_of(), state(answer(1), answer(3))).next_trials) == [4, 5, 6]


def test_training_goes_on_after_a_short_break(manifest_of: ManifestOf) -> None:
    left_ = left(manifest_of(), state(answer(1, valid=False)), after_min=GAP_MIN - 1)
    assert numbers(left_.next_trials) == [2, 3, 4, 5, 6]
    assert numbers(left_.to_repeat) == [1]
    assert not left_.training_due


@pytest.mark.parametrize(
    ("after_min", "due"), [(GAP_MIN - 0.1, False), (GAP_MIN + 0.1, True), (-5.0, True)]
)
def test_after_a_long_break_training_is_due_again(
    manifest_of: ManifestOf, after_min: float, due: bool
) -> None:
    """Also where the clock was set back, so that nobody knows how long the break was."""
    for done in ((1,), (1, 2), (1, 2, 3)):
        left_ = left(manifest_of(), state(*map(answer, done)), after_min=after_min)
        assert left_.training_due is due
        first = max(done) + 1
        assert numbers(left_.next_trials) == list(range(max(first, 3) if due else first, 7))


def test_starting_again_ends_no_break(manifest_of: ManifestOf) -> None:
    """Started again after an hour, killed at once, and started again: still an hour's break."""
    stood = state(answer(1), answer(2), answer(3), 60.0, ("opened", {}), ("phase", {}))
    assert left(manifest_of(), stood).training_due


def test_training_that_was_begun_again_and_broke_off_is_due_again(manifest_of: ManifestOf) -> None:
    again = ("phase", {"phase": "training", "again": True})
    rows = [answer(1), answer(2), answer(3), 60.0, ("opened", {}), again]
    rows.append(answer(7, phase="training", repeats=1))
    left_ = left(manifest_of(), state(*rows))
    assert (left_.training_due, left_.next_number) == (True, 8)
    assert numbers(left_.next_trials) == [4, 5, 6]
    rows.append(("training_over", {}))
    left_ = left(manifest_of(), state(*rows))
    assert (left_.training_due, left_.next_number) == (False, 8)
    assert numbers(left_.next_trials) == [4, 5, 6]


def test_without_training_none_is_due(manifest_of: ManifestOf) -> None:
    manifest = manifest_of(trials=[{"trial": n, "phase": "main"} for n in NUMBERS])
    left_ = left(manifest, state(answer(1)), after_min=1000.0)
    assert not left_.training_due
    assert numbers(left_.next_trials) == [2, 3, 4, 5, 6]


@given(
    st.lists(st.booleans(), min_size=6, max_size=6),
    st.integers(0, 20),
    st.integers(0, 20),
    st.lists(st.sampled_from([1.0, 60.0]), min_size=20, max_size=20),
)
def test_however_often_it_breaks_off_every_trial_is_asked_once(
    valid: list[bool], first: int, second: int, breaks: list[float]
) -> None:
    """A session is run by what is left, and breaks off after any number of answers, twice."""
    manifest = SessionManifest(
        task="absolute",
        subject=1,
        session=1,
        slot=1,
        code="",
        language="en",
        pilot=False,
        simulated_participant=True,
        simulated_rig=True,
        study={},
        study_sha256=sha256_of_values({}),
        plan_sha256="",
        models_sha256={},
        rig={},
        model_sources={},
        identical={},
        description="",
        **program_facts(),
        trials=[{"trial": n, "phase": "training" if n <= 2 else "main"} for n in NUMBERS],
    )
    told: list[Told | float] = []
    for answers in (first, second, 100):
        stood = state(*told)
        remaining = left(manifest, stood, after_min=breaks[len(told) % 20])
        for step in steps(remaining, valid)[:answers]:
            told.append(step)
        told += [breaks[len(told) % 20], ("opened", {})]
    check(state(*told), valid)


def steps(remaining: Resumption, valid: list[bool]) -> list[Told]:
    """What a session does with what is left, as the loop of trials does it."""
    number = remaining.next_number
    done: list[Told] = []
    if remaining.training_due:
        done.append(("phase", {"phase": "training", "again": True}))
        for planned in (1, 2):
            done.append(answer(number, repeats=planned, phase="training"))
            number += 1
        done.append(("training_over", {}))
    for phase in ("training", "main"):
        owed = [t["trial"] for t in remaining.to_repeat if t["phase"] == phase]
        for trial in remaining.next_trials:
            if trial["phase"] == phase:
                done.append(answer(trial["trial"], valid=valid[trial["trial"] - 1]))
                owed += [] if valid[trial["trial"] - 1] else [trial["trial"]]
        for planned in owed:
            done.append(answer(number, repeats=planned, phase=phase))
            number += 1
    return done


def check(stood: SessionState, valid: list[bool]) -> None:
    trials = numbers(stood.rows)
    assert len(set(trials)) == len(trials)
    main = [row for row in stood.rows if row["phase"] == "main"]
    assert [row["trial"] for row in main if row["repeats"] is None] == [3, 4, 5, 6]
    repeated = sorted(row["repeats"] for row in main if row["repeats"])
    assert repeated == [n for n in (3, 4, 5, 6) if not valid[n - 1]]
    assert stood.rows[0]["trial"] == 1
