"""Figures of a running rig from its shared memory, and the thread that only wakes up."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from tactileq.rig.devices.monitoring.bare_thread import BareThread, Look, WakeUps
from tactileq.rig.devices.monitoring.figures import Monitor
from tactileq.rig.shared.live.child import Child
from tactileq.rig.shared.live.memory import (
    BLOCK,
    CONTACT,
    FORCE_ASSUMED,
    GONE,
    STALE,
    UNDERFLOW,
    Live,
    Rows,
)
from tactileq.rig.shared.live.messages import Done

GRID = ((50.0, 350.0), (0.5, 3.5))


class Blocks(Live):
    """Shared memory into which a test puts blocks."""

    given: Rows = np.zeros(0, dtype=BLOCK)

    def blocks_since(self, count: int) -> tuple[int, Rows]:
        return self.given.size, self.given[count:]


@pytest.fixture
def live() -> Iterator[Live]:
    with Blocks.create() as live:
        yield live


def blocks(count: int, **fields: float) -> Rows:
    rows = np.zeros(count, dtype=BLOCK)
    rows["frames"] = 480
    rows["time_s"] = 100 + np.arange(count) * 0.01
    rows["hand_s"] = rows["time_s"]
    rows["dac_time_s"] = rows["time_s"] + 0.006
    for name, value in fields.items():
        rows[name] = value
    return rows


def hand(live: Live, time_s: float, *, speed: float = 100.0, flags: int = CONTACT) -> None:
    live.write_reading(time_s, 0.0, y_mm=0.0, speed_mm_s=speed, force_n=1.0, flags=flags)


def test_level_delay_and_counts_are_those_of_the_log(live: Blocks) -> None:
    monitor = Monitor(live, rate_hz=48000.0, peak_g=2.0)
    for moment in np.arange(99.0, 101.0, 0.002):
        hand(live, float(moment) + 0.0005)
    rows = blocks(100, square_sum_g2=480 * 0.04, peak_g=0.5)
    rows["flags"][:3] = UNDERFLOW
    rows["flags"][3:10] = STALE
    rows["peak_g"][:4] = 2.0  # longer ago than the level that is shown
    live.given = rows
    now = monitor.look()
    assert (now.blocks, now.misses, now.stale_blocks, now.limited_blocks) == (100, 3, 7, 4)
    np.testing.assert_allclose(now.rms_g, 0.2)
    assert now.peak_g == 0.5
    np.testing.assert_allclose(now.output_ms, 6.0, atol=1e-6)
    np.testing.assert_allclose(now.reading_ms, 1.5, atol=1e-6)


def test_shares_of_a_block_are_those_since_the_beginning(live: Blocks) -> None:
    monitor = Monitor(live, rate_hz=48000.0, peak_g=2.0)
    rows = blocks(1000, seconds=0.0002)
    rows["seconds"][:3] = 0.005
    live.given = rows
    monitor.look()
    live.given = np.concatenate([rows, blocks(1000, seconds=0.0002)])
    now = monitor.look()
    np.testing.assert_allclose(now.share_p50, 0.02, rtol=1e-5)
    np.testing.assert_allclose(now.share_p999, 0.5, rtol=1e-5)
    assert now.blocks == 2000


def test_the_hand_is_in_the_grid_or_not(live: Blocks) -> None:
    monitor = Monitor(live, rate_hz=48000.0, peak_g=2.0, grid=GRID)
    assert monitor.look().hand == "gone"
    hand(live, 1.0, speed=-100.0)
    assert monitor.look().in_grid is True
    hand(live, 1.1, speed=20.0, flags=CONTACT | FORCE_ASSUMED)
    now = monitor.look()
    assert now.in_grid is False
    assert now.hand == "force assumed"
    hand(live, 1.2, flags=GONE)
    assert monitor.look().hand == "gone"
    assert Monitor(live, rate_hz=48000.0, peak_g=2.0).look().in_grid is None


def test_nothing_yet_is_no_error(live: Blocks) -> None:
    now = Monitor(live, rate_hz=48000.0, peak_g=2.0).look()
    assert (now.blocks, now.rms_g, now.peak_g) == (0, 0.0, 0.0)
    assert np.isnan([now.share_p50, now.reading_ms, now.output_ms]).all()


def test_a_thread_misses_what_it_sleeps_over() -> None:
    thread = BareThread(0.01)
    assert thread.woke(0.009) == 0
    assert thread.woke(0.035) == pytest.approx(0.03)
    assert (thread.periods, thread.misses) == (5, 3)


def test_the_bare_thread_answers_and_ends_with_its_input() -> None:
    child = Child("tactileq.rig.devices.monitoring.bare_thread", 0.001)
    child.ready(Done)
    first = child.ask(Look(), WakeUps)
    assert first.periods >= first.misses >= 0
    while (later := child.ask(Look(), WakeUps)).periods == first.periods:
        pass
    assert later.periods > first.periods
    child.close()
    assert not child.runs
