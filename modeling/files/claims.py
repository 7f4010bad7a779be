"""What a study fixes before its first answer, its table [plan] (docs/method/protocols.md#plan).

Experiments read it in study files, analysis in the descriptions of data sets.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.files.answer_tables import ANSWER_TABLES, ENDS
from tactileq.modeling.files.described import FileSection, key
from tactileq.modeling.files.hashes import sha256_of_values
from tactileq.modeling.files.kinds import Label, is_different

FEW = 0.15
LARGEST_FEW = 0.5
WITHDRAWN = "model"  # a rule of studies that registered it: of people outside the bounds
RATINGS = tuple(dict.fromkeys(c.name for t in ANSWER_TABLES.values() for c in t.columns if c.scale))
# The largest difference that there can be: in points of a scale, or between two shares.
LARGEST = {**dict.fromkeys(RATINGS, ENDS[1] - ENDS[0]), "correct": 1.0}


@dataclass(frozen=True, kw_only=True)
class ClaimSection(FileSection):
    """One claim about two sets of models, with the bounds that would contradict it."""

    WHERE: ClassVar[str] = "[[plan.claims]]"
    name: Annotated[Label, key("what the report calls it")]
    task: Annotated[str, key("the task whose answers decide")]
    measure: Annotated[
        str, key('a scale of the task, or "correct": the proportion of such answers')
    ]
    models: Annotated[
        tuple[str, str],
        key(
            "the difference is that of the second from the first; in a task whose trials hold "
            "both, that of the proportion correct from chance",
            expected="two different sets of models",
            advice='write ["full", "simplified"]',
            holds=is_different,
        ),
    ]
    bounds: Annotated[
        tuple[float, float],
        key(
            "the smallest differences that matter: points of the scale, or proportions correct",
            expected="two bounds, below and above 0",
            advice="give the smallest differences that matter",
            holds=lambda bounds: bounds[0] < 0 < bounds[1],
        ),
    ]
    test: Annotated[Literal["equivalence", "difference"], key("what is claimed")]

    def __post_init__(self) -> None:
        super().__post_init__()
        measures = ANSWER_TABLES[self.task].measures if self.task in ANSWER_TABLES else ()
        if not measures:
            raise InputError(
                f"expected a task with ratings or right answers about models in the claim "
                f"{self.name}, got {shown(self.task)}; name one, or leave the claim out."
            )
        if self.measure not in measures:
            raise InputError(
                f"expected {' or '.join(measures)} for the measure in the claim {self.name} about "
                f"[{self.task}], got {shown(self.measure)}; choose one."
            )
        largest = LARGEST[self.measure]
        if max(map(abs, self.bounds)) > largest:
            raise InputError(
                f"expected bounds within {-largest:g} and {largest:g} for {self.measure} in the "
                f"claim {self.name}, got {shown(list(self.bounds))}; give the smallest differences "
                "that matter."
            )


@dataclass(frozen=True, kw_only=True)
class PlanSection(FileSection):
    """Claims and exclusions, fixed before the first answer."""

    WHERE: ClassVar[str] = "[plan]"
    exclusions: Annotated[
        tuple[Label, ...],
        key(
            "a sentence for each reason to leave a participant or an answer out",
            expected="a list of sentences in one line",
            advice='write ["…"]',
        ),
    ] = ()
    highest_share_at_ends: Annotated[
        float,
        key("share of ratings at an end of a scale above which it counts as exhausted", ge=0, le=1),
    ] = 0.2
    rule: Annotated[
        Literal["hierarchical", "tests", "model"],
        key(
            "what decides verdicts: the hierarchical model of the participants on ratings, tests "
            'on right answers; or paired t-test and TOST on both; "model" was withdrawn'
        ),
    ] = "tests"
    few: Annotated[
        float,
        key(
            'of studies that registered rule = "model" alone: share of people outside the bounds '
            "below which models counted as equivalent",
            ge=0,
            le=LARGEST_FEW,
        ),
    ] = FEW
    claims: Annotated[tuple[ClaimSection, ...], key("what is claimed")] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        names = [claim.name for claim in self.claims]
        if not is_different(names):
            raise InputError(
                f"expected claims of different names, got {', '.join(names)}; rename one."
            )
        if self.rule != WITHDRAWN and self.few != FEW:
            raise _few_without_model(self)

    @classmethod
    def read(cls, values: object, *, where: str = "", folder: Path | None = None) -> Self:
        """A plan from its table; `few` is refused beside a rule that has none."""
        plan = super().read(values, where=where, folder=folder)
        if plan.rule != WITHDRAWN and isinstance(values, Mapping) and "few" in values:
            raise _few_without_model(plan)
        return plan

    def to_dict(self) -> dict[str, Any]:
        """The plan as plain values, as in a study file; a rule of tests goes without saying."""
        unsaid = {"tests": ("rule", "few"), WITHDRAWN: ()}.get(self.rule, ("few",))
        return {name: value for name, value in super().to_dict().items() if name not in unsaid}

    def require_current(self) -> None:
        """Refuse to begin a study with a rule that was withdrawn.

        Raises
        ------
        InputError
            Names the rule to write.
        """
        if self.rule == WITHDRAWN:
            raise InputError(
                'expected rule = "hierarchical" or "tests" in [plan] of a new study, got "model", '
                "which was withdrawn, since few ratings of each texture cannot tell how many "
                'people feel a difference; write rule = "hierarchical" and remove few (sessions of '
                "a study that was begun with it go on, and are analysed)."
            )

    @property
    def sha256(self) -> str:
        """SHA-256 of its values."""
        return sha256_of_values(self.to_dict())


def _few_without_model(plan: PlanSection) -> InputError:
    return InputError(
        f'expected few in [plan] of studies alone that registered rule = "model", got '
        f'{shown(plan.few)} beside the rule "{plan.rule}"; remove it.'
    )
