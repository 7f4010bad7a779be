"""The section on the odd one out: shares of right answers and the corresponding d′.

docs/method/speed-accuracy.md#odd-one-out
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from tactileq.analysis.answers.responses import Responses
from tactileq.analysis.chapters.chapter import Answered, who_took_part
from tactileq.analysis.columns import TEXTURE
from tactileq.analysis.labels import ALL_TEXTURES, TASK_TITLES, sentence_case
from tactileq.analysis.page.outcomes import Outcome, Weight
from tactileq.analysis.page.page import Table
from tactileq.analysis.page.sections import Section, of_task
from tactileq.analysis.statistics.claims import NO_TEST
from tactileq.analysis.statistics.compared_answers import is_oddity
from tactileq.analysis.statistics.dprime import d_primes, oddity_d_prime
from tactileq.analysis.statistics.verdicts import ClaimFound
from tactileq.modeling.files.answer_tables import AnswerTable
from tactileq.modeling.files.columns import Column, names
from tactileq.modeling.participants.choices import ODDITY_CHANCE

ODDITY_COLUMNS = (
    Column("claim", is_name=True),
    TEXTURE,
    Column("verdict", is_name=True),
    Column("n", "participants"),
    Column("share", "share of right answers", format=".3f"),
    Column("share_low", "95% CI from", format=".3f"),
    Column("share_high", "to", format=".3f"),
    Column("d_prime", "d′", format=".2f"),
    Column("d_prime_low", "95% CI from", format=".2f"),
    Column("d_prime_high", "to", format=".2f"),
    Column("bound", "upper bound of the share", format=".3f"),
    Column("bound_d_prime", "as d′", format=".2f"),
)


def applies(table: AnswerTable) -> bool:
    """Whether the odd one of three is to be found, of which d′ follows from the right answers."""
    return is_oddity(table)


def sections(answered: Answered) -> list[Section]:
    """A section for each task of this kind with a verdict."""
    return [
        oddity_section(answered.judged_in(stream.task), answered.responses, ending=stream.ending)
        for stream in answered.streams("oddity", applies)
        if answered.judged_in(stream.task)
    ]


def oddity_section(
    found: Sequence[ClaimFound], responses: Responses, *, ending: str = ""
) -> Section:
    """Right answers and d′ of a task in which the odd one of three is to be found.

    Parameters
    ----------
    found : sequence of ClaimFound
        Of this task, with tests; one at least.
    ending : str
        Of the names of the section's files.
    """
    task, simulated = found[0].claim.task, responses.simulated
    done, tile = who_took_part(responses, task)
    sensitivity = pd.concat([oddity_sensitivity(one) for one in found], ignore_index=True)
    table = Table(
        "oddity",
        "Right answers and d′",
        "The task is to find the one of three that differs; chance is 1/3. d′ follows from the "
        "decision model of the task (the one farthest from the other two is chosen); its interval "
        "is that of the mean share. Observers who feel no difference are right by chance, so only "
        "the upper one of the claim's bounds matters; it is given as a share and as a d′. Verdicts "
        "rest on the shares.",
        sensitivity,
        ODDITY_COLUMNS,
        simulated,
    )
    overall = sensitivity[sensitivity["texture"] == ALL_TEXTURES].to_dict("records")
    outcomes = tuple(Outcome(Weight.SECONDARY, _in_words(row, task)) for row in overall)
    section = Section(
        "oddity",
        f"{sentence_case(TASK_TITLES[task])}: d′",
        (table,),
        outcomes=outcomes,
        done=(done,),
        tiles=(tile,),
    )
    return of_task(section, ending)


def oddity_sensitivity(found: ClaimFound) -> pd.DataFrame:
    """The tests of a claim about the odd-one-out task as shares of right answers and d′.

    docs/method/speed-accuracy.md#odd-one-out

    Parameters
    ----------
    found : ClaimFound
        Its differences are those of the share from chance.

    Returns
    -------
    DataFrame
        `ODDITY_COLUMNS`, a row for each row of its tests. Infinite where all answers were right,
        NaN where there is no interval or no bound.
    """
    rows = [_sensitivity(row) for row in found.tests.to_dict("records")]
    return pd.DataFrame(rows, columns=names(ODDITY_COLUMNS))


def _sensitivity(row: Mapping[Hashable, Any]) -> dict[str, object]:
    share, chance = float(row["mean_other"]), ODDITY_CHANCE
    low, high, bound = (chance + row[name] for name in ("ci_low", "ci_high", "bound_high"))
    d_prime, d_low, d_high, as_d_prime = d_primes(share, low, high, bound, of=oddity_d_prime)
    return {
        **{name: row[name] for name in ("claim", "texture", "verdict", "n")},
        "share": share,
        "share_low": low,
        "share_high": high,
        "d_prime": d_prime,
        "d_prime_low": d_low,
        "d_prime_high": d_high,
        "bound": bound,
        "bound_d_prime": as_d_prime,
    }


def _in_words(row: Mapping[Hashable, Any], task: str) -> str:
    intervals = ("", "")
    if np.isfinite(row["share_low"]):
        intervals = (
            f" (95% CI {row['share_low']:.1%} to {row['share_high']:.1%})",
            f" ({_number(row['d_prime_low'])} to {_number(row['d_prime_high'])})",
        )
    text = (
        f"{sentence_case(TASK_TITLES[task])}, {row['claim']}: {row['share']:.1%} of the answers "
        f"were right over all textures{intervals[0]}, d′ {_number(row['d_prime'])}{intervals[1]}"
    )
    if np.isfinite(row["bound"]):
        text += f"; upper bound {row['bound']:.1%}, d′ {_number(row['bound_d_prime'])}"
    return f"{text}; {row['verdict'] or NO_TEST}."


def _number(d_prime: float) -> str:
    return "∞" if np.isinf(d_prime) else f"{d_prime:.2f}"
