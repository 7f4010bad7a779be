"""All cases of the atlas; a new one costs a function in this folder and a line in its module."""

from __future__ import annotations

from analysis.benches.atlas import (
    answers,
    blending,
    filters,
    hands,
    peaks,
    tracking,
    verdicts,
    vibrators,
)
from analysis.benches.atlas.case import Case

CASES: tuple[Case, ...] = (
    *filters.CASES,
    *blending.CASES,
    *hands.CASES,
    *peaks.CASES,
    *tracking.CASES,
    *verdicts.CASES,
    *vibrators.CASES,
    *answers.CASES,
)
# Families that come with what they are about, so that the atlas says what it does not know yet.
TO_COME = {
    "observers": "force and disturbance observers come with the cable device",
    "wall": "passivity of the virtual wall comes with the cable device",
    "cables": "tension and slack of the cables come with the cable device",
    "equivalence, mixed models": "come with the statistics for them",
}
