"""The store: an answer that was taken is safe; what does not belong together is refused."""

from __future__ import annotations

import errno
import json
import os
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager
from datetime import UTC, date, datetime, timedelta
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactileq.experiments.sessions.kept import log
from tactileq.experiments.sessions.kept.data_set import DESCRIPTION_NAME
from tactileq.experiments.sessions.kept.files import SessionFiles, sessions_in
from tactileq.experiments.sessions.kept.log import line_of, read_log
from tactileq.experiments.sessions.kept.manifest import SessionManifest
from tactileq.experiments.sessions.kept.overrides import Overrides
from tactileq.experiments.sessions.kept.state import session_state
from tactileq.experiments.sessions.kept.tables import GrowingTable, cell
from tactileq.experiments.sessions.kept.writer import StoreError
from tactileq.experiments.sessions.store import admission
from tactileq.experiments.sessions.store.interface import MemoryStore, Store
from tactileq.experiments.sessions.store.session_store import SessionStore
from tactileq.modeling import InputError
from tactileq.modeling.files.columns import Column
from tactileq.modeling.files.reading import reason_of
from tactileq.rig.shared.interface import Acceleration, HandRows, PresentationRecord
from tests.experiments.scripted import rated
from tests.refusals import check_refusal, refused

FileSizeLimit = Callable[[int], AbstractContextManager[None]]
ManifestOf = Callable[..., SessionManifest]
Rows = Callable[[Path], list[dict[str, str]]]
STEM = "sub-01_ses-01_task-absolute"
TOO_LARGE = reason_of(OSError(errno.EFBIG, ""))
FAILING = reason_of(OSError(errno.EIO, ""))
IN_THE_WAY = reason_of(OSError(errno.EEXIST, ""))


@pytest.fixture
def manifest(manifest_of: ManifestOf) -> SessionManifest:
    return manifest_of()


def contents(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def completed(folder: Path, manifest: SessionManifest) -> SessionFiles:
    with SessionStore.create(folder, manifest) as store:
        store.answer(1, rated(1))
        store.finish("complete")
        return store.files


# What is written


def test_everything_stands_in_the_log_in_its_order(
    tmp_path: Path, manifest: SessionManifest
) -> None:
    with SessionStore.create(tmp_path, manifest) as store:
        store.log("presented", trial=1, surface="real", start_s=np.float64(0.25))
        store.answer(1, rated(1, frequency_similarity=0.1 + 0.2))
        store.log("slider", value=float("nan"))
        store.finish("aborted", "felt ill", by="participant")
    events = read_log(store.files.log).events
    assert [event["n"] for event in events] == [1, 2, 3, 4, 5, 6]
    assert [event["run"] for event in events] == [1] * 6
    names = ["opened", "presented", "answer", "slider", "ended", "stored"]
    assert [event["event"] for event in events] == names
    assert events[0]["manifest_sha256"] == SessionManifest.load(store.files.manifest).sha256
    assert events[1]["start_s"] == 0.25
    assert events[2]["row"]["frequency_similarity"] == 0.1 + 0.2
    assert events[3]["value"] is None
    assert (events[4]["reason"], events[4]["by"]) == ("felt ill", "participant")
    times = [event["t_s"] for event in events]
    assert times == sorted(times)
    assert times[0] >= 0


def test_the_manifest_is_whole_and_forced_to_disk_before_there_is_a_log(
    tmp_path: Path, manifest: SessionManifest, monkeypatch: pytest.MonkeyPatch
) -> None:
    real, order = os.fsync, []

    def noted(handle: int) -> None:
        order.append(Path(os.readlink(f"/proc/self/fd/{handle}")).name)
        order.append(manifest.files(tmp_path).log.exists())
        real(handle)

    monkeypatch.setattr(os, "fsync", noted)
    SessionStore.create(tmp_path, manifest).close()
    forced = next(n for n, name in enumerate(order) if "_manifest" in str(name))
    assert order[forced + 1] is False


def test_an_answer_is_forced_to_disk_when_it_has_been_taken(
    tmp_path: Path, manifest: SessionManifest, monkeypatch: pytest.MonkeyPatch
) -> None:
    with SessionStore.create(tmp_path, manifest) as store:
        real, sizes = os.fsync, []

        def slow(handle: int) -> None:
            time.sleep(0.02)
            real(handle)
            sizes.append(os.fstat(handle).st_size)

        monkeypatch.setattr(os, "fsync", slow)
        for trial in (1, 2, 3):
            store.log("presented", trial=trial)
            store.answer(trial, rated(trial))
            text = store.files.log.read_bytes()[: sizes[-1]].decode()
            assert f'"event": "answer", "trial": {trial}' in text


def test_who_logs_never_waits_for_the_disk_and_much_goes_at_once(
    tmp_path: Path, manifest: SessionManifest, monkeypatch: pytest.MonkeyPatch
) -> None:
    with SessionStore.create(tmp_path, manifest) as store:
        stuck, forced = threading.Event(), []

        def standing(handle: int) -> None:
            forced.append(handle)
            assert stuck.wait(500)

        monkeypatch.setattr(os, "fsync", standing)
        for value in range(1000):
            store.log("slider", value=value)  # would wait for ever, did it wait for the disk
        stuck.set()
        store.answer(1, rated(1))
        assert len(forced) < 1000
    events = read_log(store.files.log).events
    assert [e["value"] for e in events if e["event"] == "slider"] == list(range(1000))


def test_many_threads_may_log(tmp_path: Path, manifest: SessionManifest) -> None:
    with SessionStore.create(tmp_path, manifest) as store, ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda n: store.answer(n, rated(n)), range(40)))
    rows = session_state(store.files.log).rows
    assert sorted(row["trial"] for row in rows) == list(range(40))


