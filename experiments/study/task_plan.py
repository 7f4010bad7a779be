"""How many people do a task, how often, on which days: a table such as [absolute] of a study."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, ClassVar, Literal

from tactileq.modeling import InputError
from tactileq.modeling.errors import shown
from tactileq.modeling.files.answer_tables import ANSWER_TABLES
from tactileq.modeling.files.described import FileSection, key
from tactileq.modeling.files.kinds import Label, is_different

# The usual repeats of a task whose table does not say; 1 in any other.
REPEATS = {"relative": 3, "oddity": 6, "threshold": 60}
MOST_TRAINING_TRIALS = 100
# Of a session, where the rule of verdicts is not that of tests and the study does not say.
CATCH_TRIALS = 6
MOST_CATCH_TRIALS = 100


def _can_be_compared(names: tuple[str, ...]) -> bool:
    return len(names) != 1 and is_different(names)


@dataclass(frozen=True, kw_only=True)
class TaskPlan(FileSection):
    """How many people do a task, how often, and on which days: a table of the task's name.

    docs/method/protocols.md#schedule

    Raises
    ------
    InputError
        For any other value.
    """

    WHERE: ClassVar[str] = "[TASK]"
    participants: Annotated[
        int, key("by day a multiple of the number of models, for balance", ge=1, le=9999)
    ]
    schedule: Annotated[
        Literal["by-day", "interleaved"],
        key("each model on a day of its own, or all mixed in one session"),
    ]
    repeats: Annotated[
        int,
        key(
            "of each texture with each model; trials of each texture where a trial holds both, of "
            "each frequency in [threshold] "
            f"({', '.join(f'{count} in [{task}]' for task, count in REPEATS.items())})",
            ge=1,
            le=100,
        ),
    ] = 1
    models: Annotated[
        tuple[Label, ...],
        key(
            "the sets that are compared; without it the first two of [models]",
            expected="a list of two models or more, all different",
            advice='write ["full", "simplified"]',
            holds=_can_be_compared,
        ),
    ] = ()
    training_trials: Annotated[
        int, key("for practice, at least", ge=0, le=MOST_TRAINING_TRIALS)
    ] = 2
    most_training_trials: Annotated[
        int,
        key(
            "for practice while strokes stay outside the grid; 0 for training_trials",
            ge=0,
            le=MOST_TRAINING_TRIALS,
        ),
    ] = 0
    break_after: Annotated[int, key("trials between two breaks; 0 for none", ge=0, le=10_000)] = 0
    anchors: Annotated[
        dict[str, str],
        key(
            "[absolute]: real surfaces that come beside the virtual one of another texture, once "
            "in each session",
            advice='write {canvas = "PVC"}',
        ),
    ] = field(default_factory=dict)
    feel_all: Annotated[bool, key("no answer before all virtual surfaces of a trial were felt")] = (
        False
    )
    catch: Annotated[
        dict[str, str],
        key(
            "[oddity]: surfaces with one that everybody can tell from it, of which catch trials "
            "are made; without it the anchors",
            advice='write {canvas = "PVC"}',
        ),
    ] = field(default_factory=dict)
    catch_trials: (
        Annotated[
            int,
            key(
                "[oddity]: main trials of a session that are catch trials; without it "
                f'{CATCH_TRIALS} under rule = "hierarchical"',
                ge=0,
                le=MOST_CATCH_TRIALS,
            ),
        ]
        | None
    ) = None

    def __post_init__(self) -> None:
        super().__post_init__()
        most = self.most_training_trials or self.training_trials
        if most < self.training_trials:
            raise InputError(
                f"expected most_training_trials of at least the {self.training_trials} "
                f"training_trials, got {most}; raise it, or lower training_trials."
            )
        object.__setattr__(self, "most_training_trials", most)

    def to_dict(self) -> dict[str, Any]:
        """The plan as plain values, as in a study file; of catch trials only what it says."""
        unsaid: dict[str, object] = {"catch": {}, "catch_trials": None}
        values = super().to_dict()
        return {name: value for name, value in values.items() if unsaid.get(name, ()) != value}


PAPER_PLANS = {
    "absolute": TaskPlan(participants=20, schedule="interleaved"),
    "relative": TaskPlan(participants=24, schedule="by-day", repeats=REPEATS["relative"]),
}


def with_catch_trials(plan: TaskPlan, *, rule: str, anchors: Mapping[str, str]) -> TaskPlan:
    """A plan of the odd-one-out task with its catch trials, where it does not number them.

    Parameters
    ----------
    rule : {"hierarchical", "tests", "model"}
        Of the study's verdicts; but for "tests" there are catch trials unless the plan says no.
    anchors : mapping of texture to texture
        Of the absolute task: the pairs of a plan that names none.
    """
    if plan.catch_trials is not None or not (plan.catch or rule != "tests"):
        return plan
    return replace(plan, catch=dict(plan.catch or anchors), catch_trials=CATCH_TRIALS)


def check_plan(task: str, plan: TaskPlan, *, textures: tuple[str, ...]) -> None:
    """Refuse a plan that its task or the study's textures do not allow; models are named in it."""
    count = len(plan.models)
    if plan.schedule == "by-day" and plan.participants % count:
        even = "an even number" if count == 2 else f"a multiple of {count}"
        raise InputError(
            f"expected {even} of participants for the schedule by-day in [{task}], got "
            f"{plan.participants}; change it, so that equally many begin with each model."
        )
    if task == "absolute" and plan.feel_all:
        raise InputError(
            "expected feel_all in a task with several virtual surfaces, got it in [absolute]; "
            "remove it there."
        )
    _check_anchors(task, plan.anchors, textures)
    _check_catch(task, plan, textures)
    if ANSWER_TABLES[task].both_models:
        _check_both_models(task, plan)
    if not ANSWER_TABLES[task].of_surfaces and plan.schedule != "interleaved":
        raise InputError(
            f"expected the schedule interleaved in [{task}], where no models are compared, got "
            f"{plan.schedule}; correct it."
        )


