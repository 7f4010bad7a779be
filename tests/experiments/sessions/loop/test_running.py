"""Whole sessions on disk: begun, broken off, killed, gone on with, refused."""

from __future__ import annotations

import errno
import os
import signal
import stat
import tomllib
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tactileq.experiments.sessions.bids.export import export_all, export_session
from tactileq.experiments.sessions.kept import log, program
from tactileq.experiments.sessions.kept.log import read_log
from tactileq.experiments.sessions.kept.manifest import SessionManifest
from tactileq.experiments.sessions.kept.roster import Roster
from tactileq.experiments.sessions.kept.state import session_state
from tactileq.experiments.sessions.kept.stored_sessions import held_sessions
from tactileq.experiments.sessions.kept.writer import StoreError
from tactileq.experiments.sessions.loop.people import (
    ConsentRefused,
    Intake,
    Rating,
    SessionAborted,
)
from tactileq.experiments.sessions.loop.running import Circumstances, run_session
from tactileq.experiments.sessions.loop.surfaces import Surfaces
from tactileq.experiments.sessions.loop.trial_loop import People, SessionResult
from tactileq.experiments.sessions.store import admission
from tactileq.experiments.sessions.store.session_store import SessionStore
from tactileq.experiments.sessions.store.status import study_progress
from tactileq.experiments.sessions.store.withdrawing import withdraw
from tactileq.experiments.study.models import ModelSets
from tactileq.experiments.study.questions import Question
from tactileq.experiments.study.study import Consent, Study
from tactileq.experiments.study.task_plan import TaskPlan
from tactileq.experiments.tasks import plan_session, task_named
from tactileq.experiments.verification.verifying import verify_data
from tactileq.modeling import InputError
from tactileq.modeling.files.locks import is_held
from tactileq.modeling.files.places import LOCK_NAME
from tactileq.modeling.files.reading import reason_of
from tactileq.rig.desk.twin import SimulatedRig
from tests.experiments.scripted import Ready, Scripted
from tests.experiments.sealing import change_text
from tests.refusals import refused
from tests.rig.planted import planted_stimulus

STEM = "sub-01_ses-01_task-absolute"
TRIALS = 5  # one for training, two textures with two models


@pytest.fixture
def small(study: Study) -> Study:
    """The smallest study: two textures."""
    absolute = TaskPlan(participants=2, schedule="interleaved", training_trials=1)
    relative = TaskPlan(participants=2, schedule="by-day", training_trials=1)
    return replace(
        study,
        textures=("canvas", "PVC"),
        trays={"canvas": "C", "PVC": "B"},
        tasks={"absolute": absolute, "relative": relative},
    )


@pytest.fixture
def run(
    small: Study, models: ModelSets, rig: Any, tmp_path: Path
) -> Callable[..., tuple[SessionResult, Path]]:
    """Runs a session into the test's folder; what is not given is well behaved."""

    def session(
        respondent: Any = None, *, task: str = "absolute", subject: int = 1, **of: Any
    ) -> tuple[SessionResult, Path]:
        used: dict[str, Any] = {"models": models, "rig": rig, "session": 1}
        used |= {name: of.pop(name) for name in list(of) if name in (*used, "circumstances")}
        study = of.pop("study", small)
        folder = of.pop("folder", tmp_path)
        circumstances = Circumstances(**of) if of else None
        return run_session(
            task_named(task),
            study,
            subject=subject,
            people=People(respondent=respondent or Scripted(), experimenter=Ready()),
            data_folder=folder,
            circumstances=circumstances,
            **used,
        )

    return session


class Tired(Scripted):
    """Stops after so many answers."""

    def __init__(self, after: int) -> None:
        super().__init__()
        self._after = after

    def wait(self, until: Callable[[], bool]) -> None:
        if self.answered == self._after:
            raise SessionAborted("tired")


def log_beside(manifest: Path) -> Path:
    return manifest.with_name(manifest.name.replace("manifest.json", "log.jsonl"))


def rows_of(manifest: Path) -> list[dict[str, Any]]:
    return [dict(row) for row in session_state(log_beside(manifest)).rows]


