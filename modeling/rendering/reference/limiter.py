"""The limits on a stream, in Python."""

from __future__ import annotations

import numpy as np

from tactileq.modeling.rendering.plan import RenderPlan


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
        """The next samples, within the limits."""
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
        room = max(0.0, (self._limits.mean_square - kept) / self._share)
        if not y * y <= room:
            self.touched[1] += 1
            y = float(np.copysign(np.sqrt(room), y)) if y == y else 0.0
        self._mean_square = kept + self._share * (y * y)
        if self._mean_square < 1e-20 * self._limits.mean_square:
            self._mean_square = 0.0
        return y
