"""Where a texture needs a further layer: excess power along laws over the grid.

A layer's frequency changes with speed, often as a power of it (1 for a spatial wavelength, 0 for a
resonance). What the spectra of all conditions have above the response so far is summed along such
laws (a Hough transform), whatever is missing or false in single conditions.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tactileq.modeling.arrays import Floats, Integers
from tactileq.modeling.equalizer.bands import HIGHEST_FREQUENCY_SHARE
from tactileq.modeling.estimation.coherent import Observed, response
from tactileq.modeling.estimation.likelihood import FORGIVEN_MISFIT, LOWEST_FITTED_HZ, Power, split
from tactileq.modeling.fitting.texture_grid import TextureGrid

# What doubling does: see `layer_search`.
CELL = 0.02  # of log frequency; doubled: +4 %, worst +45 %, three layers fewer
WIDTHS = (1, 2, 4, 8, 16, 32, 64)  # of boxes, in cells
# From a square root outwards: of equal supports the first, so the less extreme, wins.
EXPONENTS = np.array(sorted(np.linspace(-0.3, 1.3, 17), key=lambda p: abs(p - 0.5)))
# No single condition counts for more than this in log likelihood. Doubled: −1 %, worst +7 %.
CLEAR_EVIDENCE = 40.0
CANDIDATES = 3
RAISED = (1.3, 1e4)  # power ratio at which a new layer starts


class MissingLayer(NamedTuple):
    """A layer that might be missing: frequencies, widths (Hz) and power ratio in each record."""

    frequencies_hz: Floats
    bandwidths_hz: Floats
    raised: Floats
    evidence: float


def candidates(grid: TextureGrid, theta: Floats, signs: Floats | None) -> list[MissingLayer]:
    """Laws along which most power is missing, by falling evidence.

    Parameters
    ----------
    grid : TextureGrid
        K records.
    theta : (K, p) ndarray
        The layers so far at the records, relative to the grid's scale.
    signs : (m,) ndarray, optional
        Without them layers are independent.
    """
    ratio, lines = _excess(grid.powers, theta, signs, scale=grid.scale)
    cells = ratio.shape[1] - 1
    shifts = np.rint(EXPONENTS[:, None] * grid.record_places[:, 0] / CELL).astype(np.intp)
    reach = int(np.abs(shifts).max(initial=0))
    place = np.arange(-reach, cells + reach)[None, :] + shifts[:, :, None]  # (laws, C, places)
    found = []
    for width in WIDTHS:
        if width > cells // 2:
            break
        gain, raised = _boxes(ratio, lines, width)
        support = _along(gain, shifts, reach)
        for _ in range(CANDIDATES):
            law, middle = np.unravel_index(int(np.argmax(support)), support.shape)
            found.append((float(support[law, middle]), width, place[law, :, middle], raised))
            near = slice(max(0, int(middle) - 2 * width), int(middle) + 2 * width + 1)
            support[:, near] = 0.0
    return _distinct(found, rate_hz=grid.rate_hz)


def _along(gain: Floats, shifts: Integers, reach: int) -> Floats:
    """Sums of each condition's gain (C, cells) at its shifts (laws, C), (laws, places)."""
    cells = gain.shape[1]
    padded = np.zeros((len(gain), cells + 4 * reach))
    padded[:, 2 * reach : 2 * reach + cells] = gain
    support = np.zeros((len(shifts), cells + 2 * reach))
    for law, of_law in zip(support, shifts + reach, strict=True):
        for row, start in zip(padded, of_law.tolist(), strict=True):
            law += row[start : start + law.size]
    return support


def _distinct(
    found: list[tuple[float, int, Integers, Floats]], *, rate_hz: float
) -> list[MissingLayer]:
    chosen: list[MissingLayer] = []
    taken: list[tuple[Integers, int]] = []
    for evidence, width, place, raised in sorted(found, key=lambda f: -f[0]):
        if any(np.median(np.abs(place - p)) < 0.75 * max(width, w) for p, w in taken):
            continue
        taken.append((place, width))
        inside = np.clip(place, 0, raised.shape[1] - 1)
        frequency = LOWEST_FITTED_HZ * np.exp((place + 0.5) * CELL)
        frequency = np.clip(frequency, LOWEST_FITTED_HZ, HIGHEST_FREQUENCY_SHARE * rate_hz)
        height = np.where(place == inside, raised[np.arange(len(place)), inside], 1.0)
        # A Lorentzian of width B is detected best by a box of about 1.4 B.
        bandwidth = 0.7 * width * CELL * frequency
        chosen.append(MissingLayer(frequency, bandwidth, np.clip(height, *RAISED), evidence))
        if len(chosen) == CANDIDATES:
            break
    return chosen


