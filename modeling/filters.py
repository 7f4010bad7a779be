"""Rendering in Python: what `kernel.h` does, where there is no compiler, and the all-pole rival.

Both filters pass white noise through orthogonal steps, so that their states keep unit variance (or
lose some) at every sample, whatever the parameters do from one update to the next. Plain Python
floats are IEEE doubles, and all is computed in the order of `kernel.h`: the bits are the same.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from modeling.autoregressive import ARModel
from modeling.errors import InputError
from modeling.line_spectral import prediction_coefficients, reflection_coefficients
from modeling.noise import white_noise
from modeling.peq import Floats, band_coefficients, clamp_bands
from modeling.plan import LayeredModel, RenderCounters, RenderPlan, noise_lowpass

# Rounding must not put a pole on the unit circle.
_HIGHEST_REFLECTION = 1 - 1e-12


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


class Foresight:
    """Where a hand will be, if it goes on as it did lately.

    The change from reading to reading is smoothed, since the noise of readings goes on no more than
    a step does: a change beyond what a hand can do, or what has come to rest.
    """

    def __init__(self, plan: RenderPlan) -> None:
        self._furthest, self._share = plan.hand_changes, plan.slope_share
        self._to_end = (plan.update_samples - 1) / plan.update_samples
        self._last: list[float] = []
        self._slopes = [0.0, 0.0]

    def __call__(self, speed_mm_s: Floats, force_n: Floats) -> tuple[Floats, Floats]:
        """The hand (2, n) amid the time to the next readings, and just before them."""
        hand = np.stack([speed_mm_s, force_n])
        slopes = np.array([self._slopes_at(now) for now in hand.T.tolist()]).reshape(-1, 2).T
        with np.errstate(over="ignore"):
            return hand + slopes * (self._to_end / 2), hand + slopes * self._to_end

    def _slopes_at(self, now: list[float]) -> list[float]:
        """The smoothed changes per update of speed and force with the next reading."""
        if self._last:
            readings = zip(self._slopes, self._last, now, self._furthest, strict=True)
            self._slopes = [self._slope(*reading) for reading in readings]
        self._last = now
        return self._slopes

    def _slope(self, slope: float, last: float, now: float, furthest: float) -> float:
        change = now - last
        goes_on = -furthest <= change <= furthest and now != 0
        return slope + self._share * (change - slope) if goes_on else 0.0


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
        self._slews = plan.slews(self._table).tolist()
        self._foresight = Foresight(plan)
        self._gains: list[float] = []
        self._courses = [(0.0, 0.0)] * (1 + self._table.n_layers)
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
        """Start every gain on its way to what is wanted now, as far as one update may go."""
        wanted, taps, self._bands = setting
        now = self._gains or wanted
        self._gains = [_towards(*move) for move in zip(now, wanted, self._slews, strict=True)]
        per_sample = 1 / self._plan.update_samples
        self._courses = [
            (start * tap, (end - start) * per_sample * tap)
            for start, end, tap in zip(now, self._gains, taps, strict=True)
        ]

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
        output = [
            gain * w for gain, w in zip(self._course(0, len(noise)), floor_noise, strict=True)
        ]
        for layer, (p, q, r, b1, b2) in enumerate(self._bands):
            s1, s2 = self._state[layer]
            course = self._course(1 + layer, len(noise))
            for n, w in enumerate(noise):
                turned = (s1 + b1 * w) + (p * s1 - q * s2)
                s2 = (s2 + b2 * w) + (r * s2 + q * s1)
                output[n] += course[n] * (s1 + turned)
                s1 = turned
            self._state[layer] = (s1, s2)
        return output

    def _course(self, which: int, count: int) -> list[float]:
        """One gain, times its tap, at each of the next samples."""
        now, step = self._courses[which]
        course = []
        for _ in range(count):
            now += step
            course.append(now)
        self._courses[which] = (now, step)
        return course


def _towards(gain: float, wanted: float, slew: float) -> float:
    change = wanted - gain
    if change > slew:
        return gain + slew
    return gain - slew if change < -slew else wanted


class Compensator:
    """Eq. 7 on a stream: the signal less a share of it in the compensation's band."""

    def __init__(self, plan: RenderPlan) -> None:
        self._notch, self._state = plan.compensation, (0.0, 0.0)
        if self._notch is not None:
            c = band_coefficients(
                self._notch.frequency_hz, self._notch.bandwidth_hz, rate_hz=plan.rate_hz
            )
            self._band = [float(x) for x in (c.p, c.q, c.r, c.b1, c.b2)]
            self._gain = self._notch.band_share * float(c.tap)

    def filter(self, signal: list[float]) -> list[float]:
        """The next samples, compensated."""
        if self._notch is None:
            return signal
        (p, q, r, b1, b2), (s1, s2) = self._band, self._state
        output = []
        for y in signal:
            x = y if np.isfinite(y) else 0.0
            turned1 = (s1 + b1 * x) + (p * s1 - q * s2)
            turned2 = (s2 + b2 * x) + (r * s2 + q * s1)
            if x == 0 and turned1 * turned1 + turned2 * turned2 < 1e-30:
                turned1 = turned2 = 0.0
            output.append(x - self._gain * (s1 + turned1))
            s1, s2 = turned1, turned2
        self._state = (s1, s2)
        return output


