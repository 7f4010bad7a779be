"""The loop of both protocols: what is presented, asked, stored, and that silence follows."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import wavfile

from experiments.sessions.store import SessionStore, StoreError
from experiments.sessions.surfaces import Rating, SessionAborted, Surfaces
from experiments.study.models import ModelSets
from experiments.study.study import Study
from experiments.tasks.absolute import run_absolute
from experiments.tasks.relative import run_relative
from modeling import InputError
from rig.interface import Acceleration, Fault
from rig.twin import SimulatedRig


def with_simplified(models: ModelSets, simplified: Mapping[str, Any]) -> ModelSets:
    return ModelSets(sets={**models.sets, "simplified": simplified})


def session(study: Study, folder: Path, task: str = "absolute", **parts: Any) -> Any:
    run = run_absolute if task == "absolute" else run_relative
    return run(study, subject=1, session=1, data_folder=folder, **parts)


def log_of(folder: Path, rows: Any) -> list[tuple[str, str]]:
    (path,) = folder.rglob("*_log.tsv")
    return [(row["event"], row["detail"]) for row in rows(path)]


@pytest.mark.parametrize("task", ["absolute", "relative"])
def test_a_person_at_the_simulated_rig_is_stored_as_a_person(
    tmp_path: Path, study: Study, models: ModelSets, rig: Any, respondent: Any, task: str, rows: Any
) -> None:
    respondent.simulated = False
    result = session(study, tmp_path, task, models=models, rig=rig, respondent=respondent)
    sidecar = json.loads(result.path.with_suffix(".json").read_text())
    assert (sidecar["SimulatedParticipant"], sidecar["SimulatedRig"]) == (False, True)
    assert {row["simulated"] for row in rows(result.path)} == {"true"}
    (participant,) = rows(tmp_path / "participants.tsv")
    assert participant["simulated"] == "false"


def test_order_is_on_disk_and_mounting_confirmed_before_anything_is_presented(
    tmp_path: Path, study: Study, models: ModelSets, rig: Any, misbehaving: Any, rows: Any
) -> None:
    class Watchful(misbehaving):
        def confirm_mount(self, tray: str) -> None:
            (order,) = tmp_path.rglob("*_order.json")
            trials = json.loads(order.read_text())["trials"]
            assert tray == trials[len(self.trays)]["tray"]
            assert rig.notes[-1] == ("silence", None)
            assert log_of(tmp_path, rows)[-1][0] == "mount requested"
            super().confirm_mount(tray)

    session(study, tmp_path, models=models, rig=rig, respondent=Watchful())
    events = [event for event, _ in log_of(tmp_path, rows)]
    assert events[:4] == ["session started", "phase started", "mount requested", "mount confirmed"]
    assert events[-1] == "session ended"
    assert events.count("mount confirmed") == 7


@pytest.mark.parametrize("moment", ["confirm_mount", "rate", "announce"])
@pytest.mark.parametrize("error", [RuntimeError("pen fell"), KeyboardInterrupt()])
def test_silence_follows_any_exception(
    moment: str,
    error: BaseException,
    *,
    tmp_path: Path,
    study: Study,
    models: ModelSets,
    rig: Any,
    respondent: Any,
    rows: Any,
) -> None:
    def fail(*_: object) -> None:
        rig.notes.append(("sound", None))
        raise error

    setattr(respondent, moment, fail)
    with pytest.raises(type(error)):
        session(study, tmp_path, models=models, rig=rig, respondent=respondent)
    assert rig.notes[-1] == ("silence", None)
    assert log_of(tmp_path, rows)[-1][0] == "session broken off"


def test_silence_follows_a_broken_rig(
    tmp_path: Path, study: Study, models: ModelSets, rig: Any, respondent: Any
) -> None:
    rig.broken = True
    with pytest.raises(RuntimeError, match="vibrator"):
        session(study, tmp_path, models=models, rig=rig, respondent=respondent)
    assert rig.notes[-1] == ("silence", None)


def test_silence_follows_a_full_disk_and_the_disk_is_blamed(
    *,
    tmp_path: Path,
    study: Study,
    models: ModelSets,
    rig: Any,
    respondent: Any,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def full(*_: object) -> None:
        raise StoreError("no space")

    def announce(*_: object) -> None:
        monkeypatch.setattr(SessionStore, "append", full)
        monkeypatch.setattr(SessionStore, "log", full)

    respondent.rate = lambda trial, surfaces: Rating(
        magnitude_similarity=1.0, frequency_similarity=1.0, response_time_s=1.0
    )
    respondent.announce = announce
    with pytest.raises(StoreError, match="no space"):
        session(study, tmp_path, models=models, rig=rig, respondent=respondent)
    assert rig.notes[-1] == ("silence", None)


def test_an_abort_keeps_the_answers_and_is_logged(
    tmp_path: Path, study: Study, models: ModelSets, rig: Any, misbehaving: Any, rows: Any
) -> None:
    class Tired(misbehaving):
        def confirm_mount(self, tray: str) -> None:
            if self.answered == 2:
                raise SessionAborted

    result = session(study, tmp_path, models=models, rig=rig, respondent=Tired())
    assert (result.answered, result.planned, result.completed) == (2, 7, False)
    assert len(rows(result.path)) == 2
    assert rig.notes[-1] == ("silence", None)
    assert log_of(tmp_path, rows)[-1] == ("session aborted", "2 trials answered")


def test_escape_on_the_last_page_is_no_abort(
    tmp_path: Path, study: Study, models: ModelSets, rig: Any, misbehaving: Any, rows: Any
) -> None:
    class InAHurry(misbehaving):
        def announce(self, title: str, text: str) -> None:
            if title == "Thank you":
                raise SessionAborted

    result = session(study, tmp_path, models=models, rig=rig, respondent=InAHurry())
    assert result.completed
    assert log_of(tmp_path, rows)[-1][0] == "session ended"


def test_a_missing_model_is_told_before_anything_is_written(
    tmp_path: Path, study: Study, models: ModelSets, rig: Any, respondent: Any
) -> None:
    few = with_simplified(models, {"PVC": models.sets["full"]["PVC"]})
    with pytest.raises(InputError, match=r"a simplified model of each texture.*canvas, MDF"):
        session(study, tmp_path / "data", models=few, rig=rig, respondent=respondent)
    assert not (tmp_path / "data").exists()


def test_one_identical_pair_of_models_is_a_control_and_all_are_refused(
    tmp_path: Path, study: Study, models: ModelSets, rig: Any, respondent: Any
) -> None:
    one = with_simplified(models, {**models.sets["simplified"], "PVC": models.sets["full"]["PVC"]})
    assert "PVC" in one.identical(study.textures)
    result = session(study, tmp_path / "one", models=one, rig=rig, respondent=respondent)
    assert result.completed
    description = json.loads((tmp_path / "one/dataset_description.json").read_text())
    sidecar = json.loads(result.path.with_suffix(".json").read_text())
    for stated in (description, sidecar):
        assert stated["ModelsSHA256"] == one.sha256(study.textures)
        assert stated["StudySHA256"] == study.sha256
    assert len(set(sidecar["ModelsSHA256"]["PVC"].values())) == 1
    same = ModelSets(sets={"full": models.sets["full"], "simplified": models.sets["full"]})
    with pytest.raises(InputError, match="identical ones for all"):
        session(study, tmp_path / "all", models=same, rig=rig, respondent=respondent)
    assert not (tmp_path / "all").exists()


def test_sessions_with_other_models_need_another_data_folder(
    tmp_path: Path, study: Study, models: ModelSets, rig: Any, respondent: Any
) -> None:
    session(study, tmp_path, models=models, rig=rig, respondent=respondent)
    other = with_simplified(
        models, {**models.sets["simplified"], "PVC": models.sets["full"]["PVC"]}
    )
    with pytest.raises(InputError, match="ModelsSHA256 unchanged.*another PVC"):
        run_absolute(
            study,
            subject=2,
            session=1,
            models=other,
            rig=rig,
            respondent=respondent,
            data_folder=tmp_path,
        )


def test_the_rigs_button_toggles_and_old_presses_do_not_count(models: ModelSets, rig: Any) -> None:
    rig.presses = 1
    surfaces = Surfaces(rig, texture="PVC", models=[models.sets["full"]["PVC"]])
    surfaces.present_real()
    surfaces.follow_rig_button()
    assert surfaces.shows_real
    assert surfaces.switches == 0
    rig.presses = 2
    for _ in range(4):
        surfaces.follow_rig_button()
    assert surfaces.shows_real
    assert surfaces.switches == 2
    assert surfaces.presses == 1


def test_toggling_among_several_returns_to_the_one_presented_last(
    models: ModelSets, rig: Any
) -> None:
    surfaces = Surfaces(rig, texture="PVC", models=list(models.sets["full"].values()))
    surfaces.present_real()
    surfaces.toggle()
    assert surfaces.shows_real
    assert surfaces.selected is None
    surfaces.present_virtual(2)
    surfaces.toggle()
    surfaces.toggle()
    assert rig.notes[-1] == ("virtual", list(models.sets["full"].values())[2])
    assert (surfaces.selected, surfaces.presses, surfaces.switches) == (2, 2, 3)
    with pytest.raises(InputError, match="button from 0 to 2"):
        surfaces.present_virtual(3)


@pytest.mark.parametrize("value", [-0.1, 100.1, float("nan")])
def test_impossible_ratings_are_refused(value: float) -> None:
    with pytest.raises(InputError, match="from 0 to 100"):
        Rating(magnitude_similarity=value, frequency_similarity=50.0, response_time_s=1.0)


def test_the_rig_is_open_during_the_session_only_and_one_that_refuses_leaves_nothing(
    tmp_path: Path, study: Study, models: ModelSets, rig: Any, misbehaving: Any
) -> None:
    class Watchful(misbehaving):
        def confirm_mount(self, tray: str) -> None:
            assert rig.opened

    session(study, tmp_path / "data", models=models, rig=rig, respondent=Watchful())
    assert not rig.opened

    def refuse() -> None:
        raise InputError("expected a card, got none; plug it in.")

    rig.open = refuse
    with pytest.raises(InputError, match="expected a card"):
        session(study, tmp_path / "none", models=models, rig=rig, respondent=Watchful())
    assert not (tmp_path / "none").exists()


def failing(misbehaving: Any, rig: Any, *, at: set[int], invalidates: bool = True) -> Any:
    """A respondent in some of whose answers (from 1) the rig fails."""

    class Unlucky(misbehaving):
        def rate(self, trial: Any, surfaces: Surfaces) -> Rating:
            if self.answered + 1 in at:
                told = "expected a sound process that plays, got none; it was started again."
                rig.faults.append(Fault(1.5, told, invalidates))
            rating: Rating = super().rate(trial, surfaces)
            return rating

    return Unlucky()


def test_trials_in_which_the_rig_failed_are_stored_and_repeated_once_at_the_end_of_their_phase(
    tmp_path: Path, study: Study, models: ModelSets, rig: Any, misbehaving: Any, rows: Any
) -> None:
    # The training trial, the second main trial, and the repeat of the latter.
    unlucky = failing(misbehaving, rig, at={1, 4, 9})
    result = session(study, tmp_path, models=models, rig=rig, respondent=unlucky)
    assert (result.planned, result.answered, result.invalid) == (9, 9, 3)
    assert result.completed
    stored = rows(result.path)
    places = [(row["trial"], row["phase"], row["valid"], row["repeats"]) for row in stored]
    assert places == [
        ("1", "training", "0", "n/a"),
        ("8", "training", "1", "1"),
        ("2", "main", "1", "n/a"),
        ("3", "main", "0", "n/a"),
        *((str(number), "main", "1", "n/a") for number in (4, 5, 6, 7)),
        ("9", "main", "0", "3"),
    ]
    for again, before in ((stored[1], stored[0]), (stored[8], stored[3])):
        same = ("texture", "model", "tray", "first_surface")
        assert [again[name] for name in same] == [before[name] for name in same]
    assert unlucky.heard.count("Please call the experimenter") == 3
    told = [detail for event, detail in log_of(tmp_path, rows) if event == "fault"]
    assert [detail.split(":")[0] for detail in told] == [
        "trial 1, 1.5000 s after opening",
        "trial 3, 1.5000 s after opening",
        "trial 9, 1.5000 s after opening",
    ]


def test_a_fault_that_changed_nothing_for_the_hand_and_one_between_trials_are_only_logged(
    tmp_path: Path, study: Study, models: ModelSets, rig: Any, misbehaving: Any, rows: Any
) -> None:
    class Unlucky(misbehaving):
        def confirm_mount(self, tray: str) -> None:
            rig.faults.append(Fault(0.5, "expected a process, got none.", invalidates=True))

    harmless = failing(misbehaving, rig, at={2}, invalidates=False)
    for number, respondent in enumerate((harmless, Unlucky())):
        folder = tmp_path / str(number)
        result = session(study, folder, models=models, rig=rig, respondent=respondent)
        assert {row["valid"] for row in rows(result.path)} == {"1"}
        assert "fault" in [event for event, _ in log_of(folder, rows)]


class Stroking(SimulatedRig):
    """Its participant feels each presentation for half a second."""

    def present_model(self, model: Any) -> float:
        return self._felt_for(super().present_model(model))

    def present_real(self, texture: str) -> float:
        return self._felt_for(super().present_real(texture))

    def _felt_for(self, began_s: float) -> float:
        for _ in range(50):
            self.read()
        return began_s


def test_the_hands_history_and_the_presentations_of_each_trial_are_kept(
    tmp_path: Path, study: Study, models: ModelSets, respondent: Any, rows: Any
) -> None:
    result = session(study, tmp_path, models=models, rig=Stroking(), respondent=respondent)
    stem = str(result.path.name).removesuffix("_beh.tsv")
    source = tmp_path / "sourcedata/sub-01/ses-01"
    hand = rows(source / f"{stem}_hand.tsv")
    shown = rows(source / f"{stem}_presentations.tsv")
    for name, table in (("hand", hand), ("presentations", shown)):
        described = json.loads((source / f"{stem}_{name}.json").read_text())
        assert list(described) == list(table[0])
        assert all(column["Description"] for column in described.values())
    answers = rows(result.path)
    assert [row["trial"] for row in shown] == [row["trial"] for row in answers for _ in range(3)]
    for answer in answers:
        trial = [row for row in hand if row["trial"] == answer["trial"]]
        times = [float(row["time_s"]) for row in trial]
        assert len(trial) >= 3 * 250
        assert all(0 < b - a < 0.005 for a, b in pairwise(times))
        assert {row["surface"] for row in trial} >= {"real", "virtual"}
        assert {row["force_assumed"] for row in trial} == {"0"}
    speeds = {float(row["speed_mm_s"]) for row in hand}
    assert min(speeds) < -200
    assert max(speeds) > 200
    for row in shown:
        assert float(row["end_s"]) > float(row["start_s"])
        if row["surface"] == "virtual":
            assert float(row["dose_g2_s"]) > 0
            assert 0 < float(row["outside_share"]) < 0.5
            assert len(row["model_sha256"]) == 64
        else:
            assert (row["dose_g2_s"], row["outside_share"]) == ("0", "n/a")


def test_what_was_measured_at_the_pen_is_kept_in_g(
    tmp_path: Path, study: Study, models: ModelSets, rig: Any, respondent: Any, rows: Any
) -> None:
    samples = np.linspace(-3.0, 3.0, 480)
    pieces = [(), ()]  # before and after each trial; something was measured in the second one only
    measured = Acceleration(start_s=12.25, rate_hz=48000.0, samples_g=samples)
    told = iter([*pieces, (), (measured, measured)])
    rig.take_acceleration = lambda: next(told, ())
    session(study, tmp_path, models=models, rig=rig, respondent=respondent)
    found = sorted(tmp_path.rglob("*.wav"))
    stem = "sub-01_ses-01_task-absolute_trial-002_pen"
    assert [path.name for path in found] == [f"{stem}-1.wav", f"{stem}-2.wav"]
    rate_hz, kept = wavfile.read(found[0])
    assert rate_hz == 48000
    assert kept == pytest.approx(samples, abs=1e-6)
    logged = [detail for event, detail in log_of(tmp_path, rows) if event == "pen recorded"]
    assert logged[0] == f"{stem}-1.wav, first sample 12.250000 s after opening"


def test_who_strokes_outside_the_models_grid_is_told_after_the_trial(
    tmp_path: Path, study: Study, models: ModelSets, respondent: Any, rows: Any
) -> None:
    slow = {
        name: {texture: at_speeds(model, 1e-4) for texture, model in kinds.items()}
        for name, kinds in models.sets.items()
    }
    session(study, tmp_path, models=ModelSets(sets=slow), rig=Stroking(), respondent=respondent)
    assert respondent.heard.count("Your strokes") == 7
    told = [d for event, d in log_of(tmp_path, rows) if event == "hand outside the grid"]
    assert len(told) == 7
    assert "mostly too fast; please stroke more slowly" in told[0]


def at_speeds(model: Any, factor: float) -> Any:
    """The model as if it had been recorded at other speeds."""
    return replace(model, speeds_mm_s=model.speeds_mm_s * factor)


def test_a_response_begins_with_the_first_sample_on_whatever_clock_the_rig_has(
    models: ModelSets, rig: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    host = [100.0]
    monkeypatch.setattr("experiments.sessions.surfaces.time.perf_counter", lambda: host[0])
    rig.now_s = lambda: 7.0
    rig.present_real = lambda texture: 6.75  # the first sample left 0.25 s ago
    surfaces = Surfaces(rig, texture="PVC", models=[models.sets["full"]["PVC"]])
    assert surfaces.response_time_s == 0.0
    surfaces.present_real()
    assert surfaces.first_sample_s == 6.75
    host[0] += 2.0
    assert surfaces.response_time_s == pytest.approx(2.25)
    surfaces.present_virtual()  # a later presentation changes nothing
    assert surfaces.response_time_s == pytest.approx(2.25)
