"""From answers to verdicts: the values of each claim, and doubts about its verdict.

docs/method/statistics.md#verdicts
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy import stats

from analysis.answers.plan import DIFFERENCE, MODEL_RULE, AnalysisPlan, Claim
from analysis.answers.responses import Responses, setup_of
from analysis.columns import TEXTURE
from analysis.labels import MEASURES, MODELS, SCALES, TASKS
from analysis.statistics.claims import (
    CONTROL,
    DIFFERENCES,
    EQUALITY,
    NOT_TESTED,
    SHOWN,
    Standing,
    Values,
    claim_tests,
    complete_means,
    share_at_ends,
    with_people,
)
from analysis.statistics.draws import generators
from analysis.statistics.equivalence import ALPHA
from analysis.statistics.paired import (
    sign_flips_p,
    t_test,
    why_undefined,
    without_rounding_noise,
)
from analysis.statistics.participants.design import (
    PeopleData,
    choice_studies,
    rating_studies,
    textures_of,
)
from analysis.statistics.participants.verdict import FEWEST, PeopleFound, people_found
from modeling import InputError
from modeling.arrays import Floats
from modeling.files.answer_tables import ANSWER_TABLES, ENDS, AnswerTable
from modeling.files.columns import Column, names
from modeling.participants.choices import (
    ODDITY,
    DecisionModel,
    forced_choice,
)
from modeling.seeds import number_of


@dataclass(frozen=True, eq=False, kw_only=True)
class ClaimFound:
    """One claim with its tests and their data.

    Parameters
    ----------
    claim : Claim
    tests : DataFrame
        `analysis.statistics.claims.claim_tests`; without rows where nobody answered.
    values : DataFrame
        texture, participant_id, reference, other.
    standing : Standing
    people : PeopleFound, optional
        Where the model of the participants decides.
    few : float
        Share of people outside the bounds below which they do not count, of the plan.
    """

    claim: Claim
    tests: pd.DataFrame
    values: pd.DataFrame
    standing: Standing
    people: PeopleFound | None = None
    few: float = AnalysisPlan.few


def claims_found(responses: Responses, *, rng: np.random.Generator) -> list[ClaimFound]:
    """Every claim of the plan, then an exploratory one of each measure that no claim is about.

    Parameters
    ----------
    responses : Responses
    rng : Generator
        Draws sign flips.

    Returns
    -------
    list of ClaimFound
        Without those about tasks that nobody has begun.
    """
    found = []
    own = generators(rng)
    for claim in all_claims(responses):
        values = claim_values(responses, claim)
        standing = claim_standing(responses, claim, rng=own[claim.task])
        tests = claim_tests(claim, values, standing=standing, rng=own[claim.task])
        few = responses.plan.few
        people = None if standing.unfinished else claim_people(responses, claim, rng=rng)
        if people is not None:
            tests = with_people(tests, people, claim, standing=standing, few=few)
        found.append(
            ClaimFound(
                claim=claim,
                tests=tests,
                values=values.table,
                standing=standing,
                people=people,
                few=few,
            )
        )
    return found


def claim_people(
    responses: Responses, claim: Claim, *, rng: np.random.Generator
) -> PeopleFound | None:
    """What the model of the participants says of a claim; None where it does not decide.

    Parameters
    ----------
    responses : Responses
    claim : Claim
    rng : Generator
        Seeds the draws from the posterior.
    """
    data = people_data(responses, claim)
    if data is None or claim.bounds is None:
        return None
    own = np.random.default_rng([int(rng.integers(2**32)), number_of(claim.name)])
    return people_found(
        data.studies,
        claim.bounds,
        model=data.model,
        people=data.people,
        textures=data.textures,
        rng=own,
    )


def people_data(responses: Responses, claim: Claim) -> PeopleData | None:
    """Every answer about a claim, complete or not; None where the plan's rule is not the model's.

    Nor is there any of a task whose decision model is unknown, of claims without bounds, of fewer
    than eight people, or where all models are identical.
    """
    if responses.plan.rule != MODEL_RULE or not claim.planned or claim.bounds is None:
        return None
    same = list(responses.identical(claim.models))
    answers = answers_about(responses, claim)
    answers = answers[~answers["texture"].isin(same) & answers[claim.measure].notna()]
    people = sorted(answers["participant_id"].unique())
    checks = responses.anchors.get(claim.task, answers[:0])
    checks = checks[checks["participant_id"].isin(people)]
    if len(people) < FEWEST:
        return None
    textures = textures_of(answers)
    if claim.measure in SCALES:
        ratings = rating_studies(answers, checks, claim.measure, models=claim.models, people=people)
        return PeopleData(studies=ratings, model=None, people=people, textures=textures)
    model = decision_model(claim.task, answers)
    if model is None:
        return None
    compared = claim.models[1:] if model.both_models else claim.models
    choices = choice_studies(answers, checks, models=compared, people=people)
    return PeopleData(studies=choices, model=model, people=people, textures=textures)


def decision_model(task: str, answers: pd.DataFrame) -> DecisionModel | None:
    """The decision model of a task with right answers, by its chance; None where none is known."""
    if ANSWER_TABLES[task].both_models:
        return ODDITY if is_oddity(ANSWER_TABLES[task]) else None
    chance = chance_of(task, answers)
    if np.isnan(chance) or not np.isclose(1 / chance, round(1 / chance)):
        return None
    return forced_choice(round(1 / chance))


def is_oddity(table: AnswerTable) -> bool:
    """Whether a task is to find the odd one of three, by what its table declares."""
    return table.both_models and bool(np.isclose(table.chance, ODDITY.chance))


def all_claims(responses: Responses) -> tuple[Claim, ...]:
    """The claims of the plan about tasks with answers, and exploratory ones beside them."""
    begun = [task for task, answers in responses.answers.items() if not answers.empty]
    planned = [claim for claim in responses.plan.claims if claim.task in begun]
    known = {(claim.task, claim.measure, claim.models) for claim in planned}
    others = [
        Claim(
            name=_exploratory_name(task, measure, pair, begun=begun),
            task=task,
            measure=measure,
            models=pair,
            bounds=None,
            test=DIFFERENCE,
            planned=False,
        )
        for task in begun
        for measure in ANSWER_TABLES[task].measures
        for pair in pairs_of(responses, task)
        if (task, measure, pair) not in known
    ]
    return (*planned, *others)


def _exploratory_name(
    task: str, measure: str, pair: tuple[str, str], *, begun: Sequence[str]
) -> str:
    """The measure, with the model unless it is the usual one, and the task unless it is the first.

    The first of those that have the measure, so that adding a task renames no claim.
    """
    first = next(other for other in begun if measure in ANSWER_TABLES[other].measures)
    words = [MEASURES[measure], *pair[1:] * (pair != MODELS)]
    return " ".join([*words, *[f"of the {TASKS[task]}"] * (task != first)])


def pairs_of(responses: Responses, task: str) -> list[tuple[str, str]]:
    """The reference with each other set of models that a task compares."""
    reference, *others = models_of(responses, task)
    return [(reference, other) for other in others]


def models_of(responses: Responses, task: str) -> tuple[str, ...]:
    """The sets of models that a task compares, the reference first."""
    planned = responses.planned.get(task)
    asked = set(responses.answers[task]["model"].dropna())
    if planned:
        return planned.models
    return MODELS if asked <= set(MODELS) else tuple(sorted(asked))


def claim_values(responses: Responses, claim: Claim) -> Values:
    """The values of every participant for each texture with each model; complete cells only.

    In a task whose trials hold both models the reference is chance.
    """
    answers = answers_about(responses, claim)
    repeats = repeats_of(responses, claim.task)
    if ANSWER_TABLES[claim.task].both_models:
        both = answers.assign(model=claim.models[1])
        table = complete_means(both, claim.measure, models=claim.models, repeats=repeats)
        return Values(table=table.assign(reference=chance_of(claim.task, answers)))
    table = complete_means(answers, claim.measure, models=claim.models, repeats=repeats)
    return Values(table=table, share_at_ends=claim_shares(responses, claim))


def claim_shares(responses: Responses, claim: Claim) -> dict[str, float]:
    """`Values.share_at_ends` of a claim: empty of a measure without ends."""
    if claim.measure not in SCALES:
        return {}
    answers, same = answers_about(responses, claim), responses.identical(claim.models)
    return share_at_ends(answers, claim.measure, identical=same, ends=ENDS)


def answers_about(responses: Responses, claim: Claim) -> pd.DataFrame:
    """The main trials in which one of the claim's models was presented; both, where trials do."""
    answers = responses.answers[claim.task]
    if ANSWER_TABLES[claim.task].both_models:
        return holding_both(claim.task, answers, claim.models)
    return answers[answers["model"].isin(claim.models)]


