"""Confusion matrices of the relative task."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from tactileq.analysis.labels import MODELS
from tactileq.modeling.arrays import Floats
from tactileq.modeling.files.columns import Column


@dataclass(frozen=True, eq=False)
class ConfusionMatrix:
    """Answers of the forced choice for one model.

    Parameters
    ----------
    model : str
        Name of the set of models.
    textures : (k,) tuple of str
        Names of the columns.
    counts : (k, k) ndarray of int
        Row: the real surface presented; column: the virtual surface answered.
    presented : tuple of str
        Names of the rows, where they are not those of the columns.
    """

    model: str
    textures: tuple[str, ...]
    counts: NDArray[np.int64]
    presented: tuple[str, ...] = ()

    @property
    def rows(self) -> tuple[str, ...]:
        """Names of the rows."""
        return self.presented or self.textures

    @property
    def row_shares(self) -> Floats:
        """(k, k) shares of a row's answers, each row adding up to 1; NaN in rows without any."""
        totals = self.counts.sum(axis=1, keepdims=True)
        shares = np.full(self.counts.shape, np.nan)
        np.divide(self.counts, totals, out=shares, where=totals > 0)
        return shares


def confusion_matrices(
    relative: pd.DataFrame, models: tuple[str, ...] = MODELS
) -> dict[str, ConfusionMatrix]:
    """Count which texture was taken for which, with each set of models (PAPER fig. 10).

    Parameters
    ----------
    relative : DataFrame
        `Responses.answers` of an identification task; trials without an answer are left out.
    models : tuple of str
        Sets of models to count, in this order.

    Returns
    -------
    dict
        By model, all over the same textures: all that were presented or on offer.
    """
    answered = relative[relative["answer"].notna()]
    offered = {name for layout in answered["layout"] for name in str(layout).split("|")}
    textures = tuple(sorted(offered | set(answered["texture"]), key=str.casefold))
    matrices = {}
    for model in models:
        chosen = answered[answered["model"] == model]
        counts = pd.crosstab(chosen["texture"], chosen["answer"])
        square = counts.reindex(index=list(textures), columns=list(textures), fill_value=0)
        matrices[model] = ConfusionMatrix(model, textures, square.to_numpy(dtype=np.int64))
    return matrices


def participant_counts(
    relative: pd.DataFrame, matrix: ConfusionMatrix
) -> tuple[tuple[str, ...], NDArray[np.int64]]:
    """The counts behind a matrix, person by person.

    Parameters
    ----------
    relative : DataFrame
        That the matrix was counted from.

    Returns
    -------
    (participants, (n, k, k) ndarray of int)
        Who answered with this model, in order, and their counts.
    """
    chosen = relative[relative["answer"].notna() & (relative["model"] == matrix.model)]
    people = tuple(sorted(chosen["participant_id"].unique()))
    counts = np.zeros((len(people), *matrix.counts.shape), dtype=np.int64)
    place = {texture: number for number, texture in enumerate(matrix.textures)}
    who = {name: number for number, name in enumerate(people)}
    np.add.at(
        counts,
        (
            chosen["participant_id"].map(who).to_numpy(dtype=int),
            chosen["texture"].map(place).to_numpy(dtype=int),
            chosen["answer"].map(place).to_numpy(dtype=int),
        ),
        1,
    )
    return people, counts


CONFUSION_COLUMNS = (
    Column("presented", is_name=True),
    Column("answered", is_name=True),
    Column("count"),
    Column("row_share"),
)


def confusion_table(matrix: ConfusionMatrix) -> pd.DataFrame:
    """The matrix in long form.

    Returns
    -------
    DataFrame
        One row per cell: presented (the real surface), answered (the virtual one), count,
        row_share (0–1).
    """
    shares = matrix.row_shares
    return pd.DataFrame(
        {
            "presented": real,
            "answered": virtual,
            "count": int(matrix.counts[i, j]),
            "row_share": shares[i, j],
        }
        for i, real in enumerate(matrix.rows)
        for j, virtual in enumerate(matrix.textures)
    )
