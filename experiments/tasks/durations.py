"""How long a session may take: a rough estimate, to plan appointments by."""

from __future__ import annotations

from tactileq.experiments.study.study import Study
from tactileq.experiments.tasks import plan_session

# Seconds of one trial, with the mounting of its sample where there is one: assumed, not measured.
TRIAL_S = {"absolute": 50.0, "relative": 75.0, "oddity": 60.0, "threshold": 5.0}
OTHER_TRIAL_S = 60.0
WELCOME_S = 300.0  # consent, questions, explanation
BREAK_S = 120.0


def trials_of_session(study: Study, task: str) -> tuple[int, int]:
    """Training (the fewest) and main trials of one session of a task.

    Raises
    ------
    InputError
        If the study has no such task.
    """
    # Counted in an order as sessions draw it: what a trial is, the task alone knows.
    trials = plan_session(study, task=task, subject=1, session=1).trials
    main = sum(trial.phase == "main" for trial in trials)
    return study.plan_of(task).training_trials, main


def minutes_of_catch_trials(study: Study, task: str) -> int:
    """About how much of each session the catch trials of a task take; 0 without any.

    Raises
    ------
    InputError
        If the study has no such task.
    """
    seconds = (study.plan_of(task).catch_trials or 0) * TRIAL_S.get(task, OTHER_TRIAL_S)
    return round(seconds / 60)


def minutes_of_session(study: Study, task: str) -> int:
    """About how long a session of a task takes.

    Raises
    ------
    InputError
        If the study has no such task.
    """
    training, main = trials_of_session(study, task)
    every = study.plan_of(task).break_after
    breaks = (main - 1) // every if every else 0
    seconds = (training + main) * TRIAL_S.get(task, OTHER_TRIAL_S) + breaks * BREAK_S + WELCOME_S
    return round(seconds / 60)
