"""Layers as they are rendered: the coherent response |G_w + Σ G_i H_i(f)| of many spectra at once.

All spectra of a texture, or several starts for one, are climbed side by side
(docs/method/equalizer.md#response, docs/method/estimation.md#likelihood): arrays have one row per
spectrum, bins that a row does not need have no weight.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from tactileq.modeling.arrays import Bools, Floats, Integers
from tactileq.modeling.equalizer.bands import HIGHEST_FREQUENCY_SHARE, LOWEST_BANDWIDTH_HZ
from tactileq.modeling.estimation.compiled import CompiledSpectra, Costs, is_compiled
from tactileq.modeling.estimation.likelihood import (
    LEAST_POWER,
    WIDEST_LOG_GAIN,
    WIDEST_SHARE,
    Bins,
    Power,
    bins_near,
    split,
)

# Width at −3 dB of a spectral line seen through the taper of `Spectrum.tapered`, in lines; a band
# that is as narrow looks wider by it, and lower, at the same level.
LINE_WIDTH = 0.9
NARROWEST_LINES = 1.5
# Half the corner of the high-pass of the preparation: of layers below it only a skirt is seen.
LOWEST_LAYER_HZ = 5.0
HIGHEST_LOOKED_AT = 0.49  # of the rate: where a layer's response at its own frequency is looked at
# A layer higher than this many times the response at its own frequency is mostly cancelled by
# others: two such layers describe what one would, and nothing predicts what is left of them
# elsewhere. Being twice as high costs nothing, four times as high five units of log likelihood.
# Either one doubled: +2 %, worst +21 % (11 drawn surfaces, tools/double_constants.py).
LARGEST_SHARE = 2.0
CANCELLING = 20.0
FIRST_DAMPING, LEAST_DAMPING, HOPELESS_DAMPING = 1e-2, 1e-4, 1e2
RIDGE = 1e-6
LONGEST_STEP = 1.0  # a factor of e in any parameter


@dataclass(frozen=True, eq=False)
class Observed:
    """Binned power of K spectra, relative to the square of one common scale.

    Parameters
    ----------
    power, weight, count, tangent, cotangent : (K, n) ndarray
        As in `Bins`, one row per spectrum; rows with fewer bins end in some without weight.
    line_hz : (K,) ndarray
        Width of a spectral line, see `LINE_WIDTH`; 0 where the truth itself is looked at.
    """

    power: Floats
    weight: Floats
    count: Floats
    tangent: Floats
    cotangent: Floats
    line_hz: Floats
    rate_hz: float

    @cached_property
    def scatter(self) -> Floats:
        """The misfit, (K,), that the scatter of a periodogram alone gives in these bins."""
        from scipy.special import digamma

        count = np.maximum(self.count, 0.5)
        each = self.weight * (np.log(count) - digamma(count))
        return np.asarray(np.where(self.weight > 0, each, 0.0).sum(axis=1))

    @cached_property
    def compiled(self) -> CompiledSpectra:
        """The same for the compiled engine."""
        return CompiledSpectra(
            self.power,
            self.weight,
            self.tangent,
            self.cotangent,
            line_hz=self.line_hz,
            rate_hz=self.rate_hz,
            highest_hz=HIGHEST_LOOKED_AT * self.rate_hz,
            costs=Costs(LEAST_POWER, CANCELLING, LARGEST_SHARE),
        )

    def rows(self, chosen: Sequence[int] | Integers) -> Observed:
        """Some of the spectra, any of them several times."""
        return Observed(
            self.power[chosen],
            self.weight[chosen],
            self.count[chosen],
            self.tangent[chosen],
            self.cotangent[chosen],
            self.line_hz[chosen],
            self.rate_hz,
        )

    def without(self, hidden: Bools) -> Observed:
        """The same with (K,) spectra hidden: their bins have no weight."""
        seen = ~hidden[:, None]
        return replace(self, weight=self.weight * seen, count=self.count * seen)


def observe(
    powers: Sequence[Power | None], centres_hz: Floats, widths_hz: Floats, *, scale: float
) -> Observed:
    """Bins narrow near each spectrum's own layers (K, m); None is a spectrum without any."""
    rows = [
        None if power is None else bins_near(power, centres, widths)
        for power, centres, widths in zip(powers, centres_hz, widths_hz, strict=True)
    ]
    n = max((bins.power.size for bins in rows if bins is not None), default=1)
    table = np.zeros((5, len(rows), n))
    table[[0, 3, 4]] = 1.0
    rate_hz, line_hz = 1.0, np.ones(len(rows))
    for row, (bins, power) in enumerate(zip(rows, powers, strict=True)):
        if bins is None or power is None:
            continue
        relative = bins.power * (power.scale / scale) ** 2
        filled = (relative, bins.weight, bins.count, bins.tangent, bins.cotangent)
        table[:, row, : bins.power.size] = filled
        rate_hz, line_hz[row] = power.rate_hz, LINE_WIDTH * power.step_hz
    power_of, weight, count, tangent, cotangent = table
    return Observed(power_of, weight, count, tangent, cotangent, line_hz, rate_hz)


