"""Stationarity of a record in speed and level: drift is found, reported and corrected.

A turntable that slows down moves all spatial frequencies together. The record is then played at a
changing rate, so that they stay constant (order tracking), and belongs to its middle. A level that
changes cannot be corrected; it is reported.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tactileq.modeling.arrays import Floats

SEGMENTS = 4
FINE, PARTS = 0.005, 4  # cells of 2 % of the frequency, moved by quarters of one
LOWEST_HZ = 20.0
LARGEST_DRIFT = 0.3
DRIFT_STEPS = 15
# Of log likelihood, that frequencies stay constant when followed. Of 1,200 steady records of
# planted and drawn textures none gained 16; of 100 whose frequencies drift by 20 % nine in ten
# gain 20.
LEAST_GAIN = 20.0
LEAST_DRIFT = 0.04
SMOOTHED_CELLS = 5
CLEAR_SLOPE = 0.08  # of log power, from cell to cell
OVERSAMPLING = 4
LEAST_LEVEL_CHANGE_DB = 3.0
LEVEL_DEVIATIONS = 5.0
TINY = 1e-300


class Drift(NamedTuple):
    """What changes from the beginning of a record to its end.

    `frequency`: of all frequencies together, relative to the middle; 0 where they stay constant.
    `level_db`: from the quietest quarter to the loudest; 0 where sampling error explains it.
    """

    frequency: float
    level_db: float


def drift_of(samples: Floats, rate_hz: float) -> Drift:
    """Drift within a record of (n,) samples, n ≥ 64."""
    quarters = np.array_split(samples, SEGMENTS)
    count = min(quarter.size for quarter in quarters)
    window = np.hanning(count)
    window /= np.sqrt(np.mean(window**2))
    power = np.abs(np.fft.rfft([window * q[:count] for q in quarters], axis=1)) ** 2 / count
    frequency = np.asarray(np.fft.rfftfreq(count, 1 / rate_hz))
    return Drift(_frequency_drift(power, frequency), _level_change_db(power))


def without_drift(samples: Floats, drift: float) -> Floats:
    """The record with its frequencies held at those of its middle, (n,).

    Parameters
    ----------
    samples : (n,) ndarray
    drift : float
        As `Drift.frequency`: frequencies go from 1 − drift/2 to 1 + drift/2 of the middle's.
    """
    from scipy.signal import resample

    n = samples.size
    share = np.arange(n) / n
    # Where the phase of what stands at the middle's frequency has advanced as in a steady record.
    advanced = share + drift * (share**2 - share) / 2
    at = np.interp(share, advanced, share)
    fine = resample(samples, OVERSAMPLING * n)
    warped: Floats = np.interp(at, np.arange(OVERSAMPLING * n) / (OVERSAMPLING * n), fine)
    return warped


def _frequency_drift(power: Floats, frequency_hz: Floats) -> float:
    """The drift whose spectra agree best, if they agree much better than without."""
    step = frequency_hz[1]
    highest_hz = (frequency_hz[-1] - step) / (1 + LARGEST_DRIFT / 2)
    reach = int(np.ceil(np.log1p(LARGEST_DRIFT) / FINE))  # to both sides of the lowest border
    cells = np.log(max(highest_hz / LOWEST_HZ, 1.0)) / (PARTS * FINE)
    count = int(cells) * PARTS + 1
    if count < 2 * PARTS + 1:  # too slow, or too short, to see anything move
        return 0.0
    places = LOWEST_HZ * np.exp(FINE * np.arange(-reach, count + reach))
    edges = np.append(frequency_hz - step / 2, frequency_hz[-1] + step / 2)
    summed = np.concatenate((np.zeros((SEGMENTS, 1)), np.cumsum(power, axis=1)), axis=1)
    below = np.array([np.interp(places, edges, row) for row in summed])
    drifts = np.linspace(-LARGEST_DRIFT, LARGEST_DRIFT, 2 * DRIFT_STEPS + 1)
    middles = (np.arange(SEGMENTS) + 0.5) / SEGMENTS - 0.5
    moved = np.rint(np.log1p(drifts[:, None] * middles) / FINE).astype(np.intp)
    borders = reach + np.arange(0, count, PARTS) + moved[:, :, None]  # (drifts, segments, borders)
    cells = np.diff(below[np.arange(SEGMENTS)[:, None], borders]) / np.diff(places[borders])
    cells = np.maximum(cells, TINY)
    logs = np.log(cells)
    level = logs.mean(axis=2, keepdims=True)
    # Independent lines in a cell, of which a Hann window leaves two in three.
    lines = np.diff(places[reach : reach + count : PARTS]) / step / 1.5
    lines = lines * _information_share(logs[DRIFT_STEPS].mean(axis=0))
    together = np.log(np.exp(logs - level).mean(axis=1))
    losses = (SEGMENTS * together - (logs - level).sum(axis=1)) @ lines
    best = int(np.argmin(losses))
    gained = losses[DRIFT_STEPS] - losses[best]
    drift = float(drifts[best])
    return drift if gained > LEAST_GAIN and abs(drift) >= LEAST_DRIFT else 0.0


def _information_share(log_power: Floats) -> Floats:
    """Information of a cell (n,) about a drift, 0…1: none where the spectrum is flat."""
    from scipy.ndimage import uniform_filter1d

    slope = np.gradient(uniform_filter1d(log_power, SMOOTHED_CELLS, mode="nearest"))
    square = uniform_filter1d(slope, SMOOTHED_CELLS, mode="nearest") ** 2
    weights: Floats = square / (square + CLEAR_SLOPE**2)
    return weights


def _level_change_db(power: Floats) -> float:
    """Range of the segments' levels, where it is more than their scatter."""
    levels_db = 10 * np.log10(np.maximum(power.sum(axis=1), TINY))
    mean = power.mean(axis=0)
    # Deviation of a segment's level: independent lines of exponentially distributed power.
    deviation_db = 10 / np.log(10) * np.sqrt(1.5 * np.sum(mean**2)) / max(mean.sum(), TINY)
    change = float(np.ptp(levels_db))
    limit = max(LEAST_LEVEL_CHANGE_DB, LEVEL_DEVIATIONS * float(deviation_db))
    return change if change > limit else 0.0
