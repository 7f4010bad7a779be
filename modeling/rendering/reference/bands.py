"""The bands of a layered model on a stream, in Python."""

from __future__ import annotations

from typing import Any

import numpy as np

from tactileq.modeling.equalizer.bands import band_coefficients, clamp_bands
from tactileq.modeling.hand import Hand
from tactileq.modeling.rendering.noise import white_noise
from tactileq.modeling.rendering.plan import LayeredModel, RenderPlan
from tactileq.modeling.rendering.reference.hand import GainRamps


class BandFilter:
    """A PEQ of m bands (docs/method/equalizer.md#recursion) at the model's rate.

    Parameters are those for the extrapolated hand: those for the hand as it is read would be
    late. Frequencies and bandwidths are set for the middle of the time to the next update; gains
    ramp linearly to those for its last sample, and at most by the plan's slews. The first
    update sets all at once.
    """

    def __init__(self, model: LayeredModel, plan: RenderPlan) -> None:
        self.clamped = 0
        self._table, self._plan = model.table, plan.own
        self.axes = (self._table.speeds_mm_s, self._table.forces_n)
        self._gains = GainRamps(plan.own, self._table.largest_gains)
        self._bands = [(0.0,) * 5] * self._table.n_layers
        self._state = [(0.0, 0.0)] * self._table.n_layers

    def settings(self, amid: Hand, end: Hand) -> list[Any]:
        """All gains that are wanted, and the coefficients of every band, at each update."""
        middle, last = self._table.at(*amid), self._table.at(*end)
        frequency, bandwidth, clamped = clamp_bands(
            middle.frequencies_hz, middle.bandwidths_hz, rate_hz=self._plan.rate_hz
        )
        self.clamped += clamped
        c = band_coefficients(frequency, bandwidth, rate_hz=self._plan.rate_hz)
        gains = np.concatenate([last.noise_gain[:, None], last.gains], axis=1)
        taps = np.concatenate([np.ones((gains.shape[0], 1)), c.tap], axis=1)
        table = np.stack([c.p, c.q, c.r, c.b1, c.b2], axis=-1)
        bands = [[tuple(band) for band in update] for update in table.tolist()]
        return list(zip(gains.tolist(), taps.tolist(), bands, strict=True))

    def update(self, setting: Any) -> None:
        """Put coefficients into force, and start the ramp of every gain to its target."""
        wanted, taps, self._bands = setting
        self._gains.update(wanted, taps)

    def inputs(self, key: np.uint64, start: int, *, count: int) -> tuple[list[float], ...]:
        """The next noise, for the bands and the noise branch."""
        return (white_noise(key, start, count).tolist(),)

    def filter(self, *inputs: list[float]) -> list[float]:
        """The recursion of docs/method/equalizer.md#recursion with the parameters in force."""
        [noise] = inputs
        floor_gains = self._gains.course(0, len(noise))
        output = [gain * w for gain, w in zip(floor_gains, noise, strict=True)]
        for layer, (p, q, r, b1, b2) in enumerate(self._bands):
            s1, s2 = self._state[layer]
            course = self._gains.course(1 + layer, len(noise))
            for n, w in enumerate(noise):
                turned = (s1 + b1 * w) + (p * s1 - q * s2)
                s2 = (s2 + b2 * w) + (r * s2 + q * s1)
                output[n] += course[n] * (s1 + turned)
                s1 = turned
            self._state[layer] = (s1, s2)
        return output