def one_spectrum(bins: Bins, *, line_hz: float) -> Observed:
    """One spectrum's bins as the only row."""
    return Observed(
        bins.power[None],
        bins.weight[None],
        bins.count[None],
        bins.tangent[None],
        bins.cotangent[None],
        np.array([line_hz]),
        bins.rate_hz,
    )


class Climbed(NamedTuple):
    """Parameters (K, p), signs (K, m) and misfit (K,) of each row at its maximum.

    `misfit` is minus the log likelihood, 0 where every bin is as expected; `objective` adds what
    cancelling layers cost.
    """

    theta: Floats
    signs: Floats
    misfit: Floats
    objective: Floats

    def row(self, k: int) -> Climbed:
        return Climbed(self.theta[k], self.signs[k], self.misfit[k], self.objective[k])


class Response(NamedTuple):
    """Expected power (K, n), and its relative derivatives.

    By the parameters (K, p, n), and by the tangents of the places (K, n).
    """

    power: Floats
    by_parameter: Floats
    by_tangent: Floats


def response(theta: Floats, signs: Floats | None, observed: Observed) -> Response:
    """Power of the response as a record of finite length shows it.

    Parameters
    ----------
    theta : (K, 1 + 3m) ndarray
        Log noise gain, then log frequencies, log bandwidths (Hz) and log amplitudes of m layers;
        see `likelihood.split`.
    signs : (K, m) or (m,) ndarray, optional
        1 or −1. Without them the layers are independent: each has a noise of its own, and their
        powers add.

    Notes
    -----
    A band is H = 1/(1 − ju) with u = (g²·cot(πF/fs) − tan(πF/fs))/(k(1+g²)) at the frequency F,
    g = tan(πf/fs), k = tan(πB/fs): `bands.band_response`, rearranged. Seen through a line of width
    δ, the band has the width √(B² + δ²) and the power of its peak is lower by B over it.
    """
    if is_compiled():
        return Response(*observed.compiled.responses(theta, signs))
    m, per_hz = (theta.shape[1] - 1) // 3, np.pi / observed.rate_hz
    noise, frequency, bandwidth, gain = split(theta, m)
    centre, width = np.exp(frequency), np.exp(bandwidth)
    seen = np.hypot(width, observed.line_hz[:, None])
    width_share = ((width / seen) ** 2)[..., None]  # d ln seen by d ln B
    g, k = np.tan(per_hz * centre), np.tan(per_hz * seen)
    scale = 1 / (k * (1 + g * g))
    cotangent, tangent = observed.cotangent[:, None, :], observed.tangent[:, None, :]
    u = (g * g * scale)[..., None] * cotangent - scale[..., None] * tangent
    amplitude = np.exp(gain) * np.sqrt(width / seen)
    floor = np.exp(noise)
    if signs is None:
        power, by_noise, by_gain, by_u = _independent(floor, amplitude, u)
    else:
        power, by_noise, by_gain, by_u = _coherent(floor, amplitude * signs, u)
    growth = 2 * g * per_hz * centre
    by_frequency = (growth * (1 + g * g) * scale)[..., None] * cotangent - growth[..., None] * u
    by_width = u * (-per_hz * seen * (1 + k * k) / k)[..., None]
    derivative = np.empty((theta.shape[0], 1 + 3 * m, power.shape[1]))
    derivative[:, 0] = by_noise
    derivative[:, 1 : 1 + m] = by_u * by_frequency
    derivative[:, 1 + m : 1 + 2 * m] = (
        width_share * (by_u * by_width) + 0.5 * (1 - width_share) * by_gain
    )
    derivative[:, 1 + 2 * m :] = by_gain
    beside = -(g * g * scale)[..., None] * cotangent**2 - scale[..., None]
    return Response(power, derivative, np.asarray((by_u * beside).sum(axis=1)))


