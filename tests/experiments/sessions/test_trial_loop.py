"""The loop of both protocols: what is presented, asked, stored, and that silence follows."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from experiments.sessions.store import SessionStore, StoreError
from experiments.sessions.surfaces import Rating, SessionAborted, Surfaces
from experiments.study.models import ModelSets
from experiments.study.study import Study
from experiments.tasks.absolute import run_absolute
from experiments.tasks.relative import run_relative
from modeling import InputError


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
    few = ModelSets(full=models.full, simplified={"PVC": models.full["PVC"]})
    with pytest.raises(InputError, match=r"a simplified model of each texture.*canvas, MDF"):
        session(study, tmp_path / "data", models=few, rig=rig, respondent=respondent)
    assert not (tmp_path / "data").exists()


def test_one_identical_pair_of_models_is_a_control_and_all_are_refused(
    tmp_path: Path, study: Study, models: ModelSets, rig: Any, respondent: Any
) -> None:
    one = ModelSets(full=models.full, simplified={**models.simplified, "PVC": models.full["PVC"]})
    assert "PVC" in one.identical(study.textures)
    result = session(study, tmp_path / "one", models=one, rig=rig, respondent=respondent)
    assert result.completed
    description = json.loads((tmp_path / "one/dataset_description.json").read_text())
    sidecar = json.loads(result.path.with_suffix(".json").read_text())
    for stated in (description, sidecar):
        assert stated["ModelsSHA256"] == one.sha256(study.textures)
        assert stated["StudySHA256"] == study.sha256
    assert len(set(sidecar["ModelsSHA256"]["PVC"].values())) == 1
    same = ModelSets(full=models.full, simplified=models.full)
    with pytest.raises(InputError, match="identical ones for all"):
        session(study, tmp_path / "all", models=same, rig=rig, respondent=respondent)
    assert not (tmp_path / "all").exists()


def test_sessions_with_other_models_need_another_data_folder(
    tmp_path: Path, study: Study, models: ModelSets, rig: Any, respondent: Any
) -> None:
    session(study, tmp_path, models=models, rig=rig, respondent=respondent)
    other = ModelSets(full=models.full, simplified={**models.simplified, "PVC": models.full["PVC"]})
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
    surfaces = Surfaces(rig, texture="PVC", models=[models.full["PVC"]])
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
    surfaces = Surfaces(rig, texture="PVC", models=list(models.full.values()))
    surfaces.present_real()
    surfaces.toggle()
    assert surfaces.shows_real
    assert surfaces.selected is None
    surfaces.present_virtual(2)
    surfaces.toggle()
    surfaces.toggle()
    assert rig.notes[-1] == ("virtual", list(models.full.values())[2])
    assert (surfaces.selected, surfaces.presses, surfaces.switches) == (2, 2, 3)
    with pytest.raises(InputError, match="button from 0 to 2"):
        surfaces.present_virtual(3)


@pytest.mark.parametrize("value", [-0.1, 100.1, float("nan")])
def test_impossible_ratings_are_refused(value: float) -> None:
    with pytest.raises(InputError, match="from 0 to 100"):
        Rating(magnitude_similarity=value, frequency_similarity=50.0, response_time_s=1.0)
