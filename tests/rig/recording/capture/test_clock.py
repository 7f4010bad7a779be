"""The time of samples by regression."""

from __future__ import annotations

import numpy as np
import pytest

from tactileq.rig.recording.capture.clock import SampleClock

RATE_HZ = 48000.0


def test_a_card_that_runs_fast_is_followed_within_a_millisecond() -> None:
    clock, rng = SampleClock(RATE_HZ), np.random.default_rng(0)
    true_rate_hz = RATE_HZ * (1 + 150e-6)
    for block in range(60 * 50):
        position = block * 960
        clock.add(position, 7.0 + position / true_rate_hz + rng.exponential(0.002))
        times = clock.times_s(position, 960)
        true = 7.0 + (position + np.arange(960)) / true_rate_hz
        if position > 5 * RATE_HZ:
            # The jitter's own mean, 2 ms, is not to be told from latency.
            assert np.abs(times - true - 0.002).max() < 0.001
    assert clock.drift_ppm == pytest.approx(150, abs=15)
    assert clock.jitter_s == pytest.approx(0.002, rel=0.2)


def test_before_five_seconds_the_stated_rate_holds() -> None:
    clock = SampleClock(RATE_HZ)
    assert (clock.drift_ppm, clock.jitter_s) == (0.0, 0.0)
    clock.add(0, 1.0)
    clock.add(48000, 2.1)
    assert clock.drift_ppm == 0
    assert clock.times_s(24000, 2) == pytest.approx([1.55, 1.55 + 1 / RATE_HZ])
    clock.restart()
    clock.add(96000, 9.0)
    assert clock.times_s(96000, 1) == pytest.approx([9.0])
