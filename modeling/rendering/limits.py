"""Limits of a signal: peak, RMS and duration (docs/method/rendering.md#limits)."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from tactileq.modeling.errors import InputError


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Limits of a renderer's output; every sample that a limit affects is counted.

    First the duration, then the peak, then the RMS: what leaves obeys all three.

    Parameters
    ----------
    peak : float
        Largest absolute value, in the model's unit; above 0, infinite for none (the default).
    rms : float
        Largest running RMS, in the model's unit: the root of the mean square weighted by
        exp(−age/`rms_window_s`). A sample that would exceed it is reduced just so far that it does
        not. Above 0, infinite for none. What it allows over a time on end: `largest_rms`.
    rms_window_s : float
        Above 0 and finite.
    duration_s : float
        Longest vibration without a pause; what follows is muted until a pause. Above 0, infinite
        for none.
    pause_s : float
        Shortest silence that counts as a pause; above 0 and finite.
    silence : float
        Largest absolute value that counts as silence, in the model's unit; above 0 and finite. By
        default 0.001 (1 mg, far below what anybody feels): noise of the hand's readings at rest
        does not count as vibration.

    Raises
    ------
    InputError
        For values out of range, or so small (1e-162) that their square is 0.
    """

    peak: float = np.inf
    rms: float = np.inf
    rms_window_s: float = 1.0
    duration_s: float = np.inf
    pause_s: float = 0.1
    silence: float = 1e-3

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            endless = field.name in ("rms_window_s", "pause_s", "silence") and np.isinf(value)
            # A square below the smallest double would be a limit of 0, which stands for none.
            if endless or not (value > 0 and value * value > 0):
                finite = " and finite" if endless else ""
                raise InputError(
                    f"expected {field.name} above 0{finite} for limits, got {value}; correct it."
                )

    @property
    def mean_square(self) -> float:
        """The square of `rms`."""
        return self.rms * self.rms

    def largest_rms(self, seconds: float) -> float:
        """Largest RMS over this many seconds in the model's unit, which occurs after a long
        silence.

        Parameters
        ----------
        seconds : float
            Above 0.

        Notes
        -----
        At its peak P from silence on, a signal brings the running mean square to its limit R² after
        t = −w ln(1 − R²/P²), w being the window, and stays there: docs/method/rendering.md#limits.
        """
        if self.peak <= self.rms:
            return self.peak
        if np.isinf(self.peak):  # all at once
            return float(self.rms * np.sqrt(1 + self.rms_window_s / seconds))
        ratio = (self.rms / self.peak) ** 2
        rise_s = min(seconds, float(-self.rms_window_s * np.log1p(-ratio)))
        return float(self.peak * np.sqrt((rise_s + (seconds - rise_s) * ratio) / seconds))
