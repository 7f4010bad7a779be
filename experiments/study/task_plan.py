"""How many people do a task, how often, on which days: a table such as [absolute] of a study."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any, Literal

from experiments.study.tables import (
    as_list,
    as_table,
    require_bool,
    require_different,
    require_keys,
    require_label,
)
from modeling import InputError
from modeling.checks import check_keys, check_whole
from modeling.errors import shown
from modeling.files.answer_tables import ANSWER_TABLES

Schedule = Literal["by-day", "interleaved"]
SCHEDULES: tuple[Schedule, ...] = ("by-day", "interleaved")

# The usual repeats of a task whose table does not say; 1 in any other.
REPEATS = {"relative": 3, "oddity": 6, "threshold": 60}
MOST_TRAINING_TRIALS = 100
# Of a session, where the rule of verdicts is the model and the study does not say.
CATCH_TRIALS = 6
MOST_CATCH_TRIALS = 100


@dataclass(frozen=True, kw_only=True)
class TaskPlan:
    """How many people do a task, and how its trials are spread over their days.

    docs/method/protocols.md#schedule

    Parameters
    ----------
    participants : int
        At least 1; by day a multiple of the number of models, so that their order is
        counterbalanced exactly.
    schedule : {"by-day", "interleaved"}
        Either each model on a day of its own (one session per model), or all mixed in one session.
    repeats : int
        How often each texture comes with each model, ≥ 1. In a task whose every trial holds both
        models: trials of each texture; in the threshold task: trials of each frequency.
    models : tuple of str
        The sets of models that are compared, two at least; empty for the first two of the study.
    training_trials, most_training_trials : int
        Trials for practice: the fewest, and the most where strokes stay outside the grid; 0 for as
        many as the fewest.
    break_after : int
        Trials between two breaks; 0 for none.
    anchors : mapping of texture to texture
        Real surfaces that are presented beside the virtual one of another texture, said to
        correspond (docs/method/protocols.md#anchors); once in each session.
    feel_all : bool
        Whether all virtual surfaces of a trial have to be felt before an answer.
    catch : mapping of texture to texture
        Of the odd-one-out task: surfaces with one that everybody can tell from it, the odd one of
        a catch trial and the other two in either way (docs/method/protocols.md#catch-trials).
    catch_trials : int, optional
        Main trials of a session that are catch trials, 0 … 100; without it as many as the study's
        rule of verdicts asks for.

    Raises
    ------
    InputError
        For any other value.
    """

    participants: int
    schedule: Schedule
    repeats: int = 1
    models: tuple[str, ...] = ()
    training_trials: int = 2
    most_training_trials: int = 0
    break_after: int = 0
    anchors: Mapping[str, str] = field(default_factory=dict)
    feel_all: bool = False
    catch: Mapping[str, str] = field(default_factory=dict)
    catch_trials: int | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "models", tuple(self.models))
        for name in ("anchors", "catch"):
            object.__setattr__(self, name, dict(getattr(self, name)))
        self._check_numbers()
        if self.schedule not in SCHEDULES:
            raise InputError(
                f"expected a schedule of {' or '.join(SCHEDULES)}, got {shown(self.schedule)}; "
                "choose one of the two."
            )
        require_bool("feel_all", self.feel_all)
        for name in self.models:
            require_label("a set of models", name)
        require_different("models", self.models)
        if len(self.models) == 1:
            raise InputError(
                f"expected two models or more to compare, got {self.models[0]} alone; name "
                "another one beside it."
            )

    def _check_numbers(self) -> None:
        check_whole("participants", self.participants, low=1, high=9999)
        check_whole("repeats", self.repeats, low=1, high=100)
        check_whole("break_after", self.break_after, low=0, high=10_000)
        check_whole("training_trials", self.training_trials, low=0, high=MOST_TRAINING_TRIALS)
        check_whole(
            "most_training_trials", self.most_training_trials, low=0, high=MOST_TRAINING_TRIALS
        )
        if self.catch_trials is not None:
            check_whole("catch_trials", self.catch_trials, low=0, high=MOST_CATCH_TRIALS)
        most = self.most_training_trials or self.training_trials
        if most < self.training_trials:
            raise InputError(
                f"expected most_training_trials of at least the {self.training_trials} "
                f"training_trials, got {most}; raise it, or lower training_trials."
            )
        object.__setattr__(self, "most_training_trials", most)

    def to_dict(self) -> dict[str, Any]:
        """The plan as plain values, as in a study file; of catch trials only what it says."""
        values = {**asdict(self), "models": list(self.models)}
        unsaid: dict[str, object] = {"catch": {}, "catch_trials": None}
        return {name: value for name, value in values.items() if unsaid.get(name, ()) != value}

    @staticmethod
    def from_dict(task: str, values: object) -> TaskPlan:
        """A plan from the table of a task in a study file.

        Raises
        ------
        InputError
            For unknown or missing keys, or values out of range.
        """
        table = as_table(values, where=f"[{task}]", example=f"[{task}] above its keys")
        check_keys(table, tuple(f.name for f in fields(TaskPlan)), where=f"[{task}]")
        require_keys(table, ("participants", "schedule"), where=f"[{task}]")
        table = {"repeats": REPEATS.get(task, 1), **table}
        example = '["full", "simplified"]'
        table["models"] = as_list(
            table.get("models", ()), where=f"models in [{task}]", example=f"models = {example}"
        )
        for name in ("anchors", "catch"):
            table[name] = as_table(
                table.get(name, {}),
                where=f"{name} in [{task}]",
                example=f'{name} = {{canvas = "PVC"}}',
            )
        return TaskPlan(**table)


PAPER_PLANS = {
    "absolute": TaskPlan(participants=20, schedule="interleaved"),
    "relative": TaskPlan(participants=24, schedule="by-day", repeats=REPEATS["relative"]),
}


def with_catch_trials(plan: TaskPlan, *, rule: str, anchors: Mapping[str, str]) -> TaskPlan:
    """A plan of the odd-one-out task with its catch trials, where it does not number them.

    Parameters
    ----------
    plan : TaskPlan
    rule : {"tests", "model"}
        Of the study's verdicts; under "model" there are catch trials unless the plan says no.
    anchors : mapping of texture to texture
        Of the absolute task: the pairs of a plan that names none.
    """
    if plan.catch_trials is not None or not (plan.catch or rule == "model"):
        return plan
    return replace(plan, catch=plan.catch or anchors, catch_trials=CATCH_TRIALS)


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
