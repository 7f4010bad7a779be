"""What is kept of the shared memory: rows with what was presented, blocks added up, the button."""

from __future__ import annotations

from collections.abc import Iterator
from math import isnan
from typing import Any

import numpy as np
import pytest

from tactileq.rig.desk.journal import Journal, Played
from tactileq.rig.shared.interface import SURFACES
from tactileq.rig.shared.live.memory import (
    BLOCK,
    BUTTON,
    CONTACT,
    FORCE_ASSUMED,
    GONE,
    STALE,
    UNDERFLOW,
    Live,
)

OPENED_S = 1000.0


@pytest.fixture
def live() -> Iterator[Live]:
    with Live.create() as memory:
        yield memory


def journal(live: Live, *, real_measured: bool = False) -> Journal:
    return Journal(live, opened_s=OPENED_S, rate_hz=48000, real_measured=real_measured)


def write(live: Live, time_s: float, *, speed: float = -120.0, flags: int = CONTACT) -> None:
    live.write_reading(OPENED_S + time_s, 0.0, y_mm=0.0, speed_mm_s=speed, force_n=1.5, flags=flags)


@pytest.mark.parametrize("measured", [False, True])
def test_rows_say_what_was_presented_when_they_were_read(live: Live, measured: bool) -> None:
    kept = journal(live, real_measured=measured)
    for number in range(10):
        write(live, 0.1 * number)
    kept.begin("virtual", 1, start_s=OPENED_S + 0.15)
    kept.end(OPENED_S + 0.45)
    kept.begin("real", 2, start_s=OPENED_S + 0.65)
    rows = kept.take_rows()
    names = [SURFACES[number] for number in rows.surface]
    assert names == ["none"] * 2 + ["virtual"] * 3 + ["none"] * 2 + ["real"] * 3
    assert rows.presentation.tolist() == [0, 0, 1, 1, 1, 0, 0, 2, 2, 2]
    assert rows.time_s == pytest.approx(0.1 * np.arange(10))
    assert rows.speed_mm_s[:7].tolist() == [-120.0] * 7
    assert np.isnan(rows.speed_mm_s[7:]).tolist() == [not measured] * 3
    assert np.isnan(rows.force_n[7:]).tolist() == [not measured] * 3
    write(live, 1.0)
    later = kept.take_rows()  # what is presented still is
    assert [SURFACES[number] for number in later.surface] == ["real"]
    assert len(kept.take_rows()) == 0


def test_assumed_force_is_marked_and_a_hand_that_is_gone_is_not_available(live: Live) -> None:
    kept = journal(live)
    write(live, 0.1, flags=CONTACT | FORCE_ASSUMED)
    write(live, 0.2, flags=GONE | FORCE_ASSUMED)
    rows = kept.take_rows()
    assert rows.force_assumed.tolist() == [True, False]
    assert np.isnan(rows.speed_mm_s).tolist() == [False, True]


def test_each_press_of_the_button_counts_once_however_long_it_is_held(live: Live) -> None:
    kept = journal(live)
    assert not kept.take_pressed()
    for number, down in enumerate([0, BUTTON, BUTTON]):
        write(live, 0.1 * number, flags=CONTACT | down)
    assert kept.take_pressed()
    write(live, 0.5, flags=CONTACT | BUTTON)  # still the same press
    assert not kept.take_pressed()
    write(live, 0.6)
    write(live, 0.7, flags=CONTACT | BUTTON)
    write(live, 0.8)
    assert kept.take_pressed()


def test_readings_that_nobody_looked_at_in_time_are_counted(live: Live) -> None:
    kept = journal(live)
    for number in range(16384 + 100):
        write(live, 0.002 * number)
    rows = kept.take_rows()
    assert kept.lost >= 100
    assert len(rows) + kept.lost == 16384 + 100
    assert rows.time_s[0] == pytest.approx(0.002 * kept.lost)


def test_blocks_of_a_presentation_add_up() -> None:
    blocks: Any = np.zeros(3, dtype=BLOCK)
    blocks["frames"] = 128
    blocks["square_sum_g2"] = [1.0, 2.0, 4.0]
    blocks["peak_g"] = [0.5, 2.0, 1.0]
    blocks["flags"] = [0, STALE | UNDERFLOW, STALE]
    blocks["dac_time_s"] = [5.0, 5.1, 5.2]
    played = Played()
    assert isnan(played.end_s)
    played.add(blocks[:2], 48000)
    played.add(blocks[2:], 48000)
    assert (played.frames, played.square_sum_g2, played.peak_g) == (384, 7.0, 2.0)
    assert (played.misses, played.stale) == (1, 2)
    assert played.end_s == pytest.approx(5.2 + 128 / 48000)