def test_names_of_the_log_are_its_own(tmp_path: Path, manifest: SessionManifest) -> None:
    with SessionStore.create(tmp_path, manifest) as store:
        with refused(TypeError, names=["presented", "n"]):
            store.log("presented", n=7)
        with refused(InputError, expected=["complete", "aborted", "crashed"], got="'done'"):
            store.finish("done")
    with refused(StoreError, expected="log", got=store.files.log):
        store.log("presented")
    store.close()


def test_the_hand_and_the_pen_stand_beside_it(
    tmp_path: Path, manifest: SessionManifest, rows: Rows
) -> None:
    hand = HandRows(
        time_s=np.array([0.1, 0.2]),
        speed_mm_s=np.array([10.0, np.nan]),
        force_n=np.array([0.5, 0.6]),
        surface=np.array([1, 2]),
        presentation=np.array([1, 2]),
        force_assumed=np.array([False, True]),
    )
    shown = PresentationRecord(number=1, surface="real", texture="canvas", start_s=0, end_s=0.15)
    piece = Acceleration(start_s=0.1, rate_hz=1000.0, samples_g=np.zeros(10))
    for begin in (SessionStore.create, SessionStore.resume):
        with begin(tmp_path, manifest) as store:
            store.trace(1, hand, presentations=[shown], faults=())
            store.acceleration(1, [piece, piece])
        table = store.files.named("hand.tsv")
        table.write_bytes(table.read_bytes() + b"1\t2\t0.")  # killed while it wrote a row
    with SessionStore.resume(tmp_path, manifest) as store:
        store.trace(2, hand, presentations=[shown], faults=())
    assert [row["trial"] for row in rows(table)] == ["1"] * 4 + ["2"] * 2
    assert [row["speed_mm_s"] for row in rows(table)] == ["10", "n/a"] * 3
    assert len(rows(store.files.named("presentations.tsv"))) == 3
    pens = [e for e in read_log(store.files.log).events if e["event"] == "pen"]
    names = [f"sub-01_ses-01_task-absolute_trial-001_pen-{n}.wav" for n in (1, 2, 3, 4)]
    assert [event["file"] for event in pens] == names
    assert all((store.files.folder / name).exists() for name in names)


def test_in_memory_rows_are_kept_and_nothing_is_written() -> None:
    memory = MemoryStore()
    store: Store = memory
    with store:
        store.log("presented", trial=1)
        store.answer(1, rated(1))
        store.trace(1, HandRows.joined([]), presentations=(), faults=())
        store.acceleration(1, ())
        store.finish("complete")
    assert memory.rows == [rated(1)]
    assert memory.status == "complete"
    assert [event["event"] for event in memory.events] == ["presented", "ended"]


# Disks


def answer_eight(store: SessionStore, taken: list[int]) -> None:
    for trial in range(2, 9):
        store.log("presented", trial=trial)
        store.answer(trial, rated(trial))
        taken.append(trial)


