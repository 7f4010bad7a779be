"""Peaks of one spectrum as a sum of powers: how many there are, and where.

docs/method/estimation.md#single-spectra, docs/method/estimation.md#growth

A sum of powers needs no signs. It grows by the largest residual; its peaks share one shape between
Lorentzian and Gaussian, so that no layers are spent on skirts of another form.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.estimation.likelihood import (
    FORGIVEN_MISFIT,
    Bins,
    Power,
    bins_near,
    centres_and_widths,
    limits_of_sum,
    maximise,
    misfit_of,
    power_sum,
    power_sum_of_peaks,
    split,
)

# A layer must raise the log likelihood by this much in a record of 5000 samples, and by ln n more
# in one n times as long, where chance has more places to look like one (one record of white noise
# in ten has such a place). BIC would ask 10 to 12 for three parameters; 6 finds more of the weak
# layers, and what it finds is nearly always there.
PENALTY = 6.0
PENALTY_SAMPLES = 5000
SEVERAL_AT_ONCE = 40.0
MOST_LAYERS = 12
NARROWEST_BOX = 5
WIDEST_BOX_HZ = 520.0


@dataclass(frozen=True, eq=False)
class Peaks:
    """Peaks of one spectrum as a sum of powers, by rising frequency.

    Parameters
    ----------
    frequencies_hz, bandwidths_hz, gains : (m,) ndarray
        Gains, relative to `Power.scale`, are those of the peaks' own power.
    shape : float
        Of all peaks: 1 is Lorentzian, larger falls off faster.
    evidence : (m,) ndarray
        What leaving a peak out costs in log likelihood, all else kept.
    """

    noise_gain: float
    frequencies_hz: Floats
    bandwidths_hz: Floats
    gains: Floats
    shape: float
    evidence: Floats

    def only(self, kept: list[int]) -> Peaks:
        """These peaks (0-based) alone."""
        names = ("frequencies_hz", "bandwidths_hz", "gains", "evidence")
        return replace(self, **{name: getattr(self, name)[kept] for name in names})


def find_peaks_jointly(power: Power) -> Peaks:
    """Noise and peaks of one spectrum: greedy growth, refitted as a whole after every addition.

    Growth ends where no further peak raises the log likelihood by `PENALTY`.
    """
    from scipy.special import gammaincinv

    # Where three in ten lines of noise alone would lie; above are peaks. Exponentially distributed
    # lines, or means of several.
    below = gammaincinv(power.records, 0.3) / power.records
    floor = np.quantile(power.power[power.weight > 0], 0.3) / below
    theta, m = np.array([0.5 * np.log(floor), 0.0]), 0
    expected = np.full(power.power.size, floor)
    while m < MOST_LAYERS:
        candidates = _candidates(power, expected)[: MOST_LAYERS - m]
        if not len(candidates):
            break
        grown = _insert(theta, m, candidates, power, expected)
        bins = bins_near(power, *centres_and_widths(grown, m + len(candidates)))
        before = misfit_of(bins, power_sum(theta if m else _noise_alone(bins), m, bins)[0])
        m_grown = m + len(candidates)
        limits = limits_of_sum(m_grown, power)
        grown, after = maximise(grown, bins, m=m_grown, limits=limits, steps=4, enough=1.0)
        if before - after < penalty(power) * len(candidates):
            break
        theta, m = grown, m_grown
        expected = _expected_on_lines(theta, m, power)
    if not m:
        theta = _noise_alone(bins_near(power, np.zeros(0), np.zeros(0)))
    return _as_peaks(theta, m, power)


def _noise_alone(bins: Bins) -> Floats:
    """Parameters of the likeliest power sum without peaks."""
    return np.array([0.5 * np.log(bins.weight @ bins.power / bins.weight.sum()), 0.0])


def penalty(power: Power) -> float:
    """What a further layer must gain in log likelihood, at least 2."""
    samples = power.rate_hz / power.step_hz
    return max(2.0, PENALTY + float(np.log(samples / PENALTY_SAMPLES)))


def _candidates(power: Power, expected: Floats) -> Floats:
    """Where power stands above what is expected: rows of (frequency_hz, bandwidth_hz, ratio).

    The likelihood ratio of a box of raised power, over boxes of widths in octaves; the best one,
    and with it all that are beyond doubt and far from it.
    """
    total = np.concatenate(([0.0], np.cumsum(power.weight * power.power / expected)))
    lines = np.concatenate(([0.0], np.cumsum(power.weight)))
    found = []
    width = NARROWEST_BOX
    while width * power.step_hz <= WIDEST_BOX_HZ and width < expected.size:
        hop = max(1, width // 6)
        lines_within = np.maximum(lines[width::hop] - lines[:-width:hop], 1e-9)
        raised = np.maximum((total[width::hop] - total[:-width:hop]) / lines_within, 1.0)
        lines_within *= power.records
        gain = (
            lines_within / (1 + lines_within * FORGIVEN_MISFIT**2) * (raised - 1 - np.log(raised))
        )
        for _ in range(4):
            best = int(np.argmax(gain))
            if gain[best] < penalty(power):
                break
            middle = best * hop + (width - 1) / 2
            found.append((float(gain[best]), middle, width, float(raised[best])))
            gain[max(0, best - 2 * width // hop - 1) : best + 2 * width // hop + 2] = 0.0
        width = 2 * width - 1
    chosen: list[tuple[float, float, int, float]] = []
    for candidate in sorted(found, reverse=True):
        if chosen and candidate[0] < max(SEVERAL_AT_ONCE, 0.15 * chosen[0][0]):
            break
        if all(abs(candidate[1] - c[1]) > 1.5 * (candidate[2] + c[2]) for c in chosen):
            chosen.append(candidate)
    # A Lorentzian of width B is detected best by a box of about 1.4 B.
    rows = [
        (power.frequency_hz[0] + c[1] * power.step_hz, 0.7 * c[2] * power.step_hz, c[3])
        for c in chosen
    ]
    return np.array(rows).reshape(-1, 3)


def _insert(theta: Floats, m: int, candidates: Floats, power: Power, expected: Floats) -> Floats:
    """Parameters of the power sum with the candidates as further peaks."""
    noise, frequency, bandwidth, gain = split(theta, m)
    shape = theta[-1:]
    centre, width, ratio = candidates.T
    there = np.interp(centre, power.frequency_hz, expected)
    height = 0.5 * np.log(there * np.maximum(ratio - 1, 0.3) / 0.7)
    parts = (noise, frequency, np.log(centre), bandwidth, np.log(width), gain, height, shape)
    return np.concatenate(parts)


def _expected_on_lines(theta: Floats, m: int, power: Power) -> Floats:
    """The power sum at every line of the periodogram."""
    tangent = np.tan(np.pi / power.rate_hz * power.frequency_hz)
    ones = np.ones(tangent.size)
    lines = Bins(ones, ones, ones, tangent, 1 / tangent, power.rate_hz)
    expected: Floats = power_sum_of_peaks(theta, m, lines).sum(axis=0)
    return expected


def _as_peaks(theta: Floats, m: int, power: Power) -> Peaks:
    bins = bins_near(power, *centres_and_widths(theta, m))
    parts = power_sum_of_peaks(theta, m, bins)
    whole = misfit_of(bins, parts.sum(axis=0))
    # Summed again: next to a pure tone, the whole less the tone would be rounded to nothing.
    rest = [np.delete(parts, i, axis=0).sum(axis=0) for i in range(1, m + 1)]
    evidence = np.array([misfit_of(bins, expected) - whole for expected in rest])
    noise, frequency, bandwidth, gain = split(theta, m)
    order = np.argsort(frequency)
    # Later peaks may have taken over for earlier ones.
    order = order[evidence[order] > penalty(power)]
    return Peaks(
        noise_gain=float(np.exp(noise[0])),
        frequencies_hz=np.exp(frequency)[order],
        bandwidths_hz=np.exp(bandwidth)[order],
        gains=np.exp(gain)[order],
        shape=float(np.exp(theta[-1])),
        evidence=evidence[order],
    )


def power_sum_misfit(peaks: Peaks, bins: Bins) -> float:
    """How well the sum of the peaks' powers fits."""
    return misfit_of(bins, power_sum(theta_of(peaks), peaks.gains.size, bins)[0])


def theta_of(peaks: Peaks) -> Floats:
    """The parameters of the power sum, (3m+2,); see `likelihood.split`."""
    parts = (peaks.noise_gain, peaks.frequencies_hz, peaks.bandwidths_hz, peaks.gains, peaks.shape)
    theta: Floats = np.log(np.hstack(parts))
    return theta
