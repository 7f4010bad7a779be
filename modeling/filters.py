"""Rendering in Python: what `kernel.h` does, where there is no compiler; and of all-pole models.

The filters pass white noise through orthogonal steps, so that their states keep unit variance (or
lose some) at every sample, whatever the parameters do from one update to the next. Plain Python
floats are IEEE doubles, and all is computed in the order of `kernel.h`: the bits are the same.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from modeling.limiter import Compensator, Limiter
from modeling.motion import Foresight, GainCourses
from modeling.noise import white_noise
from modeling.peq import Floats, band_coefficients, clamp_bands
from modeling.plan import LayeredModel, RenderCounters, RenderPlan, noise_lowpass


class StreamFilter(Protocol):
    """A filter whose state carries on from block to block.

    A setting holds its coefficients from one parameter update to the next.
    """

    clamped: int

    def settings(self, speed_mm_s: Floats, force_n: Floats) -> list[Any]:
        """One setting for each of (n,) speeds and forces."""

    def update(self, setting: Any) -> None:
        """Put a setting into force."""

    def inputs(self, key: np.uint64, start: int, *, count: int) -> tuple[list[float], ...]:
        """Its driving noise from position `start` on: one or more lists of `count` samples."""

    def filter(self, *inputs: list[float]) -> list[float]:
        """The output for the next samples of its inputs."""


class PythonEngine:
    """Renders with any `StreamFilter`: updates, filters, compensates and limits."""

    def __init__(self, stream_filter: StreamFilter, plan: RenderPlan, *, key: np.uint64) -> None:
        self._filter, self._plan, self._key = stream_filter, plan, key
        self._position = 0
        self._lift_offs = 0
        self._limiter = Limiter(plan)
        self._compensator = Compensator(plan)

    @property
    def counters(self) -> RenderCounters:
        """What had to be corrected so far."""
        return RenderCounters(self._lift_offs, self._filter.clamped, *self._limiter.touched)

    def render(self, speed_mm_s: Floats, force_n: Floats) -> Floats:
        """The next samples for (n,) speeds and forces."""
        count, period = speed_mm_s.size, self._plan.update_samples
        finite = np.isfinite(speed_mm_s) & np.isfinite(force_n)
        self._lift_offs += count - int(np.count_nonzero(finite))
        inputs = self._filter.inputs(self._key, self._position, count=count)
        starts = list(range(-self._position % period, count, period))
        bounds = [*starts, count]
        output = self._filter.filter(*(part[: bounds[0]] for part in inputs))
        settings = self._filter.settings(speed_mm_s[starts], force_n[starts])
        for start, stop, setting in zip(starts, bounds[1:], settings, strict=True):
            self._filter.update(setting)
            output += self._filter.filter(*(part[start:stop] for part in inputs))
        self._position += count
        return np.array(self._limiter.limit(self._compensator.filter(output)), dtype=np.float64)


class BandFilter:
    """A PEQ of m bands (METHOD 3) at the model's rate or above.

    Parameters are those for the hand as it will be: those for the hand as it is read would be
    late. Frequencies and bandwidths are set for the middle of the time to the next update; gains
    move in a straight line to those for its last sample, and at most by the plan's slews. The first
    update sets all at once.
    """

    def __init__(self, model: LayeredModel, plan: RenderPlan) -> None:
        self.clamped = 0
        self._table, self._plan = model.table, plan
        self._scale = np.sqrt(plan.rate_hz / model.rate_hz)
        self._lowpass = noise_lowpass(model.rate_hz, plan.rate_hz)
        self._foresight = Foresight(plan)
        self._gains = GainCourses(plan, self._table.largest_gains)
        self._bands = [(0.0,) * 5] * self._table.n_layers
        self._state = [(0.0, 0.0)] * self._table.n_layers

    def settings(self, speed_mm_s: Floats, force_n: Floats) -> list[Any]:
        """All gains that are wanted, and the coefficients of every band, at each update."""
        amid, end = (self._table.at(*hand) for hand in self._foresight(speed_mm_s, force_n))
        frequency, bandwidth, clamped = clamp_bands(
            amid.frequencies_hz, amid.bandwidths_hz, rate_hz=self._plan.rate_hz
        )
        self.clamped += clamped
        c = band_coefficients(frequency, bandwidth, rate_hz=self._plan.rate_hz)
        gains = np.concatenate([end.noise_gain[:, None], end.gains], axis=1)
        taps = np.concatenate([np.ones((gains.shape[0], 1)), c.tap], axis=1)
        table = np.stack([c.p, c.q, c.r, c.b1, c.b2], axis=-1)
        bands = [[tuple(band) for band in update] for update in table.tolist()]
        return list(zip(gains.tolist(), taps.tolist(), bands, strict=True))

    def update(self, setting: Any) -> None:
        """Put coefficients into force, and start every gain on its way to what is wanted."""
        wanted, taps, self._bands = setting
        self._gains.update(wanted, taps)

    def inputs(self, key: np.uint64, start: int, *, count: int) -> tuple[list[float], ...]:
        """The next noise for the bands and, low-passed without delay, for the noise branch.

        The noise is known ahead, so the low-pass has zero phase and the sum stays coherent.
        """
        half = self._lowpass.size // 2
        wide = self._scale * white_noise(key, start - half, count + 2 * half)
        # Tap by tap: the order of additions, and so the result, is the same for any block size.
        floor_noise = np.zeros(count)
        for tap, weight in enumerate(self._lowpass):
            floor_noise += weight * wide[tap : tap + count]
        return wide[half : half + count].tolist(), floor_noise.tolist()

    def filter(self, *inputs: list[float]) -> list[float]:
        """The recursion of METHOD 3 with the parameters in force."""
        noise, floor_noise = inputs
        floor_gains = self._gains.course(0, len(noise))
        output = [gain * w for gain, w in zip(floor_gains, floor_noise, strict=True)]
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
