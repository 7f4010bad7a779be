"""Pieces of strokes as one record, with the power of each frequency kept.

docs/method/strokes.md#joining
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError

FADE_S = 0.02


def joined(pieces: Sequence[Floats], rate_hz: float) -> Floats:
    """Pieces one after the other, each faded into the next one over 20 ms.

    Pieces of a texture's vibration are independent of each other, so their powers add: the squares
    of the two fades sum to 1, and white noise stays white and as loud.

    Parameters
    ----------
    pieces : sequence of (n,) ndarray
        One at least, each of mean about 0 and of at least 40 ms (two fades).

    Returns
    -------
    (sum of n less one fade for each join,) ndarray
    """
    fade = fade_samples(rate_hz)
    short = [piece.size for piece in pieces if piece.size < 2 * fade]
    if not pieces or short:
        got = f"one of {short[0]}" if short else "none"
        raise InputError(
            f"expected pieces of at least {2 * fade} samples to join, got {got}; take longer ones."
        )
    rising = np.sin(np.pi / 2 * (np.arange(fade) + 0.5) / fade)
    out = np.zeros(joined_samples((piece.size for piece in pieces), rate_hz))
    begin = 0
    for place, piece in enumerate(pieces):
        weighted = piece.copy()
        if place > 0:
            weighted[:fade] *= rising
        if place < len(pieces) - 1:
            weighted[-fade:] *= rising[::-1]
        out[begin : begin + piece.size] += weighted
        begin += piece.size - fade
    return out


def joined_samples(sizes: Iterable[int], rate_hz: float) -> int:
    """How many samples pieces of these sizes have once they are joined; 0 of none."""
    every = list(sizes)
    return sum(every) - fade_samples(rate_hz) * max(len(every) - 1, 0)


def fade_samples(rate_hz: float) -> int:
    """Length of the fade from one piece into the next."""
    return max(round(FADE_S * rate_hz), 1)