class Limiter:
    """Keeps a stream within `Limits`, sample by sample."""

    def __init__(self, plan: RenderPlan) -> None:
        limits = plan.limits
        self._limits, self._share = limits, plan.mean_share
        self._longest = plan.samples(limits.duration_s)
        self._pause = plan.samples(limits.pause_s)
        self._mean_square = 0.0
        self._sounding = self._silent = 0
        # Samples that peak, RMS and duration limited.
        self.touched = [0, 0, 0]

    def limit(self, signal: list[float]) -> list[float]:
        """The next samples, no louder than the limits allow."""
        if self._longest:
            signal = [self._within_duration(y) for y in signal]
        if np.isfinite(self._limits.peak):
            signal = [self._within_peak(y) for y in signal]
        if np.isfinite(self._limits.rms):
            signal = [self._within_rms(y) for y in signal]
        return signal

    def _within_duration(self, y: float) -> float:
        quiet = abs(y) <= self._limits.silence
        self._silent = self._silent + 1 if quiet else 0
        begun = self._sounding > 0 or not quiet
        self._sounding = 0 if self._silent >= self._pause else self._sounding + begun
        if self._sounding <= self._longest or y == 0:
            return y
        self.touched[2] += 1
        return 0.0

    def _within_peak(self, y: float) -> float:
        peak = self._limits.peak
        if -peak <= y <= peak:
            return y
        self.touched[0] += 1
        return peak if y > 0 else -peak if y < 0 else 0.0

    def _within_rms(self, y: float) -> float:
        kept = (1 - self._share) * self._mean_square
        room = (self._limits.mean_square - kept) / self._share
        if not y * y <= room:
            self.touched[1] += 1
            y = float(np.copysign(np.sqrt(room), y)) if y == y else 0.0
        self._mean_square = kept + self._share * (y * y)
        return y


class LatticeFilter:
    """An all-pole filter as a normalised lattice (Gray and Markel 1975), at the model's rate.

    Every stage turns (its input, its state) by an angle, so with white noise of unit variance all
    states and the unscaled output have unit variance too; the gain is applied behind it. A direct
    form, stable as each of its filters is, can grow without bound when they change.
    """

    def __init__(self, model: ARModel, rate_hz: float) -> None:
        if rate_hz != model.rate_hz:
            raise InputError(
                f"expected the AR model's own rate of {model.rate_hz:g} Hz, got {rate_hz:g} (an "
                "all-pole filter has no equal at another rate); render at that rate and resample."
            )
        self.clamped = 0
        self._model = model
        self._state = [0.0] * model.order
        self._setting: Any = (0.0, [(0.0, 1.0)] * model.order)

    def settings(self, speed_mm_s: Floats, force_n: Floats) -> list[Any]:
        """Output RMS, and sine and cosine of every stage from the highest order down."""
        at = self._model.parameters(speed_mm_s, force_n)
        sine = reflection_coefficients(prediction_coefficients(at.line_spectral_frequencies))
        sine = np.nan_to_num(np.clip(sine, -_HIGHEST_REFLECTION, _HIGHEST_REFLECTION))
        cosine = np.sqrt((1 - sine) * (1 + sine))
        rms = at.gain / cosine.prod(axis=-1)
        table = np.stack([sine, cosine], axis=-1)[:, ::-1]
        stages = [[tuple(stage) for stage in update] for update in table.tolist()]
        return list(zip(rms.tolist(), stages, strict=True))

    def update(self, setting: Any) -> None:
        """Put angles and RMS into force."""
        self._setting = setting

    def inputs(self, key: np.uint64, start: int, *, count: int) -> tuple[list[float], ...]:
        """The next noise, of unit variance."""
        return (white_noise(key, start, count).tolist(),)

    def filter(self, *inputs: list[float]) -> list[float]:
        """The lattice with the angles in force."""
        rms, stages = self._setting
        state, output = self._state, []
        highest = len(stages) - 1
        for forward in inputs[0]:
            for stage, (sine, cosine) in enumerate(stages):
                held = state[highest - stage]
                backward = sine * forward + cosine * held
                forward = cosine * forward - sine * held
                if stage:
                    state[highest - stage + 1] = backward
            state[0] = forward
            output.append(rms * forward)
        return output
