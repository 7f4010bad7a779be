"""What the experimenter is shown of a study."""

from __future__ import annotations

from datetime import datetime, timedelta

import pytest

from tactileq.experiments.sessions.kept.manifest import SessionManifest
from tactileq.experiments.sessions.kept.roster import Roster
from tactileq.experiments.sessions.store.session_store import SessionStore
from tactileq.experiments.sessions.store.status import TaskProgress, study_progress
from tactileq.experiments.sessions.store.withdrawing import drop_out, withdraw
from tactileq.modeling import InputError
from tests.refusals import refused


def due(root, *, subject=1, days=0):
    """What is due so many days after today, whenever the tests began."""
    day = datetime.now().astimezone().date() + timedelta(days=days)
    people = {person.subject: person for person in study_progress(root, today=day).people}
    return people[subject].due


def test_sessions_are_told_as_they_stand(write_session):
    files = write_session(answered=4, status="aborted", invalid=[4])
    write_session(subject=2, answered=3, status=None)
    progress = study_progress(files.root)
    (one,), (other,) = (person.sessions for person in progress.people)
    assert (one.task, one.session, one.status) == ("absolute", 1, "aborted")
    assert (one.answered, one.planned) == (2, 7)  # two of the four were training
    assert (other.status, other.answered) == ("crashed", 1)
    assert [person.code for person in progress.people] == ["SIM-001", "SIM-002"]
    assert progress.tasks == (
        TaskProgress(task="absolute", complete=0, planned=2),
        TaskProgress(task="relative", complete=0, planned=4),
        TaskProgress(task="oddity", complete=0, planned=2),
        TaskProgress(task="threshold", complete=0, planned=2),
    )


def test_the_next_session_follows_the_order_of_the_study(write_session):
    files = write_session(answered=3, status="aborted")
    root = files.root
    assert due(root) == "absolute, with --resume"
    with SessionStore.resume(root, SessionManifest.load(files.manifest)) as store:
        assert due(root) == "absolute is running"
        store.finish("complete")
    assert due(root) == "relative 1"
    write_session("relative")
    assert due(root) == "relative 2, not before tomorrow"
    assert due(root, days=1) == "relative 2"
    write_session("relative", session=2)
    assert due(root) == "oddity"
    for task in ("oddity", "threshold"):
        write_session(task)
    assert due(root) == ""
    assert [task.complete for task in study_progress(root).tasks] == [1, 2, 1, 1]


def damage(files):
    files.log.write_bytes(files.log.read_bytes().replace(b'"utc"', b'"utx"'))


# Of one person: what was done, one after another, and what is due then.
CRASHED, DAMAGED = None, "damaged"
A, ODD, T = ("absolute", 1), ("oddity", 1), ("threshold", 1)
R1, R2 = ("relative", 1), ("relative", 2)


@pytest.mark.parametrize(
    ("done", "expected"),
    [
        # Interrupted: to be resumed, whatever was never begun before it.
        ([(R1, "aborted")], "relative 1, with --resume"),
        ([(R1, CRASHED)], "relative 1, with --resume"),
        ([(A, "complete"), (ODD, "aborted")], "oddity, with --resume"),
        ([(R1, "complete"), (R2, "aborted")], "relative 2, with --resume"),
        ([(T, CRASHED)], "threshold, with --resume"),
        # Of two, the one that was active last.
        ([(A, "aborted"), (R1, "aborted")], "relative 1, with --resume"),
        ([(A, CRASHED), (ODD, CRASHED)], "oddity, with --resume"),
        ([(ODD, "aborted"), (A, "aborted")], "absolute, with --resume"),
        ([(A, "aborted"), (R1, "complete")], "absolute, with --resume"),
        # Damaged: after what can go on, before what was never begun.
        ([(A, DAMAGED), (R1, "aborted")], "relative 1, with --resume"),
        ([(A, "aborted"), (R1, DAMAGED)], "absolute, with --resume"),
        ([(R1, "complete"), (R2, DAMAGED)], "relative 2 is damaged"),
        ([(A, "complete"), (R1, "complete"), (T, DAMAGED)], "threshold is damaged"),
        # Never begun: a task that was begun is finished before another.
        ([(R1, "complete")], "relative 2, not before tomorrow"),
        ([(ODD, "complete")], "absolute"),
        ([(ODD, "complete"), (R1, "complete")], "relative 2, not before tomorrow"),
        ([(A, "complete")], "relative 1"),
    ],
)
def test_what_was_begun_is_due_before_what_was_not(write_session, done, expected):
    for (task, session), status in done:
        files = write_session(
            task,
            session=session,
            answered=None if status in ("complete", DAMAGED) else 3,
            status="complete" if status == DAMAGED else status,
        )
        if status == DAMAGED:
            damage(files)
    assert due(files.root) == expected


def test_what_runs_now_is_told_before_all_else(write_session):
    root = write_session(answered=3, status="aborted").root
    files = write_session("threshold", answered=3, status="aborted")
    with SessionStore.resume(root, SessionManifest.load(files.manifest)) as store:
        assert due(root) == "threshold is running"
        store.finish("aborted")
    assert due(root) == "threshold, with --resume"


@pytest.mark.parametrize("ending", ["manifest.json", "log.jsonl"])
def test_a_damaged_session_is_one_and_the_others_stand_as_they_do(write_session, ending):
    files = write_session()
    write_session(subject=2)
    path = files.named(ending)
    path.write_bytes(path.read_bytes().replace(b'"utc"', b'"utx"').replace(b'"plan', b'"plam'))
    damaged, other = study_progress(files.root).people
    assert [(one.status, one.planned) for one in damaged.sessions] == [("damaged", 0)]
    assert [(one.status, one.answered) for one in other.sessions] == [("complete", 7)]
    assert (damaged.due, other.due) == ("absolute is damaged", "relative 1")
    roster = Roster(files.root).path
    roster.write_bytes(b"x" + roster.read_bytes())
    progress = study_progress(files.root)
    assert [person.subject for person in progress.people] == [2]
    assert progress.damaged == (f"line 1 of {roster}",)


def test_who_left_counts_no_more(write_session):
    root = write_session().root
    write_session(subject=2)
    drop_out(root, 1)
    withdraw(root, 2)
    progress = study_progress(root)
    assert [person.left for person in progress.people] == ["dropped", "withdrawn"]
    assert [person.due for person in progress.people] == ["", ""]
    assert progress.tasks[0].complete == 0
    assert progress.people[1].code == ""


def test_no_name_of_a_condition_is_told(write_session):
    files = write_session()
    write_session("relative")
    told = repr(study_progress(files.root))
    assert "SIM-001" in told
    for name in ("full", "simplified", "canvas", "velvet"):
        assert name not in told


def test_a_folder_without_sessions_is_refused(tmp_path):
    with refused(InputError, expected=["sessions", tmp_path / "sourcedata"], got="--study"):
        study_progress(tmp_path)
    with refused(InputError, expected="folder", got=[tmp_path / "elsewhere", "--data"]):
        study_progress(tmp_path / "elsewhere")
