"""The claims made before the first answer, as stored in the manifests of the sessions."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from tactileq.modeling.files.claims import PlanSection
from tactileq.modeling.files.described import naming

EQUIVALENCE, DIFFERENCE = "equivalence", "difference"
MODEL_RULE, TESTS_RULE = "hierarchical", "tests"


@dataclass(frozen=True, kw_only=True)
class Claim:
    """One claim about two models.

    Parameters
    ----------
    name, task, measure : str
        `measure` is one of the measures of the task's table of answers.
    models : (str, str)
        The reference, and the one whose difference from it is claimed about; of a task whose
        trials hold both the difference is that of the share of right answers from chance.
    bounds : (float, float), optional
        In points of the scale, or shares of right answers; below and above 0. Without them
        nothing is called equivalent.
    test : {"equivalence", "difference"}
    planned : bool
        Whether it was fixed before the first answer; else it is exploratory.
    """

    name: str
    task: str
    measure: str
    models: tuple[str, str]
    bounds: tuple[float, float] | None
    test: str
    planned: bool = True


@dataclass(frozen=True, kw_only=True)
class AnalysisPlan:
    """What was fixed before the first answer.

    Parameters
    ----------
    exclusions : tuple of str
        One sentence for each reason to leave somebody or something out.
    highest_share_at_ends : float
        Share of ratings at either end of a scale (0 … 1) above which no equality is concluded.
    sha256 : tuple of str
        Of the pages to preregister that sessions ran under; several where the study was changed.
    rule : {"tests", "hierarchical", "model"}
        What decides the verdicts: paired t-test and TOST, as in studies that name no rule; of
        ratings the hierarchical model of the participants; or tests, in studies that registered a
        model which was withdrawn (`modeling.files.claims.WITHDRAWN`).
    """

    claims: tuple[Claim, ...]
    exclusions: tuple[str, ...] = ()
    highest_share_at_ends: float = 0.2
    sha256: tuple[str, ...] = ()
    rule: str = TESTS_RULE


def plan_from(values: object, *, path: Path, sha256: tuple[str, ...] = ()) -> AnalysisPlan:
    """The plan of a study's values, as a manifest holds them.

    Parameters
    ----------
    values : mapping
        The table `plan` of the study.
    path : Path
        The file, for what is said of it.
    sha256 : tuple of str
        Of the pages to preregister.

    Raises
    ------
    InputError
        For claims or a rule that are not such as a study file can state.
    """
    with naming(path):
        stated = PlanSection.read(values)
    claims = tuple(Claim(**vars(claim)) for claim in stated.claims)
    said = {name: value for name, value in vars(stated).items() if name != "few"}
    return AnalysisPlan(**{**said, "claims": claims, "sha256": sha256})
