"""The absolute evaluation (METHOD 11, paper VII-B1).

The participant knows that the virtual surface stands for the real one, feels both as often as
wanted, and rates on two scales from 0 to 100 how alike they are.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from experiments.sessions.trial_loop import Respondent, Script, SessionResult, Surfaces, run_session
from experiments.study.design import AbsoluteTrial, Phase, plan_session
from experiments.study.models import ModelSets
from experiments.study.study import Study
from modeling import TextureModel
from rig.interface import TextureRig

# --- Parameters -----------------------------------------------------------------------------

TASK_DESCRIPTION = (
    "A real and a virtual surface, said to correspond, are compared at will and their similarity "
    "is rated on two visual analogue scales without a preset marker."
)
ANNOUNCEMENTS: dict[Phase, tuple[str, str]] = {
    "training": (
        "Training",
        "You will compare a real surface with its virtual copy. Switch between the two as often "
        "as you like, then rate how alike they are on both scales. "
        "These first ratings are for practice.",
    ),
    "main": (
        "The ratings begin",
        "Switch between the real surface and its virtual copy as often as you like, "
        "then rate how alike they are on both scales.",
    ),
}
CLOSING = ("Thank you", "This part is complete.")
COLUMNS: dict[str, dict[str, Any]] = {
    "trial": {"Description": "Running number in the session, training included"},
    "phase": {
        "Description": "Part of the session",
        "Levels": {"training": "for practice", "main": "counts"},
    },
    "texture": {"Description": "Real surface, and the texture that the virtual one models"},
    "model": {
        "Description": "Model behind the virtual surface",
        "Levels": {"full": "all layers", "simplified": "without imperceptible layers"},
    },
    "tray": {"Description": "Tray that held the sample"},
    "first_surface": {
        "Description": "Surface presented when the trial began",
        "Levels": {"real": "real surface", "virtual": "virtual surface"},
    },
    "magnitude_similarity": {
        "Description": "Rated similarity of vibration magnitude, 0 (different) to 100 (identical)",
        "Units": "arbitrary",
    },
    "frequency_similarity": {
        "Description": "Rated similarity of frequency pattern, 0 (different) to 100 (identical)",
        "Units": "arbitrary",
    },
    "toggles": {"Description": "Changes between the real and the virtual surface"},
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


def run_absolute(
    study: Study,
    *,
    subject: int,
    session: int,
    models: ModelSets,
    rig: TextureRig,
    respondent: Respondent,
    data_folder: str | Path,
) -> SessionResult:
    """Run one session of the absolute evaluation and store it.

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
    plan = plan_session(study, task="absolute", subject=subject, session=session)
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

    def virtual(trial: AbsoluteTrial) -> list[TextureModel]:
        return [models.of(trial.texture, trial.model)]

    def begin(trial: AbsoluteTrial, surfaces: Surfaces) -> None:
        if trial.first_surface == "real":
            surfaces.present_real()
        else:
            surfaces.present_virtual()

    def ask(trial: AbsoluteTrial, surfaces: Surfaces) -> Mapping[str, object]:
        rating = respondent.rate(trial, surfaces)
        return {
            "first_surface": trial.first_surface,
            "magnitude_similarity": rating.magnitude_similarity,
            "frequency_similarity": rating.frequency_similarity,
            "toggles": surfaces.switches,
            "response_time_s": rating.response_time_s,
        }

    return Script(
        announcements=ANNOUNCEMENTS, closing=CLOSING, virtual=virtual, begin=begin, ask=ask
    )
