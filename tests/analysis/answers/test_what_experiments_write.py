"""The format that both rooms share: what the experiments write, the analysis reads."""

from __future__ import annotations

import pytest

from analysis.answers.loading import Responses, load_responses
from analysis.statistics.confusion import confusion_matrices
from analysis.statistics.paired import rating_tests
from analysis.statistics.rates import rate_tests
from experiments.observers.whole_study import simulate_study
from experiments.sessions.surfaces import Choice, SessionAborted, Surfaces
from experiments.study.models import ModelSets
from experiments.study.study import Study
from experiments.study.task_plan import TaskPlan
from experiments.tasks.relative import RelativeTrial, run_relative
from modeling import Threshold, simplify
from rig.twin import SimulatedRig
from stimuli.planted.textures import planted_texture

TEXTURES = ("leather", "MDF", "PVC")


@pytest.fixture(scope="module")
def responses(tmp_path_factory) -> Responses:
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
                "absolute": TaskPlan(participants=3, schedule="interleaved", training_trials=1),
                "relative": TaskPlan(
                    participants=4, schedule="by-day", repeats=2, training_trials=1
                ),
            },
        ),
        real=truths,
        models=ModelSets(
            sets={
                "full": truths,
                "simplified": {
                    name: simplify(truth, threshold).model for name, truth in truths.items()
                },
            }
        ),
        rig=SimulatedRig(seed=1),
        data_folder=folder,
        seed=7,
        threshold=threshold,
    )
    return load_responses(folder)


def test_a_session_left_early_is_named(tmp_path):
    class Leaving:
        """A person who gives four answers and goes."""

        simulated = False
        answered = 0

        def announce(self, title: str, text: str) -> None: ...

        def confirm_mount(self, tray: str) -> None: ...

        def choose(self, trial: RelativeTrial, surfaces: Surfaces) -> Choice:
            if self.answered == 4:
                raise SessionAborted
            self.answered += 1
            surfaces.present_virtual(0)
            return Choice(button=0, response_time_s=1.0)

    truths = {texture: planted_texture(texture) for texture in Study.load().textures}
    fewer = {texture: truth.with_layers([0]) for texture, truth in truths.items()}
    fewer = {texture: truth.with_layers([0]) for texture, truth in truths.items()}
    run_relative(
        Study.load(),
        subject=1,
        session=1,
        models=ModelSets(sets={"full": truths, "simplified": fewer}),
        rig=SimulatedRig(),
        respondent=Leaving(),
        data_folder=tmp_path,
    )
    responses = load_responses(tmp_path)
    assert (responses.simulated_participants, responses.simulated_rig) == (False, True)
    (warning,) = responses.warnings
    assert warning.startswith("sub-01 relative ses-01 answered 4 of ")
    assert warning.endswith(" trials (ended early).")


def test_every_answer_arrives(responses):
    assert responses.simulated_participants
    assert responses.simulated_rig
    assert responses.warnings == ()
    assert len(responses.absolute) == 3 * 3 * 2
    assert len(responses.relative) == 4 * 3 * 2 * 2
    assert len(responses.training["absolute"]) == 3
    assert len(responses.training["relative"]) == 4 * 2
    assert set(responses.absolute["texture"]) == set(TEXTURES)
    assert responses.absolute["magnitude_similarity"].between(0, 100).all()


def test_no_pair_is_missing(responses):
    assert (rating_tests(responses.absolute)["excluded"] == "").all()
    assert (rate_tests(responses.relative)["n"] == 4).all()
    for matrix in confusion_matrices(responses.relative).values():
        assert matrix.counts.sum(axis=1).tolist() == [4 * 2] * 3
