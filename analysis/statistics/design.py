"""Single answers as a linear predictor: texture × model + day + order.

docs/method/mixed-models.md#predictor
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from tactileq.analysis.statistics.paired import participant_means
from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import counted

MODEL_EFFECT, SESSION, ORDER = (
    "model, other to reference",
    "each further session",
    "first to last trial",
)


@dataclass(frozen=True, eq=False, kw_only=True)
class Design:
    """The answers of several people and what each was an answer to.

    Parameters
    ----------
    values : (m,) ndarray
    people : (m,) ndarray
        Who answered.
    columns : (m, p) ndarray
        The predictors. The first is the model: −½ the reference, +½ the other one.
    terms : mapping of str to int
        Columns whose coefficients are reported, by name.
    textures : int
        How many there are.
    """

    values: Floats
    people: NDArray[Any]
    columns: Floats
    terms: dict[str, int]
    textures: int

    @property
    def model(self) -> Floats:
        """The first column."""
        return self.columns[:, 0]

    @property
    def participants(self) -> int:
        """How many people answered."""
        return len(np.unique(self.people))

    @property
    def unfit(self) -> str:
        """Why no model can be fitted; empty where one can."""
        if self.participants < 2:
            return counted(self.participants, "participant")
        if np.ptp(self.values) == 0:
            return "all answers are the same"
        if np.linalg.matrix_rank(self.columns) < self.columns.shape[1]:
            return "the effect of the model cannot be separated from textures, sessions or order"
        return ""


def design(answers: pd.DataFrame, column: str, *, models: tuple[str, str]) -> Design:
    """Predictors of single answers; every texture counts once in the coefficient of the model.

    docs/method/mixed-models.md#predictor

    Parameters
    ----------
    answers : DataFrame
        participant_id, texture, model and `column` (NaN where not answered), one row per trial in
        the order of the trials; session where there are several.
    models : (str, str)
        The reference, and the other one. Textures on which nobody answered with one of them are
        left out.
    """
    own = answers[answers["model"].isin(models) & answers[column].notna()]
    own = own[own.groupby("texture")["model"].transform("nunique") == 2]
    model = np.where(own["model"] == models[1], 0.5, -0.5)
    textures = pd.get_dummies(own["texture"], dtype=float).to_numpy()
    # Sum coding: what is left of the model is its mean over textures.
    apart = textures[:, :-1] - textures[:, -1:]
    columns = [model, np.ones(len(own)), *apart.T, *(model[:, None] * apart).T]
    terms = {MODEL_EFFECT: 0}
    for name, covariate in ((SESSION, _sessions(own)), (ORDER, _order(own))):
        if len(covariate) and np.ptp(covariate) > 0:
            terms[name] = len(columns)
            columns.append(covariate - covariate.mean())
    return Design(
        values=own[column].to_numpy(dtype=float),
        people=own["participant_id"].to_numpy(),
        columns=np.column_stack(columns),
        terms=terms,
        textures=textures.shape[1],
    )


def _sessions(own: pd.DataFrame) -> Floats:
    """Number of each answer's session, by name; all 0 where there are no sessions."""
    if "session" not in own:
        return np.zeros(len(own))
    return np.asarray(own["session"].rank(method="dense"), dtype=float)


def _order(own: pd.DataFrame) -> Floats:
    """Place of each answer in its session, from 0, the first, to 1."""
    session = own.groupby(["participant_id", *(["session"] if "session" in own else [])])
    last = session["texture"].transform("size") - 1
    return np.asarray(session.cumcount() / last.clip(lower=1), dtype=float)


def complete_participants(
    answers: pd.DataFrame, column: str, *, models: tuple[str, str]
) -> pd.DataFrame:
    """Means over textures, each counting once, of who answered on every one with both models.

    Parameters
    ----------
    answers : DataFrame
        As in `design`.
    models : (str, str)

    Returns
    -------
    DataFrame
        By participant_id, a column for each of the models.
    """
    means = participant_means(answers[answers["model"].isin(models)], column)
    by_person = means.reindex(columns=["participant_id", *models]).set_index("participant_id")
    lacking = by_person.index[by_person.isna().any(axis=1)]
    return by_person.drop(index=lacking.unique()).groupby(level=0).mean()
