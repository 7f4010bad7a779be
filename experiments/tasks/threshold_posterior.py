"""QUEST+: what is known of a person's thresholds after some answers, and what to present next.

docs/method/protocols.md#detection-threshold, Watson 2017 (QUEST+). Everything follows from the
answers alone, so nothing has to be kept when a session is resumed. Slope and lapse rate are those
of the person: what the answers at other frequencies say of them counts, too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cache
from math import isfinite, log10
from typing import TYPE_CHECKING

import numpy as np

from tactileq.modeling import InputError
from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import shown

if TYPE_CHECKING:
    from questplus import QuestPlus

# --- Parameters -----------------------------------------------------------------------------

# Levels are of the sinusoid's peak, in dB re 1 g. 2 dB is finer than 60 trials can resolve.
LEVELS_DB: Floats = np.arange(-70.0, 21.0, 2.0)
# Beyond the levels on both sides, to distinguish a threshold beyond them from one at them.
THRESHOLDS_DB: Floats = np.arange(-80.0, 31.0, 1.0)
# Normal, broad: the shipped thresholds lie from -42 to -16 dB. One wrong answer to a strong tone
# then does not cost a dozen trials.
EXPECTED_DB, EXPECTED_SD_DB = -30.0, 15.0
SLOPES = (1.0, 1.5, 2.2, 3.3, 5.0)
LAPSE_RATES = (0.0, 0.02, 0.04, 0.06)  # shares that are wrong however strong the tone
# Beyond what the prior assumes; if these explain the answers so many times better, a note says so
# (docs/method/protocols.md#lapses).
MORE_LAPSES = (0.08, 0.1, 0.12, 0.14, 0.16, 0.18, 0.2)
NOTED_BAYES_FACTOR = 4.0
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
    level_db : float
        One of `LEVELS_DB`.
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
    level_db : float
        Posterior mean, dB re 1 g (peak).
    sd_db : float
        Posterior standard deviation.
    slope, lapse_rate : float
        Posterior means, of all frequencies; the slope is Weibull's, over amplitudes.
    beyond : {"", "above", "below"}
        Whether the threshold is more likely than not above the highest level that the rig can
        present, or below the lowest that is asked; `level_db` is then that level, a bound.
    more_lapses : bool
        Whether more lapses than the prior assumes explain the person's answers much better:
        `level_db` is then probably too high. Not of a bound.
    """

    frequency_hz: float
    level_db: float
    sd_db: float
    slope: float
    lapse_rate: float
    trials: int
    beyond: str = ""
    more_lapses: bool = False


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


def posterior(answers: Sequence[Answer], frequency_hz: float) -> Floats:
    """Probability of every slope, lapse rate and threshold at one frequency.

    By Bayes' rule; the thresholds at other frequencies are summed over. The shape is that of
    `QuestPlus.posterior`.

    Parameters
    ----------
    answers : sequence of Answer
        Of one person, at any frequencies.
    """
    logs = _log_weights([a for a in answers if a.frequency_hz == frequency_hz])
    axis = _quest_plus().prior.get_axis_num("threshold")
    for other in {a.frequency_hz for a in answers} - {frequency_hz}:
        weights = _log_weights([a for a in answers if a.frequency_hz == other])
        highest = weights.max()
        logs = logs + np.log(np.exp(weights - highest).sum(axis=axis, keepdims=True))
    weights = np.exp(logs - logs.max())
    return np.asarray(weights / weights.sum())


def _log_weights(answers: Sequence[Answer]) -> Floats:
    """Logarithm of prior times likelihood; of a product, which might be too small a number."""
    log_prior, log_likelihoods = _logs()
    return np.asarray(log_prior + np.tensordot(_counts(answers), log_likelihoods))


def _counts(answers: Sequence[Answer]) -> Floats:
    """How many were right, and how many wrong, at each level."""
    counts = np.zeros((2, LEVELS_DB.size))
    for answer in answers:
        counts[int(not answer.correct), int(np.searchsorted(LEVELS_DB, answer.level_db))] += 1
    return counts


def lapse_bayes_factor(answers: Sequence[Answer]) -> float:
    """How many times better `MORE_LAPSES` explain a person's answers than `LAPSE_RATES` do.

    The likelihood is averaged over the prior of the thresholds, over slopes and over lapse rates.
    """
    from scipy.special import logsumexp  # late: takes longer to load than all of modeling

    log_prior, log_likelihoods = _logs_of_lapses()
    threshold = _quest_plus().prior.get_axis_num("threshold")
    logs = sum(
        logsumexp(
            log_prior
            + np.tensordot(
                _counts([a for a in answers if a.frequency_hz == frequency_hz]), log_likelihoods
            ),
            axis=threshold,
        )
        for frequency_hz in {a.frequency_hz for a in answers}
    )
    assumed, more = np.split(np.exp(logs - np.max(logs)), [len(LAPSE_RATES)], axis=-1)
    return float(more.mean() / assumed.mean())


