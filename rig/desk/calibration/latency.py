"""Latency from hand to vibration: onsets, lags, and statistics over trials.

docs/method/rig.md#latency
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError
from tactileq.modeling.seeds import generator
from tactileq.rig.shared.live.memory import reading_ages_s

AIM_MS = 20.0
# Textures are felt to change at about 40 ms (Okamoto and others 2009).
MOST_MS = 40.0
LEAST_TRIALS = 50
LATENCY_HIGH_PASS_HZ = 20.0  # what the hand itself does is slower
LEAST_STEP_DB = 10.0
LEAST_EVIDENCE = 20.0  # of the logarithm of the likelihood
LEAST_VIBRATION_S = 2e-3
LAG_BIN_S = 1e-3
RESAMPLES = 2000
CONFIDENCE = 0.95


def high_passed(samples: ArrayLike, *, rate_hz: float) -> Floats:
    """Samples without what is below 20 Hz; causal, so that no onset moves forward."""
    from scipy.signal import butter, sosfilt, sosfilt_zi  # late: as below

    sos = butter(2, LATENCY_HIGH_PASS_HZ, "highpass", fs=rate_hz, output="sos")
    values = np.asarray(samples, dtype=np.float64)
    return np.asarray(sosfilt(sos, values, zi=sosfilt_zi(sos) * values[0])[0])


def onset_s(rest: ArrayLike, searched: ArrayLike, *, rate_hz: float) -> float | None:
    """When a vibration begins: the likeliest moment at which the variance changes.

    Samples before it have the variance of the rest, those after it another one, which is
    estimated; both Gaussian. It counts where the variance grows tenfold (10 dB) at least and the
    change is e²⁰ times likelier than none.

    Parameters
    ----------
    rest : (m,) array_like
        Before the hand moves, high-passed.
    searched : (n,) array_like
        From the hand's step on, until it ends; likewise.

    Returns
    -------
    float or None
        Seconds from the first searched sample; None where nothing begins.
    """
    power = np.asarray(searched, dtype=np.float64) ** 2
    # Digital silence has no variance: 80 dB below the loudest sample stands for it.
    before = max(float(np.mean(np.square(rest))), 1e-8 * float(power.max(initial=0.0)), 1e-30)
    shortest = max(round(LEAST_VIBRATION_S * rate_hz), 2)
    if power.size <= shortest:
        return None
    left = power.size - np.arange(power.size - shortest)
    after = np.cumsum(power[::-1])[::-1][: left.size]
    ratio = np.maximum(after / left / before, 1e-30)
    evidence = left / 2 * (ratio - 1 - np.log(ratio))
    evidence[ratio < 10 ** (LEAST_STEP_DB / 10)] = -np.inf
    best = int(np.argmax(evidence))
    if not evidence[best] > LEAST_EVIDENCE:
        return None
    return best / rate_hz


def stroke_lag_s(
    power_g2: ArrayLike, level: ArrayLike, *, longest_s: float, floor_g2: float
) -> float:
    """By how much a vibration's level follows the hand's, over one stretch of strokes.

    The likeliest lag for samples of a Gaussian vibration whose variance is the floor plus some
    multiple of `level`². Most of what is known of it comes from where the hand turns round.

    Parameters
    ----------
    power_g2 : (n,) array_like
        Mean square of the vibration, high-passed, in bins of 1 ms.
    level : (n,) array_like
        What the rig was to render, at the same times, in any unit; ≥ 0.
    longest_s : float
        Lags from 0 up to this are looked at; so much at the beginning only serves as a past.
    floor_g2 : float
        Mean square at rest, > 0.

    Raises
    ------
    InputError
        If the stretch is no longer than the longest lag.
    """
    power, wanted = np.asarray(power_g2, np.float64), np.square(np.asarray(level, np.float64))
    longest = round(longest_s / LAG_BIN_S)
    if power.size != wanted.size or power.size <= 2 * longest:
        raise InputError(
            f"expected strokes of more than {2 * longest_s:g} s for lags up to {longest_s:g} s, "
            f"got {power.size * LAG_BIN_S:g} s; stroke longer."
        )
    heard = power[longest:]
    misfits = [
        _misfit(heard, wanted[longest - lag : wanted.size - lag], floor_g2)
        for lag in range(longest + 1)
    ]
    best = int(np.argmin(misfits))
    return LAG_BIN_S * (best + _between(misfits, best))


def _misfit(heard: Floats, wanted: Floats, floor: float) -> float:
    """−log likelihood per bin, up to a constant, at the likeliest multiple."""
    scale = max(float(heard.mean() - floor), 1e-12 * floor) / max(float(wanted.mean()), 1e-300)
    expected = floor + scale * wanted
    return float(np.mean(np.log(expected) + heard / expected))


def _between(values: Sequence[float], best: int) -> float:
    """Where a parabola through a minimum and its neighbours has its own, in steps."""
    if not 0 < best < len(values) - 1:
        return 0.0
    before, at, after = values[best - 1 : best + 2]
    return 0.5 * (before - after) / (before - 2 * at + after)


@dataclass(frozen=True)
class LatencySummary:
    """Latency over trials, in ms; each interval holds 95 % (percentiles of a bootstrap).

    Parameters
    ----------
    median_within_ms, p95_within_ms : (low, high)
    trials : int
        Those in which a vibration was found.
    missed : int
        Those in which none was.
    """

    median_ms: float
    median_within_ms: tuple[float, float]
    p95_ms: float
    p95_within_ms: tuple[float, float]
    trials: int
    missed: int


def summary_of(
    latencies_s: Sequence[float | None], *, least: int = LEAST_TRIALS, seed: int = 0
) -> LatencySummary:
    """Median and 95th percentile of trials, with intervals.

    Parameters
    ----------
    latencies_s : sequence of float or None
        None where no vibration was found.
    least : int
        So many have to be found.
    seed : int
        Of the bootstrap.

    Raises
    ------
    InputError
        If too few trials were found.
    """
    from scipy.stats import bootstrap  # late: takes longer to load than all of modeling

    found = 1e3 * np.array([latency for latency in latencies_s if latency is not None])
    if found.size < least:
        raise InputError(
            f"expected a vibration in at least {least} trials, got {found.size} of "
            f"{len(latencies_s)}; raise the level, fix the sensor firmly, or take more trials."
        )

    def within(share: float) -> tuple[float, float]:
        result = bootstrap(
            (found,),
            lambda values, axis: np.quantile(values, share, axis=axis),
            n_resamples=RESAMPLES,
            confidence_level=CONFIDENCE,
            method="percentile",
            rng=generator(seed, round(1e3 * share)),
        ).confidence_interval
        return float(result.low), float(result.high)

    return LatencySummary(
        median_ms=float(np.median(found)),
        median_within_ms=within(0.5),
        p95_ms=float(np.quantile(found, 0.95)),
        p95_within_ms=within(0.95),
        trials=found.size,
        missed=len(latencies_s) - found.size,
    )


def check_latency(summary: LatencySummary, *, accepted: str | None) -> None:
    """Refuse a 95th percentile above 40 ms, unless it is accepted with a reason.

    Raises
    ------
    InputError
    """
    if summary.p95_ms > MOST_MS and not accepted:
        raise InputError(
            f"expected a latency of at most {MOST_MS:g} ms in 95 % of trials, got "
            f"{summary.p95_ms:.1f} ms, at which textures feel different; use smaller blocks, "
            "or accept it with --accept and a reason, which is kept in the rig file."
        )


@dataclass(frozen=True)
class Part:
    """One part of the way from hand to vibration, median and 95th percentile in ms."""

    name: str
    median_ms: float
    p95_ms: float


def parts_of(reading_times_s: ArrayLike, blocks: np.ndarray, *, rate_hz: float) -> list[Part]:
    """Latency according to the log of blocks.

    Parameters
    ----------
    reading_times_s : (m,) array_like
        Of the hand's readings, rising.
    blocks : (n,) array of tactileq.rig.shared.live.memory.BLOCK

    Returns
    -------
    list of Part
        Age of the reading that a block extrapolates; the block itself, since a step waits up to so
        long for the next; from there to the card's output, as its driver states it.
    """
    times = np.asarray(reading_times_s, dtype=np.float64)
    parts = {
        "age of the reading in a block": reading_ages_s(times, blocks),
        "one block": blocks["frames"] / rate_hz,
        "block to output, as stated": blocks["dac_time_s"] - blocks["time_s"],
    }
    return [
        Part(name, 1e3 * float(np.median(values)), 1e3 * float(np.quantile(values, 0.95)))
        for name, values in parts.items()
        if len(values)
    ]
