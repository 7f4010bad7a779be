# The public face, for type checkers: these cannot see what __init__.py loads late.
from tactileq.analysis.spectra.comparison import compare_spectra as compare_spectra
from tactileq.analysis.spectra.figures.spectra import (
    figure_spectra_and_threshold as figure_spectra_and_threshold,
)
from tactileq.analysis.textures.results import TextureResult as TextureResult
from tactileq.experiments.observers.in_memory import simulate_sessions as simulate_sessions
from tactileq.experiments.observers.percepts import Perception as Perception
from tactileq.experiments.observers.psychometrics import Psychometrics as Psychometrics
from tactileq.experiments.observers.psychometrics import Trait as Trait
from tactileq.experiments.observers.whole_study import simulate_study as simulate_study
from tactileq.experiments.publishing.presented import render_presentation as render_presentation
from tactileq.experiments.sessions.kept.writer import StoreError as StoreError
from tactileq.experiments.sessions.loop.running import Circumstances as Circumstances
from tactileq.experiments.sessions.loop.running import run_session as run_session
from tactileq.experiments.sessions.loop.task import Task as Task
from tactileq.experiments.sessions.loop.trial_loop import People as People
from tactileq.experiments.sessions.loop.trial_loop import SessionResult as SessionResult
from tactileq.experiments.sessions.loop.trial_loop import run_trials as run_trials
from tactileq.experiments.study.design import SessionPlan as SessionPlan
from tactileq.experiments.study.design import fisher_yates as fisher_yates
from tactileq.experiments.study.models import ModelSets as ModelSets
from tactileq.experiments.study.study import Study as Study
from tactileq.experiments.study.task_plan import TaskPlan as TaskPlan
from tactileq.experiments.tasks import plan_session as plan_session
from tactileq.experiments.tasks import task_named as task_named
from tactileq.modeling import *  # noqa: F403
from tactileq.modeling.models.loading import load_any_models as load_any_models
from tactileq.modeling.models.loading import load_model as load_model
from tactileq.rig.desk.twin import SimulatedRig as SimulatedRig
from tactileq.rig.recording.importing.files import import_csv as import_csv
from tactileq.rig.recording.importing.files import import_wav as import_wav
from tactileq.rig.shared.setup.rig_file import RigFile as RigFile
from tactileq.stimuli.planted.textures import planted_texture as planted_texture
from tactileq.stimuli.planted.textures import record_texture as record_texture