def _excess(
    powers: Sequence[Power | None], theta: Floats, signs: Floats | None, *, scale: float
) -> tuple[Floats, Floats]:
    """Cumulated power ratio and number of lines, (C, cells + 1), at the borders of cells."""
    highest = max(p.frequency_hz[-1] for p in powers if p is not None)
    borders = LOWEST_FITTED_HZ * np.exp(np.arange(0.0, np.log(highest / LOWEST_FITTED_HZ), CELL))
    ratio, lines = np.zeros((2, len(powers), borders.size))
    for row, power in enumerate(powers):
        if power is None:
            continue
        expected = expected_on_lines(power, theta[row], signs) * (scale / power.scale) ** 2
        edge = np.append(power.frequency_hz, power.frequency_hz[-1] + power.step_hz)
        edge = edge - power.step_hz / 2
        weight = power.weight * power.records
        for out, values in ((ratio, weight * power.power / expected), (lines, weight)):
            out[row] = np.interp(borders, edge, np.concatenate(([0.0], np.cumsum(values))))
    return ratio, lines


def expected_on_lines(power: Power, theta: Floats, signs: Floats | None) -> Floats:
    """Expected power at every line of one periodogram."""
    tangent = np.tan(np.pi / power.rate_hz * power.frequency_hz)[None]
    one = np.ones(tangent.shape)
    lines = Observed(one, one, one, tangent, 1 / tangent, np.zeros(1), power.rate_hz)
    expected: Floats = response(theta[None], signs, lines).power[0]
    return expected


def _boxes(ratio: Floats, lines: Floats, width: int) -> tuple[Floats, Floats]:
    """Likelihood gain and power ratio (C, cells) of raised boxes around each cell."""
    cells = ratio.shape[1] - 1
    low = np.clip(np.arange(cells) - (width - 1) // 2, 0, cells)
    high = np.clip(low + width, 0, cells)
    lines_within = lines[:, high] - lines[:, low]
    raised = (ratio[:, high] - ratio[:, low]) / np.maximum(lines_within, 1e-9)
    raised = np.where(lines_within > 1e-6, np.maximum(raised, 1.0), 1.0)
    weight = lines_within / (1 + lines_within * FORGIVEN_MISFIT**2)
    gain = np.minimum(weight * (raised - 1 - np.log(raised)), CLEAR_EVIDENCE)
    return gain, raised


def inserted_independently(theta: Floats, candidate: MissingLayer, *, rate_hz: float) -> Floats:
    """Parameters (K, p + 3) of independent layers with the candidate as the last one."""
    m = (theta.shape[1] - 1) // 3
    noise, frequency, bandwidth, gain = split(theta, m)
    u = _offsets_at(frequency, bandwidth, candidate.frequencies_hz, rate_hz=rate_hz)
    power = np.exp(2 * noise[:, 0]) + (np.exp(2 * gain) / (1 + u * u)).sum(axis=1)
    amplitude = 0.5 * np.log(power * np.maximum(candidate.raised - 1, 0.3) / 0.7)
    return _appended(theta, candidate, amplitude)


def _appended(theta: Floats, candidate: MissingLayer, log_amplitude: Floats) -> Floats:
    m = (theta.shape[1] - 1) // 3
    noise, frequency, bandwidth, gain = split(theta, m)
    columns = (
        noise,
        np.column_stack((frequency, np.log(candidate.frequencies_hz))),
        np.column_stack((bandwidth, np.log(candidate.bandwidths_hz))),
        np.column_stack((gain, log_amplitude)),
    )
    return np.concatenate(columns, axis=1)


def _offsets_at(frequency: Floats, bandwidth: Floats, at_hz: Floats, *, rate_hz: float) -> Floats:
    """u (C, m) of each layer at one frequency per condition; see `coherent.response`."""
    per_hz = np.pi / rate_hz
    g, k = np.tan(per_hz * np.exp(frequency)), np.tan(per_hz * np.exp(bandwidth))
    t = np.tan(per_hz * at_hz)[:, None]
    u: Floats = (g * g / t - t) / (k * (1 + g * g))
    return u


def inserted(
    theta: Floats, signs: Floats, candidate: MissingLayer, *, sign: float, rate_hz: float
) -> tuple[Floats, Floats]:
    """Parameters (K, p + 3) and signs (m + 1,) with the candidate as the last layer.

    Its amplitude is such that the response at its frequency reaches the raised power.
    """
    noise, frequency, bandwidth, gain = split(theta, signs.size)
    u = _offsets_at(frequency, bandwidth, candidate.frequencies_hz, rate_hz=rate_hz)
    parts = signs * np.exp(gain) / (1 + u * u)
    in_phase, quadrature = np.exp(noise[:, 0]) + parts.sum(axis=1), (parts * u).sum(axis=1)
    power = candidate.raised * (in_phase**2 + quadrature**2)
    amplitude = np.sqrt(np.maximum(power - quadrature**2, 0.0)) - sign * in_phase
    amplitude = np.maximum(amplitude, 0.1 * np.sqrt(power))
    return _appended(theta, candidate, np.log(amplitude)), np.append(signs, sign)
