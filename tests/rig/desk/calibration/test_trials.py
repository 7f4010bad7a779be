"""Trials of latency on a rig that is calculated: the planted delay comes back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tactileq.modeling import InputError, Renderer
from tactileq.rig.desk.calibration.measuring import Record
from tactileq.rig.desk.calibration.trials import (
    MORE,
    MOVING_S,
    Watched,
    probe_texture,
    step_latencies_s,
    steps_of,
    stroke_latencies_s,
    write_steps,
)
from tactileq.rig.devices.hand.scripted import ScriptedTrajectory
from tactileq.rig.shared.live.memory import BLOCK, READING
from tests.refusals import refused

RATE_HZ = 8000.0
NO_BLOCKS = np.zeros(0, dtype=BLOCK)


def rows_of(times_s: np.ndarray, x_mm: np.ndarray, speed: np.ndarray) -> np.ndarray:
    rows = np.zeros(times_s.size, dtype=READING)
    rows["time_s"], rows["x_mm"], rows["speed_mm_s"], rows["force_n"] = times_s, x_mm, speed, 1.0
    return rows


def stepping(tmp_path: Path, *, delay_s: float, start_s: float = 50.0) -> Watched:
    """A scripted hand, and white noise that follows it late."""
    seconds = write_steps(tmp_path / "steps.tsv", 50, seed=1)
    script = ScriptedTrajectory.load(tmp_path / "steps.tsv")
    times = np.arange(0, seconds, 0.001)
    x_mm = np.array([script.at(float(time))[0] for time in times])
    samples = np.arange(0, seconds, 1 / RATE_HZ)
    edges = np.loadtxt(tmp_path / "steps.tsv", skiprows=1)[1:-1, 0]
    moved = np.searchsorted(edges, samples - delay_s, side="right") % 2 == 1
    rng = np.random.default_rng(2)
    heard = 0.2 * moved * rng.standard_normal(samples.size)
    heard += 0.005 * rng.standard_normal(samples.size)
    record = Record(heard, start_s, RATE_HZ)
    return Watched([record], rows_of(start_s + times, x_mm, 0 * x_mm), NO_BLOCKS)


def test_every_step_of_the_script_is_found(tmp_path: Path) -> None:
    seen = stepping(tmp_path, delay_s=0.01)
    starts = steps_of(seen.readings["time_s"], seen.readings["x_mm"])
    assert starts.size == round(50 * MORE)
    script = np.loadtxt(tmp_path / "steps.tsv", skiprows=1)
    begins = 50.0 + script[1:-1:2, 0]
    np.testing.assert_allclose(starts, begins, atol=2e-5)


def test_a_repeated_reading_does_not_move_a_step() -> None:
    times = np.arange(0, 0.1, 0.002)
    x_mm = np.maximum(0, times - 0.0613) * 150.0
    stale = x_mm.copy()
    stale[32] = stale[31]
    np.testing.assert_allclose(steps_of(times, stale), [0.0613], atol=1e-9)


@pytest.mark.parametrize("delay_s", [0.002, 0.0125, 0.045])
def test_the_planted_delay_is_measured(tmp_path: Path, delay_s: float) -> None:
    found = step_latencies_s(stepping(tmp_path, delay_s=delay_s))
    assert len(found) == round(50 * MORE)
    latencies = np.array(found, dtype=float)
    assert abs(np.median(latencies) - delay_s) < 3e-4
    assert np.abs(latencies - delay_s).max() < 1e-3


def test_without_vibration_none_is_found(tmp_path: Path) -> None:
    seen = stepping(tmp_path, delay_s=MOVING_S + 0.06)
    quiet = Record(0.01 * np.random.default_rng(3).standard_normal(160_000), 50.0, RATE_HZ)
    found = step_latencies_s(Watched([quiet], seen.readings, NO_BLOCKS))
    assert set(found) == {None}


def test_steps_in_a_gap_are_left_out(tmp_path: Path) -> None:
    seen = stepping(tmp_path, delay_s=0.01)
    (whole,) = seen.records
    half = whole.samples_g.size // 2
    later = half + round(0.5 * RATE_HZ)
    parts = [
        Record(whole.samples_g[:half], whole.time_s, RATE_HZ),
        Record(whole.samples_g[later:], whole.time_s + later / RATE_HZ, RATE_HZ),
    ]
    found = step_latencies_s(Watched(parts, seen.readings, NO_BLOCKS))
    assert round(50 * MORE) - 5 <= len(found) < round(50 * MORE)
    assert None not in found


def stroking(*, delay_s: float, seconds: float = 26.0) -> Watched:
    """A hand that strokes as a sine; its texture is rendered and heard late."""
    times = np.arange(0, seconds, 0.002)
    speeds = 180.0 * np.sin(2 * np.pi * times)
    samples = np.arange(0, seconds, 1 / 5000.0)
    late = np.interp(samples - delay_s, times, speeds)
    heard = Renderer(probe_texture(0.2), seed=4).render(late, np.ones(late.size))
    heard = heard + 0.003 * np.random.default_rng(5).standard_normal(heard.size)
    return Watched([Record(heard, 9.0, 5000.0)], rows_of(9.0 + times, 0 * times, speeds), NO_BLOCKS)


def test_strokes_tell_the_delay() -> None:
    found = np.array(stroke_latencies_s(stroking(delay_s=0.018), floor_g2=9e-6), dtype=float)
    assert found.size >= 50
    # The renderer takes the hand of the sample before, and every millisecond anew.
    assert abs(np.median(found) - 0.018) < 1e-3
    assert np.quantile(np.abs(found - 0.018), 0.95) < 3e-3


def test_a_hand_at_rest_is_refused() -> None:
    seen = stroking(delay_s=0.018)
    seen.readings["speed_mm_s"] = 0.0
    with refused(InputError, expected="strokes", got="none"):
        stroke_latencies_s(seen, floor_g2=9e-6)


def test_the_probe_is_proportional_to_speed() -> None:
    levels = [
        Renderer(probe_texture(0.2), seed=6).render(np.full(20_000, speed), np.ones(20_000)).std()
        for speed in (75.0, 150.0, 300.0)
    ]
    np.testing.assert_allclose(levels, [0.1, 0.2, 0.4], rtol=0.03)
