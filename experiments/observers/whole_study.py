"""A whole study in silico: simulated participants in the very same protocols and store."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from tactileq.experiments.observers.experimenter import SimulatedExperimenter
from tactileq.experiments.observers.percepts import Perception
from tactileq.experiments.observers.psychometrics import Psychometrics
from tactileq.experiments.observers.simulated import (
    SimulatedParticipant,
    occasion_of,
    require_plantable,
)
from tactileq.experiments.sessions.bids.export import export_all
from tactileq.experiments.sessions.loop.running import Circumstances, run_session
from tactileq.experiments.sessions.loop.trial_loop import People, SessionResult
from tactileq.experiments.study.models import ModelSets
from tactileq.experiments.study.study import Study
from tactileq.experiments.tasks import task_named
from tactileq.modeling import TextureModel, Threshold
from tactileq.modeling.checks import check_whole
from tactileq.rig.shared.interface import TextureRig

Progress = Callable[[int, int, str], None]


def simulate_study(
    study: Study,
    *,
    real: Mapping[str, TextureModel],
    models: ModelSets,
    rig: TextureRig,
    data_folder: str | Path,
    seed: int,
    threshold: Threshold,
    psychometrics: Psychometrics | None = None,
    sources: Mapping[str, str] | None = None,
    progress: Progress | None = None,
) -> tuple[SessionResult, ...]:
    """Run all sessions of all subjects of all tasks with simulated participants.

    Parameters
    ----------
    study : Study
        Fixes the orders, by its own seed.
    real : mapping of str to TextureModel
        The truth behind each real surface.
    models : ModelSets
        What the virtual surfaces present.
    data_folder : path
        Root of a new data set.
    seed : int
        ≥ 0; of the participants and their answers.
    threshold : Threshold
        Of the average participant, who feels nothing below it.
    psychometrics : Psychometrics, optional
        How percepts become answers.
    sources : mapping of set of models to str, optional
        Where the models came from, for the manifests.
    progress : callable, optional
        Called with sessions done, sessions in all, and the session just done.

    Returns
    -------
    tuple of SessionResult
        In the order in which the sessions were run.

    Raises
    ------
    InputError
        If a model is missing or not in g, an effect cannot be planted, or a session has been run
        before.
    StoreError, OSError
        If the disk does not take the answers.
    """
    check_whole("seed", seed, low=0, high=2**63)
    perception = Perception(study, real=real, models=models, threshold=threshold)
    population = psychometrics or Psychometrics()
    require_plantable(perception, population)
    circumstances = Circumstances(sources=sources or {})
    agenda = _agenda(study)
    results = []
    for done, (task, subject, session) in enumerate(agenda, start=1):
        participant = SimulatedParticipant(
            perception,
            population,
            seed=seed,
            subject=subject,
            occasion=occasion_of(task, session),
        )
        result, _ = run_session(
            task_named(task),
            study,
            subject=subject,
            session=session,
            models=models,
            rig=rig,
            people=People(respondent=participant, experimenter=SimulatedExperimenter()),
            data_folder=data_folder,
            circumstances=circumstances,
        )
        results.append(result)
        if progress is not None:
            progress(done, len(agenda), f"{task}, subject {subject}, session {session}")
    export_all(data_folder)
    return tuple(results)


def _agenda(study: Study) -> list[tuple[str, int, int]]:
    """Task, subject and session of every session, day by day."""
    return [
        (task, subject, session)
        for task, plan in study.tasks.items()
        for session in range(1, study.sessions(task) + 1)
        for subject in range(1, plan.participants + 1)
    ]
