"""Experiments: designs and orders, protocols, store, console and simulated participants."""

from experiments.observers.simulated import Psychometrics
from experiments.observers.whole_study import simulate_study
from experiments.sessions.store import StoreError
from experiments.sessions.trial_loop import SessionResult
from experiments.study.design import SessionPlan, fisher_yates, plan_session
from experiments.study.models import ModelSets
from experiments.study.study import Study
from experiments.tasks.absolute import run_absolute
from experiments.tasks.relative import run_relative

__all__ = [
    "ModelSets",
    "Psychometrics",
    "SessionPlan",
    "SessionResult",
    "StoreError",
    "Study",
    "fisher_yates",
    "plan_session",
    "run_absolute",
    "run_relative",
    "simulate_study",
]
