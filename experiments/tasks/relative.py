"""The relative evaluation (METHOD 11, paper VII-B2).

The participant feels a real surface and, behind one button each, the virtual surfaces of all
textures, switches freely, and says once which virtual surface is the real one.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from experiments.sessions.trial_loop import Respondent, Script, SessionResult, Surfaces, run_session
from experiments.study.design import Phase, RelativeTrial, plan_session
from experiments.study.models import ModelSets
from experiments.study.study import Study
from modeling import TextureModel
from rig.interface import TextureRig

# --- Parameters -----------------------------------------------------------------------------

TASK_DESCRIPTION = (
    "Forced choice: which of the virtual surfaces, one per button and in a new layout each time, "
    "is the real surface that can be felt beside them?"
)
ANNOUNCEMENTS: dict[Phase, tuple[str, str]] = {
    "training": (
        "Training",
        "One real surface is in place. Each numbered button presents a virtual surface; one of "
        "them is its copy. Switch as often as you like, then confirm the one that you think it "
        "is. These first choices are for practice.",
    ),
    "main": (
        "The choices begin",
        "Find the virtual surface that is the copy of the real one. Switch as often as you like; "
        "if you are not sure, take the most similar one.",
    ),
}
CLOSING = ("Thank you", "This part is complete.")
COLUMNS: dict[str, dict[str, Any]] = {
    "trial": {"Description": "Running number in the session, training included"},
    "phase": {
        "Description": "Part of the session",
        "Levels": {"training": "for practice", "main": "counts"},
    },
    "texture": {"Description": "Real surface, which is the right answer"},
    "model": {
        "Description": "Model behind all virtual surfaces of the trial",
        "Levels": {"full": "all layers", "simplified": "without imperceptible layers"},
    },
    "tray": {"Description": "Tray that held the sample"},
    "layout": {"Description": "Texture behind each button, from button 1, separated by |"},
    "answer": {"Description": "Texture of the chosen virtual surface"},
    "correct": {
        "Description": "Whether the answer is the texture of the real surface",
        "Levels": {"1": "right", "0": "wrong"},
    },
    "presses": {"Description": "Presentations of a virtual surface, repeated ones included"},
    "response_time_s": {"Description": "From first presentation to answer", "Units": "s"},
    "simulated": {
        "Description": "Whether the participant, the rig or both were simulated",
        "Levels": {
            "true": "simulated; SimulatedParticipant and SimulatedRig say what",
            "false": "a person at a real rig",
        },
    },
}

# --- The session ----------------------------------------------------------------------------


def run_relative(
    study: Study,
    *,
    subject: int,
    session: int,
    models: ModelSets,
    rig: TextureRig,
    respondent: Respondent,
    data_folder: str | Path,
) -> SessionResult:
    """Run one session of the relative evaluation and store it.

    Parameters
    ----------
    study : Study
    subject, session : int
        From 1; with the study's seed they fix the order of the trials.
    models : ModelSets
        Full and simplified model of every texture of the study.
    rig : TextureRig
        Presents the surfaces; silent afterwards, whatever happens.
    respondent : Respondent
        The console, or a simulated participant.
    data_folder : path
        Root of the data set.

    Returns
    -------
    SessionResult
        Not completed if the participant ended it early.

    Raises
    ------
    InputError
        If a model is missing or the session has been run before.
    StoreError
        If the disk does not take the answers.
    """
    models.require(study.textures)
    plan = plan_session(study, task="relative", subject=subject, session=session)
    return run_session(
        plan,
        _script(models, respondent),
        columns=COLUMNS,
        description=TASK_DESCRIPTION,
        rig=rig,
        respondent=respondent,
        data_folder=data_folder,
    )


def _script(models: ModelSets, respondent: Respondent) -> Script:
    """What is presented and asked in a trial."""

    def virtual(trial: RelativeTrial) -> list[TextureModel]:
        return [models.of(texture, trial.model) for texture in trial.layout]

    def begin(trial: RelativeTrial, surfaces: Surfaces) -> None:
        surfaces.present_real()

    def ask(trial: RelativeTrial, surfaces: Surfaces) -> Mapping[str, object]:
        choice = respondent.choose(trial, surfaces)
        answer = trial.layout[choice.button]
        return {
            "layout": "|".join(trial.layout),
            "answer": answer,
            "correct": int(answer == trial.texture),
            "presses": surfaces.presses,
            "response_time_s": choice.response_time_s,
        }

    return Script(
        announcements=ANNOUNCEMENTS, closing=CLOSING, virtual=virtual, begin=begin, ask=ask
    )
