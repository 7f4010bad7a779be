"""Both tasks of the paper: what each presents, asks and stores."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from experiments.study.models import ModelSets
from experiments.study.study import Study
from experiments.tasks import plan_session, task_named
from experiments.tasks.absolute import run_absolute
from experiments.tasks.relative import run_relative
from modeling import InputError
from modeling.files.answer_tables import ANSWER_TABLES


def test_an_absolute_session_is_stored_as_it_went(
    tmp_path: Path, study: Study, models: ModelSets, rig: Any, respondent: Any, rows: Any
) -> None:
    result = run_absolute(
        study,
        subject=1,
        session=1,
        data_folder=tmp_path,
        models=models,
        rig=rig,
        respondent=respondent,
    )
    trials = plan_session(study, task="absolute", subject=1, session=1).trials
    stored = rows(result.path)
    assert result.completed
    assert len(stored) == len(trials) == 7
    assert list(stored[0]) == [
        "trial",
        "phase",
        "texture",
        "model",
        "tray",
        "first_surface",
        "magnitude_similarity",
        "frequency_similarity",
        "toggles",
        "response_time_s",
        "valid",
        "repeats",
        "simulated",
    ]
    for row, trial in zip(stored, trials, strict=True):
        assert (row["texture"], row["model"]) == (trial.texture, trial.model)
        assert (row["tray"], row["first_surface"]) == (trial.tray, trial.first_surface)
        assert (row["magnitude_similarity"], row["frequency_similarity"]) == ("70", "30.5")
        assert (row["toggles"], row["simulated"]) == ("2", "true")
    assert respondent.trays == [trial.tray for trial in trials]
    assert respondent.heard == ["Training", "The ratings begin", "Thank you"]


def test_each_absolute_trial_presents_its_own_surfaces_in_its_own_order(
    tmp_path: Path, study: Study, models: ModelSets, rig: Any, respondent: Any
) -> None:
    run_absolute(
        study,
        subject=1,
        session=1,
        data_folder=tmp_path,
        models=models,
        rig=rig,
        respondent=respondent,
    )
    wanted: list[tuple[str, object]] = [("silence", None)]
    for trial in plan_session(study, task="absolute", subject=1, session=1).trials:
        real = ("real", trial.texture)
        virtual = ("virtual", models.of(trial.texture, trial.model))
        first, second = (real, virtual) if trial.first_surface == "real" else (virtual, real)
        wanted += [first, second, first, ("silence", None)]
    assert rig.notes == [*wanted, ("silence", None)]


def test_a_relative_session_is_stored_as_it_went(
    tmp_path: Path, study: Study, models: ModelSets, rig: Any, respondent: Any, rows: Any
) -> None:
    result = run_relative(
        study,
        subject=1,
        session=1,
        data_folder=tmp_path,
        models=models,
        rig=rig,
        respondent=respondent,
    )
    trials = plan_session(study, task="relative", subject=1, session=1).trials
    stored = rows(result.path)
    assert list(stored[0]) == [
        "trial",
        "phase",
        "texture",
        "model",
        "tray",
        "layout",
        "answer",
        "correct",
        "presses",
        "response_time_s",
        "valid",
        "repeats",
        "simulated",
    ]
    for row, trial in zip(stored, trials, strict=True):
        assert row["layout"].split("|") == list(trial.layout)
        assert row["answer"] == trial.layout[1]
        assert row["correct"] == str(int(trial.layout[1] == trial.texture))
        assert (row["presses"], row["response_time_s"]) == ("3", "3.25")
    presented = [note for note in rig.notes if note[0] != "silence"][:4]
    first = trials[0]
    layout = [models.of(texture, first.model) for texture in first.layout]
    assert presented == [
        ("real", first.texture),
        ("virtual", layout[0]),
        ("virtual", layout[1]),
        ("virtual", layout[1]),
    ]


def test_every_declared_table_has_its_task_and_another_name_is_refused() -> None:
    for name in ANSWER_TABLES:
        assert task_named(name).name == name
        assert {"training", "main", "closing"} <= set(task_named(name).texts)
    with pytest.raises(InputError, match="expected the task absolute or .*, got 'os'"):
        task_named("os")