def test_a_full_disk_loses_nothing_that_was_safe(
    tmp_path: Path, manifest: SessionManifest, file_size_limit: FileSizeLimit
) -> None:
    """Wherever the disk is full: within the answer, within the event before it, or before both."""
    for room in range(0, 600, 23):
        folder, taken = tmp_path / str(room), [1]
        store = SessionStore.create(folder, manifest)
        store.answer(1, rated(1))
        before = store.files.log.read_bytes()
        facts = [TOO_LARGE, "--resume"]
        with (
            file_size_limit(len(before) + room),
            refused(StoreError, expected=store.files.log, got=facts) as told,
        ):
            answer_eight(store, taken)
        with refused(StoreError, expected=store.files.log, got=TOO_LARGE):
            store.close()
        assert "\n" not in str(told.value)
        found = store.files.log.read_bytes()
        assert found.startswith(before)
        assert found.endswith(b"\n")
        assert [row["trial"] for row in session_state(store.files.log).rows] == taken
        with SessionStore.resume(folder, manifest) as store:
            store.answer(len(taken) + 1, rated(len(taken) + 1))
        rows = session_state(store.files.log).rows
        assert [row["trial"] for row in rows] == [*taken, len(taken) + 1]


@pytest.mark.parametrize("call", ["write", "fsync"])
def test_a_failing_disk_is_told_at_the_answer_and_ever_after(
    tmp_path: Path, manifest: SessionManifest, monkeypatch: pytest.MonkeyPatch, call: str
) -> None:
    store = SessionStore.create(tmp_path, manifest)
    store.answer(1, rated(1))

    def fail(*_: object) -> int:
        raise OSError(errno.EIO, "Input/output error")

    with monkeypatch.context() as broken:
        broken.setattr(os, call, fail)
        with refused(StoreError, expected=store.files.log, got=FAILING):
            store.answer(2, rated(2))
    for again in (
        lambda: store.log("presented"),
        lambda: store.answer(2, rated(2)),
        lambda: store.finish("crashed"),
        lambda: store.close(),
    ):
        with refused(StoreError, expected=store.files.log, got=FAILING):
            again()
    state = session_state(store.files.log)
    assert [row["trial"] for row in state.rows] == [1]
    assert state.status == "crashed"