def next_level_db(answers: Sequence[Answer], frequency_hz: float, *, highest_db: float) -> float:
    """The level whose answer leaves the least entropy to be expected (QUEST+), up to the highest.

    Parameters
    ----------
    answers : sequence of Answer
        Of one person so far, at any frequencies.
    frequency_hz : float
        What is presented next.
    highest_db : float
        The highest level that the rig can present.

    Raises
    ------
    InputError
        If the rig can present none of `LEVELS_DB`.
    """
    allowed = LEVELS_DB[highest_db + _TOLERANCE_DB >= LEVELS_DB]
    if not allowed.size:
        raise InputError(
            f"expected a rig that presents {LEVELS_DB[0]:g} dB re 1 g, got {highest_db:.4g} dB at "
            "most; raise its limits."
        )
    made = _quest_plus()
    chooser = copy(made)
    chooser.posterior = made.prior.copy(data=posterior(answers, frequency_hz))
    chooser.likelihoods = made.likelihoods.sel(intensity=allowed)
    return float(chooser.next_stim["intensity"])


def estimate(answers: Sequence[Answer], frequency_hz: float) -> Estimate:
    """A person's threshold at one frequency, with at least one answer there.

    Parameters
    ----------
    answers : sequence of Answer
        Of one person, at any frequencies.

    Raises
    ------
    InputError
        For no answer at this frequency.
    """
    own = [answer for answer in answers if answer.frequency_hz == frequency_hz]
    if not own:
        raise InputError(f"expected answers at {frequency_hz:g} Hz, got none; run the session.")
    weights = posterior(answers, frequency_hz)
    threshold_db, slope, lapse_rate = _parameters()
    point_db = threshold_db + POINT_DB / slope
    mean = {
        name: float((weights * value).sum())
        for name, value in (("db", point_db), ("slope", slope), ("lapse", lapse_rate))
    }
    sd_db = float(np.sqrt((weights * (point_db - mean["db"]) ** 2).sum()))
    highest_db = min(max(answer.highest_db for answer in own), float(LEVELS_DB[-1]))
    beyond, level_db = "", mean["db"]
    if weights[point_db > highest_db].sum() > 0.5:
        beyond, level_db = "above", highest_db
    elif weights[point_db < LEVELS_DB[0]].sum() > 0.5:
        beyond, level_db = "below", float(LEVELS_DB[0])
    return Estimate(
        frequency_hz=frequency_hz,
        level_db=level_db,
        sd_db=sd_db,
        slope=mean["slope"],
        lapse_rate=mean["lapse"],
        trials=len(own),
        beyond=beyond,
        more_lapses=not beyond and lapse_bayes_factor(answers) > NOTED_BAYES_FACTOR,
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
        prior={"threshold": np.exp(-(((THRESHOLDS_DB - EXPECTED_DB) / EXPECTED_SD_DB) ** 2) / 2)},
        func="weibull",
        stim_scale="dB",
    )


@cache
def _logs() -> tuple[Floats, Floats]:
    """Logarithms of the prior, and of the likelihoods by answer and level."""
    made = _quest_plus()
    likelihoods = made.likelihoods.transpose("response", "intensity", *made.prior.dims).values
    # A likelihood of 0 stays far below all others, and 0 times its logarithm is 0.
    return np.log(made.prior.values), np.log(np.maximum(likelihoods, 1e-300))


@cache
def _logs_of_lapses() -> tuple[Floats, Floats]:
    """As `_logs`, with `MORE_LAPSES` behind `LAPSE_RATES`."""
    log_prior, log_likelihoods = _logs()
    right = np.exp(log_likelihoods[0, ..., :1])  # without lapses
    # With the rate λ: 1 − λ − (½ − λ)·(1 − p), where p = 2·right − 1 is the share that is felt.
    right = right - (2 * right - 1) * np.array([*LAPSE_RATES, *MORE_LAPSES])
    return log_prior[..., :1], np.log(np.maximum([right, 1 - right], 1e-300))


@cache
def _parameters() -> tuple[Floats, Floats, Floats]:
    """Threshold, slope and lapse rate at every place of the posterior."""
    prior = _quest_plus().prior
    threshold, slope, lapse_rate = (
        prior[name].broadcast_like(prior).transpose(*prior.dims).values
        for name in ("threshold", "slope", "lapse_rate")
    )
    return threshold, slope, lapse_rate
