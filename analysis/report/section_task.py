"""The section on a task without a chapter of its own, based on its declared columns.

docs/own-protocol.md
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from analysis.answers.responses import Responses
from analysis.labels import TASKS, sentence_case
from analysis.page.outcomes import Outcome
from analysis.page.page import Item, Table
from analysis.page.sections import Section
from analysis.report.section_answers import rates_picture, rates_table, who_took_part
from analysis.report.sentences import rate_outcomes
from analysis.statistics.claims import CLAIM_COLUMNS
from analysis.statistics.rates import correct_rates
from analysis.statistics.verdicts import ClaimFound, chance_of, has_rates, models_of
from modeling.files.columns import Column, chosen, names

# Tasks with a chapter of their own; thresholds are reported by tactileq threshold.
WITH_CHAPTER = ("absolute", "relative", "oddity", "threshold")
ASKED_COLUMNS = (
    Column("what", " ", is_name=True),
    Column("done", format=".0f"),
    Column("planned", format=".0f"),
)
TASK_CLAIM_COLUMNS = chosen(
    CLAIM_COLUMNS,
    *("claim", "measure", "texture", "verdict", "n", "mean_reference", "mean_other"),
    *("mean_difference", "ci_low", "ci_high", "p_holm", "p_equivalence_holm", "doubt"),
)


def tasks_without_chapter(responses: Responses) -> list[str]:
    """Those with answers that `task_section` is for."""
    answers = responses.answers
    return [task for task in answers if task not in WITH_CHAPTER and len(answers[task])]


def task_section(
    responses: Responses, task: str, found: Sequence[ClaimFound], *, rng: np.random.Generator
) -> Section:
    """How much of a task was completed, the results of its claims, and the rate of right answers.

    Parameters
    ----------
    responses : Responses
    task : str
        With answers.
    found : sequence of ClaimFound
        Its claims, with tests; none while it is not finished.
    rng : Generator
        Draws the bootstrap, and sign flips.
    """
    done, tile = who_took_part(responses, task)
    items: list[Item] = [_asked_table(responses, task)]
    outcomes: list[Outcome] = []
    if found:
        items.append(_claims_table(found, task, simulated=responses.simulated))
    if found and has_rates(task) and responses.answers[task]["correct"].notna().any():
        about_right = [one for one in found if one.claim.measure == "correct"]
        shown, outcomes = _rates(responses, task, about_right, rng=rng)
        items += shown
    return Section(
        f"task-{task}",
        sentence_case(TASKS[task]),
        tuple(items),
        outcomes=tuple(outcomes),
        done=(done,),
        tiles=(tile,),
    )


def _rates(
    responses: Responses, task: str, found: Sequence[ClaimFound], *, rng: np.random.Generator
) -> tuple[list[Item], list[Outcome]]:
    """Shares of right answers with each model, against chance where it is known."""
    answers, name = responses.answers[task], f"correct_rates_{task}"
    chance, simulated = chance_of(task, answers), responses.simulated
    rates = correct_rates(answers, models_of(responses, task), rng=rng, chance=chance)
    items: list[Item] = [
        rates_picture(one, name, chance=chance, simulated=simulated) for one in found
    ]
    items.append(rates_table(rates, name, chance=chance, simulated=simulated))
    return items, rate_outcomes(rates, task, chance=chance)


def _asked_table(responses: Responses, task: str) -> Table:
    done, planned = responses.done(task), responses.planned.get(task)
    counts = {
        "participants": (done.participants, planned and planned.participants),
        "sessions": (done.sessions, planned and planned.sessions),
        "trials (without training)": (responses.trials_done(task), planned and planned.trials),
    }
    rows = [(what, there, wanted or np.nan) for what, (there, wanted) in counts.items()]
    return Table(
        f"asked_{task}",
        f"The {TASKS[task]}: completed and planned",
        "Without participants who dropped out. n/a: not stated in the data.",
        pd.DataFrame(rows, columns=names(ASKED_COLUMNS)),
        ASKED_COLUMNS,
        responses.simulated,
    )


def _claims_table(found: Sequence[ClaimFound], task: str, *, simulated: bool) -> Table:
    tests = pd.concat([one.tests for one in found], ignore_index=True)
    return Table(
        f"claims_{task}",
        f"Claims about the {TASKS[task]}",
        "The rows of this task in the table of verdicts, with the means of both models. Where "
        "trials contain both models, the reference is chance.",
        tests[names(TASK_CLAIM_COLUMNS)],
        TASK_CLAIM_COLUMNS,
        simulated,
    )
