"""Sinusoids in a record: the mains hum, and pure tones.

Thomson's F-test distinguishes a sinusoid from a narrow band of noise: the spectra of one record
through several tapers, which are independent for noise, agree in amplitude and phase for a sinusoid
(Thomson 1982, "Spectrum estimation and harmonic analysis").
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from tactileq.modeling.arrays import Bools, Floats

TIME_BANDWIDTH = 3.0
TAPERS = 5
# Of all lines of a record that stand out, so few are taken for a sinusoid that is not there.
CERTAIN = 1e-6
PROBABLE = 1e-4  # where one is expected, as at the mains' harmonics
MOST = 24
PASSES = 2
MAINS_HZ = (50.0, 60.0)
LOOKED_AT = 8  # records, before all are searched for hum
MAINS_TOLERANCE = 2e-3  # of the frequency, beside half a line
HIGHEST_HARMONIC_HZ = 1000.0
NEIGHBOURS = 31  # lines
STANDING_OUT, STANDING_OUT_WHERE_EXPECTED = 20.0, 8.0  # times the median of the neighbours
ZOOMED_POINTS = 65  # over two lines
MOST_TAPER_POINTS = 4096
TINY = 1e-300


class Sinusoids(NamedTuple):
    """Frequencies (Hz), amplitudes (peak) and phases (rad at the first sample), each (k,)."""

    frequency_hz: Floats
    amplitude: Floats
    phase: Floats

    def samples(self, count: int, rate_hz: float) -> Floats:
        """Their sum, (count,)."""
        turns = 2 * np.pi * self.frequency_hz[:, None] * np.arange(count) / rate_hz
        waves: Floats = (self.amplitude[:, None] * np.cos(turns + self.phase[:, None])).sum(axis=0)
        return waves

    def only(self, chosen: np.ndarray) -> Sinusoids:
        return Sinusoids(*(values[chosen] for values in self))


_NONE = Sinusoids(*(np.zeros(0),) * 3)


def find_sinusoids(samples: Floats, rate_hz: float, *, lowest_hz: float) -> Sinusoids:
    """Sinusoids that are certain, by rising frequency.

    Parameters
    ----------
    samples : (n,) ndarray
    lowest_hz : float
        None is looked for below.
    """
    found: list[Sinusoids] = []
    rest = samples
    for _ in range(PASSES):  # what a loud one spills may hide another
        candidates = _standing_out(rest, rate_hz, by=STANDING_OUT)
        tested = _tested(rest, rate_hz, candidates[candidates >= lowest_hz])
        sure = tested.sinusoids.only(tested.p < CERTAIN)
        if not sure.frequency_hz.size:
            break
        found.append(sure)
        rest = rest - sure.samples(rest.size, rate_hz)
    every = [np.concatenate(values) for values in zip(_NONE, *found, strict=True)]
    order = np.argsort(every[0], kind="stable")[:MOST]
    return Sinusoids(*(values[order] for values in every))


def mains_harmonics(samples: Floats, rate_hz: float, mains_hz: float) -> Sinusoids:
    """The harmonics of the mains that a record probably holds."""
    candidates = _standing_out(samples, rate_hz, by=STANDING_OUT_WHERE_EXPECTED)
    expected = mains_hz * np.maximum(np.rint(candidates / mains_hz), 1.0)
    line_hz = rate_hz / samples.size
    near = np.abs(candidates - expected) <= MAINS_TOLERANCE * expected + line_hz
    near &= expected <= HIGHEST_HARMONIC_HZ
    tested = _tested(samples, rate_hz, candidates[near])
    off = np.abs(tested.sinusoids.frequency_hz - expected[near])
    right = off <= MAINS_TOLERANCE * expected[near] + 0.5 * line_hz
    return tested.sinusoids.only(right & (tested.p < PROBABLE))


def common_hum(
    records: Sequence[Floats], rate_hz: float, *, speeds_mm_s: Sequence[float]
) -> list[tuple[float, ...]]:
    """The mains' lines (Hz) in each of some records of one texture.

    Hum is there whatever the speed: a line counts where half of the records hold it, and more than
    half of the speeds, two at least; at one speed a grating might stand at the mains' frequency.

    Parameters
    ----------
    records : sequence of (n,) ndarray
        Prepared, at one rate.
    speeds_mm_s : sequence of float
        Of each record; those without contact have one of their own, such as 0.
    """
    speeds = np.asarray(speeds_mm_s, dtype=np.float64)
    most = 0
    lines: list[tuple[float, ...]] = [()] * len(records)
    if np.unique(speeds).size < 2:
        return lines
    step = max(1, len(records) // LOOKED_AT)
    for mains_hz in MAINS_HZ:
        looked_at = [mains_harmonics(x, rate_hz, mains_hz) for x in records[::step]]
        if 2 * sum(bool(found.frequency_hz.size) for found in looked_at) < len(looked_at):
            continue
        found = [mains_harmonics(x, rate_hz, mains_hz) for x in records]
        numbers = [np.rint(f.frequency_hz / mains_hz) for f in found]
        every = np.unique(np.concatenate(numbers))
        held = np.array([np.isin(every, n) for n in numbers])
        common = every[_at_most_speeds(held, speeds)]
        here = int(held[:, np.isin(every, common)].sum())
        if here > most:  # of harmonics that both mains share the one with more besides
            most = here
            lines = [
                tuple(f.frequency_hz[np.isin(n, common)].tolist())
                for f, n in zip(found, numbers, strict=True)
            ]
    return lines


def _at_most_speeds(held: Bools, speeds_mm_s: Floats) -> Bools:
    """Which lines are in half of the records and at most of the speeds; `held` is (records, k)."""
    at_speed = np.array([held[speeds_mm_s == v].any(axis=0) for v in np.unique(speeds_mm_s)])
    wide = (2 * at_speed.sum(axis=0) > len(at_speed)) & (at_speed.sum(axis=0) > 1)
    of_all: Bools = wide & (2 * held.sum(axis=0) >= len(held))
    return of_all


def without_hum(samples: Floats, rate_hz: float, hum_hz: Sequence[float]) -> Floats:
    """The record (n,) without the likeliest sinusoid near each of the mains' lines (Hz)."""
    if not hum_hz:
        return samples
    hum = sinusoids_near(samples, rate_hz, np.asarray(hum_hz, dtype=np.float64))
    return samples - hum.samples(samples.size, rate_hz)