def holding_both(task: str, answers: pd.DataFrame, models: tuple[str, str]) -> pd.DataFrame:
    """Of a task whose trials hold both models: those of this pair, where its table lists them."""
    listed = ANSWER_TABLES[task].models_in
    if not listed:
        return answers
    return answers[[set(str(held).split("|")) == set(models) for held in answers[listed]]]


def repeats_of(responses: Responses, task: str) -> int:
    """Answers that make a cell of a texture and a model complete: as planned, else the usual."""
    if task in responses.planned:
        return responses.planned[task].repeats
    answers = responses.answers[task]
    cells = ["participant_id", "texture"] + ["model"] * (not ANSWER_TABLES[task].both_models)
    return int(answers.groupby(cells).size().mode().max())


def claim_standing(responses: Responses, claim: Claim, *, rng: np.random.Generator) -> Standing:
    """Doubts about a verdict on a claim.

    docs/method/statistics.md#withheld
    """
    return Standing(
        identical=responses.identical(claim.models),
        highest_share_at_ends=responses.plan.highest_share_at_ends,
        sensitivity=_sensitivity(responses, claim, rng=rng),
        unfinished=claim.task in responses.unfinished,
    )


def _sensitivity(responses: Responses, claim: Claim, *, rng: np.random.Generator) -> str:
    """Whether participants told different surfaces apart, as `Standing.sensitivity` states it.

    Ratings show it by anchors, right answers to trials of one model by the reference's share above
    chance, those to trials of both models by catch trials.
    """
    task, table = claim.task, ANSWER_TABLES[claim.task]
    apart = responses.anchors.get(task, pd.DataFrame())
    if claim.measure in table.scales and len(apart):
        own = answers_about(responses, claim)
        own = own[own["texture"].isin(apart["texture"])]
        means = [each.groupby("participant_id")[claim.measure].mean() for each in (own, apart)]
        above = means[0] - means[1]
        failed = "anchors were not rated lower than the textures' own models"
    elif claim.measure == "correct" and table.has_rates and table.has_chance:
        values = claim_values(responses, claim).table.groupby("participant_id")["reference"].mean()
        above = values - chance_of(task, responses.answers[task])
        failed = f"answers on {claim.models[0]} models were not above chance"
    elif table.both_models and len(apart):
        above = apart.groupby("participant_id")["correct"].mean() - chance_of(task, apart)
        failed = "catch trials were not answered above chance"
    else:
        return NOT_TESTED
    return SHOWN if _one_sided_p(above.dropna(), rng=rng) < ALPHA else failed


