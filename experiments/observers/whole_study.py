"""A whole study in silico: every simulated subject through the very same protocols and store."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from experiments.observers.simulated import Perception, Psychometrics, SimulatedParticipant
from experiments.sessions.trial_loop import SessionResult, run_session
from experiments.study.models import ModelSets
from experiments.study.study import TASKS, Study
from experiments.tasks import task_named
from modeling import TextureModel, Threshold
from modeling.checks import check_whole
from modeling.models.loading import Layered
from rig.interface import TextureRig

Progress = Callable[[int, int, str], None]


def simulate_study(
    study: Study,
    *,
    real: Mapping[str, TextureModel],
    full: Mapping[str, TextureModel],
    simplified: Mapping[str, Layered],
    rig: TextureRig,
    data_folder: str | Path,
    seed: int,
    threshold: Threshold,
    psychometrics: Psychometrics | None = None,
    progress: Progress | None = None,
) -> tuple[SessionResult, ...]:
    """Run all sessions of all subjects of all tasks with simulated participants.

    Parameters
    ----------
    study : Study
        Fixes the orders, by its own seed.
    real : mapping of str to TextureModel
        The truth behind each real surface.
    full : mapping of str to TextureModel
    simplified : mapping of str to TextureModel or RegressedModel
        What the virtual surfaces present.
    rig : TextureRig
    data_folder : path
        Root of a new data set.
    seed : int
        ≥ 0; of the participants' answers.
    threshold : Threshold
        Below it the participants feel nothing.
    psychometrics : Psychometrics, optional
        How percepts become answers.
    progress : callable, optional
        Called with sessions done, sessions in all, and the session just done.

    Returns
    -------
    tuple of SessionResult
        In the order in which the sessions were run.

    Raises
    ------
    InputError
        If a model is missing or not in g, or a session has been run before.
    StoreError
        If the disk does not take the answers.
    """
    check_whole("seed", seed, low=0, high=2**63)
    models = ModelSets(sets={"full": full, "simplified": simplified})
    perception = Perception(study, real=real, models=models, threshold=threshold)
    agenda = _agenda(study)
    results = []
    for done, (task, subject, session) in enumerate(agenda, start=1):
        participant = SimulatedParticipant(
            perception,
            psychometrics or Psychometrics(),
            seed=seed,
            subject=subject,
            occasion=_occasion(task, session),
        )
        result = run_session(
            task_named(task),
            study,
            subject=subject,
            session=session,
            models=models,
            rig=rig,
            respondent=participant,
            data_folder=data_folder,
        )
        results.append(result)
        if progress is not None:
            progress(done, len(agenda), result.path.stem)
    return tuple(results)


def _occasion(task: str, session: int) -> tuple[int, ...]:
    """What distinguishes the sessions of a participant in the seeds of the answers."""
    # Published answers of the paper's two tasks hang on this one number.
    number = TASKS.index(task)
    return (2 * session + number,) if number < 2 else (session, number)


def _agenda(study: Study) -> list[tuple[str, int, int]]:
    """Task, subject and session of every session, day by day."""
    return [
        (task, subject, session)
        for task, plan in study.tasks.items()
        for session in range(1, study.sessions(task) + 1)
        for subject in range(1, plan.participants + 1)
    ]
