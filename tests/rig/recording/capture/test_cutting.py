"""Strokes cut into pieces: never two conditions in one, never a sample twice, whatever comes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tactileq.modeling import InputError
from tactileq.rig.recording.capture.cutting import (
    SHORTEST_PART_S,
    StrokeCutter,
    cut_strokes,
    is_clipped,
)
from tactileq.rig.recording.capture.grid import StrokeGrid
from tactileq.rig.shared.live.memory import CONTACT, FORCE_ASSUMED, GONE, SIMULATED
from tests.refusals import refused

RATE_HZ = 2000.0
GRID = StrokeGrid([80.0, 160.0, 240.0], [0.6, 1.2])


def numbered(seconds: float) -> np.ndarray:
    """Samples that tell their place: the number of each, far below full scale."""
    return np.arange(round(seconds * RATE_HZ)) * 1e-6


def steady(seconds: float, speed: float, force: float = 0.6) -> tuple[np.ndarray, np.ndarray]:
    return np.full(round(seconds * 500), speed), np.full(round(seconds * 500), force)


class Places(StrokeCutter):
    """A cutter whose high-pass lets everything pass, so that pieces hold their own places."""

    def __init__(self, *arguments, **options) -> None:
        super().__init__(*arguments, **options)
        self._high_pass = PassAll()


class PassAll:
    def __call__(self, samples):
        return samples

    def restart(self) -> None:
        pass


def cut(samples, rows, *, blocks=(), longest_s=1.0, speed_delay_s=0.0, grid=GRID):
    """Pieces by (condition, first place, size), however the two streams were cut into blocks."""
    cutter = Places(
        grid, RATE_HZ, g_per_fullscale=1e6, longest_s=longest_s, speed_delay_s=speed_delay_s
    )
    time_s = np.arange(samples.size) / RATE_HZ
    pieces = []
    ends = sorted({*(round(b * samples.size) for b in blocks), samples.size})
    last = told = 0
    for end in ends:
        # Readings come when they are there, or later.
        until = np.searchsorted(rows["time_s"], time_s[end - 1] if end else 0.0)
        until = rows.size if end == samples.size else int(until)
        pieces += cutter.feed(samples[last:end], time_s[last:end], rows[told:until])
        last, told = end, until
    return [*pieces, *cutter.end_stroke()]


@given(
    st.integers(0, 2**31),
    st.lists(st.floats(0, 1), max_size=20),
    st.sampled_from([0.2, 0.5, 1.0]),
    st.sampled_from([0.0, 0.015, 0.1]),
)
@example(1, [0.0546875], 0.2, 0.015)  # ends where time + delay is rounded past the last reading
@settings(max_examples=30)
def test_pieces_never_overlap_never_leave_their_cell_and_do_not_depend_on_blocks(
    readings_of, stroking, seed, blocks, longest_s, speed_delay_s
) -> None:
    speed, force = stroking(4.0, GRID.speeds_mm_s, GRID.forces_n, seed=seed)
    rng = np.random.default_rng(seed)
    rows = readings_of(speed, force)
    rows["flags"][rng.integers(rows.size, size=3)] |= GONE
    samples = numbered(4.0)
    options = {"longest_s": longest_s, "speed_delay_s": speed_delay_s}
    pieces, whole = (cut(samples, rows, blocks=given, **options) for given in (blocks, ()))
    assert [p.samples_g.tolist() for p in pieces] == [p.samples_g.tolist() for p in whole]
    used = np.zeros(samples.size, dtype=int)
    for piece in pieces:
        places = np.rint(piece.samples_g).astype(int)
        assert np.array_equal(places, np.arange(places[0], places[-1] + 1))
        assert round(SHORTEST_PART_S * RATE_HZ) <= places.size <= round(longest_s * RATE_HZ)
        used[places] += 1
        at = places / RATE_HZ
        assert piece.start_s == pytest.approx(at[0])
        v = np.abs(np.interp(at + speed_delay_s, rows["time_s"], speed))
        f = np.interp(at, rows["time_s"], force)
        cell = GRID.conditions.index(piece.condition)
        assert (GRID.cells(v, f) == cell).all()
        assert piece.mean_speed_mm_s == pytest.approx(v.mean())
        assert piece.force_sd_n == pytest.approx(f.std(), abs=1e-9)
    assert used.max(initial=0) <= 1


@pytest.mark.parametrize(("speed_delay_s", "last"), [(0.0, 997), (0.02, 957)])
@pytest.mark.parametrize("blocks", [(), np.linspace(0, 1, 101)])
def test_a_steady_hand_loses_nothing_but_the_ends(readings_of, blocks, speed_delay_s, last) -> None:
    rows = readings_of(*steady(2.0, -160))
    pieces = cut(numbered(2.0), rows, blocks=blocks, longest_s=0.75, speed_delay_s=speed_delay_s)
    # To the last reading, 2 ms before the end, or as long before it as its speed is late.
    assert [p.samples_g.size for p in pieces] == [1500, 1500, last]
    assert {p.condition for p in pieces} == {(160.0, 0.6)}
    assert all(p.simulated and not p.force_assumed and not p.clipped for p in pieces)


@pytest.mark.parametrize(
    ("spoil", "left"),
    [
        (lambda rows: None, 1),
        (lambda rows: rows["flags"].__setitem__(slice(None), 0), 0),  # hovers
        (lambda rows: rows["flags"].__setitem__(slice(None), CONTACT | GONE), 0),
        (lambda rows: rows["speed_mm_s"].__setitem__(250, np.nan), 2),
        (lambda rows: rows["flags"].__setitem__(250, 0), 2),  # one lift-off
        (lambda rows: rows["time_s"].__setitem__(slice(250, None), rows["time_s"][250:] + 0.2), 2),
    ],
)
def test_what_nobody_knows_of_the_hand_is_not_used(spoil, left, readings_of) -> None:
    rows = readings_of(*steady(0.9, 80))
    spoil(rows)
    assert len(cut(numbered(0.9), rows)) == left


def test_a_stay_of_less_than_100_ms_is_not_used(readings_of) -> None:
    for seconds, count in ((0.098, 0), (0.106, 1)):
        speed = np.zeros(300)
        speed[100 : 100 + round(seconds * 500)] = 240
        assert len(cut(numbered(0.6), readings_of(speed, np.full(300, 1.2)))) == count


def test_a_speed_that_comes_late_is_moved_back(readings_of) -> None:
    speed = np.zeros(500)
    speed[100:300] = 80.0
    for delay_s in (0.0, 0.02):
        (piece,) = cut(numbered(1.0), readings_of(speed, np.full(500, 0.6)), speed_delay_s=delay_s)
        assert piece.samples_g[0] / RATE_HZ == pytest.approx(0.2 - delay_s, abs=0.0015)


def test_lost_samples_end_the_piece_before_them(readings_of) -> None:
    cutter = Places(GRID, RATE_HZ, g_per_fullscale=1e6)
    rows = readings_of(*steady(1.0, 80))
    time_s = np.arange(1000) / RATE_HZ
    assert cutter.feed(numbered(0.5), time_s, rows[:260]) == []
    assert cutter.condition == (80.0, 0.6)
    (before,) = cutter.end_stroke()
    assert before.samples_g.size == 1000
    assert cutter.condition is None
    assert cutter.feed(numbered(0.4), 0.55 + time_s[:800], rows[260:]) == []
    (after,) = cutter.end_stroke()
    assert after.start_s == pytest.approx(0.55)


def test_gravity_and_the_swinging_arm_are_taken_out_and_the_texture_is_not(readings_of) -> None:
    time_s = np.arange(round(4 * RATE_HZ)) / RATE_HZ
    texture = 0.01 * np.sin(2 * np.pi * 60 * time_s)
    arm = 0.5 + 0.2 * np.sin(2 * np.pi * time_s)
    found = cut_strokes(
        arm + texture,
        time_s,
        readings_of(*steady(4.1, 80)),
        grid=GRID,
        rate_hz=RATE_HZ,
        g_per_fullscale=2.0,
    )
    piece = found[80.0, 0.6][2].samples_g
    # Of 0.4 g at 1 Hz the filter leaves (1/5)^4.
    assert np.abs(piece).max() == pytest.approx(0.02 + 0.4 / 5**4, rel=0.01)


def test_clipping_is_seen_at_full_scale_and_below_it(readings_of) -> None:
    wave = np.sin(np.arange(4000) / 7)
    assert is_clipped(wave)
    assert is_clipped(np.clip(0.9 * wave, -0.6, 0.6))
    assert not is_clipped(0.9 * wave + 0.01 * np.random.default_rng(0).normal(size=4000))
    assert not is_clipped(np.zeros(100))
    loud = np.random.default_rng(1).normal(scale=0.5, size=round(0.5 * RATE_HZ))
    time_s = np.arange(loud.size) / RATE_HZ
    rows = readings_of(*steady(0.6, 80), flags=CONTACT | FORCE_ASSUMED)
    found = cut_strokes(np.clip(loud, -1, 1), time_s, rows, grid=GRID, rate_hz=RATE_HZ)
    (piece,) = found[80.0, 0.6]
    assert piece.clipped
    assert piece.force_assumed
    assert not piece.simulated


def test_rates_and_lengths_that_give_no_pieces_are_refused() -> None:
    with refused(InputError, expected=["640 Hz", "0.1 s"], got="500 Hz"):
        StrokeCutter(GRID, 500.0, g_per_fullscale=1.0)
    with refused(InputError, expected="0.2 s", got="0.1 s"):
        StrokeCutter(GRID, RATE_HZ, g_per_fullscale=1.0, longest_s=0.1)


def test_simulated_is_what_any_reading_says(readings_of) -> None:
    rows = readings_of(*steady(0.5, 80), flags=CONTACT)
    rows["flags"][120] |= SIMULATED
    (piece,) = cut(numbered(0.5), rows)
    assert piece.simulated
