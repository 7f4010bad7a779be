"""Whether the hand stroked as the models were recorded, and what to tell a participant if not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.rig.shared.interface import SURFACES, HandRows, PresentationRecord

MOSTLY = 0.5
OFTEN = 0.1
HOW = ("too_slow", "too_fast", "too_light", "too_hard")


@dataclass(frozen=True, kw_only=True)
class Outside:
    """Shares (0 … 1) of the time with a moving hand on virtual surfaces, outside the models' grids.

    NaN where the hand did not move on one; of forces, where they were assumed.
    """

    outside: float = nan
    too_slow: float = nan
    too_fast: float = nan
    too_light: float = nan
    too_hard: float = nan


def outside_grid(rows: HandRows, records: Sequence[PresentationRecord]) -> Outside | None:
    """How long the hand was slower, faster, lighter or harder than any condition of the models.

    Parameters
    ----------
    records : sequence of PresentationRecord
        Those that count; each has the grid of its model.

    Returns
    -------
    Outside or None
        None where the hand did not move on a virtual surface.
    """
    if not rows.presentation.any():
        return None
    found = [_beyond(rows, record) for record in records if record.speeds_mm_s is not None]
    beyond = np.concatenate([np.zeros((0, 4)), *found])
    if not len(beyond):
        return None
    known = ~np.isnan(beyond).all(axis=0)
    shares = np.full(4, nan)
    shares[known] = np.nanmean(beyond[:, known], axis=0)
    outside = float(np.mean(np.nan_to_num(beyond).any(axis=1)))
    slow, fast, light, hard = map(float, shares)
    return Outside(outside=outside, too_slow=slow, too_fast=fast, too_light=light, too_hard=hard)


def advice_on(outside: Outside | None) -> tuple[str, int] | None:
    """What to tell a participant whose hand was outside for most of the time; None otherwise.

    Returns
    -------
    (str, int) or None
        The key of a page, "strokes." and how most of it was outside (one of `HOW`), and for how
        many per cent of the time.
    """
    if outside is None or outside.outside <= MOSTLY:
        return None
    worst = max(HOW, key=lambda name: float(np.nan_to_num(getattr(outside, name))))
    return f"strokes.{worst}", round(100 * outside.outside)


def beyond_edge(rows: HandRows) -> float:
    """Share (0 … 1) of the time below the height of a virtual wall that was spent beside it."""
    on_virtual = rows.surface == SURFACES.index("virtual")
    with np.errstate(invalid="ignore"):
        below = on_virtual & (rows.depth_mm > 0)
    return float(np.mean(rows.beyond_edge[below])) if below.any() else 0.0


def _beyond(rows: HandRows, record: PresentationRecord) -> Floats:
    """(n, 4): 1 where too slow, too fast, too light, too hard, as the hand moved on the surface."""
    assert record.speeds_mm_s is not None
    assert record.forces_n is not None
    speed = np.abs(rows.speed_mm_s)
    with np.errstate(invalid="ignore"):
        moves = (rows.presentation == record.number) & (speed > 0) & (rows.force_n > 0)
    speed, force = speed[moves], rows.force_n[moves]
    (slowest, fastest), (lightest, hardest) = record.speeds_mm_s, record.forces_n
    beyond = np.stack(
        [speed < slowest, speed > fastest, force < lightest, force > hardest], axis=1
    ).astype(np.float64)
    beyond[rows.force_assumed[moves], 2:] = nan
    return beyond
