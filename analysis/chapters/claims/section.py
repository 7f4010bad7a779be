"""The chapter on claims: the verdicts, and what they answer to the question of the report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import pandas as pd

from tactileq.analysis.answers.responses import Responses
from tactileq.analysis.chapters.chapter import LEAD, Answered, who_took_part
from tactileq.analysis.chapters.claims.answer import answer, unfinished_tasks
from tactileq.analysis.chapters.claims.forest import figure_forest
from tactileq.analysis.chapters.claims.people import people_items
from tactileq.analysis.chapters.claims.plan_sentences import deviations, methods_paragraph
from tactileq.analysis.chapters.claims.sentences import (
    claim_sentences,
    decided_interval,
    differing,
)
from tactileq.analysis.labels import SCALES
from tactileq.analysis.page.page import Fold, Picture, Table
from tactileq.analysis.page.sections import Section
from tactileq.analysis.statistics.claims import CLAIM_COLUMNS, NO_TEST, VERDICT_COLUMNS
from tactileq.analysis.statistics.described_verdicts import (
    PLANTED_COLUMNS,
    SETUP_COLUMNS,
    differences_by_setup,
    planted_verdicts,
)
from tactileq.analysis.statistics.equivalence import INCONCLUSIVE
from tactileq.analysis.statistics.verdicts import ClaimFound, overall_row
from tactileq.modeling.files.columns import Column, Columns, chosen, names, without

TESTS_SHOWN = chosen(
    CLAIM_COLUMNS,
    *("claim", "texture", "mean_reference", "mean_other", "mean_difference", "ci_low", "ci_high"),
    *("t", "df", "p", "p_equivalence", "d_z", "d_z_low", "d_z_high", "bf01", "shapiro_p"),
    *("wilcoxon_p", "sign_flips_p", "people_f", "people_df", "people_df_rest", "people_p"),
    *("note", "excluded"),
)
IN_SHORT_COLUMNS = (
    Column("claim", is_name=True),
    Column("verdict", is_name=True),
    Column("n"),
    Column("difference"),
    Column("ci_low", "95% CI from"),
    Column("ci_high", "to"),
    Column("ci90_low", "90% CI from"),
    Column("ci90_high", "to"),
    Column("bound_low", "allowed from"),
    Column("bound_high", "to"),
    Column("textures", "textures that differ"),
    Column("people_sd", "SD between people"),
    Column("people_sd_low", "SD of people: 95% CI from"),
    Column("people_sd_high", "to"),
    Column("people_p", "p that people differ", is_p_value=True),
    Column("rule", "decided by", is_name=True),
    Column("beside", "the other rule says", is_name=True),
)
IN_WORDS_COLUMNS = (Column("claim", is_name=True), Column("sentence"))
# Of the table of verdicts.
_OF_MODEL = (
    *("rule", "tests_verdict", "model_verdict"),
    *("model_mean", "model_low", "model_high", "p_of_model"),
)
READ_AND_CHECKED = (
    "On reading: every value lies in its range; answers follow the planned order of trials, where "
    "a session's manifest is there; all are of one study and its models. What was found is listed "
    "under exclusions and deviations."
)
BY_MODEL = (
    "Rule “hierarchical”: the verdict is that of the model of the participants, over all textures "
    "and on single ones on the mean effect, of single textures with Holm's correction of their "
    "posterior probabilities; that of the paired tests stands beside it. Rule “tests”, and all "
    "other columns: "
)


def sections(answered: Answered) -> list[Section]:
    """The verdicts of all claims, and what they answer to the question of the report."""
    responses, found = answered.responses, answered.found
    judged = [one for one in found if not one.caveats.unfinished]
    verdicts = pd.concat([one.tests["verdict"] for one in found]) if found else pd.Series()
    section = _verdicts(answered) if answered.tested else Section("verdicts", "Verdicts", ())
    headline = answer(found, responses)
    return [
        replace(
            section,
            headline=headline and replace(headline, lead=LEAD),
            verified=(READ_AND_CHECKED,),
            cautions=tuple(
                _cautions(responses, inconclusive=bool((verdicts == INCONCLUSIVE).any()))
            ),
            deviations=tuple(deviations(responses, found)),
            methods=methods_paragraph(responses, judged) if judged else "",
        )
    ]


def _verdicts(answered: Answered) -> Section:
    """Every claim with its tests; of unfinished tasks the number of participants, no effect."""
    responses, found, planted = answered.responses, answered.tested, answered.planted
    simulated = responses.simulated
    judged = answered.judged
    begun = dict.fromkeys(one.claim.task for one in found if one.caveats.unfinished)
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
    in_words = Table(
        "claim_sentences",
        "Results in words, for a paper",
        "For each claim all textures together, then one by one.",
        pd.DataFrame(
            [(one.claim.name, sentence) for one in found for sentence in claim_sentences(one)],
            columns=names(IN_WORDS_COLUMNS),
        ),
        IN_WORDS_COLUMNS,
        simulated,
    )
    return Section(
        "verdicts",
        "Verdicts",
        (
            _in_short(found, simulated=simulated),
            in_words,
            verdicts,
            *_setups_table(judged, simulated=simulated),
            *(_planted_table(judged, planted),) * bool(planted and judged),
            Fold("Tests behind the verdicts", (detail,)),
            *people_items(judged, simulated=simulated),
        ),
        front=_forest(judged, simulated=simulated),
        done=tuple(sentence for sentence, _ in so_far),
        tiles=tuple(tile for _, tile in so_far),
    )


def _in_short(found: Sequence[ClaimFound], *, simulated: bool) -> Table:
    """A row for each claim."""
    rows = []
    for one in found:
        row = overall_row(one)
        if row is None:
            continue
        mean, low, high = decided_interval(one, row, level="95%")
        _, low90, high90 = decided_interval(one, row, level="90%")
        by_model = one.people if one.by_model else None
        rows.append(
            {
                **row,
                "n": row["n"] if by_model is None else len(by_model.people),
                "difference": mean,
                "ci_low": low,
                "ci_high": high,
                "ci90_low": low90,
                "ci90_high": high90,
                "verdict": row["verdict"] or NO_TEST,
                "people_p": row["people_p"] if one.claim.measure in SCALES else float("nan"),
                "textures": ", ".join(str(each["texture"]) for each in differing(one)),
                "beside": row["model_verdict" if by_model is None else "tests_verdict"],
            }
        )
    return Table(
        "claims_in_short",
        "Each claim in a row",
        "Difference: other − reference, over the textures whose models differ, in points of the "
        "scale or shares of right answers, by what decides. Everything else is in the supplement.",
        pd.DataFrame(rows, columns=names(IN_SHORT_COLUMNS)),
        without(IN_SHORT_COLUMNS, "bound_low", "bound_high", "people_sd"),
        simulated,
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
        "verdict is based on their answers. Undecided: inconclusive, or a verdict that was "
        "withheld.",
        planted_verdicts(found, planted or {}),
        PLANTED_COLUMNS,
        simulated=True,
    )


def _cautions(responses: Responses, *, inconclusive: bool) -> list[str]:
    """What must not be concluded from the answers.

    Parameters
    ----------
    inconclusive : bool
        Whether some test shows neither a difference nor equivalence.
    """
    sentences = []
    if responses.unfinished:
        done = "; ".join(unfinished_tasks(responses))
        sentences.append(
            f"The study is not complete ({done}): neither effects nor tests of "
            "its claims are shown before it is complete, because seeing them could influence "
            "whether it is stopped or continued."
        )
    if responses.simulated_participants:
        sentences.append(
            "Simulated participants follow a model that was specified beforehand: their answers "
            "test the procedure and say nothing about what people feel."
        )
    elif responses.simulated_rig:
        sentences.append(
            "The participants are people, but the rig was simulated and nobody felt a real "
            "surface: their answers test the procedure and say nothing about what people feel."
        )
    if inconclusive:
        sentences.append(
            "Inconclusive means neither different nor equivalent: a test of a difference that is "
            "not significant does not show that two models are equivalent; only a verdict of "
            "equivalence by bounds fixed before data collection can show that."
        )
    return sentences
