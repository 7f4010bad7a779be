"""The sections on people's answers: verdicts, ratings and choices."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from analysis.answers.responses import Responses
from analysis.figures.answers import figure_correct_rates, figure_ratings
from analysis.figures.forest import figure_forest
from analysis.labels import ALL_TEXTURES, MODELS, TASKS, sentence_case
from analysis.page.page import Fold, Picture, Table
from analysis.page.sections import Section
from analysis.report.claim_sentences import claim_outcomes
from analysis.report.section_people import people_items
from analysis.report.sentences import rate_outcomes
from analysis.statistics.claims import CLAIM_COLUMNS, VERDICT_COLUMNS
from analysis.statistics.rates import CORRECT_RATE_COLUMNS, UNKNOWN_CHANCE, correct_rates
from analysis.statistics.verdicts import (
    PLANTED_COLUMNS,
    SETUP_COLUMNS,
    ClaimFound,
    chance_of,
    differences_by_setup,
    models_of,
    planted_verdicts,
)
from modeling.errors import counted
from modeling.files.columns import Columns, chosen, names, without
from modeling.files.writing import file_stem

TESTS_SHOWN = chosen(
    CLAIM_COLUMNS,
    *("claim", "texture", "mean_reference", "mean_other", "mean_difference", "ci_low", "ci_high"),
    *("t", "df", "p", "p_equivalence", "d_z", "d_z_low", "d_z_high", "bf01", "shapiro_p"),
    *("wilcoxon_p", "sign_flips_p", "note", "excluded"),
)
# Of the table of verdicts.
_OF_MODEL = ("rule", "tests_verdict", "model_mean", "model_low", "model_high", "p_of_model")
BY_MODEL = (
    "Rule “model”: the verdict is that of the model of the participants, over all textures on the "
    "mean effect and on the share of people outside the bounds, of single textures on the mean "
    "alone, with Holm's correction of their posterior probabilities; that of the paired tests "
    "stands beside it. Rule “tests”, and all other columns: "
)
CORRECT_RATES_SHOWN = (
    *without(CORRECT_RATE_COLUMNS, "note"),
    *chosen(CORRECT_RATE_COLUMNS, "note"),
)


def verdict_section(
    responses: Responses,
    found: Sequence[ClaimFound],
    *,
    planted: Mapping[str, Mapping[str, float]] | None = None,
) -> Section:
    """Every claim with its tests; at least one. `planted` as in `verdicts.planted_verdicts`.

    For claims about unfinished tasks the tables give the number of participants, and no effect.
    """
    simulated = responses.simulated
    judged = [one for one in found if not one.standing.unfinished]
    begun = dict.fromkeys(one.claim.task for one in found if one.standing.unfinished)
    so_far = [who_took_part(responses, task) for task in begun]
    tests = pd.concat([one.tests for one in found], ignore_index=True)
    by_model = any(one.people is not None for one in judged)
    verdicts = Table(
        "claims",
        "Verdicts",
        f"{BY_MODEL * by_model}First row: the mean over the textures whose models differ, with "
        "equal weight for each texture, over participants who answered completely. Then each "
        "texture: a family of its own, with Holm's correction separately for tests of a "
        "difference and of equivalence (TOST); identical models are controls. Differences and "
        "bounds are in points of the scale, or shares of right answers. Where the last column "
        "gives a reason, neither equivalence nor a difference within the bounds is concluded, "
        "whatever p is. No effect is shown for a task that lacks participants or sessions. The "
        "tests themselves are below.",
        tests[names(VERDICT_COLUMNS)],
        _verdicts_shown(by_model=by_model),
        simulated,
    )
    detail = Table(
        "claim_tests",
        "Tests behind the verdicts",
        "Paired t-tests over participants with 95% confidence intervals. d_z: mean difference "
        "divided by the standard deviation of the differences. BF₀₁: Bayes factor for no "
        "difference (JZS, r = 0.707). Also given: the Shapiro–Wilk test of the differences, "
        "Wilcoxon's signed-rank test, and a permutation test that flips signs; where participants "
        "do not vary, p is from the sign flips. Where equivalence is withheld, neither TOST nor "
        "BF₀₁ is evidence for it.",
        tests,
        TESTS_SHOWN,
        simulated,
    )
    return Section(
        "verdicts",
        "Verdicts",
        (
            *_forest(judged, simulated=simulated),
            *people_items(judged, simulated=simulated),
            verdicts,
            *_setups_table(judged, simulated=simulated),
            *(_planted_table(judged, planted),) * bool(planted and judged),
            Fold("Tests behind the verdicts", (detail,)),
        ),
        outcomes=tuple(claim_outcomes(found)),
        done=tuple(sentence for sentence, _ in so_far),
        tiles=tuple(tile for _, tile in so_far),
    )


def _verdicts_shown(*, by_model: bool) -> Columns:
    """Columns of the table of verdicts; those of the model only where it decides some."""
    return VERDICT_COLUMNS if by_model else without(VERDICT_COLUMNS, *_OF_MODEL)


def _forest(judged: Sequence[ClaimFound], *, simulated: bool) -> tuple[Picture, ...]:
    """The picture of all claims with a verdict; none where there is no such claim."""
    if not judged:
        return ()
    picture = Picture(
        "forest",
        "Differences and their bounds",
        "Mean differences over participants with 90% and 95% confidence intervals; where the model "
        "of the participants decides, below its mean and 95% interval. Where the 90% "
        "interval lies within the bounds (grey), a test of equivalence is significant, apart from "
        "Holm's correction; where the 95% interval excludes 0, a test of a difference is. The "
        "marker shows the verdict: an interval within the bounds is not equivalence where "
        "participants were not shown to tell surfaces apart.",
        figure_forest(judged, simulated=simulated),
        simulated,
    )
    return (picture,)


def _setups_table(found: Sequence[ClaimFound], *, simulated: bool) -> tuple[Table, ...]:
    """The differences at each set-up, where there are several."""
    by_setup = differences_by_setup(found)
    if by_setup.empty:
        return ()
    table = Table(
        "setups",
        "Differences at each set-up",
        "Means over the textures whose models differ, of complete participants; described, not "
        "tested: verdicts are those of all set-ups together.",
        by_setup,
        SETUP_COLUMNS,
        simulated,
    )
    return (table,)


def _planted_table(
    found: Sequence[ClaimFound], planted: Mapping[str, Mapping[str, float]] | None
) -> Table:
    return Table(
        "planted_effects",
        "Verdicts compared with the planted differences",
        "Planted: by how many points simulated participants rate the other model higher; the "
        "verdict is based on their answers. Undecided: inconclusive, felt by some, or a "
        "verdict that was withheld.",
        planted_verdicts(found, planted or {}),
        PLANTED_COLUMNS,
        simulated=True,
    )


def rating_section(responses: Responses, found: Sequence[ClaimFound]) -> Section:
    """Absolute evaluation (PAPER VIII-A); `found` are its claims, one at least."""
    done, tile = who_took_part(responses, "absolute")
    pairs = list(dict.fromkeys(one.claim.models for one in found))
    pictures = [
        Picture(
            _name("ratings", pair),
            f"Rated similarity of virtual and real surface, {pair[0]} and {pair[1]} models",
            "Bars: means over participants with 95% confidence intervals; points: participants. "
            "Compare figure 9 of the paper, whose bars are standard errors.",
            figure_ratings(
                [one for one in found if one.claim.models == pair], simulated=responses.simulated
            ),
            responses.simulated,
        )
        for pair in pairs
    ]
    return Section(
        "ratings",
        "Absolute evaluation: ratings",
        tuple(pictures),
        done=(done,),
        tiles=(tile,),
    )


def choice_section(
    responses: Responses, found: Sequence[ClaimFound], *, rng: np.random.Generator
) -> Section:
    """Relative evaluation (PAPER VIII-B); `found` are its claims, `rng` draws the bootstrap."""
    relative, simulated = responses.relative, responses.simulated
    models = models_of(responses, "relative")
    chance = chance_of("relative", relative)
    rates = correct_rates(relative, models, rng=rng, chance=chance)
    done, tile = who_took_part(responses, "relative")
    overall = rates[rates["texture"] == ALL_TEXTURES].set_index("model")["mean"]
    shown = " → ".join(f"{overall[model]:.0%}" for model in models if model in overall)
    rate_tile = (shown, f"right answers, {' → '.join(models)} (chance {chance:.0%})")
    return Section(
        "choices",
        "Relative evaluation: forced choice",
        (
            *(
                rates_picture(one, "correct_rates", chance=chance, simulated=simulated)
                for one in found
            ),
            rates_table(rates, "correct_rates", chance=chance, simulated=simulated),
        ),
        outcomes=tuple(rate_outcomes(rates, "relative", chance=chance)),
        done=(done,),
        tiles=(tile, rate_tile),
    )


def _name(what: str, pair: tuple[str, str]) -> str:
    """The stem of a picture's file."""
    return what if pair == MODELS else f"{what}_{file_stem('_'.join(pair))}"


