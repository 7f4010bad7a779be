"""Rivals that filter white noise by coefficients read from a table.

All-pole and pole–zero filters are one recursion; layers are bands side by side.
Coefficients blended from one condition to the next may be unstable, line spectral frequencies
never are: so these are blended once, to the nodes of a finer table, whose coefficients are then
read linearly, as the kernel reads its parameters.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import reduce
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from tactileq.benches.rendering.levels import System
from tactileq.modeling import ARModel, InputError, Spectrum, TextureModel
from tactileq.modeling.arrays import Floats
from tactileq.modeling.fitting.autoregressive import fit_filter
from tactileq.modeling.models.grid import Cells, within_grid
from tactileq.modeling.models.line_spectral import (
    line_spectral_frequencies,
    prediction_coefficients,
    reflection_coefficients,
)
from tactileq.modeling.models.parameter_table import ParameterTable, wide_enough
from tactileq.modeling.recordings.spectrum import smooth

PARTS = (2, 4, 8)  # of a cell, among which the fewest are taken that are stable between nodes
_WITHIN = np.array([0.25, 0.5, 0.75])  # of a cell, where stability is checked
SMOOTHING_HZ = (
    6.0  # of the power that sections are fitted to; chosen on drawn surfaces 3001 to 3005
)
MOST_EVALUATIONS = 100
_QUIETEST = 1e-6  # of the loudest line's power, so that its logarithm is finite
OUTERMOST = 0.999  # largest product of a section's poles or zeros


@dataclass(frozen=True, eq=False, kw_only=True)
class PoleZeroFilter:
    """y[n] = x[n] + Σ b_k·x[n−k] − Σ a_k·y[n−k] with x = gain·w.

    Parameters
    ----------
    poles, zeros : (p,), (q,) ndarray
        a₁ … a_p and b₁ … b_q.
    gain : float
        In g per unit noise.
    """

    poles: Floats
    zeros: Floats
    gain: float
    rate_hz: float

    def response(self, frequency_hz: ArrayLike) -> Floats:
        """Magnitude at (n,) frequencies in Hz."""
        from scipy.signal import freqz

        numerator, denominator = (np.append(1.0, part) for part in (self.zeros, self.poles))
        _, response = freqz(numerator, denominator, worN=np.asarray(frequency_hz), fs=self.rate_hz)
        return np.asarray(self.gain * np.abs(response))

    @property
    def system(self) -> System:
        """What a direct form I keeps: the last p outputs, then the last q inputs."""
        p, q = self.poles.size, self.zeros.size
        row = np.concatenate((-self.poles, self.zeros))
        a, b = np.eye(p + q, k=-1), np.zeros(p + q)
        a[0], b[0] = row, self.gain
        if q:
            a[p], b[p] = 0.0, self.gain
        return System(a, b, row, self.gain)

    def times(self, factor: float) -> PoleZeroFilter:
        """Louder by a factor."""
        return replace(self, gain=self.gain * factor)


@dataclass(frozen=True, eq=False, kw_only=True)
class SecondOrderBands:
    """Bands side by side: y = g·w + Σ y_i with y_i = b·(w − w″) − a₁·y_i′ − a₂·y_i″.

    Parameters
    ----------
    noise_gain : float
        g.
    first, second, gains : (m,) ndarray
        a₁, a₂ and b of the bands.
    """

    noise_gain: float
    first: Floats
    second: Floats
    gains: Floats
    rate_hz: float

    def response(self, frequency_hz: ArrayLike) -> Floats:
        """Magnitude at (n,) frequencies in Hz."""
        delay = np.exp(-2j * np.pi * np.asarray(frequency_hz) / self.rate_hz)[:, None]
        bands = self.gains * (1 - delay**2) / (1 + self.first * delay + self.second * delay**2)
        return np.asarray(np.abs(self.noise_gain + bands.sum(axis=1)))

    @property
    def system(self) -> System:
        """What a direct form I keeps: the last two outputs of each band, and two inputs."""
        m = self.gains.size
        a, b = np.zeros((2 * m + 2, 2 * m + 2)), np.zeros(2 * m + 2)
        each = np.arange(m)
        a[2 * each, 2 * each], a[2 * each, 2 * each + 1] = -self.first, -self.second
        a[2 * each, -1], b[2 * each] = -self.gains, self.gains
        a[2 * each + 1, 2 * each] = 1.0
        a[-1, -2] = b[-2] = 1.0
        bands = a[2 * each].sum(axis=0)
        return System(a, b, bands, self.noise_gain + float(self.gains.sum()))

    def times(self, factor: float) -> SecondOrderBands:
        """Louder by a factor."""
        return replace(self, noise_gain=self.noise_gain * factor, gains=self.gains * factor)


def _values_at(
    table: CoefficientTable | BandTable, speed_mm_s: float, force_n: float
) -> tuple[Floats, float]:
    """A table's values (k,) for a hand, and the level that is left below its grid."""
    hand, ramp = within_grid(
        table.speeds_mm_s, table.forces_n, speed_mm_s=speed_mm_s, force_n=force_n
    )
    [at] = Cells(table.speeds_mm_s, table.forces_n, hand=hand).blend(table.values)
    return at, float(ramp[0])


