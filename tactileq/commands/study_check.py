"""tactileq study check: is this study as it was meant?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tactileq.options import StudyArgument
from tactileq.telling import share_of, tell_models

if TYPE_CHECKING:
    from experiments.study.models import ModelSets
    from experiments.study.study import Study


def study_check(path: StudyArgument) -> None:
    """Load a study and all its models, and say what is wrong or right with them.

    Example: tactileq study check study.toml
    """
    plan, sets, _ = loaded(path)
    print(f"study: {plan.name}, {len(plan.textures)} textures, SHA-256 {plan.sha256[:12]}…")
    told = ", ".join(f"{name} ({place})" for name, place in plan.models.items())
    print(f"models: one of each texture in {told}")
    tell_models(sets, plan.textures)
    _tell_sessions(plan)
    _tell_balance(plan)
    _tell_claims(plan)


def loaded(path: Path) -> tuple[Study, ModelSets, list[Path]]:
    """A study, its models and all that was read for both.

    Raises
    ------
    InputError
        For a study or models that cannot be used.
    """
    from experiments.console.languages import require_texts
    from experiments.study.models import load_model_sets
    from experiments.study.study import Study

    plan = Study.load(path)
    require_texts(plan)
    if any(place.endswith(".toml") for place in plan.models.values()):
        with share_of("Compiling the scene") as tell:
            sets, files = load_model_sets(plan, path.parent, progress=tell)
    else:
        sets, files = load_model_sets(plan, path.parent)
    sets.require(plan)
    return plan, sets, [path, *files]


def _tell_claims(plan: Study) -> None:
    from experiments.tasks.page import proof_of_sensitivity

    claims = plan.plan.claims
    print(f"claims: {len(claims)}" if claims else "claims: none; whatever is found is exploratory")
    for claim in claims:
        print(f"  {claim.name}: {proof_of_sensitivity(plan, claim)}")


def _tell_sessions(plan: Study) -> None:
    from experiments.tasks.durations import minutes_of_session, trials_of_session

    for task, planned in plan.tasks.items():
        training, main = trials_of_session(plan, task)
        sessions = plan.sessions(task)
        print(
            f"{task}: {planned.participants} participants, {sessions} "
            f"session{'s' if sessions > 1 else ''} each, {training} + {main} trials in a session; "
            f"about {minutes_of_session(plan, task)} min a session (an estimate)"
        )


def _tell_balance(plan: Study) -> None:
    from experiments.tasks.balance import balance_of

    print("balance of the orders (least to most of its counts, of how many):")
    for row in (row for task in plan.tasks for row in balance_of(plan, task)):
        print(f"  {row.task:9} {row.what:56} {row.least} to {row.most} of {row.of}")