def rates_picture(found: ClaimFound, name: str, *, chance: float, simulated: bool) -> Picture:
    """Shares of right answers with either model of a claim; `name` begins that of the file."""
    task, (reference, other) = found.claim.task, found.claim.models
    paper = " Compare figure 11 of the paper, whose bars are standard errors." * (
        task == "relative"
    )
    line = f"; {UNKNOWN_CHANCE}." if np.isnan(chance) else "; dashed: chance."
    return Picture(
        _name(name, found.claim.models),
        f"Correct rates of the {TASKS[task]}, {reference} and {other} models",
        "Bars: means over participants with 95% confidence intervals; points: participants"
        f"{line}{paper}",
        figure_correct_rates(found, chance=chance, simulated=simulated),
        simulated,
    )


def rates_table(rates: pd.DataFrame, name: str, *, chance: float, simulated: bool) -> Table:
    """Shares of right answers from `correct_rates`; `name` is that of the file."""
    title, test = "Correct rates", f"; {UNKNOWN_CHANCE}, nothing is tested against it"
    if not np.isnan(chance):
        title = "Correct rates against chance"
        test = (
            ", and a one-sample t-test against chance (sign flips where all have the same rate) "
            "with Holm's correction over the textures of one model"
        )
    return Table(
        name,
        title,
        "Participants are the units: mean of their rates with a 95% interval (bias-corrected and "
        f"accelerated bootstrap over participants){test}. The rows over all textures weight "
        "textures equally and include complete participants only.",
        rates,
        CORRECT_RATES_SHOWN,
        simulated,
    )


def who_took_part(responses: Responses, task: str) -> tuple[str, tuple[str, str]]:
    """The sentence and the tile with the number of participants, out of those planned."""
    where = TASKS[task]
    done, planned = responses.done(task), responses.planned.get(task)
    people = str(done.participants)
    kind = "simulated participant" if responses.simulated_participants else "participant"
    rig = " with the simulated rig" if responses.simulated_rig else ""
    trials = f"{counted(len(responses.answers[task]), 'trial')} (without training)"
    last, sessions = done.participants, ""
    if planned is not None:
        last, kind = planned.participants, f"planned {kind}"
        people += f" of {last}"
        sessions = f", {done.sessions} of {counted(planned.sessions, 'planned session')}"
    who = f"{kind}{'s' * (last != 1)}{rig}"
    sentence = f"{sentence_case(where)}: {people} {who}{sessions}, {trials}."
    return sentence, (people, f"{who}, {where}")
