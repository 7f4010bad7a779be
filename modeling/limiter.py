"""What comes behind the filters, in Python: compensation of the vibrator, then the limits."""

from __future__ import annotations

import numpy as np

from modeling.peq import band_coefficients
from modeling.plan import RenderPlan


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