def _check_anchors(task: str, anchors: Mapping[str, str], textures: tuple[str, ...]) -> None:
    if anchors and task != "absolute":
        raise InputError(
            f"expected anchors in [absolute] alone, got some in [{task}]; remove them there."
        )
    for real, virtual in anchors.items():
        if real not in textures or virtual not in textures or real == virtual:
            raise InputError(
                f"expected two different textures of the study in each anchor, got {shown(real)} "
                f"= {shown(virtual)}; name the real surface, then that of the virtual one."
            )


def _check_catch(task: str, plan: TaskPlan, textures: tuple[str, ...]) -> None:
    if task != "oddity" and (plan.catch or plan.catch_trials is not None):
        raise InputError(
            f"expected catch and catch_trials in [oddity] alone, got one in [{task}]; remove it "
            "there."
        )
    for surface, other in plan.catch.items():
        if surface not in textures or other not in textures or surface == other:
            raise InputError(
                f"expected two different textures of the study in each pair of catch, got "
                f"{shown(surface)} = {shown(other)}; name two that everybody can tell apart."
            )
    if plan.catch_trials and not plan.catch:
        first, second = textures[:2]
        raise InputError(
            f"expected a pair of textures for the {plan.catch_trials} catch trials of [{task}], "
            "got catch trials without a surface that differs; name two that everybody can tell "
            f'apart, as in catch = {{"{first}" = "{second}"}}, or write catch_trials = 0.'
        )


def _check_both_models(task: str, plan: TaskPlan) -> None:
    if len(plan.models) != 2 or plan.schedule != "interleaved":
        raise InputError(
            f"expected two models and the schedule interleaved in [{task}], each of whose trials "
            f"holds both, got {', '.join(plan.models)} {plan.schedule}; correct it."
        )
    if plan.repeats % 2:
        raise InputError(
            f"expected an even number of repeats in [{task}], so that each of the two models has "
            f"its turn equally often, got {plan.repeats}; correct it."
        )
