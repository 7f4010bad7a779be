"""QUEST+ for one frequency: what is known after some answers, and what to present next.

docs/method/protocols.md#detection-threshold, Watson 2017 (QUEST+). Everything follows from the
answers alone, so nothing has to be kept when a session is resumed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cache
from math import isfinite, log10
from typing import TYPE_CHECKING

import numpy as np

from modeling import InputError
from modeling.arrays import Floats
from modeling.errors import shown

if TYPE_CHECKING:
    from questplus import QuestPlus

# --- Parameters -----------------------------------------------------------------------------

# Levels are of the sinusoid's peak, in dB re 1 g. 2 dB are finer than what 40 trials can tell.
LEVELS_DB: Floats = np.arange(-80.0, 21.0, 2.0)
# Beyond the levels on both sides, so that a threshold beyond them can be told from one at them.
THRESHOLDS_DB: Floats = np.arange(-90.0, 31.0, 1.0)
SLOPES = (1.0, 1.5, 2.2, 3.3, 5.0)
LAPSE_RATES = (0.0, 0.02, 0.04, 0.06)
CHANCE = 0.5
# The level that is right in 75 % of trials without lapses lies so far from Weibull's scale, times
# the slope: 1 − ½·exp(−(a/t)^slope) = ¾.
POINT_DB = 20.0 * log10(np.log(2.0))
_TOLERANCE_DB = 1e-6


@dataclass(frozen=True, kw_only=True)
class Answer:
    """One valid answer of the main part.

    Parameters
    ----------
    frequency_hz : float
    level_db : float
        One of `LEVELS_DB`.
    correct : bool
    highest_db : float
        The highest level that the rig could present.
    """

    frequency_hz: float
    level_db: float
    correct: bool
    highest_db: float


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """The threshold at one frequency: where 75 % of the answers are right, lapses left out.

    Parameters
    ----------
    frequency_hz : float
    level_db : float
        Posterior mean, dB re 1 g (peak).
    sd_db : float
        Posterior standard deviation.
    slope, lapse_rate : float
        Posterior means; the slope is Weibull's, over amplitudes.
    trials : int
    beyond : {"", "above", "below"}
        Whether the threshold is more likely than not above the highest level that the rig can
        present, or below the lowest that is asked; `level_db` is then that level, a bound.
    """

    frequency_hz: float
    level_db: float
    sd_db: float
    slope: float
    lapse_rate: float
    trials: int
    beyond: str = ""


# --- From rows of the table -----------------------------------------------------------------


def answers_of(rows: Sequence[Mapping[str, object]]) -> list[Answer]:
    """The valid answers of the main part, in order; values may be numbers or their text.

    Raises
    ------
    InputError
        For a frequency or an amplitude that the task cannot have presented, or another answer.
    """
    return [
        _answer(row)
        for row in rows
        if row["phase"] == "main" and str(row["valid"]).lower() in ("1", "1.0", "true")
    ]


def _answer(row: Mapping[str, object]) -> Answer:
    numbers = {name: _number(row, name) for name in ("frequency_hz", "amplitude_g", "highest_g")}
    correct = _number(row, "correct", lowest=0.0)
    exact_db = 20 * log10(numbers["amplitude_g"])
    level_db = float(LEVELS_DB[np.argmin(np.abs(LEVELS_DB - exact_db))])
    if abs(level_db - exact_db) > 0.05 or correct not in (0.0, 1.0):
        raise InputError(
            "expected an answer (correct 0 or 1) to an amplitude that the task presents, in steps "
            f"of 2 dB re 1 g, got {shown(row['correct'])} at {numbers['amplitude_g']:g} g; the "
            "table is damaged."
        )
    return Answer(
        frequency_hz=numbers["frequency_hz"],
        level_db=level_db,
        correct=correct == 1.0,
        highest_db=20 * log10(numbers["highest_g"]),
    )


def _number(row: Mapping[str, object], name: str, *, lowest: float = 1e-9) -> float:
    try:
        value = float(str(row[name]))
    except ValueError:
        value = float("nan")
    if not (isfinite(value) and value >= lowest):
        raise InputError(
            f"expected a number above 0 for {name} in the answers of the threshold task, got "
            f"{shown(row[name])}; the table is damaged."
        )
    return value


# --- What is known --------------------------------------------------------------------------


def posterior(answers: Sequence[Answer]) -> Floats:
    """Probability of every slope, lapse rate and threshold, after answers at one frequency.

    Bayes' rule from an even prior; the shape is that of `QuestPlus.posterior`.
    """
    made = _quest_plus()
    grid = made.prior.dims
    likelihoods = made.likelihoods.transpose("response", "intensity", *grid).values
    # Sums of logarithms: a product of many small numbers would become 0.
    with np.errstate(divide="ignore"):
        logs = np.log(made.prior.values)
        for answer in answers:
            level = int(np.searchsorted(LEVELS_DB, answer.level_db))
            logs = logs + np.log(likelihoods[int(not answer.correct), level])
    weights: Floats = np.exp(logs - logs.max())
    return np.asarray(weights / weights.sum())


def next_level_db(answers: Sequence[Answer], *, highest_db: float) -> float:
    """The level whose answer leaves the least entropy to be expected (QUEST+), up to the highest.

    Raises
    ------
    InputError
        Where the rig can present none of `LEVELS_DB`.
    """
    allowed = LEVELS_DB[highest_db + _TOLERANCE_DB >= LEVELS_DB]
    if not allowed.size:
        raise InputError(
            f"expected a rig that presents {LEVELS_DB[0]:g} dB re 1 g, got {highest_db:.4g} dB at "
            "most; raise its limits."
        )
    made = _quest_plus()
    chooser = copy(made)
    chooser.posterior = made.prior.copy(data=posterior(answers))
    chooser.likelihoods = made.likelihoods.sel(intensity=allowed)
    return float(chooser.next_stim["intensity"])


def estimate(answers: Sequence[Answer]) -> Estimate:
    """The threshold at one frequency, from at least one answer.

    Raises
    ------
    InputError
        For no answer.
    """
    if not answers:
        raise InputError("expected answers at this frequency, got none; run the session.")
    weights = posterior(answers)
    threshold_db, slope, lapse_rate = _parameters()
    point_db = threshold_db + POINT_DB / slope
    mean = {
        name: float((weights * value).sum())
        for name, value in (("db", point_db), ("slope", slope), ("lapse", lapse_rate))
    }
    sd_db = float(np.sqrt((weights * (point_db - mean["db"]) ** 2).sum()))
    highest_db = min(max(answer.highest_db for answer in answers), float(LEVELS_DB[-1]))
    beyond, level_db = "", mean["db"]
    if weights[point_db > highest_db].sum() > 0.5:
        beyond, level_db = "above", highest_db
    elif weights[point_db < LEVELS_DB[0]].sum() > 0.5:
        beyond, level_db = "below", float(LEVELS_DB[0])
    return Estimate(
        frequency_hz=answers[0].frequency_hz,
        level_db=level_db,
        sd_db=sd_db,
        slope=mean["slope"],
        lapse_rate=mean["lapse"],
        trials=len(answers),
        beyond=beyond,
    )


@cache
def _quest_plus() -> QuestPlus:
    """Made once: its likelihoods take a second."""
    from questplus import QuestPlus  # late: takes longer to load than all of modeling

    return QuestPlus(
        stim_domain={"intensity": LEVELS_DB},
        param_domain={
            "threshold": THRESHOLDS_DB,
            "slope": list(SLOPES),
            "lower_asymptote": [CHANCE],
            "lapse_rate": list(LAPSE_RATES),
        },
        outcome_domain={"response": ["correct", "wrong"]},
        func="weibull",
        stim_scale="dB",
    )


def _parameters() -> tuple[Floats, Floats, Floats]:
    """Threshold, slope and lapse rate at every place of the posterior."""
    prior = _quest_plus().prior
    threshold, slope, lapse_rate = (
        prior[name].broadcast_like(prior).transpose(*prior.dims).values
        for name in ("threshold", "slope", "lapse_rate")
    )
    return threshold, slope, lapse_rate
