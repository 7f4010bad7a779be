"""The chapter on right answers with each model, against chance (PAPER VIII-B)."""

from __future__ import annotations

from functools import partial

import numpy as np
import pandas as pd

from tactileq.analysis.chapters.chapter import Answered, Stream, named_by, who_took_part
from tactileq.analysis.chapters.choices.figure import figure_correct_rates
from tactileq.analysis.labels import ALL_TEXTURES, TASK_TITLES, names_or_none, sentence_case
from tactileq.analysis.page.outcomes import Outcome, Weight
from tactileq.analysis.page.page import Picture, Table
from tactileq.analysis.page.sections import Section, of_task
from tactileq.analysis.statistics.compared_answers import chance_of, models_of
from tactileq.analysis.statistics.rates import CORRECT_RATE_COLUMNS, UNKNOWN_CHANCE, correct_rates
from tactileq.analysis.statistics.verdicts import ClaimFound
from tactileq.modeling.files.answer_tables import ANSWER_TABLES, AnswerTable
from tactileq.modeling.files.columns import chosen, without

ALPHA = 0.05
CORRECT_RATES_SHOWN = (
    *without(CORRECT_RATE_COLUMNS, "note"),
    *chosen(CORRECT_RATE_COLUMNS, "note"),
)


def applies(table: AnswerTable) -> bool:
    """Whether each model has a share of right answers."""
    return table.has_rates


def sections(answered: Answered) -> list[Section]:
    """A section for each task with right answers by model."""
    return [
        _section(answered, stream)
        for stream in answered.streams("choices", applies)
        if answered.responses.answers[stream.task]["correct"].notna().any()
    ]


def _section(answered: Answered, stream: Stream) -> Section:
    task, responses = stream.task, answered.responses
    answers, simulated = responses.answers[task], responses.simulated
    models = models_of(responses, task)
    chance = chance_of(task, answers)
    rates = correct_rates(answers, models, rng=stream.rng, chance=chance)
    done, tile = who_took_part(responses, task)
    found = [one for one in answered.judged_in(task) if one.claim.measure == "correct"]
    section = Section(
        "choices",
        f"{sentence_case(TASK_TITLES[task])}: right answers",
        (
            *(_rates_picture(one, chance=chance, simulated=simulated) for one in found),
            _rates_table(rates, chance=chance, simulated=simulated),
        ),
        outcomes=tuple(rate_outcomes(rates, task, chance=chance)),
        done=(done,),
        tiles=(tile,),
    )
    return of_task(section, stream.ending)


def _rates_picture(found: ClaimFound, *, chance: float, simulated: bool) -> Picture:
    """Shares of right answers with either model of a claim."""
    task, (reference, other) = found.claim.task, found.claim.models
    paper = " Compare figure 11 of the paper, whose bars are standard errors." * (
        ANSWER_TABLES[task].is_identification
    )
    line = f"; {UNKNOWN_CHANCE}." if np.isnan(chance) else "; dashed: chance."
    return Picture(
        named_by("correct_rates", found.claim.models),
        f"Correct rates of the {TASK_TITLES[task]}, {reference} and {other} models",
        "Bars: means over participants with 95% confidence intervals; points: participants"
        f"{line}{paper}",
        figure_correct_rates(found, chance=chance, simulated=simulated),
        simulated,
    )


def _rates_table(rates: pd.DataFrame, *, chance: float, simulated: bool) -> Table:
    """Shares of right answers from `correct_rates`."""
    title, test = "Correct rates", f"; {UNKNOWN_CHANCE}, nothing is tested against it"
    if not np.isnan(chance):
        title = "Correct rates against chance"
        test = (
            ", and a one-sample t-test against chance (sign flips where all have the same rate) "
            "with Holm's correction over the textures of one model"
        )
    return Table(
        "correct_rates",
        title,
        "Participants are the units: mean of their rates with a 95% interval (bias-corrected and "
        f"accelerated bootstrap over participants){test}. The rows over all textures weight "
        "textures equally and include complete participants only.",
        rates,
        CORRECT_RATES_SHOWN,
        simulated,
    )


def rate_outcomes(rates: pd.DataFrame, task: str, *, chance: float) -> list[Outcome]:
    """A sentence on each model's correct rates against chance, from `rates.correct_rates`.

    If chance is not known (NaN), it says so and tests nothing against it.
    """
    compared = _described_rate if np.isnan(chance) else partial(_against_chance, chance=chance)
    return [
        Outcome(
            Weight.DESCRIPTIVE if np.isnan(chance) else Weight.SECONDARY,
            f"{sentence_case(TASK_TITLES[task])}, {model} model: {compared(of_model)}.",
        )
        for model, of_model in rates.groupby("model", sort=False)
    ]


def _described_rate(rates: pd.DataFrame) -> str:
    return f"{_overall_rate(rates)}; {UNKNOWN_CHANCE}, nothing is tested against it)"


def _overall_rate(rates: pd.DataFrame) -> str:
    """The share of right answers over all textures; the closing bracket is left out."""
    overall = rates[rates["texture"] == ALL_TEXTURES].iloc[0]
    if not overall["participants"]:
        return "no participant has answered all textures (no overall share"
    interval = "no interval, because participants do not vary"
    if np.isfinite(overall["ci_low"]):
        interval = f"95% bootstrap CI {overall['ci_low']:.1%} to {overall['ci_high']:.1%}"
    return (
        f"{overall['mean']:.1%} of the answers were right ({interval}; participants: "
        f"{overall['participants']}"
    )


def _against_chance(rates: pd.DataFrame, *, chance: float) -> str:
    family = rates[rates["texture"] != ALL_TEXTURES]
    significant = family["p_holm"] < ALPHA
    above = family[significant & (family["mean"] > chance)]
    below = family[significant & (family["mean"] < chance)]
    text = (
        f"{_overall_rate(rates)}; chance {chance:.1%}); above chance (Holm): "
        f"{names_or_none(above['texture'])}"
    )
    if not below.empty:
        text += f"; below chance: {names_or_none(below['texture'])}"
    unclear = family[~significant & family["p_holm"].notna()]
    if not unclear.empty:
        text += f"; not distinguished from chance: {names_or_none(unclear['texture'])}"
    undefined = family[family["p_holm"].isna()]
    if not undefined.empty:
        text += f"; test undefined (see the notes): {names_or_none(undefined['texture'])}"
    return text