def test_an_error_in_the_block_is_not_hidden_by_the_disk(
    tmp_path: Path, manifest: SessionManifest, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")

    def failing() -> None:
        with SessionStore.create(tmp_path, manifest) as store:
            monkeypatch.setattr(os, "write", fail)
            store.log("presented")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        failing()


@pytest.mark.parametrize("limit", [0, 100, 1500, 2100])
def test_a_disk_that_is_full_at_the_beginning_holds_no_session(
    tmp_path: Path, manifest: SessionManifest, file_size_limit: FileSizeLimit, limit: int
) -> None:
    with file_size_limit(limit), refused(StoreError, expected=tmp_path, got=TOO_LARGE) as told:
        SessionStore.create(tmp_path, manifest)
    assert "--resume" not in str(told.value)
    assert not manifest.files(tmp_path).there()
    completed(tmp_path, manifest)


def test_a_folder_that_is_a_file_is_told_in_one_sentence(
    tmp_path: Path, manifest: SessionManifest
) -> None:
    (tmp_path / "data").write_text("a file")
    with refused(StoreError, expected=tmp_path / "data", got=IN_THE_WAY):
        SessionStore.create(tmp_path / "data", manifest)
    assert (tmp_path / "data").read_text() == "a file"


# Once, and by one


def test_a_session_is_made_once_whoever_asks_at_the_same_time(
    tmp_path: Path, manifest: SessionManifest
) -> None:
    def attempt(_: int) -> str:
        try:
            with SessionStore.create(tmp_path, manifest) as store:
                store.answer(1, rated(1))
        except InputError as refusal:
            return str(refusal)
        return "made"

    with ThreadPoolExecutor(8) as pool:
        outcomes = list(pool.map(attempt, range(16)))
    assert outcomes.count("made") == 1
    refusals = [outcome for outcome in outcomes if outcome != "made"]
    assert len(refusals) == 15
    for refusal in refusals:
        check_refusal(refusal, got=STEM)
    assert len(session_state(manifest.files(tmp_path).log).rows) == 1


def test_what_is_being_run_is_refused_and_its_state_is_running(
    tmp_path: Path, manifest: SessionManifest
) -> None:
    with SessionStore.create(tmp_path, manifest) as store:
        assert session_state(store.files.log).status == "running"
        before = contents(tmp_path)
        with refused(InputError, got=[STEM, "console"]):
            SessionStore.create(tmp_path, manifest)
        with refused(InputError, got=[STEM, os.getpid()]):
            SessionStore.resume(tmp_path, manifest)
        assert contents(tmp_path) == before
        store.answer(1, rated(1))
    assert session_state(store.files.log).status == "crashed"


def test_how_it_ended_and_what_to_do(tmp_path: Path, manifest: SessionManifest) -> None:
    with SessionStore.create(tmp_path, manifest) as store:
        store.finish("aborted", "fire alarm", by="experimenter")
    state = session_state(store.files.log)
    assert (state.status, state.reason, state.by) == ("aborted", "fire alarm", "experimenter")
    with refused(InputError, got=[STEM, "aborted", "--resume"]):
        SessionStore.create(tmp_path, manifest)
    with SessionStore.resume(tmp_path, manifest) as store:
        assert store.run == 2
        assert session_state(store.files.log).status == "running"
    assert session_state(store.files.log).status == "crashed"
    with refused(InputError, got=[STEM, "--resume"]):
        SessionStore.create(tmp_path, manifest)
    with SessionStore.resume(tmp_path, manifest) as store:
        store.finish("complete")
    state = session_state(store.files.log)
    assert (state.status, state.runs) == ("complete", 3)
    before = contents(tmp_path)
    with refused(InputError, got=[STEM, "complete"]):
        SessionStore.create(tmp_path, manifest)
    with refused(InputError, got=[STEM, "complete"]):
        SessionStore.resume(tmp_path, manifest)
    assert contents(tmp_path) == before


def test_a_leftover_file_is_not_overwritten(tmp_path: Path, manifest: SessionManifest) -> None:
    leftover = manifest.files(tmp_path).named("hand.tsv")
    leftover.parent.mkdir(parents=True)
    leftover.write_text("precious")
    with refused(InputError, got=[STEM, leftover, "manifest"]):
        SessionStore.create(tmp_path, manifest)
    assert contents(tmp_path) == {leftover: b"precious"}


def test_sessions_of_a_data_set_are_found(tmp_path: Path, manifest_of: ManifestOf) -> None:
    for subject, task in [(12, "absolute"), (2, "relative"), (2, "absolute")]:
        completed(tmp_path, manifest_of(subject=subject, task=task))
    (tmp_path / "sourcedata" / "sub-02" / "ses-01" / "notes_manifest.json").write_text("{}")
    found = sessions_in(tmp_path)
    assert [(f.subject, f.task) for f in found] == [
        (2, "absolute"),
        (2, "relative"),
        (12, "absolute"),
    ]
    assert all(SessionManifest.load(f.manifest).subject == f.subject for f in found)


# Resuming


def test_resuming_keeps_the_manifest_and_says_what_has_changed(
    tmp_path: Path, manifest_of: ManifestOf
) -> None:
    with SessionStore.create(tmp_path, manifest_of()) as store:
        before = store.files.manifest.read_bytes()
    now = manifest_of(language="ja", trials=[{"trial": 1, "phase": "main"}])
    with SessionStore.resume(tmp_path, now) as store:
        assert len(store.manifest.trials) == 6
        assert store.before.runs == 1
    assert store.files.manifest.read_bytes() == before
    opened = read_log(store.files.log).events[-2]
    assert (opened["resumed"], opened["run"], opened["changed"]) == (True, 2, {"language": "ja"})


@pytest.mark.parametrize(
    ("changed", "what", "got"),
    [
        ({"study": {"name": "Small", "seed": 4, "data_license": "CC0"}}, "study", "seed"),
        ({"models_sha256": {"canvas": {"full": "xx", "simplified": "dd"}}}, "models", "canvas"),
    ],
)
def test_a_changed_study_or_model_is_resumed_for_a_stated_reason(
    tmp_path: Path, manifest_of: ManifestOf, changed: dict[str, object], what: str, got: str
) -> None:
    SessionStore.create(tmp_path, manifest_of()).close()
    now = manifest_of(**changed)
    before = contents(tmp_path)
    with refused(InputError, expected=[what, STEM], got=[got, "--override"]):
        SessionStore.resume(tmp_path, now)
    assert contents(tmp_path) == before
    SessionStore.resume(tmp_path, now, overrides=Overrides("typing error")).close()
    opened = read_log(manifest_of().files(tmp_path).log).events[-2]
    assert opened["overrides"] == [{"what": what, "reason": "typing error"}]
    differing = {name: now.values[name] for name in (f"{what}_sha256", *changed)}
    assert opened["changed"] == differing


@pytest.mark.parametrize("name", ["simulated_participant", "simulated_rig", "pilot"])
def test_nobody_goes_on_as_another_kind(tmp_path: Path, manifest_of: ManifestOf, name: str) -> None:
    SessionStore.create(tmp_path, manifest_of()).close()
    with refused(InputError, expected=[name, False, STEM], got=True):
        SessionStore.resume(tmp_path, manifest_of(**{name: True}), overrides=Overrides("no"))


def test_what_cannot_be_resumed(tmp_path: Path, manifest: SessionManifest) -> None:
    files = manifest.files(tmp_path)
    with refused(InputError, expected="session", got=[files.manifest, "--resume"]):
        SessionStore.resume(tmp_path, manifest)
    assert not contents(tmp_path)
    SessionStore.create(tmp_path, manifest).close()
    whole = files.log.read_bytes()
    files.log.write_bytes(b"spoilt\n" + whole)
    with refused(InputError, expected=["line 1", files.log], got="'spoilt'"):
        SessionStore.resume(tmp_path, manifest, overrides=Overrides("never mind"))
    files.log.write_bytes(whole)
    text = files.manifest.read_text()
    stored = SessionManifest.load(files.manifest).sha256
    files.manifest.write_text(text.replace('"canvas", "layout"', '"MDF", "layout"', 1))
    changed = SessionManifest.load(files.manifest).sha256
    with refused(InputError, expected=[stored[:8], files.log], got=[changed[:8], files.manifest]):
        SessionStore.resume(tmp_path, manifest)
    files.manifest.write_text(text)
    SessionStore.resume(tmp_path, manifest).close()


def test_half_a_line_is_kept_by_the_next_run(tmp_path: Path, manifest: SessionManifest) -> None:
    with SessionStore.create(tmp_path, manifest) as store:
        store.answer(1, rated(1))
    half = line_of({"n": 4, "told": "ü"})[:-4]
    store.files.log.write_bytes(store.files.log.read_bytes() + half)
    assert session_state(store.files.log).cut
    SessionStore.resume(tmp_path, manifest).close()
    events = read_log(store.files.log).events
    assert [event["event"] for event in events] == [
        "opened",
        "answer",
        "stored",
        "opened",
        "stored",
    ]
    assert events[3]["cut"] == half.decode("utf-8", "backslashreplace")


# One data set


def test_the_data_set_is_described_by_its_first_session(
    tmp_path: Path, manifest_of: ManifestOf
) -> None:
    made = manifest_of(simulated_participant=True)
    completed(tmp_path, made)
    told = json.loads((tmp_path / DESCRIPTION_NAME).read_text())
    assert (told["Name"], told["License"], told["BIDSVersion"]) == ("Small", "CC0", "1.10.0")
    flags = ("Simulated", "SimulatedParticipant", "SimulatedRig", "Pilot")
    assert [told[name] for name in flags] == [True, True, False, False]
    assert told["ModelsSHA256"] == made.models_sha256


@pytest.mark.parametrize(
    ("name", "key"),
    [("simulated_participant", "SimulatedParticipant"), ("simulated_rig", "SimulatedRig")],
)
def test_people_and_simulations_never_share_a_folder(
    tmp_path: Path, manifest_of: ManifestOf, name: str, key: str
) -> None:
    completed(tmp_path, manifest_of())
    before = contents(tmp_path)
    for reason in (None, "in a hurry"):
        with refused(InputError, expected=[key, True, tmp_path / DESCRIPTION_NAME], got=False):
            SessionStore.create(
                tmp_path, manifest_of(subject=2, **{name: True}), overrides=Overrides(reason)
            )
    assert contents(tmp_path) == before


@pytest.mark.parametrize(
    ("changed", "what", "expected", "got"),
    [
        (
            {"study": {"name": "Small", "seed": 4, "data_license": "CC0"}},
            "study",
            "study",
            "seed",
        ),
        (
            {"models_sha256": {"canvas": {"full": "x", "simplified": "dd"}}},
            "models",
            "models",
            "canvas",
        ),
        ({"pilot": True}, "pilot", "pilot True", False),
    ],
)
def test_what_differs_from_the_data_set_goes_on_for_a_stated_reason(
    tmp_path: Path,
    manifest_of: ManifestOf,
    changed: dict[str, object],
    what: str,
    expected: str,
    got: object,
) -> None:
    completed(tmp_path, manifest_of())
    before = contents(tmp_path)
    other = manifest_of(subject=2, **changed)
    facts = [got, tmp_path / DESCRIPTION_NAME, "--override"]
    with refused(InputError, expected=expected, got=facts) as told:
        SessionStore.create(tmp_path, other)
    assert "\n" not in str(told.value)
    assert contents(tmp_path) == before
    with SessionStore.create(tmp_path, other, overrides=Overrides("the lamp broke")) as store:
        record = {"what": what, "reason": "the lamp broke"}
        assert SessionManifest.load(store.files.manifest).overrides == (record,)
    assert read_log(store.files.log).events[0]["overrides"] == [record]


def test_a_description_that_cannot_be_read_is_refused(
    tmp_path: Path, manifest_of: ManifestOf
) -> None:
    (tmp_path / DESCRIPTION_NAME).write_text("{")
    with refused(InputError, expected=["JSON", tmp_path / DESCRIPTION_NAME]):
        SessionStore.create(tmp_path, manifest_of())


def test_a_reason_says_something() -> None:
    for reason in ("", " ", "two\nlines"):
        with refused(InputError, expected="--override", got=repr(reason)):
            Overrides(reason)
    allowed = Overrides(" fire ")
    allowed.allow("study", "expected a, got b; do c")
    allowed.allow("study", "expected a, got b; do c")
    assert allowed.recorded == [{"what": "study", "reason": "fire"}]


# Days


def at(moment: datetime, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (log, admission):
        monkeypatch.setattr(module, "now_utc", lambda: moment)


def local_date(moment: datetime) -> date:
    return moment.astimezone().date()


def test_the_second_day_comes_after_the_first(
    tmp_path: Path, manifest_of: ManifestOf, monkeypatch: pytest.MonkeyPatch
) -> None:
    noon = datetime.now().astimezone().replace(hour=12).astimezone(UTC)
    second = manifest_of(session=2)
    with refused(InputError, expected=[STEM, "complete", "session 2"], got="--override"):
        SessionStore.create(tmp_path, second)
    at(noon, monkeypatch)
    SessionStore.create(tmp_path, manifest_of()).close()
    with refused(InputError, expected=[STEM, "complete", "session 2"], got="crashed"):
        SessionStore.create(tmp_path, second)
    with SessionStore.resume(tmp_path, manifest_of()) as store:
        store.finish("complete")
    for hours in (0, 11, -24):
        now = noon + timedelta(hours=hours)
        at(now, monkeypatch)
        dates = {"expected": ["session 2", STEM, local_date(noon)], "got": local_date(now)}
        with refused(InputError, names="--override", **dates):
            SessionStore.create(tmp_path, second)
    at(noon + timedelta(hours=13), monkeypatch)
    completed(tmp_path, second)
    third = manifest_of(session=3)
    with SessionStore.create(tmp_path, third, overrides=Overrides("leaves town")) as store:
        assert store.manifest.overrides == ({"what": "same date", "reason": "leaves town"},)
    assert len(sessions_in(tmp_path)) == 3


def test_the_second_day_is_not_on_the_date_on_which_a_resumed_first_day_ended(
    tmp_path: Path, manifest_of: ManifestOf, monkeypatch: pytest.MonkeyPatch
) -> None:
    noon = datetime.now().astimezone().replace(hour=12).astimezone(UTC)
    at(noon, monkeypatch)
    SessionStore.create(tmp_path, manifest_of()).close()
    at(noon + timedelta(days=1), monkeypatch)
    with SessionStore.resume(tmp_path, manifest_of()) as store:
        store.finish("complete")
    second = manifest_of(session=2)
    for hours in (0, 11):
        at(noon + timedelta(days=1, hours=hours), monkeypatch)
        second_date = local_date(noon + timedelta(days=1))
        with refused(InputError, expected=["session 2", STEM, second_date], got=second_date):
            SessionStore.create(tmp_path, second)
    at(noon + timedelta(days=1, hours=13), monkeypatch)
    completed(tmp_path, second)


def test_days_of_other_subjects_and_tasks_do_not_count(
    tmp_path: Path, manifest_of: ManifestOf
) -> None:
    completed(tmp_path, manifest_of(subject=2))
    completed(tmp_path, manifest_of(task="relative"))
    with refused(InputError, expected=[STEM, "complete", "session 2"]):
        SessionStore.create(tmp_path, manifest_of(session=2))


def test_a_day_before_that_cannot_be_read_is_passed_over_for_a_stated_reason(
    tmp_path: Path, manifest_of: ManifestOf
) -> None:
    files = completed(tmp_path, manifest_of())
    files.log.write_bytes(b"spoilt\n" + files.log.read_bytes())
    second = manifest_of(session=2)
    with refused(InputError, expected=["line 1", files.log], got=["'spoilt'", "--override"]):
        SessionStore.create(tmp_path, second)
    with SessionStore.create(tmp_path, second, overrides=Overrides("disk failed")) as store:
        assert [record["what"] for record in store.manifest.overrides] == ["unreadable log"]


def test_simulated_participants_may_come_twice_a_day_but_in_order(
    tmp_path: Path, manifest_of: ManifestOf
) -> None:
    kind = {"simulated_participant": True, "simulated_rig": True}
    with refused(InputError, expected=[STEM, "complete", "session 2"]):
        SessionStore.create(tmp_path, manifest_of(session=2, **kind))
    completed(tmp_path, manifest_of(**kind))
    completed(tmp_path, manifest_of(session=2, **kind))
    with SessionStore.create(
        tmp_path, manifest_of(session=4, **kind), overrides=Overrides("a test")
    ) as store:
        assert [record["what"] for record in store.manifest.overrides] == ["day before"]


# Tables


@given(st.text())
def test_no_text_breaks_a_row(value: str) -> None:
    written = cell(value)
    assert written
    assert len(written.splitlines()) == 1
    assert not set(written) & set('\t\r\n"')
    written.encode("utf-8")


def test_a_table_with_hostile_values_reads_back(tmp_path: Path) -> None:
    hostile = ['"unbalanced', "tab\there", "line\nend\r\n", "back\\slash", "", "\ud800", "ünï"]
    table = GrowingTable(tmp_path / "hand.tsv", (Column("trial"), Column("note")))
    table.extend({"trial": n, "note": value} for n, value in enumerate(hostile, start=1))
    table.close()
    read = pd.read_csv(table.path, sep="\t", keep_default_na=False)
    assert read["trial"].tolist() == [1, 2, 3, 4, 5, 6, 7]
    assert read["note"].tolist() == [
        "\\x22unbalanced",
        "tab\\there",
        "line\\nend\\r\\n",
        "back\\\\slash",
        "n/a",
        "\\ud800",
        "ünï",
    ]


def test_numbers_and_nothing_in_a_cell() -> None:
    assert [cell(v) for v in (True, False, 3, 2.5, None, float("nan"), 0.1 + 0.2)] == [
        *("true", "false", "3", "2.5", "n/a", "n/a", "0.3"),
    ]
    with refused(InputError, expected="finite", got="inf"):
        cell(float("inf"))


def test_a_table_of_other_columns_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "hand.tsv"
    path.write_text("other\n1\n")
    with refused(InputError, expected=["trial", "note", path], got="'other'"):
        GrowingTable(path, (Column("trial"), Column("note")))
    assert path.read_text() == "other\n1\n"


def test_a_table_that_the_disk_does_not_take_keeps_whole_rows(
    tmp_path: Path, file_size_limit: FileSizeLimit
) -> None:
    table = GrowingTable(tmp_path / "hand.tsv", (Column("trial"), Column("note")))
    table.extend([{"trial": 1, "note": "kept"}])
    before = table.path.read_bytes()
    facts = [TOO_LARGE, "--resume"]
    with file_size_limit(len(before) + 5), refused(StoreError, expected=table.path, got=facts):
        table.extend([{"trial": 2, "note": "too long for the disk"}])
    assert table.path.read_bytes() == before
    table.extend([{"trial": 2, "note": "room again"}])
    table.close()
    assert table.path.read_bytes() == before + b"2\troom again\n"