@dataclass(frozen=True, eq=False, kw_only=True)
class CoefficientTable:
    """Filters over a grid of S speeds × F forces, read linearly between its nodes.

    Parameters
    ----------
    speeds_mm_s, forces_n : (S,), (F,) ndarray
        Rising, above 0, two or more each.
    values : (S, F, 1 + p + q) ndarray
        Gain, a₁ … a_p, b₁ … b_q.
    poles : int
        p, 4 … 40.

    Raises
    ------
    InputError
        For a filter that is unstable at a node, or at a quarter, half or three quarters of a cell.
    """

    speeds_mm_s: Floats
    forces_n: Floats
    values: Floats
    poles: int
    rate_hz: float

    def __post_init__(self) -> None:
        share = _WITHIN[:, None, None, None]
        along = np.concatenate((self.values[:1], *_between(self.values, share)))
        across = along.swapaxes(0, 1)
        every = np.concatenate((across[:1], *_between(across, share)))
        largest = np.abs(reflection_coefficients(every[..., 1 : 1 + self.poles])).max()
        if not largest < 1:
            raise InputError(
                f"expected filters of order {self.poles} that are stable between the nodes of "
                "their table, got an unstable one; take another order."
            )

    @property
    def zeros(self) -> int:
        """Number of zeros, q."""
        return int(self.values.shape[-1]) - 1 - self.poles

    @property
    def table(self) -> ParameterTable:
        """As `rivals.h` reads it: padded to 1 + 3m columns."""
        columns = self.values.shape[-1]
        layers = -(-(columns - 1) // 3)
        padding = ((0, 0), (0, 0), (0, 1 + 3 * layers - columns))
        return ParameterTable(
            speeds_mm_s=self.speeds_mm_s,
            forces_n=self.forces_n,
            values=np.pad(self.values, padding),
            signs=np.zeros(layers),
        )

    def filter(self, speed_mm_s: float, force_n: float) -> PoleZeroFilter:
        """What is in use at one speed (mm/s) and force (N); edges as of a `TextureModel`."""
        at, level = _values_at(self, speed_mm_s, force_n)
        return PoleZeroFilter(
            poles=at[1 : 1 + self.poles],
            zeros=at[1 + self.poles :],
            gain=float(at[0]) * level,
            rate_hz=self.rate_hz,
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class BandTable:
    """Bands in direct form over a grid of S speeds × F forces, read linearly between its nodes.

    The coefficients of stable bands are convex: any blend of them is stable.

    Parameters
    ----------
    speeds_mm_s, forces_n : (S,), (F,) ndarray
        Rising, above 0, two or more each.
    values : (S, F, 1 + 3m) ndarray
        Noise gain, then a₁ of all bands, a₂ of all, and b of all (`SecondOrderBands`).
    """

    speeds_mm_s: Floats
    forces_n: Floats
    values: Floats
    rate_hz: float

    @property
    def layers(self) -> int:
        """Number of bands, m."""
        return (int(self.values.shape[-1]) - 1) // 3

    @property
    def table(self) -> ParameterTable:
        """As `rivals.h` reads it."""
        return ParameterTable(
            speeds_mm_s=self.speeds_mm_s,
            forces_n=self.forces_n,
            values=self.values,
            signs=np.zeros(self.layers),
        )

    def filter(self, speed_mm_s: float, force_n: float) -> SecondOrderBands:
        """What is in use at one speed (mm/s) and force (N); edges as of a `TextureModel`."""
        at, level = _values_at(self, speed_mm_s, force_n)
        first, second, gains = at[1:].reshape(3, -1)
        return SecondOrderBands(
            noise_gain=float(at[0]) * level,
            first=first,
            second=second,
            gains=gains * level,
            rate_hz=self.rate_hz,
        )


def tabled_bands(model: TextureModel) -> BandTable:
    """A layered model's coefficients at the nodes of its table, and half-way between them."""
    speeds, forces = (
        _finer(axis, PARTS[0]) for axis in (model.table.speeds_mm_s, model.table.forces_n)
    )
    hand = [axis.ravel() for axis in np.meshgrid(speeds, forces, indexing="ij")]
    noise_gain, frequency, bandwidth, gain = model.parameters(*hand)
    k = np.tan(np.pi * bandwidth / model.rate_hz)
    parts = (
        noise_gain[:, None],
        -2 * np.cos(2 * np.pi * frequency / model.rate_hz) / (1 + k),
        (1 - k) / (1 + k),
        gain * k / (1 + k),
    )
    values = np.concatenate(parts, axis=1).reshape(speeds.size, forces.size, -1)
    return BandTable(speeds_mm_s=speeds, forces_n=forces, values=values, rate_hz=model.rate_hz)


def _between(nodes: Floats, share: Floats) -> list[Floats]:
    """Within each cell along the first axis, at each share."""
    return [
        (low * (1 - share) + high * share).reshape(-1, *low.shape) for low, high in pairwise(nodes)
    ]


def tabled_predictor(model: ARModel) -> CoefficientTable:
    """An autoregressive model's coefficients."""
    return tabled(
        (model.speeds_mm_s, model.forces_n),
        np.concatenate((model.gains[..., None], model.line_spectral_frequencies), axis=-1),
        poles=model.order,
        rate_hz=model.rate_hz,
    )


def tabled(
    axes: tuple[Floats, Floats], values: Floats, *, poles: int, rate_hz: float
) -> CoefficientTable:
    """The table of filters given by gain and line spectral frequencies, which are blended linearly.

    Parameters
    ----------
    axes : (S,), (F,) ndarray
        Speeds and forces.
    values : (S, F, 1 + p + q) ndarray
        Gain, line spectral frequencies of the denominator, and of the numerator.

    Raises
    ------
    InputError
        Where eight nodes for one are too few for stable filters between them.
    """
    speeds, values = wide_enough(axes[0], values, along=0)
    forces, values = wide_enough(axes[1], values, along=1)
    for parts in PARTS:
        finer = _finer(_finer(values, parts).swapaxes(0, 1), parts).swapaxes(0, 1)
        each = [finer[..., 1 : 1 + poles], finer[..., 1 + poles :]]
        coefficients = [prediction_coefficients(part) for part in each if part.shape[-1]]
        try:
            return CoefficientTable(
                speeds_mm_s=_finer(speeds, parts),
                forces_n=_finer(forces, parts),
                values=np.concatenate((finer[..., :1], *coefficients), axis=-1),
                poles=poles,
                rate_hz=rate_hz,
            )
        except InputError as error:
            unstable = error
    raise unstable


def _finer(nodes: Floats, parts: int) -> Floats:
    """Along the first axis so many parts of each interval."""
    count = len(nodes)
    at = np.linspace(0, count - 1, parts * (count - 1) + 1)
    low = np.minimum(at.astype(int), count - 2)
    share = (at - low).reshape(-1, *(1,) * (nodes.ndim - 1))
    return np.asarray(nodes[low] * (1 - share) + nodes[low + 1] * share)


def fit_sections(measured: Spectrum, *, order: int) -> Floats:
    """A filter of `order` poles and zeros for a spectrum, by SciPy's `least_squares`.

    A cascade of sections of second order, from the all-pole filter of that order on: the RMS
    difference of the logarithms from the slightly smoothed power, which is what the chart's
    distance is, over all lines alike.

    Parameters
    ----------
    measured : Spectrum
        Not silent.
    order : int
        Even.

    Returns
    -------
    (1 + 2·order,) ndarray
        Gain, line spectral frequencies of the denominator, and of the numerator.
    """
    from scipy.optimize import least_squares

    start = _sections_of(fit_filter([measured], order=order).coefficients)
    wanted, angle = _smoothed_log_power(measured)
    both = np.concatenate((start, np.zeros_like(start)))

    def residual(free: Floats) -> Floats:
        return _log_power(free, angle)[0] - wanted

    def jacobian(free: Floats) -> Floats:
        return _log_power(free, angle)[1]

    level = -residual(np.append(both, 0.0)).mean()
    found = least_squares(residual, np.append(both, level), jac=jacobian, max_nfev=MOST_EVALUATIONS)
    sections = _coefficients(found.x[:-1])[0]
    halves = sections[: order // 2], sections[order // 2 :]
    return np.concatenate(
        (
            [np.exp(found.x[-1] / 2)],
            *(line_spectral_frequencies(reduce(np.convolve, half)[1:]) for half in halves),
        )
    )


def _smoothed_log_power(measured: Spectrum) -> tuple[Floats, Floats]:
    """At some hundreds of angles (n,), in radians per sample."""
    step_hz = measured.rate_hz / measured.n_samples
    power = smooth(measured.without_leakage**2 * np.pi / 4, SMOOTHING_HZ, step_hz=step_hz)
    every = slice(None, None, max(1, round(SMOOTHING_HZ / 4 / step_hz)))
    audible = np.maximum(power, _QUIETEST * power.max())[every]
    angle = 2 * np.pi * measured.frequency_hz[every] / measured.rate_hz
    return np.log(audible), angle


def _sections_of(coefficients: Floats) -> Floats:
    """Free values (2k,) of k sections, from a polynomial's roots within the unit circle."""
    roots = np.roots(np.append(1.0, coefficients))
    pairs = roots[roots.imag > 0]
    alone = np.sort(roots[roots.imag == 0].real).reshape(-1, 2)
    first = np.concatenate((-2 * pairs.real, -alone.sum(axis=1)))
    second = np.concatenate((np.abs(pairs) ** 2, alone.prod(axis=1)))
    inside = [np.clip(x / OUTERMOST, -0.999, 0.999) for x in (second, first / (1 + second))]
    free: Floats = np.arctanh(np.stack(inside, axis=1)).ravel()
    return free


def _coefficients(free: Floats) -> tuple[Floats, Floats, Floats]:
    """Sections (k, 3) = 1, c₁, c₂ of free values (2k,), and the slopes of c₁ and c₂, (k,)."""
    second, first = OUTERMOST * np.tanh(free.reshape(-1, 2)).T
    slope = OUTERMOST - np.stack((second, first)) ** 2 / OUTERMOST
    return (
        np.stack((np.ones_like(first), first * (1 + second), second), axis=1),
        slope[1] * (1 + second),
        slope[0],
    )


def _log_power(free: Floats, angle: Floats) -> tuple[Floats, Floats]:
    """Log power (n,) of sections of poles, then of zeros, and of a gain; its Jacobian (n, 4k+1).

    |1 + c₁z⁻¹ + c₂z⁻²|² = 1 + c₁² + c₂² + 2c₁(1 + c₂)·cos ω + 2c₂·cos 2ω.
    """
    sections, slope_first, slope_second = _coefficients(free[:-1])
    c1, c2 = sections[:, 1], sections[:, 2]
    once, twice = np.cos(angle)[:, None], np.cos(2 * angle)[:, None]
    size = 1 + c1**2 + c2**2 + 2 * c1 * (1 + c2) * once + 2 * c2 * twice
    size = np.maximum(size, np.finfo(np.float64).tiny)
    sign = np.repeat([-1.0, 1.0], len(sections) // 2)
    by_first = sign * (2 * c1 + 2 * (1 + c2) * once) / size
    by_second = sign * (2 * c2 + 2 * c1 * once + 2 * twice) / size
    # c₁ = f·(1 + c₂), so c₂ moves it as well.
    ratio = c1 / (1 + c2)
    jacobian = np.stack(((by_second + by_first * ratio) * slope_second, by_first * slope_first), 2)
    columns = jacobian.reshape(len(angle), -1)
    return free[-1] + np.log(size) @ sign, np.column_stack((columns, np.ones(len(angle))))