def chance_of(task: str, answers: pd.DataFrame) -> float:
    """Proportion correct of a participant who guesses, as the task's table declares it.

    Parameters
    ----------
    task : str
    answers : DataFrame
        Of the task.

    Returns
    -------
    float
        Between 0 and 1; NaN where it is not declared, or no alternatives are listed.

    Raises
    ------
    InputError
        Where trials differ in the number of alternatives, so that no one chance holds.
    """
    table = ANSWER_TABLES[task]
    if not table.alternatives:
        return table.chance
    numbers = {len(listed.split("|")) for listed in answers[table.alternatives].dropna()}
    if len(numbers) > 1:
        raise InputError(
            f"expected as many alternatives in every trial of the {table.title}, got "
            f"{' and '.join(map(str, sorted(numbers)))}; declare its chance instead."
        )
    return 1 / numbers.pop() if numbers else float("nan")


def _one_sided_p(values: pd.Series, *, rng: np.random.Generator) -> float:
    """One-sided p of a mean above 0; 1 where there is no value."""
    numbers: Floats = without_rounding_noise(values.to_numpy(dtype=float))
    if not numbers.size:
        return 1.0
    if why_undefined(numbers):
        return sign_flips_p(numbers, rng=rng, alternative="greater")
    return float(stats.ttest_1samp(numbers, 0.0, alternative="greater").pvalue)


SETUP_COLUMNS = (
    Column("claim", is_name=True),
    Column("setup", "set-up", is_name=True),
    Column("n"),
    Column("mean_difference", "difference"),
    Column("ci_low", "95% CI from"),
    Column("ci_high", "to"),
)


