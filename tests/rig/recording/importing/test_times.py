"""Gaps and jumps in columns of times, and what only looks like one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from tactileq.modeling import InputError
from tactileq.rig.recording.importing.times import TimeColumn, unwrapped
from tests.refusals import check_refusal, refused

Times = NDArray[np.float64]
RATE_HZ = 2000.0
TIME_S: Times = np.arange(4000) / RATE_HZ


def column(values: Times, unit: str = "s") -> TimeColumn:
    return TimeColumn("a.csv", "time", unit, np.asarray(values, dtype=np.float64))


def rows(time: TimeColumn, rate_hz: float | None = None) -> tuple[int, int]:
    kept, _ = time.without_gaps(rate_hz)
    return kept.start, kept.stop


def later(from_s: float, by_s: float) -> Times:
    """All times from one on are this much later."""
    return np.where(from_s <= TIME_S, TIME_S + by_s, TIME_S)


def repeated(values: Times, count: int = 10) -> Times:
    """Batches: each time stamp stands for so many samples."""
    return np.repeat(values[count - 1 :: count], count)


@pytest.mark.parametrize("rate_hz", [None, RATE_HZ])
@pytest.mark.parametrize(
    ("values", "unit", "expected"),
    [
        (later(1.2, 10), "s", (0, 2400)),
        (later(0.8, 10), "s", (1600, 4000)),
        (later(1.2, -1.2), "s", (0, 2400)),  # a second take, from 0 again
        (later(0.005, 10), "s", (10, 4000)),
        (later(0.0005, 10), "s", (1, 4000)),
        (later(1.9985, 10), "s", (0, 3997)),
        (later(1.2, 10) + later(0.3, 3) - TIME_S, "s", (600, 2400)),
        (np.floor(later(1.2, 1) * 1000), "ms", (0, 2400)),  # two samples a tick
        (np.floor((later(1.0, 10) + 38.43) * 10) / 10, "s", (0, 2000)),  # a coarse clock
        (repeated(later(1.2, 0.5)), "s", (0, 2400)),
        ((later(1.5, 3) * 1e6 + 2**32 - 7e5) % 2**32, "us", (0, 3000)),
    ],
)
def test_the_longest_part_without_a_gap(
    values: Times, unit: str, expected: tuple[int, int], rate_hz: float | None
) -> None:
    assert rows(column(unwrapped(values), unit), rate_hz) == expected


@pytest.mark.parametrize("rate_hz", [None, RATE_HZ])
@pytest.mark.parametrize(
    ("values", "unit"),
    [
        (TIME_S, "s"),
        (np.floor(TIME_S * 1000), "ms"),
        (np.floor(TIME_S * 100), "ms"),
        (np.floor(TIME_S + 38.4), "s"),
        (repeated(TIME_S), "s"),
        (repeated(TIME_S + np.where((TIME_S > 1) & (TIME_S < 1.005), 0.0149, 0)), "s"),  # one late
        (np.delete(TIME_S, 1000), "s"),
        (np.delete(TIME_S, slice(100, None, 100)), "s"),
        (np.where(TIME_S == 1, 0.9995, TIME_S), "s"),  # twice the same
        (np.where(TIME_S == 1, 0.0, TIME_S), "s"),  # one wrong
        (np.where((TIME_S >= 1) & (TIME_S < 1.02), 1.02, TIME_S), "s"),  # all late, none missing
        ((TIME_S * 1e6 + 2**32 - 7e5) % 2**32, "us"),
        (np.floor(TIME_S * 1e3 + 2**16 - 700) % 2**16, "ms"),
        (np.zeros(4000), "s"),
        (-TIME_S, "s"),
        (np.where(TIME_S == 1, np.nan, TIME_S), "s"),
    ],
)
def test_what_is_no_gap(values: Times, unit: str, rate_hz: float | None) -> None:
    assert rows(column(unwrapped(values), unit), rate_hz) == (0, values.size)


@pytest.mark.parametrize(
    ("values", "unit", "with_a_rate"),
    [
        (later(1.2, 10) * 1000, "", (0, 2400)),  # ms without saying so
        (later(1.2, 10) * 1000, "msek", (0, 2400)),
        (later(1.2, 10) * 74_000, "ticks", (0, 2400)),
        (np.where(TIME_S >= 1.2, 18_000.0, 0.0) + np.arange(4000), "", (0, 2400)),  # counts
        (np.arange(4000.0) % 100, "", (0, 4000)),  # counts over and over
    ],
)
def test_times_in_no_known_unit(values: Times, unit: str, with_a_rate: tuple[int, int]) -> None:
    assert rows(column(values, unit)) == (0, 4000)
    assert rows(column(values, unit), RATE_HZ) == with_a_rate


def test_the_gap_is_named_with_what_is_left_out() -> None:
    _, told = column(later(1.2, 10) * 1000, "ms").without_gaps(None)
    check_refusal(
        told, names=["a.csv", "gap of 10 s", "row 2400", "1199.5", "1 to 2400", 1600, 4000]
    )
    _, told = column(later(1.2, 10) * 1000, "").without_gaps(RATE_HZ)
    check_refusal(told, names="gap of 10 s")
    _, told = column(later(1.2, -1)).without_gaps(None)
    check_refusal(told, names=["back by 0.9995 s", "row 2400"])
    _, told = column(later(1.2, 10) + later(0.3, 3) - TIME_S).without_gaps(None)
    check_refusal(told, names=["gap of 10 s", "1 more break"])


@given(
    st.integers(64, 3900),
    st.floats(0.01, 1e4),
    st.sampled_from([lambda t: t, lambda t: np.floor(t * 1000) / 1000]),
)
def test_any_gap_splits_where_it_is(
    row: int, gap_s: float, ticks: Callable[[Times], Times]
) -> None:
    values = ticks(TIME_S + np.where(np.arange(4000) >= row, gap_s, 0.0))
    assert rows(column(values)) == ((0, row) if row >= 2000 else (row, 4000))


@pytest.mark.parametrize("tick_s", [0.001, 0.01, 1 / 64, 0.1, 1.0])
@pytest.mark.parametrize("phase_s", [0.0, 0.37, 0.95])
@pytest.mark.parametrize("rounded", [9, 3])
def test_the_rate_of_coarse_stamps_is_that_of_whole_ticks(
    tick_s: float, phase_s: float, rounded: int
) -> None:
    time_s = np.arange(9000) / RATE_HZ + phase_s * tick_s
    stamps = (np.floor(time_s / tick_s) * tick_s).round(rounded)
    time = column(stamps)
    # One sample at either end, and the rounding of the stamps, are all that is not known.
    tolerance = (2 / RATE_HZ + 10.0**-rounded) / (4.5 - 2 * tick_s)
    assert time.rate_hz() == pytest.approx(RATE_HZ, rel=tolerance)
    assert time.contradiction(RATE_HZ) is None
    assert time.unevenness(time.rate_hz()) is None


def test_a_clock_that_changed_once_gives_no_rate() -> None:
    time = column(np.floor(TIME_S[:3000]))
    with refused(InputError, expected="change", got=["1 change", "--rate"]):
        time.rate_hz()
    assert time.contradiction(RATE_HZ) is None


def test_only_a_counter_begins_again() -> None:
    ns = np.where(np.arange(4000) < 2000, 0, -16_500_000) + np.arange(4000) * 1e6 + 1e12
    assert (unwrapped(ns) == ns).all()
    assert rows(column(ns, "ns")) in ((0, 2000), (2000, 4000))
