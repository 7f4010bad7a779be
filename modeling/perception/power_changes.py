"""How dropping layers changes the power of the response, against a threshold.

docs/method/perception.md#change-of-power
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tactileq.modeling.arrays import Bools, Floats
from tactileq.modeling.equalizer.bands import clamp_bands, rational_tan
from tactileq.modeling.models.parameter_table import Parameters
from tactileq.modeling.perception.thresholds import Threshold

# Edges of the cells of the quadrature: over the whole range, and around each layer at
# sinh(u) half-widths from its centre, so that its top and its skirts are both resolved.
CELLS = 48
LOWEST_EDGE_HZ = 1.0
AROUND_A_LAYER = np.sinh(np.arange(-9.0, 10.0))
GAUSS_NODES, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(5)  # of a cell of half-width 1
MOSTLY = 0.5


class PowerChange(NamedTuple):
    """The change of power at n places, (n,) each.

    Parameters
    ----------
    amplitude_g : ndarray
        Peak, of the sinusoid of equal power.
    known, held : ndarray
        Power against the threshold: of frequencies where it is known, and of those above its
        table against its last level, which is a lower bound.
    unknown_share, held_share : ndarray
        Of the power: at frequencies where nothing is known of the threshold, and above its table.
    """

    amplitude_g: Floats
    known: Floats
    held: Floats
    unknown_share: Floats
    held_share: Floats

    @property
    def unknown(self) -> Bools:
        """Where most of the change is at frequencies where nothing is known of the threshold."""
        return self.unknown_share > MOSTLY

    def distances_db(self, *, margin_db: float = 0.0) -> tuple[Floats, Bools]:
        """Distance to the threshold in dB, NaN where it is not known, and where it is assumed.

        At or above the threshold is a change that is so by its known frequencies alone; below it
        one that is so with those above the table, too. Between the two nothing is known, nor where
        most of the change is at frequencies without a threshold.

        Parameters
        ----------
        margin_db : float
            ≥ 0; how far below the threshold a change has to be.
        """
        with np.errstate(divide="ignore"):
            lowest, highest = (10 * np.log10(p) for p in (self.known, self.known + self.held))
        above = lowest + margin_db >= 0
        below = ~self.unknown & (highest + margin_db < 0)
        distances = np.where(above, lowest, np.where(below, highest, np.nan))
        return distances, below & (self.held_share > MOSTLY)


class PowerChanges:
    """The response at n places, and by how much other gains would change its power.

    Parameters
    ----------
    at : Parameters
        Of the full model at n places, in g.
    rate_hz : float
        Of the model.
    hold_above : bool
        Whether its last level is held above its table, as a lower bound.
    band_hz : (float, float), optional
        What is played; the rest of the change does not count.
    """

    def __init__(
        self,
        at: Parameters,
        *,
        rate_hz: float,
        threshold: Threshold,
        hold_above: bool,
        band_hz: tuple[float, float] | None = None,
    ) -> None:
        self.rate_hz = rate_hz
        # In units of the largest gain no power overflows.
        largest = max(at.noise_gain.max(initial=0.0), np.abs(at.gains).max(initial=0.0))
        self._unit = float(largest) or 1.0
        self._noise, self._gains = at.noise_gain / self._unit, at.gains / self._unit
        centres, widths, _ = clamp_bands(at.frequencies_hz, at.bandwidths_hz, rate_hz=rate_hz)
        low, high = band_hz or (0.0, np.inf)
        ends = np.clip([*threshold.valid_range_hz, low, high], 0.0, rate_hz / 2)
        frequency, weights = _quadrature(centres, widths, rate_hz=rate_hz, ends=ends)
        self._bands = _bands(frequency, centres, widths, rate_hz=rate_hz)
        weights *= (2 / rate_hz) * ((frequency >= low) & (frequency <= high))
        self._measures = _measures(frequency, weights, threshold, hold_above=hold_above)

    def of(self, gains: Floats) -> PowerChange:
        """The change that other gains (n, m) make; 0 for a layer that is dropped."""
        other = gains / self._unit
        # |a|² − |b|² = Re (a − b)(a + b)*: exact where b is nearly a.
        difference = _summed(self._gains - other, self._bands)
        total = 2 * self._noise[:, None] + _summed(self._gains + other, self._bands)
        change = np.abs(difference.real * total.real + difference.imag * total.imag)
        # Peak² of the sinusoid of equal power: twice the mean square.
        power, known, held, unknown, above = 2 * np.einsum("nq,knq->kn", change, self._measures)
        share = np.maximum(power, np.finfo(np.float64).tiny)
        return PowerChange(
            amplitude_g=np.sqrt(power) * self._unit,
            known=self._against(known),
            held=self._against(held),
            unknown_share=unknown / share,
            held_share=above / share,
        )

    def _against(self, power: Floats) -> Floats:
        with np.errstate(over="ignore"):
            against: Floats = (np.sqrt(power) * self._unit) ** 2
        return against


def _quadrature(
    centres_hz: Floats, widths_hz: Floats, *, rate_hz: float, ends: Floats
) -> tuple[Floats, Floats]:
    """Frequencies and weights (n, q) of a Gauss rule in cells whose edges suit all layers."""
    # In t = tan(πf/rate), a band is at x half-widths where t² + x·k(1 + g²)·t = g².
    g, k = (rational_tan(np.pi / rate_hz * x)[..., None] for x in (centres_hz, widths_hz))
    half = AROUND_A_LAYER * k * (1 + g * g) / 2
    root = np.sqrt(half**2 + g * g)
    t = np.where(half > 0, g * g / (root + np.abs(half)), root - half)
    around = np.arctan(t) * rate_hz / np.pi
    whole = np.geomspace(LOWEST_EDGE_HZ, rate_hz / 2, CELLS)
    fixed = np.concatenate(([0.0], whole, ends))
    n = len(centres_hz)
    every = (np.broadcast_to(fixed, (n, fixed.size)), around.reshape(n, -1))
    edges = np.sort(np.minimum(np.concatenate(every, axis=1), rate_hz / 2), axis=1)
    middle, radius = (edges[:, 1:] + edges[:, :-1]) / 2, (edges[:, 1:] - edges[:, :-1]) / 2
    nodes = middle[..., None] + radius[..., None] * GAUSS_NODES
    weights = radius[..., None] * GAUSS_WEIGHTS
    return nodes.reshape(n, -1), weights.reshape(n, -1)


def _bands(
    frequency_hz: Floats, centres_hz: Floats, widths_hz: Floats, *, rate_hz: float
) -> NDArray[np.complex128]:
    """H_i at the frequencies (n, q) of each of n places, (n, m, q): `band_response` of many."""
    angle = np.pi / rate_hz * frequency_hz[:, None, :]
    sine, cosine = np.sin(angle), np.cos(angle)
    g, k = (rational_tan(np.pi / rate_hz * x)[..., None] for x in (centres_hz, widths_hz))
    through = k * (1 + g * g) * (sine * cosine)
    against = (g * g) * cosine**2 - sine**2
    scale = through / np.maximum(through**2 + against**2, np.finfo(np.float64).tiny)
    bands: NDArray[np.complex128] = through * scale + 1j * (against * scale)
    return bands


def _measures(
    frequency_hz: Floats, weights: Floats, threshold: Threshold, *, hold_above: bool
) -> Floats:
    """What a change is multiplied by, (5, n, q): all, known, held, unknown, above the table."""
    at = threshold.at(frequency_hz)
    known = np.isfinite(at)
    above = frequency_hz > threshold.valid_range_hz[1]
    held = above if hold_above else np.zeros_like(above)
    with np.errstate(invalid="ignore"):
        against = np.where(known, weights / at**2, 0.0)
    last = float(threshold.acceleration_g[-1])
    return np.stack(
        (weights, against, held * weights / last**2, ~(known | held) * weights, held * weights)
    )


def _summed(gains: Floats, bands: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Σ G_i H_i, (n, q)."""
    summed: NDArray[np.complex128] = (gains[:, None, :] @ bands)[:, 0, :]
    return summed
