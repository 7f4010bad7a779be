"""Whole simulated studies through the very same protocols, store and loop."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any

from tactileq import Study, simulate_study
from tactileq.experiments.observers.in_memory import simulate_sessions
from tactileq.experiments.observers.percepts import Perception
from tactileq.experiments.observers.psychometrics import Psychometrics
from tactileq.experiments.study.models import ModelSets
from tactileq.modeling import InputError, TextureModel, Threshold
from tactileq.rig.desk.twin import SimulatedRig
from tests.refusals import refused


def simulate(study: Study, folder: Path, truths: Any, models: ModelSets, **more: Any) -> Any:
    return simulate_study(
        study,
        real=truths,
        models=models,
        rig=SimulatedRig(truths),
        data_folder=folder,
        **{"seed": 3, **more},
    )


def test_each_participant_meets_either_model_on_one_day(
    tmp_path: Path,
    study: Study,
    truths: dict[str, TextureModel],
    models: ModelSets,
    threshold: Threshold,
    rows: Any,
) -> None:
    steps: list[tuple[int, int]] = []
    results = simulate(
        study,
        tmp_path,
        truths,
        models,
        threshold=threshold,
        progress=lambda done, total, name: steps.append((done, total)),
    )
    assert len(results) == 3 + 2 * 4
    assert all(result.completed for result in results)
    assert steps == [(n, len(results)) for n in range(1, len(results) + 1)]
    assert json.loads((tmp_path / "dataset_description.json").read_text())["Simulated"] is True
    days = {
        (subject, day): {
            row["model"]
            for path in tmp_path.glob(f"sub-0{subject}/ses-0{day}/beh/*relative_beh.tsv")
            for row in rows(path)
        }
        for subject in (1, 2, 3, 4)
        for day in (1, 2)
    }
    assert all(len(met) == 1 for met in days.values())
    first = Counter(next(iter(days[subject, 1])) for subject in (1, 2, 3, 4))
    assert first == {"full": 2, "simplified": 2}
    assert all(days[subject, 1] != days[subject, 2] for subject in (1, 2, 3, 4))


def value_of(cell: object) -> float | str:
    """A number as a number, whether a table holds it as 74 or as 74.0."""
    try:
        return float(str(cell))
    except ValueError:
        return str(cell)


def test_a_seed_fixes_every_answer_and_memory_holds_the_same(
    tmp_path: Path,
    study: Study,
    truths: dict[str, TextureModel],
    models: ModelSets,
    threshold: Threshold,
    rows: Any,
) -> None:
    stored = {}
    for name, seed in (("first", 3), ("again", 3), ("other", 4)):
        simulate(study, tmp_path / name, truths, models, threshold=threshold, seed=seed)
        stored[name] = [
            {"participant": int(path.name[4:6]), "session": int(path.name[11:13]), **row}
            for path in sorted((tmp_path / name).rglob("*_beh.tsv"))
            for row in rows(path)
        ]
    assert stored["first"] == stored["again"]
    assert stored["first"] != stored["other"]
    kept = simulate_sessions(
        study,
        models=models,
        perception=Perception(study, real=truths, models=models, threshold=threshold),
        psychometrics=Psychometrics(),
        seed=3,
    )
    for task, mark in (("absolute", "magnitude_similarity"), ("relative", "presses")):
        compared = ("participant", "session", "trial", "texture", "model", mark, "response_time_s")
        on_disk = [row for row in stored["first"] if mark in row]
        assert len(on_disk) == len(kept[task])
        for there, here in zip(on_disk, kept[task], strict=True):
            wanted = [value_of(here[name]) for name in compared]
            assert [value_of(there[name]) for name in compared] == wanted


def test_a_study_is_not_simulated_twice_into_one_folder(
    tmp_path: Path,
    study: Study,
    truths: dict[str, TextureModel],
    models: ModelSets,
    threshold: Threshold,
) -> None:
    simulate(study, tmp_path, truths, models, threshold=threshold)
    with refused(InputError, expected="session", got="complete"):
        simulate(study, tmp_path, truths, models, threshold=threshold)
