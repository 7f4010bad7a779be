"""Record a surface, keep what a finger can feel, render it, and test with people.

`import tactileq as tq` is the public face: all names of the shared modeling package and some of the
other rooms, each loaded on first use. Modules below it may change.
"""

try:
    from tactileq.modeling import HOMES as _MODELING
    from tactileq.modeling.face import lazily
except ModuleNotFoundError as error:  # a checkout that was not installed
    raise ImportError(
        f"expected links to the rooms in {__path__[0]}, got none to modeling; run make install, or "
        "pip install -e . (setup.py lays them)."
    ) from error

HOMES = {f"modeling.{module}": names for module, names in _MODELING.items()} | {
    "modeling.models.loading": "load_any_models load_model",
    "stimuli.planted.textures": "planted_texture record_texture",
    "rig.recording.importing.files": "import_csv import_wav",
    "rig.shared.setup.rig_file": "RigFile",
    "rig.desk.twin": "SimulatedRig",
    "analysis.textures.results": "TextureResult",
    "analysis.spectra.comparison": "compare_spectra",
    "analysis.spectra.figures.spectra": "figure_spectra_and_threshold",
    "experiments.study.study": "Study",
    "experiments.study.task_plan": "TaskPlan",
    "experiments.study.models": "ModelSets",
    "experiments.study.design": "SessionPlan fisher_yates",
    "experiments.sessions.kept.writer": "StoreError",
    "experiments.sessions.loop.task": "Task",
    "experiments.sessions.loop.running": "Circumstances run_session",
    "experiments.sessions.loop.trial_loop": "People SessionResult run_trials",
    "experiments.tasks": "plan_session task_named",
    "experiments.publishing.presented": "render_presentation",
    "experiments.observers.psychometrics": "Psychometrics Trait",
    "experiments.observers.percepts": "Perception",
    "experiments.observers.in_memory": "simulate_sessions",
    "experiments.observers.whole_study": "simulate_study",
}

__getattr__, __dir__, __all__ = lazily(__name__, HOMES)
