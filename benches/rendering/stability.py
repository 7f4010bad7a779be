"""The level of a filter while its parameters move: exact variances, no random numbers.

White noise of unit variance drives m bands of a PEQ whose parameters change at every sample. The
covariance of all states together follows P′ = A·P·Aᵀ + b·bᵀ exactly, and with it the variance of
each band and of their sum at each sample, for any realisation of the bands.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.equalizer.bands import band_coefficients
from tactileq.modeling.models.parameter_table import Parameters

RATE_HZ = 5000.0
STROKE_HZ = 2.0
CENTRES_HZ = (80.0, 300.0, 900.0)
WIDTHS_HZ = (25.0, 40.0, 120.0)


class StateEquations(NamedTuple):
    """A band as s′ = A·s + b·w, band = c·s + d·w: (…, 2, 2), (…, 2), (…, 2) and (…)."""

    matrix: Floats
    drive: Floats
    readout: Floats
    through: Floats


class Form(Protocol):
    """A realisation of unit-gain bands of frequency f and width B, any shape, at a rate."""

    def __call__(
        self, frequency_hz: Floats, bandwidth_hz: Floats, *, rate_hz: float
    ) -> StateEquations: ...


def unit_covariance_form(
    frequency_hz: Floats, bandwidth_hz: Floats, *, rate_hz: float
) -> StateEquations:
    """The kernel's own coefficients (docs/method/equalizer.md#recursion)."""
    c = band_coefficients(frequency_hz, bandwidth_hz, rate_hz=rate_hz)
    return StateEquations(
        _matrix(1 + c.p, -c.q, c.q, 1 + c.r),
        np.stack([c.b1, c.b2], axis=-1),
        c.tap[..., None] * np.stack([2 + c.p, -c.q], axis=-1),
        c.tap * c.b1,
    )


def state_variable_form(
    frequency_hz: Floats, bandwidth_hz: Floats, *, rate_hz: float
) -> StateEquations:
    """The usual topology-preserving state-variable filter: input unscaled, band = K·v1."""
    g, k = _tangents(frequency_hz, bandwidth_hz, rate_hz)
    damping = k * (1 + g * g) / g
    a1 = 1 / (1 + g * (g + damping))
    a2, a3 = g * a1, g * g * a1
    return StateEquations(
        _matrix(2 * a1 - 1, -2 * a2, 2 * a2, 1 - 2 * a3),
        np.stack([2 * a2, 2 * a3], axis=-1),
        damping[..., None] * np.stack([a1, -a2], axis=-1),
        damping * a2,
    )


def direct_form(frequency_hz: Floats, bandwidth_hz: Floats, *, rate_hz: float) -> StateEquations:
    """A transposed direct form II, as in `scipy.signal.sosfilt`."""
    g, k = _tangents(frequency_hz, bandwidth_hz, rate_hz)
    gain = k / (1 + k)
    a1 = -2 * (1 - g * g) / (1 + g * g) / (1 + k)
    a2 = (1 - k) / (1 + k)
    none = np.zeros_like(gain)
    return StateEquations(
        _matrix(-a1, none + 1, -a2, none),
        gain[..., None] * np.stack([-a1, -1 - a2], axis=-1),
        np.stack([none + 1, none], axis=-1),
        gain,
    )


OURS, PLAIN, DIRECT = "unit covariance", "plain state-variable", "direct form"
FORMS: dict[str, Form] = {
    OURS: unit_covariance_form,
    PLAIN: state_variable_form,
    DIRECT: direct_form,
}


def _tangents(f: Floats, b: Floats, rate_hz: float) -> tuple[Floats, Floats]:
    return np.tan(np.pi * f / rate_hz), np.tan(np.pi * b / rate_hz)


def _matrix(a: Floats, b: Floats, c: Floats, d: Floats) -> Floats:
    return np.stack([np.stack([a, b], axis=-1), np.stack([c, d], axis=-1)], axis=-2)


class Variances(NamedTuple):
    """Variance of each band's output alone, (n, m), and of the whole sum, (n,)."""

    bands: Floats
    total: Floats


