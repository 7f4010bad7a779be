"""Whether the hand stroked as the models were recorded."""

from __future__ import annotations

import numpy as np
import pytest

from tactileq.experiments.sessions.kept.strokes import HOW, Outside, advice_on, outside_grid
from tactileq.rig.shared.interface import HandRows, PresentationRecord

VIRTUAL = PresentationRecord(
    number=3,
    surface="virtual",
    texture="PVC",
    start_s=0.0,
    end_s=1.0,
    speeds_mm_s=(50.0, 200.0),
    forces_n=(0.5, 2.0),
)


def rows(speeds: list[float], forces: list[float], *, assumed: bool = False) -> HandRows:
    n = len(speeds)
    return HandRows(
        time_s=np.arange(n) / 500,
        speed_mm_s=np.array(speeds),
        force_n=np.array(forces),
        surface=np.full(n, 2),
        presentation=np.full(n, 3),
        force_assumed=np.full(n, assumed),
    )


def test_shares_count_the_moving_hand_whatever_its_direction() -> None:
    hand = rows([-100.0, 100, -300, 20, 300, 0, 100], [1.0, 1, 1, 1, 3, 1, 0])
    found = outside_grid(hand, [VIRTUAL])
    assert found is not None  # the last two rows are at rest and lifted off
    assert found.outside == pytest.approx(3 / 5)
    assert (found.too_fast, found.too_slow) == (pytest.approx(2 / 5), pytest.approx(1 / 5))
    assert (found.too_hard, found.too_light) == (pytest.approx(1 / 5), 0)


def test_an_assumed_force_says_nothing_about_force() -> None:
    found = outside_grid(rows([100.0, 300.0], [9.0, 9.0], assumed=True), [VIRTUAL])
    assert found is not None
    assert found.outside == 0.5
    assert np.isnan(found.too_hard)
    assert np.isnan(found.too_light)


def test_what_is_not_measured_or_on_another_surface_is_left_out() -> None:
    nan = float("nan")
    assert outside_grid(rows([nan, nan], [nan, nan]), [VIRTUAL]) is None
    assert outside_grid(rows([], []), [VIRTUAL]) is None
    real = PresentationRecord(number=3, surface="real", texture="PVC", start_s=0, end_s=1)
    assert outside_grid(rows([300.0], [1.0]), [real]) is None


@pytest.mark.parametrize("which", HOW)
def test_the_participant_is_told_what_was_wrong_for_most_of_the_time(which: str) -> None:
    assert advice_on(Outside(outside=0.754, **{which: 0.7})) == (f"strokes.{which}", 75)
    assert advice_on(Outside(outside=0.5, **{which: 0.5})) is None
    assert advice_on(None) is None
