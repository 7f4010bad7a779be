"""What is fixed before the first answer: the table [plan] (docs/method/protocols.md#plan)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Literal

from experiments.study.tables import (
    as_list,
    as_table,
    require_different,
    require_keys,
    require_label,
)
from experiments.study.task_plan import TaskPlan
from modeling import InputError
from modeling.checks import check_choice, check_keys, check_number, is_number
from modeling.errors import shown
from modeling.files.answer_tables import ANSWER_TABLES, ENDS
from modeling.files.hashes import sha256_of_values

Test = Literal["equivalence", "difference"]
TESTS: tuple[Test, ...] = ("equivalence", "difference")
Rule = Literal["model", "tests"]
RULES: tuple[Rule, ...] = ("model", "tests")
FEW = 0.15
LARGEST_FEW = 0.5
# Fewer people say too little about the spread between people, on which the model's rule rests.
FEWEST_OF_MODEL = 8
RATINGS = tuple(dict.fromkeys(c.name for t in ANSWER_TABLES.values() for c in t.columns if c.scale))
# The largest difference that there can be: in points of a scale, or between two shares.
LARGEST = {**dict.fromkeys(RATINGS, ENDS[1] - ENDS[0]), "correct": 1.0}


def measures_of(task: str) -> tuple[str, ...]:
    """Measures that claims about a task can use: its scales, the proportion of correct answers.

    Anything of a task that does not exist; `Plan.check` names it.
    """
    return ANSWER_TABLES[task].measures if task in ANSWER_TABLES else tuple(LARGEST)


@dataclass(frozen=True, kw_only=True)
class Claim:
    """One claim about two models, with the bounds that would contradict it.

    Parameters
    ----------
    name : str
    task : str
    measure : str
        One of `measures_of(task)`.
    models : (str, str)
        The difference is that of the second from the first; in a task whose trials hold both it
        is that of the share of right answers from chance.
    bounds : (float, float)
        The smallest differences that matter, below and above 0, in raw units: points of the scale,
        or shares of right answers.
    test : {"equivalence", "difference"}

    Raises
    ------
    InputError
        For values out of range.
    """

    name: str
    task: str
    measure: str
    models: tuple[str, str]
    bounds: tuple[float, float]
    test: Test

    def __post_init__(self) -> None:
        object.__setattr__(self, "models", tuple(self.models))
        object.__setattr__(self, "bounds", tuple(self.bounds))
        require_label("the name of a claim", self.name)
        if not measures_of(self.task):
            raise InputError(
                f"expected a task with ratings or right answers about models in the claim "
                f"{self.name}, got {self.task}, which compares no models; leave the claim out."
            )
        check_choice(f"the measure of {self.name}", self.measure, measures_of(self.task))
        check_choice(f"the test of {self.name}", self.test, TESTS)
        if len(self.models) != 2 or self.models[0] == self.models[1]:
            raise InputError(
                f"expected two different models in the claim {self.name}, got "
                f"{shown(list(self.models))}; name the two that it compares."
            )
        self._check_bounds()

    def _check_bounds(self) -> None:
        largest = LARGEST[self.measure]
        numbers = len(self.bounds) == 2 and all(map(is_number, self.bounds))
        if not (numbers and -largest <= self.bounds[0] < 0 < self.bounds[1] <= largest):
            raise InputError(
                f"expected bounds below and above 0 within {-largest:g} and {largest:g} for "
                f"{self.measure} in the claim {self.name}, got {shown(list(self.bounds))}; give "
                "the smallest differences that matter."
            )
        object.__setattr__(self, "bounds", tuple(map(float, self.bounds)))

    def to_dict(self) -> dict[str, Any]:
        """The claim as plain values, as in a study file."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        return {**values, "models": list(self.models), "bounds": list(self.bounds)}

    @staticmethod
    def from_dict(values: object) -> Claim:
        """A claim from its table in a study file.

        Raises
        ------
        InputError
            For unknown or missing keys, or values out of range.
        """
        where = "[[plan.claims]]"
        table = as_table(values, where=where, example=f"{where} above its keys")
        known = tuple(f.name for f in fields(Claim))
        check_keys(table, known, where=where)
        require_keys(table, known, where=where)
        for name, example in (("models", '["full", "simplified"]'), ("bounds", "[-7.5, 7.5]")):
            table[name] = as_list(
                table[name], where=f"two {name} in {where}", example=f"{name} = {example}"
            )
        return Claim(**table)


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Claims and exclusions, fixed before the first answer.

    Parameters
    ----------
    claims : tuple of Claim
    exclusions : tuple of str
        One sentence for each reason to leave a participant or an answer out.
    highest_share_at_ends : float
        Share of ratings at an end of a scale, 0 … 1, above which a scale is said to be exhausted.
    rule : {"tests", "model"}
        What decides the verdicts: paired t-test and TOST, as in study files that name no rule, or
        the hierarchical model of the participants.
    few : float
        Share of people outside the bounds, 0 … 0.5, below which models count as equivalent; of the
        rule "model" alone.

    Raises
    ------
    InputError
        For values out of range.
    """

    claims: tuple[Claim, ...] = ()
    exclusions: tuple[str, ...] = ()
    highest_share_at_ends: float = 0.2
    rule: Rule = "tests"
    few: float = FEW

    def __post_init__(self) -> None:
        object.__setattr__(self, "claims", tuple(self.claims))
        object.__setattr__(self, "exclusions", tuple(self.exclusions))
        for sentence in self.exclusions:
            require_label("an exclusion", sentence)
        require_different("names of claims", [claim.name for claim in self.claims])
        check_number("highest_share_at_ends", self.highest_share_at_ends, high=1.0)
        object.__setattr__(self, "highest_share_at_ends", float(self.highest_share_at_ends))
        check_choice("the rule in [plan]", self.rule, RULES)
        check_number("few", self.few, high=LARGEST_FEW)
        object.__setattr__(self, "few", float(self.few))
        if self.rule == "tests" and self.few != FEW:
            raise _few_without_model(self.few)

    def check(self, tasks: Mapping[str, TaskPlan]) -> None:
        """Refuse claims about tasks or models that are not planned, or about too few people.

        Raises
        ------
        InputError
            Naming the claim.
        """
        for claim in self.claims:
            if claim.task not in tasks:
                raise InputError(
                    f"expected a planned task ({', '.join(tasks)}) in the claim {claim.name}, got "
                    f"{shown(claim.task)}; plan it, or correct the claim."
                )
            unknown = [name for name in claim.models if name not in tasks[claim.task].models]
            if unknown:
                raise InputError(
                    f"expected models of [{claim.task}] ({', '.join(tasks[claim.task].models)}) in "
                    f"the claim {claim.name}, got {shown(unknown[0])}; correct it."
                )
            if self.rule == "model":
                _check_people(claim, tasks[claim.task].participants)

    def to_dict(self) -> dict[str, Any]:
        """The plan as plain values, as in a study file; a rule of tests goes without saying."""
        return {
            "exclusions": list(self.exclusions),
            "highest_share_at_ends": self.highest_share_at_ends,
            **({"rule": self.rule, "few": self.few} if self.rule == "model" else {}),
            "claims": [claim.to_dict() for claim in self.claims],
        }

    @property
    def sha256(self) -> str:
        """SHA-256 of its values."""
        return sha256_of_values(self.to_dict())

    @staticmethod
    def from_dict(values: object) -> Plan:
        """A plan from the table [plan] of a study file.

        Raises
        ------
        InputError
            For unknown keys, or values out of range.
        """
        table = as_table(values, where="[plan]", example="[plan] above its keys")
        check_keys(table, tuple(f.name for f in fields(Plan)), where="[plan]")
        if "few" in table and table.get("rule", "tests") == "tests":
            raise _few_without_model(table["few"])
        table["exclusions"] = as_list(
            table.get("exclusions", ()), where="exclusions", example='exclusions = ["…"]'
        )
        claims = as_list(table.get("claims", ()), where="claims", example="[[plan.claims]]")
        table["claims"] = tuple(map(Claim.from_dict, claims))
        return Plan(**table)


def _check_people(claim: Claim, participants: int) -> None:
    if participants < FEWEST_OF_MODEL:
        raise InputError(
            f"expected {FEWEST_OF_MODEL} participants or more in [{claim.task}] for the rule "
            f'"model" of the claim {claim.name}, got {participants}; plan {FEWEST_OF_MODEL} or '
            'more, or write rule = "tests" in [plan] and leave few out.'
        )


def _few_without_model(few: object) -> InputError:
    return InputError(
        f'expected few in [plan] beside rule = "model" alone, got {shown(few)} beside the rule '
        '"tests"; write rule = "model", or remove it.'
    )
