"""The vibrator's compensation on a stream, in Python."""

from __future__ import annotations

import numpy as np

from tactileq.modeling.equalizer.bands import band_coefficients
from tactileq.modeling.rendering.plan import RenderPlan


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
