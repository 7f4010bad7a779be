"""Onsets, lags of strokes, and what trials say: planted truth comes back."""

from __future__ import annotations

import numpy as np
import pytest

from tactileq.modeling import InputError
from tactileq.rig.desk.calibration.latency import (
    check_latency,
    high_passed,
    onset_s,
    parts_of,
    stroke_lag_s,
    summary_of,
)
from tactileq.rig.devices.simulated.vibrator import SimulatedAccelerometer, SimulatedTransducers
from tactileq.rig.shared.live.memory import BLOCK
from tests.refusals import refused

RATE_HZ = 48_000.0


def onset_errors(*, times_louder: float, resonance: bool) -> np.ndarray:
    """Of 100 onsets, found less true, in seconds."""
    rng = np.random.default_rng(1)
    errors = []
    for seed in range(100):
        start = int(rng.integers(100, 2000))
        drive = np.concatenate([np.zeros(2400 + start), rng.standard_normal(4800 - start)])
        vibration = 0.01 * times_louder * drive
        if resonance:
            vibrator = SimulatedTransducers(noise_g=0.0, g_per_fullscale=1.0, seed=seed)
            vibration = 10.0 * SimulatedAccelerometer(vibrator, rate_hz=RATE_HZ).give(vibration)
        samples = high_passed(vibration + 0.01 * rng.standard_normal(7200), rate_hz=RATE_HZ)
        found = onset_s(samples[:2400], samples[2400:], rate_hz=RATE_HZ)
        assert found is not None
        errors.append(found - start / RATE_HZ)
    return np.array(errors)


@pytest.mark.parametrize("resonance", [False, True])
def test_an_onset_is_found_to_a_few_samples(resonance: bool) -> None:
    errors = onset_errors(times_louder=5.0, resonance=resonance)
    assert np.abs(errors).max() < 1e-3
    assert abs(np.median(errors)) < 5e-5


def test_nothing_begins_in_noise_alone() -> None:
    rng = np.random.default_rng(2)
    for _ in range(100):
        noise = rng.standard_normal(7200)
        assert onset_s(noise[:2400], noise[2400:], rate_hz=RATE_HZ) is None
    assert onset_s(np.zeros(100), np.zeros(1000), rate_hz=RATE_HZ) is None


def test_an_onset_after_digital_silence_is_exact() -> None:
    vibration = np.concatenate([np.zeros(500), np.random.default_rng(3).standard_normal(2000)])
    assert onset_s(np.zeros(100), vibration, rate_hz=RATE_HZ) == 500 / RATE_HZ


def test_a_slow_push_is_no_onset() -> None:
    push = 0.5 * np.sin(2 * np.pi * 2 * np.arange(7200) / RATE_HZ)
    noise = 0.01 * np.random.default_rng(4).standard_normal(7200)
    samples = high_passed(push + noise, rate_hz=RATE_HZ)
    assert onset_s(samples[:2400], samples[2400:], rate_hz=RATE_HZ) is None


def test_the_lag_of_one_stroke_is_found_to_a_millisecond() -> None:
    rng = np.random.default_rng(5)
    moments = np.arange(0, 0.7, 1e-4)
    lags, floor_g2 = [], 9e-6
    for _ in range(50):
        phase = 2 * np.pi * rng.random()
        heard = 0.1 * np.abs(np.sin(2 * np.pi * (moments - 0.0173) + phase))
        samples = heard * rng.standard_normal(moments.size)
        samples += np.sqrt(floor_g2) * rng.standard_normal(moments.size)
        power = (samples**2).reshape(-1, 10).mean(axis=1)
        level = np.abs(np.sin(2 * np.pi * (moments.reshape(-1, 10).mean(axis=1)) + phase))
        lags.append(stroke_lag_s(power, level, longest_s=0.1, floor_g2=floor_g2))
    assert abs(np.median(lags) - 0.0173) < 2e-4
    assert np.abs(np.array(lags) - 0.0173).max() < 1.5e-3


def test_a_stroke_shorter_than_its_lag_is_refused() -> None:
    with refused(InputError, expected=["0.2 s", "0.1 s"], got="0.15 s"):
        stroke_lag_s(np.ones(150), np.ones(150), longest_s=0.1, floor_g2=1e-6)


def test_trials_are_summed_up() -> None:
    latencies = [*np.linspace(0.01, 0.02, 101), None]
    summary = summary_of(latencies)
    assert summary.trials == 101
    assert summary.missed == 1
    np.testing.assert_allclose([summary.median_ms, summary.p95_ms], [15.0, 19.5])
    low, high = summary.median_within_ms
    # The median of n uniform values over 10 ms has a standard error of 10/(2√n) ms.
    np.testing.assert_allclose([15 - low, high - 15], 1.96 * 5 / np.sqrt(101), rtol=0.25)
    assert summary.p95_within_ms[0] < 19.5 < summary.p95_within_ms[1]


def test_too_few_trials_are_refused() -> None:
    with refused(InputError, expected="50 trials", got=[49, 60]):
        summary_of([0.01] * 49 + [None] * 11)


def test_above_40_ms_somebody_has_to_accept_it() -> None:
    fine, slow = summary_of([0.039] * 50), summary_of([0.041] * 50)
    check_latency(fine, accepted=None)
    check_latency(slow, accepted="a pilot")
    with refused(InputError, expected=["40 ms", "95 %"], got=["41.0 ms", "--accept"]):
        check_latency(slow, accepted=None)


def test_the_log_of_blocks_says_what_its_parts_are() -> None:
    blocks = np.zeros(100, dtype=BLOCK)
    blocks["time_s"] = 10 + np.arange(100) * 128 / RATE_HZ
    blocks["hand_s"] = blocks["time_s"]
    blocks["dac_time_s"] = blocks["time_s"] + 0.005
    blocks["frames"] = 128
    readings = 9.999 + np.arange(1000) * 0.002
    age, block, output = parts_of(readings, blocks, rate_hz=RATE_HZ)
    assert 0.8 < age.median_ms < 1.2
    assert age.p95_ms <= 2.0
    np.testing.assert_allclose([block.median_ms, output.p95_ms], [128 / 48, 5.0])


def test_blocks_before_the_first_reading_have_no_age() -> None:
    blocks = np.zeros(3, dtype=BLOCK)
    assert [part.name for part in parts_of([5.0], blocks, rate_hz=RATE_HZ)] == [
        "one block",
        "block to output, as stated",
    ]
