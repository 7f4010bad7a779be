"""The page to preregister: what is fixed beforehand (docs/method/protocols.md#plan)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction

from tactileq.experiments.study.models import ModelSets
from tactileq.experiments.study.study import Study, plan_sha256
from tactileq.experiments.study.task_plan import TaskPlan
from tactileq.experiments.tasks import task_named
from tactileq.experiments.tasks.durations import (
    minutes_of_catch_trials,
    minutes_of_session,
    trials_of_session,
)
from tactileq.modeling.errors import counted
from tactileq.modeling.files.answer_tables import ANSWER_TABLES
from tactileq.modeling.files.claims import RATINGS, ClaimSection, PlanSection

TESTED = {
    "equivalence": "two one-sided t-tests of the differences within persons (TOST)",
    "difference": "paired t-test of the differences within persons",
}


def plan_page(study: Study, models: ModelSets) -> str:
    """The page as Markdown; the same study and models always give the same page.

    Parameters
    ----------
    models : ModelSets
        With a model of each texture in each set.

    Raises
    ------
    InputError
        For a planned task that is none.
    """
    hashes = models.sha256(study.textures)
    sections = (
        ("", [f"SHA-256 of this plan: `{plan_sha256(study, hashes)}`. Every session names it."]),
        ("Question", list(_question(study))),
        ("Design", [line for task in study.tasks for line in _design(study, task)][:-1]),
        ("Models", list(_models(study, models))),
        ("Claims", list(_claims(study))),
        ("Exclusions", list(_exclusions(study))),
        ("Participants and stopping", list(_participants(study))),
        ("Randomisation", list(_randomisation(study))),
        ("Circumstances", list(_circumstances(study))),
    )
    lines = [f"# {study.name}: plan before the first answer", ""]
    for title, body in sections:
        lines += [f"## {title}", ""] if title else []
        lines += [*body, ""]
    return "\n".join(lines)


def _question(study: Study) -> Iterator[str]:
    reference, *others = study.models
    yield (
        f"Can anybody feel the difference between virtual surfaces of the {_listed(others)} "
        f"models and those of the {reference} models, of {len(study.textures)} textures "
        f"({', '.join(study.textures)})?"
    )


def _design(study: Study, task: str) -> Iterator[str]:
    plan = study.plan_of(task)
    training, main = trials_of_session(study, task)
    yield f"**{task.capitalize()} task.** {task_named(task).description}"
    yield ""
    if not ANSWER_TABLES[task].of_surfaces:
        yield f"- Each frequency comes {_times(plan.repeats)}."
    else:
        yield f"- Models compared: {_listed(plan.models)}, {_schedule(study, task)}."
        times = "comes" if ANSWER_TABLES[task].both_models else "is presented with each model"
        yield f"- Each texture {times} {_times(plan.repeats)}."
    yield (
        f"- A session has {main} trials after {_training(training, plan)} for practice, and takes "
        f"about {minutes_of_session(study, task)} minutes (an estimate)."
    )
    yield from _proofs(study, task)
    if plan.break_after:
        yield f"- A break after every {plan.break_after} trials."
    if plan.feel_all:
        yield "- No answer is taken before all virtual surfaces of the trial were felt."
    yield ""


def _proofs(study: Study, task: str) -> Iterator[str]:
    """The trials that show whether people tell surfaces apart."""
    plan = study.plan_of(task)
    for real, virtual in plan.anchors.items():
        yield (
            f"- Anchor: real {real} beside the {plan.models[0]} model of {virtual}, "
            "presented as a pair like any other, once in each session; not part of the "
            "comparison of models."
        )
    if plan.catch_trials:
        yield (
            f"- {catch_trials_text(study, task)}, at random places: the odd one models "
            f"another texture than the other two ({_pairs(plan)}), all with the {plan.models[0]} "
            "models; not part of the comparison of models."
        )


def catch_trials_text(study: Study, task: str) -> str:
    """How many catch trials a session of a task has, and what they cost."""
    number = counted(study.plan_of(task).catch_trials or 0, "catch trial")
    minutes = counted(minutes_of_catch_trials(study, task), "minute")
    return f"{number}, about {minutes} of each session"


def _pairs(plan: TaskPlan) -> str:
    return ", ".join(f"{surface} and {other}" for surface, other in plan.catch.items())


def _schedule(study: Study, task: str) -> str:
    if study.plan_of(task).schedule == "interleaved":
        return "mixed in one session"
    return f"each on a separate day ({study.sessions(task)} sessions), counterbalanced exactly"


def _training(fewest: int, plan: TaskPlan) -> str:
    if plan.most_training_trials == fewest:
        return str(fewest)
    return f"{fewest} to {plan.most_training_trials} (until strokes stay inside the grid)"


def _models(study: Study, models: ModelSets) -> Iterator[str]:
    yield f"| texture | {' | '.join(f'{name} (SHA-256)' for name in models.names)} |"
    yield "|---|" + "---|" * len(models.names)
    for texture, hashes in models.sha256(study.textures).items():
        yield f"| {texture} | {' | '.join(f'`{hashes[name]}`' for name in models.names)} |"
    for texture, groups in models.equal_models(study.textures).items():
        for group in groups:
            yield ""
            yield (
                f"The models of {texture} in {', '.join(group)} are equal: a control, left out of "
                "their comparison."
            )


def _claims(study: Study) -> Iterator[str]:
    if not study.plan.claims:
        yield "None: all findings are exploratory."
    else:
        yield _rule(study.plan)
        yield ""
    for number, claim in enumerate(study.plan.claims, start=1):
        yield (
            f"{number}. **{claim.name}.** {_claimed(claim)} {_tested(study.plan, claim)} "
            f"{proof_of_sensitivity(study, claim)}"
        )


def _rule(plan: PlanSection) -> str:
    """What decides the verdicts."""
    if plan.rule == "tests":
        return "Rule of verdicts: the tests that each claim names."
    return (
        "Rule of verdicts: ratings are decided by the hierarchical model of the participants; two "
        "sets of models are equivalent where the 90 % interval of the mean effect lies inside the "
        "bounds, and different where its 95 % interval excludes 0. Paired t-test and TOST, apart "
        "from days where models are on different ones, are reported beside it, decide about right "
        "answers, and decide about ratings where more people began with one of the models by day."
    )


def proof_of_sensitivity(study: Study, claim: ClaimSection) -> str:
    """What has to show that people tell surfaces apart, before a claim may end in equality."""
    plan, table = study.plan_of(claim.task), ANSWER_TABLES[claim.task]
    advice = ""
    if claim.measure in table.scales:
        if plan.anchors:
            return "No equality unless the anchors are rated lower than the textures' own models."
        advice = "; give it anchors" * bool(table.other_texture)
    elif table.has_rates and table.has_chance:
        return f"No equality unless {claim.models[0]} models are recognised above chance."
    elif table.both_models:
        if plan.catch_trials:
            trials = catch_trials_text(study, claim.task)
            return (
                f"No equality unless the odd one of catch trials is found above chance ({trials})."
            )
        advice = "; give it catch trials" * bool(table.other_texture)
    return f"No equality in any case, as nothing in it tests sensitivity{advice}."


def _claimed(claim: ClaimSection) -> str:
    first, second = claim.models
    measure = claim.measure.replace("_", " ")
    unit = "points on the scale" if claim.measure in RATINGS else "(proportions of correct answers)"
    what = f"proportion of correct answers in the {claim.task} task"
    if claim.measure in RATINGS:
        what = f"{measure} in the {claim.task} task"
    against = f"{second} minus {first}"
    if ANSWER_TABLES[claim.task].both_models:
        chance = Fraction(ANSWER_TABLES[claim.task].chance).limit_denominator(100)
        against = f"{second} against {first}, minus chance ({chance})"
    low, high = claim.bounds
    return (
        f"Measure: {what}, {against}. Smallest differences that matter: {low:g} and {high:g} "
        f"{unit}."
    )


def _tested(plan: PlanSection, claim: ClaimSection) -> str:
    if plan.rule != "tests" and claim.measure in RATINGS:
        return f"Claimed: {claim.test}."
    return f"Test of {claim.test}: {TESTED[claim.test]}, corrected after Holm over the textures."


def _exclusions(study: Study) -> Iterator[str]:
    for sentence in study.plan.exclusions or ("None.",):
        yield f"- {sentence}"
    share = study.plan.highest_share_at_ends
    yield (
        f"- Nobody is excluded for it, but a scale counts as exhausted where more than "
        f"{share:.0%} of its ratings are 0 or 100."
    )


def _participants(study: Study) -> Iterator[str]:
    for task, plan in study.tasks.items():
        yield f"- {task}: {plan.participants} participants."
    yield (
        "- A participant who drops out is replaced by one who takes over the same place in "
        "the design."
    )
    yield "- Data are collected until these numbers have completed their sessions, then no more."
    yield "- Nothing is tested before."


def _randomisation(study: Study) -> Iterator[str]:
    yield (
        "Orders are Fisher–Yates shuffles within the balanced design, from the seed in the study "
        f"file (SHA-256 of the study: `{study.sha256}`), and are stored before the first trial of "
        "each session. The seed is not stated here, since orders could be predicted from it."
    )


def _circumstances(study: Study) -> Iterator[str]:
    yield f"- Acoustic masking: {study.masking}."
    yield f"- Visibility of the surface: {study.surface_visible}."
    yield f"- Languages: {', '.join(study.languages)}."
    if study.questions:
        yield f"- Questions to each participant: {', '.join(q.name for q in study.questions)}."
    version = study.consent.version
    yield f"- Consent: {f'page of version {version}' if version else 'no page'}."


def _listed(names: Sequence[str]) -> str:
    *others, last = names
    return f"{', '.join(others)} and {last}" if others else last


def _times(count: int) -> str:
    return {1: "once", 2: "twice"}.get(count, f"{count} times")
