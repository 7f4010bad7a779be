"""Experiments: designs and orders, protocols, store, console and simulated participants."""

from experiments.absolute import run_absolute
from experiments.design import SessionPlan, fisher_yates, plan_session
from experiments.models import ModelSets
from experiments.participants import Psychometrics
from experiments.relative import run_relative
from experiments.simulate import simulate_study
from experiments.store import StoreError
from experiments.study import Study
from experiments.trial_loop import SessionResult

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
