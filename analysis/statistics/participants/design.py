"""From tables of answers to what the samplers take.

docs/method/participants.md#data
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from tactileq.modeling.arrays import Floats, Integers
from tactileq.modeling.participants.ratings import RatingStudies


@dataclass(frozen=True, eq=False, kw_only=True)
class PeopleData:
    """The ratings about one claim as the model of the participants takes them.

    Parameters
    ----------
    studies : RatingStudies
        One study.
    people, textures : sequence of str
        In the order of the arrays.
    decides : bool
        Whether the verdicts are the model's: not under a plan that says otherwise, nor where models
        were on different days and more people began with one of them.
    """

    studies: RatingStudies
    people: Sequence[str]
    textures: Sequence[str]
    decides: bool = True


def rating_studies(
    answers: pd.DataFrame,
    checks: pd.DataFrame,
    column: str,
    *,
    models: Sequence[str],
    people: Sequence[str],
) -> RatingStudies:
    """One study of ratings.

    Parameters
    ----------
    answers : DataFrame
        participant_id, session, trial, texture, model and `column`; a row for each rating.
    checks : DataFrame
        Ratings of anchors, with virtual_texture; none where there are no rows.
    models : (str, str)
        The reference first.
    people : sequence of str
        Participants, in the order of the arrays.
    """
    known = answers[answers[column].notna()]
    cells, places = _cells(known, models, people)
    values = np.full((1, *places), np.nan)
    trends = np.zeros((2, 1, *places))
    values[0][cells] = known[column]
    for trend, one in zip(trends[:, 0], _trends(known), strict=True):
        trend[cells] = one
    return RatingStudies(values=values, anchors=_anchors(checks, column, people), trends=trends)


def changed(studies: RatingStudies, change: Callable[[Floats, int], Floats]) -> RatingStudies:
    """Each array changed by a function of it and of its axis of studies."""
    return RatingStudies(
        **{name: change(values, int(name == "trends")) for name, values in vars(studies).items()}
    )


def first_people(studies: RatingStudies, sizes: Sequence[int]) -> RatingStudies:
    """Studies of the first people of one study alone, one for each size."""
    tiled = changed(studies, lambda values, axis: np.repeat(values, len(sizes), axis=axis))
    for place, size in enumerate(sizes):
        tiled.values[place, size:] = np.nan
        tiled.anchors[place, size:] = np.nan
    return tiled


def side_by_side(studies: Sequence[RatingStudies]) -> RatingStudies:
    """Studies of one shape as those of one object, in their order."""
    arrays = zip(*(vars(one).values() for one in studies), strict=True)
    return changed(studies[0], lambda _, axis: np.concatenate(next(arrays), axis=axis))


def _cells(
    answers: pd.DataFrame, models: Sequence[str], people: Sequence[str]
) -> tuple[tuple[Integers, ...], tuple[int, ...]]:
    """Where each answer stands among (people, textures, models, repeats), and how many of each."""
    textures = textures_of(answers)
    cells = _in_order(answers).groupby(["participant_id", "texture", "model"])
    repeat = np.asarray(cells.cumcount().reindex(answers.index), dtype=np.intp)
    places = [
        _places(answers[column], names)
        for column, names in (("participant_id", people), ("texture", textures), ("model", models))
    ]
    repeats = int(repeat.max()) + 1 if len(repeat) else 1
    return (*places, repeat), (len(people), max(len(textures), 1), len(models), repeats)


def _in_order(answers: pd.DataFrame) -> pd.DataFrame:
    """Answers by session and trial."""
    return answers.sort_values(["session", "trial"], kind="stable")


def _places(column: pd.Series, names: Sequence[str]) -> Integers:
    places = {name: place for place, name in enumerate(names)}
    return np.array([places[name] for name in column], dtype=np.intp)


def textures_of(answers: pd.DataFrame) -> list[str]:
    """Textures in the order of the arrays."""
    return sorted(answers["texture"].unique())


def _trends(answers: pd.DataFrame) -> tuple[Floats, Floats]:
    """Session, and place of the trial in its session, −½ … ½ each."""
    days, names = pd.factorize(answers["session"], sort=True)
    day = days / (len(names) - 1) - 0.5 if len(names) > 1 else np.zeros(days.size)
    of_session = answers.groupby(["participant_id", "session"])["trial"]
    rank, count = of_session.rank(method="first") - 1, of_session.transform("size") - 1
    place = (rank / count.clip(lower=1) - 0.5 * (count > 0)).to_numpy(dtype=float)
    return np.asarray(day, dtype=float), place


def _anchors(checks: pd.DataFrame, column: str, people: Sequence[str]) -> Floats:
    """(1, n, A) ratings of anchors, each kind and repeat in a place of its own."""
    if checks.empty:
        return np.empty((1, len(people), 0))
    known = _in_order(checks[checks[column].notna()])
    kind = known["texture"].astype(str) + "|" + known["virtual_texture"].astype(str)
    repeat = known.groupby([known["participant_id"], kind]).cumcount().astype(str)
    wide = known.assign(place=kind + "|" + repeat).pivot(
        index="participant_id", columns="place", values=column
    )
    return wide.reindex(list(people)).to_numpy(dtype=float)[None]
