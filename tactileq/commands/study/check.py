"""tactileq study check: whether this study is as intended."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from tactileq.modeling.errors import counted
from tactileq.options import StudyArgument
from tactileq.printing import print_models, progress, share_of

if TYPE_CHECKING:
    from tactileq.experiments.study.models import ModelSets
    from tactileq.experiments.study.study import Study


def study_check(path: StudyArgument) -> None:
    """Load a study and all its models, and report errors, design and balance.

    Example: tactileq study check study.toml
    """
    plan, sets = loaded(path)
    textures = counted(len(plan.textures), "texture")
    print(f"study: {plan.name}, {textures}, SHA-256 {plan.sha256[:12]}…")
    places = ", ".join(f"{name} ({place})" for name, place in plan.models.items())
    print(f"models: one of each texture in {places}")
    print_models(sets, plan.textures)
    _print_texts(plan)
    _print_sessions(plan)
    _print_balance(plan)
    _print_claims(plan)


def loaded(path: Path, reads: Callable[..., None] = lambda *paths: None) -> tuple[Study, ModelSets]:
    """A study and its models; `reads` is called with what is read, before it is.

    Raises
    ------
    InputError
        For a study or models that cannot be used.
    """
    from tactileq.experiments.console.languages import texts_of_study
    from tactileq.experiments.study.models import load_model_sets
    from tactileq.experiments.study.study import Study
    from tactileq.experiments.study.trays import require_trays

    reads(path)
    plan = Study.load(path)
    plan.plan.require_current()
    reads(*plan.texts.values())
    texts_of_study(plan)
    require_trays(plan)
    if any(place.endswith(".toml") for place in plan.models.values()):
        with share_of("Compiling the scene") as advance:
            sets = load_model_sets(plan, path.parent, reads=reads, progress=advance)
    else:
        sets = load_model_sets(plan, path.parent, reads=reads)
    sets.require(plan)
    return plan, sets


def _print_texts(plan: Study) -> None:
    """What participants read, and who has not read it yet."""
    from tactileq.experiments.console.languages import texts_of_study

    texts = texts_of_study(plan)
    places = (f"{name} ({plan.texts.get(name, 'as shipped')})" for name in texts)
    print(f"texts: {', '.join(places)}")
    for name, of_language in texts.items():
        if not of_language.proofread:
            print(
                f"note: no native speaker has read the texts in {name} yet; let one read them, and "
                f"name a file with proofread = true, and what has to change, under texts."
            )


def _print_claims(plan: Study) -> None:
    from tactileq.experiments.tasks.page import proof_of_sensitivity

    claims = plan.plan.claims
    sentence = "none; all findings are exploratory"
    if claims:
        sentence = f'{len(claims)}, rule of verdicts "{plan.plan.rule}"'
    print(f"claims: {sentence}")
    for claim in claims:
        print(f"  {claim.name}: {proof_of_sensitivity(plan, claim)}")


def _print_sessions(plan: Study) -> None:
    from tactileq.experiments.tasks.durations import minutes_of_session, trials_of_session
    from tactileq.experiments.tasks.page import catch_trials_text

    for task, planned in plan.tasks.items():
        training, main = trials_of_session(plan, task)
        sessions = plan.sessions(task)
        print(
            f"{task}: {counted(planned.participants, 'participant')}, "
            f"{counted(sessions, 'session')} each, {training} training + {main} main trials per "
            f"session; about {minutes_of_session(plan, task)} min per session (an estimate)"
        )
        if planned.catch_trials:
            print(f"  {catch_trials_text(plan, task)}, among the main trials")


def _print_balance(plan: Study) -> None:
    from tactileq.experiments.tasks.balance import balance_of
    from tactileq.experiments.tasks.durations import trials_of_session

    sessions = {
        task: planned.participants * plan.sessions(task) for task, planned in plan.tasks.items()
    }
    trials = sum(count * trials_of_session(plan, task)[1] for task, count in sessions.items())
    said = f"{counted(sum(sessions.values()), 'session')} with {counted(trials, 'main trial')}"
    # At once: of a study with thousands of participants the orders take minutes.
    print(f"drawing the orders of {said}, all of them, to count their balance", flush=True)
    with progress("orders", sum(sessions.values())) as drawn:
        rows = [row for task in plan.tasks for row in balance_of(plan, task, drawn=drawn)]
    print("balance of the orders (lowest to highest count, of the total):")
    for row in rows:
        print(f"  {row.task:9} {row.what:56} {row.least} to {row.most} of {row.of}")