def test_git_is_asked_before_the_roster_is_locked(
    run: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    held = []

    def asked(*_: str) -> str:
        held.append(is_held(tmp_path / "sourcedata" / LOCK_NAME))
        return "0" * 40

    monkeypatch.setattr(program, "_git", asked)
    program.program_facts.cache_clear()
    run()
    program.program_facts.cache_clear()
    assert held == [False] * 3


def test_the_manifest_is_complete_before_the_first_trial(
    run: Callable[..., Any], small: Study, models: ModelSets, rig: Any, tmp_path: Path
) -> None:
    rig.stated = {"HandFirmware": "wheel 1.0"}

    class Watchful(Scripted):
        def rate(self, trial: Any, surfaces: Any) -> Any:
            (path,) = tmp_path.rglob("*_manifest.json")
            self.manifest = SessionManifest.load(path)
            return super().rate(trial, surfaces)

    respondent = Watchful()
    run(respondent, sources={"full": "models", "simplified": "fewer"})
    manifest = respondent.manifest
    plan = plan_session(small, task="absolute", subject=1, session=1)
    assert [trial["texture"] for trial in manifest.trials] == [t.texture for t in plan.trials]
    assert manifest.models_sha256 == models.sha256(small.textures)
    assert manifest.study_sha256 == small.sha256
    assert manifest.study["seed"] == small.seed
    assert manifest.model_sources == {"full": "models", "simplified": "fewer"}
    assert manifest.versions["numpy"]
    assert len(manifest.plan_sha256) == 64
    assert manifest.rig == {"HandFirmware": "wheel 1.0"}


def test_textures_whose_models_are_equal_are_marked(
    run: Callable[..., Any], models: ModelSets, tmp_path: Path
) -> None:
    full = models.sets["full"]
    one = ModelSets(
        sets={"full": full, "simplified": {**models.sets["simplified"], "PVC": full["PVC"]}}
    )
    _, manifest = run(models=one)
    assert SessionManifest.load(manifest).identical == {"PVC": (("full", "simplified"),)}
    same = ModelSets(sets={"full": full, "simplified": full})
    with refused(InputError, expected=["simplified", "full"], got="identical"):
        run(models=same, folder=tmp_path / "all")
    assert not (tmp_path / "all").exists()


def test_full_and_simplified_exchanged_are_refused_or_recorded(
    run: Callable[..., Any], models: ModelSets
) -> None:
    swapped = ModelSets(sets={"full": models.sets["simplified"], "simplified": models.sets["full"]})
    with refused(InputError, got=["full", "canvas", "simplified"]):
        run(models=swapped)
    _, manifest = run(models=swapped, override="the names are meant so")
    (record,) = SessionManifest.load(manifest).overrides
    assert record == {"what": "exchanged models", "reason": "the names are meant so"}


def test_a_tray_that_names_its_texture_is_refused_or_recorded_and_read_again(
    run: Callable[..., Any], small: Study, tmp_path: Path
) -> None:
    telling = replace(small, trays={"canvas": "Canvas", "PVC": "B"})
    with refused(InputError, names="--override", got=["'Canvas'", "'canvas'"]):
        run(study=telling, folder=tmp_path / "none")
    assert not (tmp_path / "none").exists()
    _, manifest = run(study=telling, override="they were painted long ago")
    stored = SessionManifest.load(manifest)
    assert stored.overrides == ({"what": "telling trays", "reason": "they were painted long ago"},)
    assert Study.from_dict(stored.study) == telling


def test_a_rig_that_refuses_leaves_nothing(
    run: Callable[..., Any], rig: Any, tmp_path: Path
) -> None:
    def refuse() -> None:
        raise InputError("expected a card, got none; plug it in.")

    rig.open = refuse
    with pytest.raises(InputError, match="expected a card"):
        run(folder=tmp_path / "none")
    assert not (tmp_path / "none").exists()


def test_a_stimulus_that_the_rig_cannot_play_is_refused_before_anything_is_written(
    run: Callable[..., Any], models: ModelSets, tmp_path: Path
) -> None:
    loud = planted_stimulus(np.full(10, 5.01), rate_hz=5000.0)
    one = ModelSets(sets={**models.sets, "simplified": {**models.sets["simplified"], "PVC": loud}})
    with refused(InputError, expected="5 g", got="5.01 g"):
        run(models=one, rig=SimulatedRig(), folder=tmp_path / "data")
    assert not (tmp_path / "data").exists()


def test_consent_and_questions_come_first_and_once(
    run: Callable[..., Any], small: Study, tmp_path: Path
) -> None:
    asking = replace(
        small,
        consent=Consent(version="2026-11"),
        questions=(Question(name="handedness", levels=("left", "right", "not said")),),
    )
    first, again = Scripted(), Scripted()
    _, manifest = run(first, study=asking)
    run(again, task="relative", study=asking)
    (asked,), (known,) = first.asked, again.asked
    assert (asked.known, known.known) == (False, True)
    assert asked.code == known.code == Roster(tmp_path).subjects()[1]["code"]
    welcome = [e for e in read_log(log_beside(manifest)).events if e["event"] == "welcome"]
    assert welcome[0]["consent"] == "2026-11"
    assert welcome[0]["answers"] == {"handedness": "not said"}


def test_an_aborted_session_goes_on_at_the_next_open_trial(run: Callable[..., Any]) -> None:
    result, manifest = run(Tired(3))
    assert (result.completed, result.reason) == (False, "tired")
    with refused(InputError, got=[STEM, "aborted", "--resume"]):
        run()
    result, _ = run(resume=True)
    assert result.completed
    rows = rows_of(manifest)
    assert [row["trial"] for row in rows] == [1, 2, 3, 4, 5]
    assert [row["run"] for row in rows] == [1, 1, 1, 2, 2]
    with refused(InputError, got=[STEM, "complete"]):
        run(resume=True)


def test_a_session_with_catch_trials_goes_on_with_those_that_it_planned(
    run: Callable[..., Any], small: Study, tmp_path: Path
) -> None:
    class Leaving(Scripted):
        def choose(self, trial: Any, surfaces: Surfaces) -> Any:
            if self.answered == 4:
                raise SessionAborted("tired")
            return super().choose(trial, surfaces)

    plan = TaskPlan(
        participants=2,
        schedule="interleaved",
        repeats=2,
        training_trials=1,
        catch={"canvas": "PVC"},
        catch_trials=4,
    )
    study = replace(small, tasks={**small.tasks, "oddity": plan})
    run(Leaving(), task="oddity", study=study)
    none = replace(small, tasks={**small.tasks, "oddity": replace(plan, catch_trials=0)})
    result, manifest = run(task="oddity", study=none, resume=True, override="none left")
    assert result.completed
    planned = SessionManifest.load(manifest).trials
    rows = rows_of(manifest)
    assert [row["run"] for row in rows] == [1] * 4 + [2] * 5
    assert [row["odd_texture"] for row in rows] == [trial["odd_texture"] for trial in planned]
    assert sum(row["odd_texture"] != row["texture"] for row in rows) == 4
    done = {one.task: one.complete for one in study_progress(tmp_path).tasks}
    assert done["oddity"] == 1


def test_both_tries_of_a_trial_that_broke_off_keep_their_own_hand_and_presentations(
    run: Callable[..., Any], rows: Callable[[Path], list[dict[str, str]]]
) -> None:
    class Stroking(Scripted):
        """Strokes for so many readings at each surface; may leave in the second trial."""

        def __init__(self, rig: SimulatedRig, readings: int, *, leaves: bool) -> None:
            super().__init__()
            self._rig, self._readings, self._leaves = rig, readings, leaves

        def rate(self, trial: Any, surfaces: Surfaces) -> Rating:
            surfaces.start()
            for _ in range(2):
                for _ in range(self._readings):
                    self._rig.read()
                surfaces.toggle()
            if self._leaves and self.answered == 1:
                raise SessionAborted("tired")
            self.answered += 1
            return Rating(magnitude_similarity=1.0, frequency_similarity=2.0, response_time_s=3.0)

    twin = SimulatedRig()
    _, manifest = run(Stroking(twin, 10, leaves=True), rig=twin)
    twin = SimulatedRig()  # whose clock begins anew
    run(Stroking(twin, 30, leaves=False), rig=twin, resume=True)
    stem = str(manifest).removesuffix("manifest.json")
    hand, shown = (rows(Path(f"{stem}{name}.tsv")) for name in ("hand", "presentations"))
    of_second = [row for row in hand if row["trial"] == "2"]
    assert Counter(row["run"] for row in of_second) == {
        "1": 21 * 5,
        "2": 61 * 5,
    }  # one as it begins
    assert {row["run"] for row in hand if row["trial"] == "1"} == {"1"}
    assert {row["run"] for row in hand if row["trial"] == "3"} == {"2"}
    assert [(r["run"], r["trial"]) for r in shown][:9:3] == [("1", "1"), ("1", "2"), ("2", "2")]
    data = manifest.parents[3]
    export_session(data, manifest)
    (events,) = data.rglob("*_events.tsv")
    presented = [row for row in rows(events) if row["trial_type"] == "presented"]
    durations = {
        run: [float(row["duration"]) for row in presented if (row["run"], row["trial"]) == run]
        for run in (("1", "2"), ("2", "2"))
    }
    assert durations["1", "2"] == pytest.approx([0.1, 0.1, 0.0])
    assert durations["2", "2"] == pytest.approx([0.3, 0.3, 0.0])
    assert len(list(data.rglob("*_physio.tsv.gz"))) == 2


def test_after_a_long_gap_training_comes_again(
    run: Callable[..., Any],
) -> None:
    _, manifest = run(Tired(3))
    log = log_beside(manifest)
    year = read_log(log).events[0]["utc"][:5]
    change_text(log, lambda text: text.replace(f'"{year}', f'"{int(year[:4]) - 1}-'))
    run(resume=True)
    rows = rows_of(manifest)
    assert [(row["trial"], row["phase"], row["repeats"]) for row in rows] == [
        (1, "training", None),
        (2, "main", None),
        (3, "main", None),
        (6, "training", 1),
        (4, "main", None),
        (5, "main", None),
    ]


def test_a_changed_study_is_refused_on_resuming_or_recorded_and_the_stored_order_stays(
    run: Callable[..., Any], small: Study
) -> None:
    _, manifest = run(Tired(2))
    before = SessionManifest.load(manifest).trials
    other = replace(small, seed=small.seed + 1)
    with refused(InputError, expected=["study", STEM], got=["seed", "--override"]):
        run(study=other, resume=True)
    result, _ = run(study=other, resume=True, override="the seed was corrected")
    assert result.completed
    assert SessionManifest.load(manifest).trials == before
    by_number = {trial["trial"]: trial for trial in before}
    for row in rows_of(manifest):
        assert row["texture"] == by_number[row["trial"]]["texture"]


class Leaves(Scripted):
    """Stops before anything was asked."""

    def welcome(self, intake: Intake) -> dict[str, str | int]:
        raise SessionAborted("tired")


def test_a_session_goes_on_as_its_manifest_says_whatever_the_study_says_by_now(
    run: Callable[..., Any], small: Study
) -> None:
    age = Question(name="age", least=18, most=99)
    began = replace(small, consent=Consent(version="1"), questions=(age,))
    run(Leaves(), study=began)
    absolute = replace(small.plan_of("absolute"), repeats=2, break_after=1)
    other = replace(
        small,
        consent=Consent(version="2"),
        textures=("canvas", "MDF"),
        trays={"canvas": "A", "MDF": "B"},
        tasks={**small.tasks, "absolute": absolute},
    )
    person = Scripted()
    result, manifest = run(person, study=other, resume=True, override="another room")
    assert result.completed
    planned = SessionManifest.load(manifest).trials
    kept = ("trial", "texture", "model", "tray", "first_surface")
    for row, trial in zip(rows_of(manifest), planned, strict=True):
        assert [row[name] for name in kept] == [trial[name] for name in kept]
    assert {trial["texture"] for trial in planned} == {"canvas", "PVC"}
    assert person.rests == 0
    assert [(asked.consent, asked.questions) for asked in person.asked] == [("1", (age,))]


def test_a_session_of_which_a_model_is_gone_is_refused_and_can_still_go_on(
    run: Callable[..., Any], small: Study, models: ModelSets
) -> None:
    _, manifest = run(Tired(2))
    other = replace(small, textures=("canvas", "MDF"), trays={"canvas": "A", "MDF": "B"})
    fewer = {name: {t: of[t] for t in ("canvas", "MDF")} for name, of in models.sets.items()}
    changed = {"study": other, "resume": True, "override": "PVC is lost"}
    with refused(InputError, got="PVC") as told:
        run(models=ModelSets(sets=fewer), **changed)
    assert "\n" not in str(told.value)
    assert [row["trial"] for row in rows_of(manifest)] == [1, 2]
    result, _ = run(resume=True)
    assert result.completed
    assert [row["trial"] for row in rows_of(manifest)] == [1, 2, 3, 4, 5]


def test_another_language_on_going_on_is_noted_and_the_manifest_stays(
    run: Callable[..., Any], small: Study
) -> None:
    both = replace(small, languages=("en", "ja"))
    _, manifest = run(Tired(2), study=both, language="ja")
    run(Tired(1), study=both, language="ja", resume=True)
    run(study=both, language="en", resume=True)
    assert SessionManifest.load(manifest).language == "ja"
    opened = [e for e in read_log(log_beside(manifest)).events if e["event"] == "opened"]
    assert [event.get("changed", {}).get("language") for event in opened] == [None, None, "en"]


TEXTS = {"en": {"rest.title": 'Time for a "break"', "keys": "Keys:\nTab, \\ and \x7f"}}


def test_what_is_read_is_stored_before_the_first_trial(
    run: Callable[..., Any], tmp_path: Path
) -> None:
    class Watchful(Scripted):
        def rate(self, trial: Any, surfaces: Any) -> Any:
            self.seen = [path.read_text("utf-8") for path in tmp_path.rglob("texts_en_*.toml")]
            return super().rate(trial, surfaces)

    respondent = Watchful()
    _, manifest = run(respondent, texts=TEXTS)
    assert [tomllib.loads(text) for text in respondent.seen] == [TEXTS["en"]]
    assert list(SessionManifest.load(manifest).texts_sha256 or {}) == ["en"]


def test_without_what_is_read_no_session_begins(
    run: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(path: Path, text: str) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))

    monkeypatch.setattr("tactileq.experiments.sessions.kept.texts.write_text", refuse)
    with refused(StoreError, names="full disk"):
        run(texts=TEXTS)
    assert not list(tmp_path.rglob("*_manifest.json"))
    assert not list(tmp_path.rglob("texts_*"))
    _, manifest = run(Tired(2))
    before = log_beside(manifest).read_bytes()
    with refused(StoreError, names="full disk"):
        run(texts=TEXTS, resume=True)
    assert log_beside(manifest).read_bytes() == before
    assert run(resume=True)[0].completed  # nobody holds the session any more