def moving_variances(at: Parameters, form: Form, *, rate_hz: float) -> Variances:
    """Exact output variances while parameters move; the state starts stationary.

    Parameters
    ----------
    at : Parameters
        In force at each of n samples; gains multiply the bands' outputs.
    form : Form
        How the bands are realised.
    rate_hz : float
        At which w has unit variance.
    """
    bands = form(at.frequencies_hz, at.bandwidths_hz, rate_hz=rate_hz)
    matrix, drive = _block_diagonal(bands.matrix), _flat(bands.drive)
    covariance = _stationary(StateEquations(*(part[:1] for part in bands)))[0]
    course = np.empty_like(matrix)
    with np.errstate(over="ignore", invalid="ignore"):
        for n in range(len(course)):
            course[n] = covariance
            covariance = matrix[n] @ covariance @ matrix[n].T + np.outer(drive[n], drive[n])
        return _output_variances(course, bands, at)


def held_variances(at: Parameters, form: Form, *, rate_hz: float) -> Variances:
    """What the variances would be if the parameters of each sample had been in force for ever."""
    bands = form(at.frequencies_hz, at.bandwidths_hz, rate_hz=rate_hz)
    return _output_variances(_stationary(bands), bands, at)


def _flat(vectors: Floats) -> Floats:
    """(n, m, 2) as (n, 2m)."""
    return vectors.reshape(len(vectors), -1)


def _block_diagonal(matrices: Floats) -> Floats:
    """(n, m, 2, 2) as (n, 2m, 2m)."""
    count, m = matrices.shape[:2]
    blocks = np.zeros((count, m, 2, m, 2))
    for i in range(m):
        blocks[:, i, :, i, :] = matrices[:, i]
    return blocks.reshape(count, 2 * m, 2 * m)


def _stationary(bands: StateEquations) -> Floats:
    """Covariance (n, 2m, 2m) of all states for parameters that are held.

    Block (i, j) solves X = A_i·X·A_jᵀ + b_i·b_jᵀ.
    """
    a, b = bands.matrix, bands.drive
    count, m = b.shape[:2]
    kronecker = np.einsum("niab,njcd->nijacbd", a, a).reshape(count, m, m, 4, 4)
    noise = np.einsum("nia,njc->nijac", b, b).reshape(count, m, m, 4, 1)
    blocks = np.linalg.solve(np.eye(4) - kronecker, noise).reshape(count, m, m, 2, 2)
    return blocks.transpose(0, 1, 3, 2, 4).reshape(count, 2 * m, 2 * m)


def _output_variances(covariance: Floats, bands: StateEquations, at: Parameters) -> Variances:
    count, m = at.gains.shape
    own = np.einsum("niaib->niab", covariance.reshape(count, m, 2, m, 2))
    readout = at.gains[..., None] * bands.readout
    through = at.gains * bands.through
    of_bands = np.einsum("nia,niab,nib->ni", readout, own, readout) + through**2
    of_sum = np.einsum("na,nab,nb->n", _flat(readout), covariance, _flat(readout))
    return Variances(of_bands, of_sum + (at.noise_gain + through.sum(axis=1)) ** 2)


def excess_db(moving: Variances, held: Variances) -> Variances:
    """Level in dB of what moves against what is held; infinite where it has overflowed."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        ratios = (10 * np.log10(a / b) for a, b in zip(moving, held, strict=True))
        return Variances(*(np.where(np.isnan(ratio), np.inf, ratio) for ratio in ratios))


def simulate(at: Parameters, form: Form, noise: Floats, *, rate_hz: float) -> Floats:
    """The (…, n) outputs for (…, n) noise, by the recursion with at's parameters at each sample."""
    bands = form(at.frequencies_hz, at.bandwidths_hz, rate_hz=rate_hz)
    output = at.noise_gain * noise
    state = np.zeros((*noise.shape[:-1], *at.gains.shape[1:], 2))
    for n in range(noise.shape[-1]):
        w = noise[..., n, None]
        band = np.einsum("ia,...ia->...i", bands.readout[n], state) + bands.through[n] * w
        output[..., n] += band @ at.gains[n]
        state = np.einsum("iab,...ib->...ia", bands.matrix[n], state)
        state += bands.drive[n] * w[..., None]
    return output