def _coherent(floor: Floats, signed: Floats, u: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Power (K, n) of one noise through all bands, and its relative derivatives.

    By log noise gain (K, n), by log amplitudes (K, m, n) and by the bands' u (K, m, n).
    """
    square = u * u
    real = 1 / (1 + square)
    imaginary = u * real
    in_phase = floor + np.einsum("km,kmn->kn", signed, real)
    quadrature = np.einsum("km,kmn->kn", signed, imaginary)
    # Never quite 0, so that a bin where layers cancel stays comparable.
    power = np.maximum(in_phase * in_phase + quadrature * quadrature, LEAST_POWER)
    along, across = in_phase / power, quadrature / power
    by_noise = 2 * floor * along
    along, across, twice = along[:, None, :], across[:, None, :], (2 * signed)[..., None]
    by_gain = twice * (real * along + imaginary * across)
    by_u = twice * (real * real) * ((1 - square) * across - 2 * u * along)
    return power, by_noise, by_gain, by_u


def _independent(
    floor: Floats, amplitude: Floats, u: Floats
) -> tuple[Floats, Floats, Floats, Floats]:
    """The same for layers each with a noise of its own: powers add."""
    real = 1 / (1 + u * u)
    share = (amplitude**2)[..., None] * real
    power = np.maximum(floor * floor + share.sum(axis=1), LEAST_POWER)
    share = 2 * share / power[:, None, :]
    return power, 2 * floor * floor / power, share, -share * u * real


def misfits(power: Floats, observed: Observed) -> Floats:
    """Minus the log likelihood of each row, (K,), 0 where every bin is as expected."""
    ratio = np.where(observed.weight > 0, observed.power / power, 1.0)
    misfit: Floats = np.einsum("kn,kn->k", observed.weight, ratio - 1 - np.log(ratio))
    return misfit


class Slopes(NamedTuple):
    """Misfit and objective (K,), Fisher information (K, p, p) and score (K, p) of each row.

    `record_information` is the information of the records alone, by their full number of lines:
    what `weight` forgives and what keeps layers from cancelling is not in it.
    """

    misfit: Floats
    objective: Floats
    information: Floats
    score: Floats


def slopes(theta: Floats, signs: Floats | None, observed: Observed) -> Slopes:
    """The objective at (K, p) parameters and what a scoring step needs."""
    if is_compiled():
        return Slopes(*observed.compiled.slopes(theta, signs))
    m, n = (theta.shape[1] - 1) // 3, observed.tangent.shape[1]
    power, derivative, _ = response(theta, signs, _with_centres(theta, m, observed))
    at_bins = derivative[:, :, :n]
    misfit = misfits(power[:, :n], observed)
    weighted = at_bins * observed.weight[:, None, :]
    information = weighted @ at_bins.transpose(0, 2, 1)
    error = np.where(observed.weight > 0, observed.power / power[:, :n] - 1, 0.0)
    score = np.einsum("kpn,kn->kp", weighted, error)
    if not m or signs is None:
        return Slopes(misfit, misfit, information, score)
    amplitude = split(theta, m)[3]
    beyond = amplitude - 0.5 * np.log(power[:, n:]) - np.log(LARGEST_SHARE)
    pull = -0.5 * derivative[:, :, n:]
    layer = np.arange(m)
    pull[:, 1 + 2 * m + layer, layer] += 1
    pull *= (beyond > 0)[:, None, :]
    beyond = np.maximum(beyond, 0.0)
    information += CANCELLING * pull @ pull.transpose(0, 2, 1)
    score -= CANCELLING * np.einsum("kpm,km->kp", pull, beyond)
    objective = misfit + 0.5 * CANCELLING * (beyond**2).sum(axis=1)
    return Slopes(misfit, objective, information, score)


def _with_centres(theta: Floats, m: int, observed: Observed) -> Observed:
    """Further places without weight: each layer's own frequency."""
    at = np.exp(split(theta, m)[1])
    at = np.tan(np.pi / observed.rate_hz * np.clip(at, 1.0, HIGHEST_LOOKED_AT * observed.rate_hz))
    none = np.zeros(at.shape)
    return Observed(
        np.concatenate((observed.power, none + 1), axis=1),
        np.concatenate((observed.weight, none), axis=1),
        np.concatenate((observed.count, none), axis=1),
        np.concatenate((observed.tangent, at), axis=1),
        np.concatenate((observed.cotangent, 1 / at), axis=1),
        observed.line_hz,
        observed.rate_hz,
    )


def limits_of(m: int, *, rate_hz: float, step_hz: float) -> tuple[Floats, Floats]:
    """Lowest and highest parameters of m layers: what a model may hold and a record can resolve."""
    narrowest_hz = max(NARROWEST_LINES * step_hz, LOWEST_BANDWIDTH_HZ)
    low = np.full(1 + 3 * m, -WIDEST_LOG_GAIN)
    high = np.full(1 + 3 * m, WIDEST_LOG_GAIN)
    low[1 : 1 + m], high[1 : 1 + m] = np.log([LOWEST_LAYER_HZ, HIGHEST_FREQUENCY_SHARE * rate_hz])
    low[1 + m : 1 + 2 * m] = np.log(narrowest_hz)
    high[1 + m : 1 + 2 * m] = np.log(WIDEST_SHARE * rate_hz)
    return low, high


def climb(
    theta: Floats,
    signs: Floats,
    observed: Observed,
    *,
    limits: tuple[Floats, Floats],
    free: Bools | None = None,
    steps: int = 30,
    enough: float = 0.1,
) -> Climbed:
    """Each row by itself to the greatest likelihood near its start.

    Fisher scoring with Levenberg–Marquardt damping.

    Parameters
    ----------
    theta : (K, p) ndarray
        Starts.
    signs : (K, m) ndarray
    limits : pair of (p,) or (K, p) ndarray
    free : (p,) or (K, p) ndarray of bool, optional
        Which parameters may move; all by default.
    steps : int
        At most.
    enough : float
        A row has settled once a step gains less than this; it ends when all have.
    """
    low, high = limits
    theta = np.clip(theta, low, high)
    moving: Floats = np.ones(theta.shape)
    if free is not None:
        moving = moving * free
    damping: Floats = np.full(theta.shape[0], FIRST_DAMPING)
    settled = np.zeros(theta.shape[0], dtype=bool)
    now = slopes(theta, signs, observed)
    for _ in range(steps):
        tried = np.clip(theta + _steps(now, damping, moving), low, high)
        there = slopes(tried, signs, observed)
        better = there.objective < now.objective
        gained = np.where(better, now.objective - there.objective, 0.0)
        theta = np.where(better[:, None], tried, theta)
        now = Slopes(*(_where(better, new, old) for new, old in zip(there, now, strict=True)))
        settled |= np.where(better, gained < enough, damping > HOPELESS_DAMPING)
        damping = np.where(better, np.maximum(damping / 10, LEAST_DAMPING), damping * 10)
        if settled.all():
            break
    return Climbed(theta, signs, now.misfit, now.objective)


def _where(chosen: Bools, new: Floats, old: Floats) -> Floats:
    return np.where(chosen.reshape(-1, *(1,) * (new.ndim - 1)), new, old)


def _steps(now: Slopes, damping: Floats, moving: Floats) -> Floats:
    """Levenberg–Marquardt steps (K, p)."""
    information = now.information * moving[:, :, None] * moving[:, None, :]
    diagonal = np.einsum("kpp->kp", information)  # a view
    diagonal += damping[:, None] * diagonal + RIDGE
    step = np.linalg.solve(information, (now.score * moving)[..., None])[..., 0]
    return np.clip(step, -LONGEST_STEP, LONGEST_STEP)


def without_layer(theta: Floats, layer: int) -> Floats:
    """Parameters (…, p) of all layers but one (0-based)."""
    m = (theta.shape[-1] - 1) // 3
    fewer: Floats = np.delete(theta, [1 + layer, 1 + m + layer, 1 + 2 * m + layer], axis=-1)
    return fewer


def record_information(theta: Floats, signs: Floats, observed: Observed) -> Floats:
    """Fisher information (K, p, p) of the records, by their full number of lines."""
    derivative = response(theta, signs, observed).by_parameter
    information: Floats = (derivative * observed.count[:, None, :]) @ derivative.transpose(0, 2, 1)
    return information


def covariance_alone(information: Floats) -> Floats:
    """Its inverse (K, p, p); a parameter that nothing depends on does not spoil the others."""
    scale = 1 / np.sqrt(np.maximum(np.einsum("kpp->kp", information), 1e-12))
    both = scale[:, :, None] * scale[:, None, :]
    scaled = information * both
    np.einsum("kpp->kp", scaled)[...] += 1e-9
    covariance: Floats = np.linalg.inv(scaled) * both
    return covariance


def level_deviations(theta: Floats, covariance: Floats, *, rate_hz: float) -> Floats:
    """Standard deviation of each layer's log level (nepers), (K, m).

    The level is G·√(k/(1+k)), k = tan(πB/fs).
    """
    m = (theta.shape[1] - 1) // 3
    width = np.exp(split(theta, m)[2])
    angle = np.pi / rate_hz * width
    k = np.tan(angle)
    by_width = 0.5 * angle * (1 + k * k) / (k * (1 + k))
    b, g = np.arange(1 + m, 1 + 2 * m), np.arange(1 + 2 * m, 1 + 3 * m)
    variance = covariance[:, g, g] + 2 * by_width * covariance[:, b, g]
    variance = variance + by_width**2 * covariance[:, b, b]
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)), dtype=np.float64)
