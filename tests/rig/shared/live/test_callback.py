"""The audio callback by itself, called without a card: levels, the log, hands of no number."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter, sosfilt

from tactileq.modeling.rendering.limits import Limits
from tactileq.modeling.vibrators.exposure import hand_arm_sections
from tactileq.rig.shared.live.memory import CONTACT, GONE, NO_HEARTBEAT, STALE, Live
from tests.modeling.rendering.lattices import in_python, planted_ar
from tests.rig.shared.live.callback import FADE, RATE_HZ, Array, Callback


@pytest.fixture
def live() -> Iterator[Live]:
    with Live.create() as made:
        yield made


def test_a_peak_limit_at_full_scale_never_leaves_it(live: Live) -> None:
    peaks = np.linspace(0.5, 3.0, 500)
    scales = (1 / peaks).astype(np.float32)
    # For some of them the product is rounded to above full scale.
    peak, scale = next(
        (peak, scale)
        for peak, scale in zip(peaks, scales, strict=True)
        if np.float32(peak) * scale > 1
    )
    callback = Callback(live, scale=float(scale))
    callback.signal(1, np.array([peak, -peak] * 100))
    played = callback.play(200)
    assert np.abs(played).max() == 1.0


@pytest.mark.parametrize("count", [1, 100, 256])
def test_a_signal_that_ends_within_a_block_is_in_the_log(live: Live, count: int) -> None:
    callback = Callback(live, scale=1.0)
    callback.signal(7, np.full(count, 0.5))
    played = callback.play(1024)
    assert np.count_nonzero(played) == count
    callback.play(1024)
    assert callback.log()["presentation"].tolist() == [7, 0]


@pytest.mark.parametrize("frames", [128, 300, 2048])
def test_all_that_was_played_counts_for_its_presentation(live: Live, frames: int) -> None:
    callback = Callback(live, scale=1.0)
    callback.texture(3, Limits(peak=1.0))
    played = [callback.play(frames) for _ in range(12)]
    callback.silence()
    played += [callback.play(frames) for _ in range(6)]
    rows = callback.log()
    assert not played[-1].any()
    assert rows["presentation"][-1] == 0
    own = rows[rows["presentation"] == 3]
    wanted = float((np.concatenate(played).astype(np.float64) ** 2).sum())
    assert own["square_sum_g2"].sum() == pytest.approx(wanted, rel=1e-9)
    assert wanted > 0


def test_what_is_asked_for_while_a_block_is_rendered_begins_with_the_next(live: Live) -> None:
    """From its first sample: one that began amid a block could not be rendered again by the log."""
    callback, limits = Callback(live, scale=1.0), Limits(peak=1.0)
    within, number = False, 0
    while not within:
        number += 1
        callback.leaves[:] = np.nan
        block = threading.Thread(target=callback.play_on, args=(number * 2_000_000,))
        block.start()
        while block.is_alive() and np.isnan(callback.leaves[0, 0]):
            pass
        callback.texture(number, limits)
        within = block.is_alive()
        block.join()
    assert callback.log()["presentation"][-1] == 0
    callback.play(1024)
    assert callback.log()["presentation"][-1] == number


@pytest.mark.parametrize("gain", [1.0, 1e6, 1e300])
def test_whatever_hand_and_model_the_limits_hold_and_every_sample_is_a_number(
    live: Live, gain: float
) -> None:
    limits = Limits(peak=0.4, rms=0.1, rms_window_s=0.05, duration_s=0.2, pause_s=0.01)
    draws = np.random.default_rng(4)
    odd = [np.nan, np.inf, -np.inf, 1e308, -1e300, -3.0, 0.0, 150.0, 150.0, 150.0]
    callback = Callback(live, scale=2.0)
    played = []
    for step in range(300):
        if step % 40 == 0:
            kind = callback.texture if step % 80 else callback.lattice
            kind(step + 1, limits, gain)
        speed, force = draws.choice(odd, 2)
        frames = int(draws.integers(1, 700))
        played.append(callback.play(frames, speed_mm_s=speed, force_n=force))
    signal = np.concatenate(played).astype(np.float64) / 2
    assert np.isfinite(signal).all()
    assert 0 < np.abs(signal).max() <= 0.4 * (1 + 1e-6)
    share = -np.expm1(-1 / (0.05 * RATE_HZ))
    mean_square = lfilter([share], [1, share - 1], signal**2)
    assert np.sqrt(mean_square.max()) <= 0.1 * (1 + 1e-6)


@pytest.mark.parametrize("count", [2400, 4800])
def test_a_signal_counts_for_how_long_vibration_may_last(live: Live, count: int) -> None:
    """A texture right behind it is muted once both have lasted for as long as one alone may."""
    callback = Callback(live, scale=1.0)
    callback.signal(1, np.full(count, 0.1))
    first = callback.play(count)
    callback.texture(2, Limits(peak=1.0, duration_s=0.2, pause_s=0.1))
    played = np.concatenate((first, *(callback.play(480) for _ in range(30))))
    assert np.flatnonzero(played)[-1] == 0.2 * RATE_HZ - 1


def test_all_pole_and_layered_models_follow_each_other_through_silence(live: Live) -> None:
    """Fades included, what is played of an all-pole model is what Python makes of it."""
    callback, limits = Callback(live, scale=1.0), Limits(peak=5.0)
    callback.lattice(1, limits, 0.05)
    first = callback.play(4800)
    callback.texture(2, limits)
    callback.play(4800)
    callback.lattice(3, limits, 0.05)
    third = callback.play(4800)
    callback.silence()
    last = callback.play(4800)
    hand = np.full(4800, 150.0), np.full(4800, 1.5)
    wanted = in_python(planted_ar(0.05), *hand, rate_hz=RATE_HZ)
    wanted[:FADE] *= np.arange(1, FADE + 1) / FADE
    np.testing.assert_allclose(first, wanted, rtol=0, atol=1e-6 * np.abs(wanted).max())
    np.testing.assert_array_equal(third[FADE:], first[:-FADE])
    assert last[: FADE - 1].all()
    assert not last[FADE:].any()
    assert callback.log()["presentation"].tolist() == [1, 2, 3, 3]


def test_a_hand_that_is_gone_ends_an_all_pole_model_in_zeros(live: Live) -> None:
    callback = Callback(live, scale=1.0)
    callback.lattice(1, Limits(peak=5.0), 0.05)
    before = callback.play(4800)
    callback.read(1.0, 150.0, 1.5)
    after = callback.play_on(4800)
    assert np.count_nonzero(before) > 4700
    # An update, 3 ms for the end of contact to the next update, 5 ms of fade, and 37 samples of the
    # model's 5 kHz that are interpolated.
    assert not after[int((0.001 + 0.004 + 0.005 + 37 / 5000) * RATE_HZ) :].any()
    assert callback.log()["flags"].tolist() == [0, STALE]


@pytest.mark.parametrize("flags", [CONTACT, GONE])
def test_one_reading_without_contact_or_device_ends_in_silence(live: Live, flags: int) -> None:
    """Nobody says so again: the process that reads the hand has ended, or a pen is lifted."""
    callback = Callback(live, scale=1.0)
    callback.texture(1, Limits(peak=5.0))
    for _ in range(40):
        callback.play(128)
    live.write_reading(callback.time_s, 0.0, y_mm=0.0, speed_mm_s=150.0, force_n=0.0, flags=flags)
    played = np.concatenate([callback.play_on(128) for _ in range(40)])
    assert played[:128].any()
    # A block until 3 ms are over, one to the update, 5 ms of fade, and what is interpolated.
    assert not played[int((0.003 + 0.006 + 0.005 + 37 / 5000) * RATE_HZ) :].any()


# --- The heartbeat --------------------------------------------------------------------------------


def steady(callback: Callback, number: int) -> None:
    callback.signal(number, np.full(48000, 0.5))


def moving(callback: Callback, number: int) -> None:
    callback.texture(number, Limits(peak=1.0))


def still_loud(callback: Callback, age_s: float) -> Array:
    """Four blocks of 256 under a moving hand, with a last heartbeat of this age."""
    callback.look(age_s)
    callback.read(0.0, 150.0, 1.5)
    return callback.play_on(1024)


@pytest.mark.parametrize("begin", [steady, moving])
def test_without_a_heartbeat_what_plays_fades_and_stays_silent_until_asked_anew(
    live: Live, begin: Any
) -> None:
    callback = Callback(live, scale=1.0)
    begin(callback, 1)
    before = callback.play(4800)
    assert still_loud(callback, 0.9).any()
    faded = still_loud(callback, 1.001)
    assert faded[: FADE - 1].any()
    assert not faded[FADE:].any()
    assert not callback.play(1024).any()  # the session is back: nothing resumes by itself
    begin(callback, 2)
    assert callback.play(1024)[FADE:].any()
    assert np.abs(before).max() > 0
    rows = callback.log()
    assert rows["flags"].tolist() == [0, 0, NO_HEARTBEAT, NO_HEARTBEAT, 0]
    assert rows["presentation"].tolist() == [1, 1, 1, 0, 2]


def test_no_heartbeat_is_needed_where_nothing_plays(live: Live) -> None:
    """Nor while what was asked for is as young as a heartbeat may be."""
    callback = Callback(live, scale=1.0, masking=1)
    callback.mask(0.1)
    callback.asked_age_s = 0.5
    callback.look(100.0)
    steady(callback, 1)
    assert callback.play_on(1024).any()
    callback.silence()
    callback.play_on(1024)
    callback.asked_age_s = 1e6
    callback.silence()
    assert not callback.play_on(1024).any()
    assert callback.masked.any()  # masking noise alone goes on
    assert not np.any(callback.log()["flags"] & NO_HEARTBEAT)


def test_masking_noise_ends_with_what_is_halted(live: Live) -> None:
    callback = Callback(live, scale=1.0, masking=1)
    callback.mask(0.1)
    steady(callback, 1)
    callback.play(1024)
    assert callback.masked[FADE:].any()
    still_loud(callback, 2.0)
    assert not callback.masked[FADE:].any()
    callback.silence()
    callback.play(1024)
    assert callback.masked[FADE:].all()


def test_the_weighted_sum_is_that_of_the_standards_filter(live: Live) -> None:
    callback = Callback(live, scale=1.0)
    rng = np.random.default_rng(4)
    signal = 0.1 * rng.standard_normal(4800)
    callback.signal(1, signal)
    felt = np.concatenate([callback.play(128) for _ in range(60)])
    sections = hand_arm_sections(RATE_HZ)
    sos = np.hstack([sections[:, :3], np.ones((3, 1)), sections[:, 3:]])
    weighted = sosfilt(sos, felt.astype(np.float64))
    rows = callback.log()
    assert rows["weighted_square_sum_g2"].sum() == pytest.approx(np.sum(weighted**2), rel=1e-6)
    assert np.abs(felt).max() < 1  # nothing was clipped
