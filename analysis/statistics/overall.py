"""The question of the study: full against simplified models over all textures."""

from __future__ import annotations

from collections.abc import Set
from dataclasses import asdict

import pandas as pd

from analysis.answers.loading import Responses
from analysis.columns import Column, names, without
from analysis.labels import MODELS, SCALES
from analysis.statistics.paired import PAIRED_COLUMNS, holm, paired_test, participant_means

CORRECT_RATE = "correct rate"
OVERALL_COLUMNS = (
    Column("measure", is_name=True),
    Column("textures"),
    *without(PAIRED_COLUMNS, "texture"),
)


def overall_tests(responses: Responses, *, identical: Set[str] = frozenset()) -> pd.DataFrame:
    """One paired test per measure over all textures, Holm over the measures.

    docs/method/statistics.md#over-all-textures

    Parameters
    ----------
    responses : Responses
    identical : set of str
        Textures whose full and simplified models are the same; they are left out.

    Returns
    -------
    DataFrame
        measure (correct rate as a share 0–1; rated similarity of either scale, 0–100), textures
        (their number), the fields of `PairedTest`, excluded and p_holm. A participant's values are
        means over the textures that they judged with both models, so that a session which ended
        early does not compare different textures. No row where nothing is left to compare.
    """
    measures = [(CORRECT_RATE, responses.relative, "correct")]
    measures += [
        (f"rated similarity of {scale}", responses.absolute, column)
        for column, scale in SCALES.items()
    ]
    rows = []
    for measure, answers, column in measures:
        compared = answers[~answers["texture"].isin(identical)]
        if not compared.empty:
            rows.append({"measure": measure, **_overall(compared, column)})
    table = pd.DataFrame(rows, columns=names(OVERALL_COLUMNS))
    return table.assign(p_holm=holm(table["p"])) if rows else table


def _overall(answers: pd.DataFrame, column: str) -> dict[str, object]:
    means = participant_means(answers, column)
    by_participant = means.dropna().groupby("participant_id")[list(MODELS)].mean()
    excluded = sorted(set(means["participant_id"]) - set(by_participant.index))
    test = paired_test(by_participant["full"], by_participant["simplified"])
    return {
        "textures": means["texture"].nunique(),
        **asdict(test),
        "excluded": ", ".join(excluded),
    }
