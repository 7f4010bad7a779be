"""The format that both rooms share: what the experiments write, the analysis reads."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tactileq.analysis.answers.loading import load_responses
from tactileq.analysis.answers.responses import PlannedTask, Responses
from tactileq.analysis.statistics.confusion import confusion_matrices
from tactileq.analysis.statistics.described_verdicts import incomplete
from tactileq.analysis.statistics.verdicts import claims_found
from tactileq.experiments.observers.whole_study import simulate_study
from tactileq.experiments.study.models import ModelSets
from tactileq.experiments.study.study import Study
from tactileq.experiments.study.task_plan import TaskPlan
from tactileq.modeling import Threshold, simplify
from tactileq.rig.desk.twin import SimulatedRig
from tactileq.stimuli.planted.textures import planted_texture
from tests.refusals import refused

TEXTURES = ("leather", "MDF", "PVC")


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A simulated study with all tasks, by the loop and the store of real ones."""
    truths = {texture: planted_texture(texture) for texture in TEXTURES}
    threshold = Threshold.shipped("codec")
    folder = tmp_path_factory.mktemp("study") / "data"
    simulate_study(
        Study(
            name="Three surfaces",
            seed=3,
            textures=TEXTURES,
            trays={"leather": "A", "MDF": "B", "PVC": "C"},
            tasks={
                "absolute": TaskPlan(
                    participants=3,
                    schedule="interleaved",
                    training_trials=1,
                    anchors={"leather": "PVC"},
                ),
                "relative": TaskPlan(
                    participants=4, schedule="by-day", repeats=2, training_trials=1
                ),
                "oddity": TaskPlan(
                    participants=1,
                    schedule="interleaved",
                    repeats=2,
                    training_trials=1,
                    catch={"leather": "PVC"},
                    catch_trials=2,
                ),
                "threshold": TaskPlan(
                    participants=1, schedule="interleaved", repeats=1, training_trials=1
                ),
            },
        ),
        real=truths,
        models=ModelSets(
            sets={
                "full": truths,
                "simplified": {
                    name: simplify(t, threshold, criterion="paper-fft").model
                    for name, t in truths.items()
                },
            }
        ),
        rig=SimulatedRig(seed=1),
        data_folder=folder,
        seed=7,
        threshold=threshold,
    )
    return folder


@pytest.fixture(scope="module")
def responses(folder) -> Responses:
    return load_responses(folder)


def test_every_answer_arrives(responses):
    assert responses.simulated_participants
    assert responses.simulated_rig
    assert responses.warnings == ()
    assert len(responses.answers["absolute"]) == 3 * 3 * 2
    assert len(responses.anchors["absolute"]) == 3
    assert set(responses.anchors["absolute"]["virtual_texture"]) == {"PVC"}
    assert len(responses.answers["relative"]) == 4 * 3 * 2 * 2
    assert len(responses.answers["oddity"]) == 3 * 2
    caught = responses.anchors["oddity"]
    assert len(caught) == 2
    assert set(caught["texture"]) | set(caught["odd_texture"]) == {"leather", "PVC"}
    assert set(caught["layout"]) == {"full|full|full"}
    own = responses.answers["oddity"]
    assert (own["odd_texture"] == own["texture"]).all()
    assert len(responses.answers["threshold"]) >= 7
    assert (responses.answers["threshold"]["frequency_hz"] > 0).all()
    assert len(responses.training["absolute"]) == 3
    assert len(responses.training["relative"]) == 4 * 2
    assert set(responses.answers["absolute"]["texture"]) == set(TEXTURES)
    assert responses.answers["absolute"]["magnitude_similarity"].between(0, 100).all()


def test_as_many_trials_are_done_as_were_planned_anchors_and_catch_trials_included(responses):
    done = {task: responses.trials_done(task) for task in ("absolute", "relative", "oddity")}
    assert done == {"absolute": 3 * (3 * 2 + 1), "relative": 48, "oddity": 6 + 2}
    assert done == {task: responses.planned[task].trials for task in done}


def test_the_study_and_its_models_are_known(responses):
    assert responses.name == "Three surfaces"
    assert responses.planned["relative"] == PlannedTask(4, 8, ("full", "simplified"), 2, 48)
    assert responses.unfinished == ()
    assert set(responses.models) == set(TEXTURES)
    assert responses.identical() == frozenset()
    assert len(responses.study_sha256) == 64


def test_no_pair_is_missing(responses):
    found = claims_found(responses, rng=np.random.default_rng(0))
    assert [(one.claim.task, one.claim.measure) for one in found] == [
        ("absolute", "magnitude_similarity"),
        ("absolute", "frequency_similarity"),
        ("relative", "correct"),
        ("oddity", "correct"),
    ]
    people = [3, 3, 4, 1]
    for one, count in zip(found, people, strict=True):
        assert list(incomplete(one)) == []
        assert (one.tests["n"] == count).all()
        assert one.claim.planned is False  # the study states no claims
    for matrix in confusion_matrices(responses.answers["relative"]).values():
        assert matrix.counts.sum(axis=1).tolist() == [4 * 2] * 3


def test_another_manifest_is_noticed(folder, responses):
    (path,) = folder.glob("sourcedata/sub-01/ses-01/*oddity_manifest.json")
    text = path.read_text()
    try:
        path.write_text(text.replace('"slot": 1', '"slot": 2'))
        with refused(ValueError, names=["manifest", path]):
            load_responses(folder)
    finally:
        path.write_text(text)
