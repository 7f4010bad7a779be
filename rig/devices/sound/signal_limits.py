"""The limits of a prepared signal: peak, running RMS, duration without a pause.

docs/method/live.md#output
"""

from __future__ import annotations

from typing import Any

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError
from tactileq.modeling.rendering.plan import RenderPlan


def check_signal(samples: Floats, plan: RenderPlan) -> None:
    """InputError where a prepared signal is beyond the limits of a plan.

    The running mean square is taken to be at its limit when the signal begins, whatever was felt
    before.
    """
    if samples.ndim != 1 or not samples.size or not np.isfinite(samples).all():
        what = "NaN or inf" if samples.ndim == 1 and samples.size else f"shape {samples.shape}"
        raise InputError(f"expected a signal as (n,) finite numbers in g, got {what}; correct it.")
    limits = plan.limits
    peak = float(np.abs(samples).max())
    if peak > limits.peak:
        raise InputError(
            f"expected a signal of at most {limits.peak:g} g, got {peak:.4g} g; lower it or raise "
            "the rig's limit."
        )
    if np.isfinite(limits.rms):
        squares = _mean_squares(samples, plan) + _left_of_limit(samples.size, plan)
        if squares.max() > limits.mean_square * (1 + 1e-9):
            raise InputError(
                f"expected a signal with a running RMS of at most {limits.rms:g} g, got "
                f"{np.sqrt(squares.max()):.4g} g; lower it or raise the rig's limit."
            )
    longest = _longest_run(np.abs(samples) > limits.silence, plan.samples(limits.pause_s))
    if np.isfinite(limits.duration_s) and longest > plan.samples(limits.duration_s):
        raise InputError(
            f"expected a signal of at most {limits.duration_s:g} s without a pause, got "
            f"{longest / plan.rate_hz:.4g} s; shorten it or raise the rig's limit."
        )


def largest_factor(samples: Floats, plan: RenderPlan) -> float:
    """The largest factor by which a signal (n,) may be multiplied; refused above by `check_signal`.

    Limits of peak and running RMS count, not that of the duration.
    """
    peak = float(np.abs(samples).max(initial=0.0))
    if not peak:
        return float("inf")
    factor = plan.limits.peak / peak
    if np.isfinite(plan.limits.rms):
        room = plan.limits.mean_square - _left_of_limit(samples.size, plan)
        squares = _mean_squares(samples, plan)
        felt = squares > 0
        factor = min(factor, float(np.sqrt((room[felt] / squares[felt]).min())))
    return float(factor)


def _mean_squares(samples: Floats, plan: RenderPlan) -> Floats:
    """Running mean squares (g²) of a signal after silence, (n,)."""
    from scipy.signal import lfilter

    return np.asarray(lfilter([plan.mean_share], [1, plan.mean_share - 1], samples**2))


def _left_of_limit(count: int, plan: RenderPlan) -> Floats:
    """What is left, sample by sample, of a running mean square that was at its limit before."""
    kept = (1.0 - plan.mean_share) ** np.arange(1, count + 1, dtype=np.float64)
    return np.asarray(plan.limits.mean_square * kept)


def _longest_run(loud: np.ndarray[Any, np.dtype[np.bool_]], pause: int) -> int:
    """Samples from the first to the last loud one, where no pause is between."""
    where = np.flatnonzero(loud)
    if not where.size:
        return 0
    begins = np.concatenate([[0], np.flatnonzero(np.diff(where) > pause) + 1])
    ends = np.concatenate([begins[1:] - 1, [where.size - 1]])
    return int((where[ends] - where[begins]).max()) + 1