def test_a_session_of_before_texts_were_stored_goes_on(run: Callable[..., Any]) -> None:
    _, manifest = run(Tired(2))
    assert "texts_sha256" not in SessionManifest.load(manifest).values
    result, _ = run(resume=True, texts=TEXTS)
    assert result.completed
    *_, opened = (e for e in read_log(log_beside(manifest)).events if e["event"] == "opened")
    stored = {path.name for path in manifest.parents[2].glob("texts_*")}
    assert {f"texts_en_{opened['changed']['texts_sha256']['en'][:16]}.toml"} == stored


def test_texts_of_other_languages_than_the_studys_are_refused(run: Callable[..., Any]) -> None:
    with refused(InputError, expected=["language", "en"], got="de"):
        run(texts={"de": TEXTS["en"]})


@pytest.mark.parametrize("number", [errno.EIO, errno.ENOSPC])
def test_an_answer_that_the_disk_did_not_keep_is_asked_for_again(
    run: Callable[..., Any], rig: Any, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    class Unlucky(Scripted):
        def rate(self, trial: Any, surfaces: Any) -> Any:
            rating = super().rate(trial, surfaces)
            if self.answered == 3:
                monkeypatch.setattr(os, "fsync", refuse)
            return rating

    def refuse(handle: int) -> None:
        raise OSError(number, os.strerror(number))

    reason = reason_of(OSError(number, ""))
    with refused(StoreError, expected=f"{STEM}_log.jsonl", got=[reason, "--resume"]) as told:
        run(Unlucky())
    monkeypatch.undo()
    assert "\n" not in str(told.value)
    assert not rig.opened
    result, manifest = run(resume=True)
    assert result.completed
    rows = rows_of(manifest)
    assert [(row["trial"], row["run"]) for row in rows] == [(1, 1), (2, 1), (3, 2), (4, 2), (5, 2)]


def test_the_second_day_comes_after_the_first_and_on_another_date(run: Callable[..., Any]) -> None:
    with refused(InputError, expected=["sub-01_ses-01_task-relative", "complete", "session 2"]):
        run(task="relative", session=2)
    run(task="relative")
    person = Scripted()
    person.simulated = False
    result, manifest = run(task="relative", session=2)  # nobody has to wait who is simulated
    assert result.completed
    assert SessionManifest.load(manifest).overrides == ()


def test_people_and_simulations_never_share_a_folder(run: Callable[..., Any]) -> None:
    run()
    person = Scripted()
    person.simulated = False
    with refused(InputError, expected=["SimulatedParticipant", False], got=True):
        run(person, subject=2)


def test_a_language_that_the_study_lacks_is_refused(run: Callable[..., Any]) -> None:
    with refused(InputError, expected=["language", "en"], got="'ja'"):
        run(language="ja")


def test_a_replacement_gets_the_slot_of_a_dropout(
    run: Callable[..., Any], small: Study, tmp_path: Path
) -> None:
    run(subject=1)
    run(subject=2)
    with refused(InputError, expected=["subject", 1, 2], got=3):
        run(subject=3)
    Roster(tmp_path).drop(1)
    _, manifest = run(subject=3)
    stored = SessionManifest.load(manifest)
    assert (stored.subject, stored.slot) == (3, 1)
    plan = plan_session(small, task="absolute", subject=3, session=1, slot=1)
    assert [trial["texture"] for trial in stored.trials] == [t.texture for t in plan.trials]


def test_who_is_refused_is_not_enrolled(run: Callable[..., Any], tmp_path: Path) -> None:
    run()
    person = Scripted()
    person.simulated = False
    for wrong in ({"subject": 2, "respondent": person}, {"subject": 2, "session": 7}):
        with pytest.raises(InputError):
            run(**wrong)
    with refused(InputError, got=["sub-02_ses-01_task-absolute_manifest.json", "--resume"]):
        run(subject=2, resume=True)
    assert list(Roster(tmp_path).subjects()) == [1]
    assert run(subject=2)[0].completed


def test_another_consent_is_asked_for_again(run: Callable[..., Any], small: Study) -> None:
    again = Scripted()
    run(study=replace(small, consent=Consent(version="1")))
    run(
        again,
        task="relative",
        study=replace(small, consent=Consent(version="2")),
        override="the ethics committee asked for another form",
    )
    assert not again.asked[0].known


def set_clock(moment: datetime, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (log, admission):
        monkeypatch.setattr(module, "now_utc", lambda: moment)


@pytest.mark.parametrize("year", [1970, 1999, 2200])
def test_no_session_begins_by_a_clock_whose_times_cannot_be_read(
    run: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, year: int
) -> None:
    set_clock(datetime(year, 7, 1, tzinfo=UTC), monkeypatch)
    with refused(InputError, expected=["2000", "2199"], got=str(year)):
        run()
    assert list(tmp_path.iterdir()) == []


def test_a_clock_that_was_set_back_is_told_and_what_it_stores_can_be_read(
    run: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[str] = []
    set_clock(datetime(2026, 7, 1, tzinfo=UTC), monkeypatch)
    run(tell=told.append)
    set_clock(datetime(2026, 6, 30, tzinfo=UTC), monkeypatch)
    run(subject=2, tell=told.append)
    (sentence,) = told
    assert "2026-06-30" in sentence
    assert "2026-07-01" in sentence
    held, damaged = held_sessions(tmp_path)
    assert (len(held), damaged) == (2, [])


@pytest.mark.parametrize("year", [1999, 2200])
def test_a_clock_that_is_set_during_a_session_costs_no_answer(
    run: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, year: int
) -> None:
    class Resets(Scripted):
        def wait(self, until: Callable[[], bool]) -> None:
            if self.answered == 2:
                set_clock(datetime(year, 7, 1, tzinfo=UTC), monkeypatch)

    set_clock(datetime(2026, 7, 1, tzinfo=UTC), monkeypatch)
    result, _ = run(Resets())
    assert result.completed
    ((held,), damaged) = held_sessions(tmp_path)
    assert damaged == []
    assert len(held.state.rows) == TRIALS
    assert {event["utc"][:10] for event in held.state.events} == {"2026-07-01"}


def test_an_answer_that_could_not_be_read_again_is_not_written(
    run: Callable[..., Any], tmp_path: Path
) -> None:
    class Wrong(Scripted):
        def rate(self, trial: Any, surfaces: Any) -> Rating:
            rating = super().rate(trial, surfaces)
            return replace(rating, response_time_s=-1.0) if self.answered == 3 else rating

    with pytest.raises(ValueError, match="response_time_s"):
        run(Wrong())
    ((held,), damaged) = held_sessions(tmp_path)
    assert (held.state.status, len(held.state.rows), damaged) == ("crashed", 2, [])
    assert run(resume=True)[0].completed


@pytest.mark.parametrize("mask", [0o002, 0o022, 0o077])
def test_who_may_go_on_with_a_data_set_is_for_the_mask_and_the_folder_to_say(
    run: Callable[..., Any], small: Study, tmp_path: Path, mask: int
) -> None:
    data = tmp_path / "data"
    data.mkdir()
    data.chmod(0o2777 & ~mask)  # what is made in it is of its group
    before = os.umask(mask)
    try:
        run(Tired(2), folder=data)
        run(folder=data, resume=True)
        run(folder=data, subject=2)
        export_all(data)
        withdraw(data, 2)
    finally:
        os.umask(before)
    modes = {path: stat.S_IMODE(path.stat().st_mode) for path in data.rglob("*")}
    assert len(modes) > 20
    for path, mode in modes.items():
        assert mode & 0o777 == (0o777 if path.is_dir() else 0o666) & ~mask, path
    assert all(mode & stat.S_ISGID for path, mode in modes.items() if path.is_dir())


class Refuses(Scripted):
    """Does not agree to the consent form, or leaves its page."""

    def __init__(self, *, leaves: bool) -> None:
        super().__init__()
        self._leaves = leaves

    def consents(self, version: str) -> bool:
        if self._leaves:
            raise SessionAborted("not stated")
        return False


@pytest.mark.parametrize("leaves", [False, True])
def test_of_who_does_not_consent_only_the_count_is_kept(
    run: Callable[..., Any], small: Study, tmp_path: Path, *, leaves: bool
) -> None:
    asking = replace(small, consent=Consent(version="1"))
    refusing = Refuses(leaves=leaves)
    for _ in range(2):
        with pytest.raises(ConsentRefused):
            run(refusing, study=asking)
    assert refusing.heard == ["consent.closing"] * 2
    assert refusing.asked == []
    assert [path.name for path in tmp_path.rglob("*") if path.is_file()] == ["roster.jsonl"]
    assert "utc" not in (tmp_path / "sourcedata/roster.jsonl").read_text()
    listed = Roster(tmp_path).listed()
    assert (listed.declined, listed.entries, listed.damaged, listed.broken) == (2, {}, "", 0)
    result, _ = run(study=asking)  # the number and its slot are free
    assert result.completed
    assert Roster(tmp_path).subjects()[1]["slot"] == 1
    assert study_progress(tmp_path).declined == 2
    export_all(tmp_path)
    wrong = {one.place for one in verify_data(tmp_path).differences}
    assert wrong == {"sourcedata/sub-01/ses-01/sub-01_ses-01_task-absolute_log.jsonl"}


def test_who_refuses_another_consent_stays_as_before(
    run: Callable[..., Any], small: Study, tmp_path: Path
) -> None:
    _, manifest = run(Tired(2), study=replace(small, consent=Consent(version="1")))
    before = log_beside(manifest).read_bytes()
    other = {"study": replace(small, consent=Consent(version="2")), "override": "another form"}
    with pytest.raises(ConsentRefused):
        run(Refuses(leaves=False), task="relative", **other)
    assert log_beside(manifest).read_bytes() == before
    result, _ = run(Refuses(leaves=False), resume=True, **other)  # its own consent was given
    assert result.completed


def test_every_rule_that_is_broken_is_told(run: Callable[..., Any], small: Study) -> None:
    told: list[str] = []
    run()
    run(subject=2, study=replace(small, masking="none"), override="a new room", tell=told.append)
    (sentence,) = told
    assert sentence.startswith("overridden (study): expected a data folder of this study")


# --- Killed between every two events --------------------------------------------------------


def killed_at(event: int, session: Callable[[], object]) -> bool:
    """Run a session in a process that kills itself before this event; whether it was killed."""
    child = os.fork()
    if child == 0:
        counted = Counter[str]()
        log, answer = SessionStore.log, SessionStore.answer

        def count() -> None:
            counted["events"] += 1
            if counted["events"] == event:
                os.kill(os.getpid(), signal.SIGKILL)

        def counting_log(self: SessionStore, name: str, **fields: object) -> None:
            count()
            log(self, name, **fields)

        def counting_answer(self: SessionStore, trial: int, row: Any) -> None:
            count()
            answer(self, trial, row)
            count()  # after it was acknowledged, too

        SessionStore.log, SessionStore.answer = counting_log, counting_answer  # type: ignore[method-assign]
        try:
            session()
        finally:
            os._exit(0)
    _, status = os.waitpid(child, 0)
    return os.WIFSIGNALED(status)


@pytest.mark.usefixtures("unsynced")
def test_killed_between_every_two_events_no_answer_is_lost_or_doubled(
    run: Callable[..., Any], small: Study, tmp_path: Path
) -> None:
    order = [
        trial.trial for trial in plan_session(small, task="absolute", subject=1, session=1).trials
    ]
    event = killed = 0
    while True:
        event += 1
        folder = tmp_path / str(event)
        acknowledged = tmp_path / f"{event}.txt"

        class Telling(Scripted):
            """Notes, outside the session, every trial that it is asked after."""

            def rate(self, trial: Any, surfaces: Any, *, told: Path = acknowledged) -> Any:
                with told.open("a") as file:
                    file.write(f"{trial.trial}\n")
                return super().rate(trial, surfaces)

        if not killed_at(event, lambda f=folder: run(Telling(), folder=f)):
            break
        killed += 1
        begun = (
            [int(line) for line in acknowledged.read_text().split()]
            if (acknowledged.exists())
            else []
        )
        (manifest,) = folder.rglob("*_manifest.json")
        state = session_state(log_beside(manifest))
        kept = [row["trial"] for row in state.rows]
        assert kept == order[: len(kept)]
        if state.events[-1]["event"] == "ended":  # killed when there was nothing more to do
            assert (state.status, kept) == ("complete", order)
            continue
        assert state.status == "crashed"
        assert len(kept) >= len(begun) - 1  # all but the trial that was being answered
        if event % 3:  # gone on with at once, or exported first
            export_all(folder)
        result, _ = run(folder=folder, resume=True)
        assert result.completed
        assert [row["trial"] for row in rows_of(manifest)] == order
    assert killed > 6 * TRIALS
    assert session_state(log_beside(manifest)).status == "complete"


def test_what_a_killed_session_left_can_be_analyzed(
    run: Callable[..., Any], tmp_path: Path
) -> None:
    assert killed_at(20, lambda: run())
    assert export_all(tmp_path).damaged == ()
    (table,) = tmp_path.glob("sub-01/ses-01/beh/*_beh.tsv")
    (manifest,) = tmp_path.rglob("*_manifest.json")
    assert len(table.read_text().splitlines()) - 1 == len(rows_of(manifest))
    run(resume=True)
    export_session(tmp_path, manifest)
    assert len(table.read_text().splitlines()) - 1 == TRIALS
