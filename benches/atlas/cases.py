"""All cases of the atlas; a new one costs a function in this folder and a line in its module."""

from __future__ import annotations

from tactileq.benches.atlas import (
    answers,
    blending,
    filters,
    hands,
    peaks,
    readings,
    tracking,
    verdicts,
    vibrators,
)
from tactileq.benches.atlas.case import Case

CASES: tuple[Case, ...] = (
    *filters.CASES,
    *blending.CASES,
    *hands.CASES,
    *readings.CASES,
    *peaks.CASES,
    *tracking.CASES,
    *verdicts.CASES,
    *vibrators.CASES,
    *answers.CASES,
)
# What the atlas does not cover yet, and why, so that the report states it.
TO_COME = {
    "force and disturbance observers": "which will come with the cable device",
    "passivity of the virtual wall": "which will come with the cable device",
    "tension and slack of the cables": "which will come with the cable device",
    "equivalence tests and mixed models": "see the appendix of tactileq analyze --validate",
}