def sinusoids_near(samples: Floats, rate_hz: float, frequencies_hz: Floats) -> Sinusoids:
    """The likeliest sinusoid near each of some frequencies (k,), certain or not."""
    return _tested(samples, rate_hz, frequencies_hz).sinusoids


@lru_cache(maxsize=8)
def _tapers(count: int) -> tuple[Floats, Floats]:
    """Slepian tapers (k, n) of unit energy, and their sums (k,)."""
    from scipy.signal.windows import dpss

    # Of long records they are read off shorter ones, from which they hardly differ.
    points = min(count, MOST_TAPER_POINTS)
    short = dpss(points, TIME_BANDWIDTH, TAPERS)
    at = (np.arange(count) + 0.5) / count * points - 0.5
    tapers = np.array([np.interp(at, np.arange(points), taper) for taper in short])
    tapers /= np.sqrt((tapers**2).sum(axis=1, keepdims=True))
    sums = tapers.sum(axis=1)
    sums[1::2] = 0.0  # odd tapers are antisymmetric
    return tapers, sums


class _Tested(NamedTuple):
    """The likeliest sinusoids near some frequencies, and p of the hypothesis that none is there."""

    sinusoids: Sinusoids
    p: Floats


def _standing_out(samples: Floats, rate_hz: float, *, by: float) -> Floats:
    """Frequencies of lines that stand out of their neighbours, the highest first."""
    from scipy.ndimage import median_filter

    tapers, _ = _tapers(samples.size)
    power = np.abs(np.fft.rfft(tapers[0] * samples)) ** 2
    usual = median_filter(power, size=NEIGHBOURS, mode="nearest")
    top = (power[1:-1] >= power[:-2]) & (power[1:-1] > power[2:])
    out = np.flatnonzero(top & (power[1:-1] > by * usual[1:-1])) + 1
    out = out[np.argsort(-power[out] / np.maximum(usual[out], TINY), kind="stable")][:MOST]
    return np.asarray(out * rate_hz / samples.size)


def _tested(samples: Floats, rate_hz: float, near_hz: Floats) -> _Tested:
    """The F-test at the largest amplitude near each of some frequencies (k,)."""
    from scipy.signal import zoom_fft

    tapers, sums = _tapers(samples.size)
    line_hz, degrees = rate_hz / samples.size, 2 * TAPERS - 2
    rows = []
    for near in near_hz.tolist():
        band = [max(near - line_hz, 0.0), near + line_hz]
        spectra = zoom_fft(tapers * samples, band, ZOOMED_POINTS, fs=rate_hz, endpoint=True)
        mean = sums @ spectra / (sums @ sums)
        best = int(np.argmax(np.abs(mean)))
        residual = float((np.abs(spectra[:, best] - sums * mean[best]) ** 2).sum())
        ratio = (TAPERS - 1) * np.abs(mean[best]) ** 2 * (sums @ sums) / max(residual, TINY)
        # The tail of F with 2 and d degrees of freedom, in closed form.
        p = (1 + 2 * ratio / degrees) ** (-degrees / 2)
        frequency = float(np.linspace(band[0], band[1], ZOOMED_POINTS)[best])
        rows.append((frequency, 2 * np.abs(mean[best]), np.angle(mean[best]), p))
    table = np.array(rows, dtype=np.float64).reshape(-1, 4).T
    return _Tested(Sinusoids(*table[:3]), table[3])
