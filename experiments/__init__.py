"""Experiments: designs and orders, protocols, store, console and simulated participants."""

from typing import TYPE_CHECKING

from tactileq import modeling

if not hasattr(modeling, "HOMES"):  # modeling.py beside a script that is run
    raise ImportError(
        f"expected the package modeling of tactileq, got {modeling}; rename that, or run python -P."
    )

from tactileq.modeling.face import lazily

HOMES = {
    "study.study": "Study",
    "study.task_plan": "TaskPlan",
    "study.models": "ModelSets",
    "study.design": "SessionPlan fisher_yates",
    "sessions.writer": "StoreError",
    "sessions.task": "Task",
    "sessions.running": "Circumstances run_session",
    "sessions.trial_loop": "People SessionResult run_trials",
    "tasks": "plan_session task_named",
    "publishing.presented": "render_presentation",
    "observers.psychometrics": "Psychometrics Trait",
    "observers.percepts": "Perception",
    "observers.in_memory": "simulate_sessions",
    "observers.whole_study": "simulate_study",
}

if TYPE_CHECKING:
    from tactileq.experiments.observers.in_memory import simulate_sessions as simulate_sessions
    from tactileq.experiments.observers.percepts import Perception as Perception
    from tactileq.experiments.observers.psychometrics import Psychometrics as Psychometrics
    from tactileq.experiments.observers.psychometrics import Trait as Trait
    from tactileq.experiments.observers.whole_study import simulate_study as simulate_study
    from tactileq.experiments.publishing.presented import render_presentation as render_presentation
    from tactileq.experiments.sessions.running import Circumstances as Circumstances
    from tactileq.experiments.sessions.running import run_session as run_session
    from tactileq.experiments.sessions.task import Task as Task
    from tactileq.experiments.sessions.trial_loop import People as People
    from tactileq.experiments.sessions.trial_loop import SessionResult as SessionResult
    from tactileq.experiments.sessions.trial_loop import run_trials as run_trials
    from tactileq.experiments.sessions.writer import StoreError as StoreError
    from tactileq.experiments.study.design import SessionPlan as SessionPlan
    from tactileq.experiments.study.design import fisher_yates as fisher_yates
    from tactileq.experiments.study.models import ModelSets as ModelSets
    from tactileq.experiments.study.study import Study as Study
    from tactileq.experiments.study.task_plan import TaskPlan as TaskPlan
    from tactileq.experiments.tasks import plan_session as plan_session
    from tactileq.experiments.tasks import task_named as task_named
else:  # a type checker that saw __getattr__ would take every name for public
    __getattr__, __dir__, __all__ = lazily(__name__, HOMES)