def differences_by_setup(found: Sequence[ClaimFound]) -> pd.DataFrame:
    """The mean difference over all textures at each set-up; no row where there is only one.

    Returns
    -------
    DataFrame
        `SETUP_COLUMNS`; of participants who are complete in all textures that are compared.
    """
    rows = []
    for one in found:
        compared = one.values[~one.values["texture"].isin(list(one.standing.identical))]
        lacking = compared["other"].isna() | compared["reference"].isna()
        incomplete_ones = compared["participant_id"][lacking]
        whole = compared[~compared["participant_id"].isin(incomplete_ones)]
        differences = (whole["other"] - whole["reference"]).groupby(whole["participant_id"]).mean()
        names_of = setup_of(pd.Series(differences.index, index=differences.index, dtype=object))
        for name, each in differences.groupby(names_of) if names_of.nunique() > 1 else ():
            values = without_rounding_noise(each.to_numpy(dtype=float))
            low, high = (np.nan, np.nan) if why_undefined(values) else t_test(values)[2:]
            row = {"claim": one.claim.name, "setup": name, "n": len(each)}
            rows.append({**row, "mean_difference": each.mean(), "ci_low": low, "ci_high": high})
    return pd.DataFrame(rows, columns=names(SETUP_COLUMNS))


PLANTED_COLUMNS = (
    Column("claim", is_name=True),
    TEXTURE,
    Column("planted"),
    Column("mean_difference", "difference"),
    Column("ci_low", "95% CI from"),
    Column("ci_high", "to"),
    Column("verdict", is_name=True),
    Column("agreement"),
)


def planted_verdicts(
    found: Sequence[ClaimFound], planted: Mapping[str, Mapping[str, float]]
) -> pd.DataFrame:
    """Verdicts compared with the differences planted in simulated participants.

    Parameters
    ----------
    found : sequence of ClaimFound
    planted : mapping of texture to mapping of measure to points
        Other − reference. Measures without planted differences are left out.

    Returns
    -------
    DataFrame
        `PLANTED_COLUMNS`. A verdict agrees where it matches the planted difference,
        contradicts where it states the opposite (a difference where none was planted, equivalence
        where the planted one reaches a bound), and is otherwise undecided.
    """
    rows = []
    for one in found:
        points = {t: of[one.claim.measure] for t, of in planted.items() if one.claim.measure in of}
        tests = one.tests[one.tests["verdict"] != CONTROL]
        compared = [texture for texture in tests["texture"] if texture in points]
        for row in tests.to_dict("records") if compared else ():
            mean = float(np.mean([points[texture] for texture in compared]))
            truth = points.get(row["texture"], mean)
            agreement = _agreement(row["verdict"], truth, bounds=one.claim.bounds)
            rows.append({**row, "planted": truth, "agreement": agreement})
    return pd.DataFrame(rows, columns=names(PLANTED_COLUMNS))


def _agreement(verdict: str, truth: float, *, bounds: tuple[float, float] | None) -> str:
    within = bounds is not None and bounds[0] < truth < bounds[1]
    wrong_equality = not within and verdict in EQUALITY
    wrong_difference = truth == 0 and verdict in DIFFERENCES
    if wrong_equality or wrong_difference:
        return "contradicts"
    return "agrees" if verdict in (*EQUALITY, *DIFFERENCES) else "undecided"


def check_complete(responses: Responses) -> None:
    """Refuse participants who lack answers to a texture with one of two models.

    Raises
    ------
    InputError
        Names them, and the textures.
    """
    lacking: dict[str, dict[str, None]] = {}
    for claim in all_claims(responses):
        standing = Standing(identical=responses.identical(claim.models))
        values = claim_values(responses, claim).table
        one = ClaimFound(claim=claim, tests=pd.DataFrame(), values=values, standing=standing)
        for participant, texture in incomplete(one):
            lacking.setdefault(participant, {})[f"{TASKS[claim.task]} of {texture}"] = None
    if not lacking:
        return
    (who, what), *others = lacking.items()
    more = f", and of {len(others)} more ({', '.join(w for w, _ in others[:5])}" if others else ""
    more += ", …)" if len(others) > 5 else ")" * bool(others)
    shown = ", ".join(list(what)[:3]) + (", …" if len(what) > 3 else "")
    raise InputError(
        f"expected all planned answers on both models of every texture, got too few of {who} "
        f"({shown}){more}; let them finish, leave them out with a reason (--exclude), or compare "
        "complete pairs alone (--complete)."
    )


def incomplete(found: ClaimFound) -> Iterator[tuple[str, str]]:
    """Participant and texture of each pair that lacks an answer, identical ones left out."""
    values = found.values
    lacking = values[["reference", "other"]].isna().any(axis=1)
    lacking &= ~values["texture"].isin(list(found.standing.identical))
    for row in values[lacking].to_dict("records"):
        yield str(row["participant_id"]), str(row["texture"])
