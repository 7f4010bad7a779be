"""How much an actuator's limits reduce a level (docs/method/scenes.md#sharing-and-budgets)."""

from __future__ import annotations

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.rendering.limits import Limits


def limit_loss_db(rms: Floats, limits: Limits) -> Floats:
    """By how much limits lower the level of Gaussian noise of (n,) RMS, in dB."""
    return np.maximum(clipped_loss_db(rms, limits.peak), _above_db(rms, limits.rms))


def _above_db(rms: Floats, limit: float) -> Floats:
    if not np.isfinite(limit):
        return np.zeros_like(rms)
    lost: Floats = 20 * np.log10(np.maximum(rms / limit, 1.0))
    return lost


def clipped_loss_db(rms: Floats, peak: float) -> Floats:
    """By how much clipping at a peak lowers the level of Gaussian noise, (n,), in dB.

    With x = peak/σ the power that is left is erf(x/√2) − √(2/π)·x·exp(−x²/2) + x²·erfc(x/√2).

    Parameters
    ----------
    rms : (n,) ndarray
        σ, ≥ 0.
    peak : float
        > 0; may be infinite.
    """
    from scipy.special import erf, erfc

    if not np.isfinite(peak):
        return np.zeros_like(rms)
    x = peak / np.maximum(rms, 1e-300)
    small = np.minimum(x, 40.0)
    left = (
        erf(small / np.sqrt(2))
        - np.sqrt(2 / np.pi) * small * np.exp(-(small**2) / 2)
        + small**2 * erfc(small / np.sqrt(2))
    )
    loss: Floats = -10 * np.log10(np.minimum(left, 1.0))
    return loss
