"""The tracking filter: its delay, its noise, its sign, and what it does at gaps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactileq.modeling.arrays import Floats
from tactileq.rig.devices.hand.tracking import (
    NEW_STROKE_S,
    REST_S,
    TrackingFilter,
    noise_gain_per_s,
)

DELAY_S = 0.01


def followed(time_s: Floats, x_mm: Floats, y_mm: Floats | None = None) -> Floats:
    """Speed after each position."""
    tracking = TrackingFilter(DELAY_S)
    y_mm = np.zeros_like(x_mm) if y_mm is None else y_mm
    return np.array([tracking.update(*row) for row in zip(time_s, x_mm, y_mm, strict=True)])


@pytest.mark.parametrize("period_s", [0.001, 0.002, 0.005])
def test_the_delay_is_exact_at_constant_acceleration(period_s: float) -> None:
    acceleration = 1500.0  # mm/s²
    time_s = np.arange(0, 0.3, period_s)
    speed = followed(time_s, acceleration * time_s**2 / 2)
    settled = time_s > 2 * DELAY_S
    expected = acceleration * (time_s - DELAY_S)
    np.testing.assert_allclose(speed[settled], expected[settled], rtol=1e-9)


def test_a_delay_that_is_no_whole_number_of_periods_is_kept_within_a_fifth_of_a_period() -> None:
    period_s, acceleration = 0.0075, 1500.0  # 133 Hz, as many tablets
    time_s = np.arange(0, 0.6, period_s)
    speed = followed(time_s, acceleration * time_s**2 / 2)
    delay = time_s - speed / acceleration
    assert np.abs(delay[time_s > 0.1] - DELAY_S).max() < period_s / 5


@pytest.mark.parametrize("period_s", [0.002, 0.004, 0.01, 0.02, 0.03])
def test_the_noise_is_that_of_the_closed_form(period_s: float) -> None:
    rng = np.random.default_rng(3)
    time_s = np.arange(20_000) * period_s
    # Fast movement along x, so that the sign does not hang on the noise.
    speed = followed(time_s, 1000 * time_s + rng.normal(0, 0.01, time_s.size))
    measured = np.std(speed[100:] - 1000)
    assert measured == pytest.approx(0.01 * noise_gain_per_s(DELAY_S, period_s), rel=0.03)


def test_for_many_positions_the_noise_falls_as_the_root_of_the_cubed_window() -> None:
    period_s = 1e-5
    asymptote = np.sqrt(12 * period_s / (2 * DELAY_S) ** 3)
    assert noise_gain_per_s(DELAY_S, period_s) == pytest.approx(asymptote, rel=1e-3)


def test_pixels_give_5_mm_s_of_noise_and_counts_a_tenth() -> None:
    # A slow stroke at 125 Hz, rounded to pixels of 96 per inch and to counts of 1000 per inch.
    rng = np.random.default_rng(5)
    time_s = np.arange(0, 20, 0.008)
    x_mm = np.cumsum(rng.uniform(30, 70, time_s.size)) * 0.008
    y_mm = np.cumsum(rng.uniform(30, 70, time_s.size)) * 0.008

    def noise(step_mm: float) -> float:
        rounded = followed(
            time_s, np.round(x_mm / step_mm) * step_mm, np.round(y_mm / step_mm) * step_mm
        )
        return float(np.std((rounded - followed(time_s, x_mm, y_mm))[20:]))

    assert noise(25.4 / 96) == pytest.approx(5.0, abs=1.0)
    assert noise(25.4 / 1000) == pytest.approx(0.5, abs=0.1)
    assert 25.4 / 96 / np.sqrt(12) * noise_gain_per_s(DELAY_S, 0.008) == pytest.approx(5, abs=1)


@pytest.mark.parametrize("angle", [0.0, 0.6, np.pi / 2, 2.5])
def test_to_and_fro_flips_the_sign_in_any_direction(angle: float) -> None:
    time_s = np.arange(0, 4, 0.002)
    along = 40 * (1 - np.cos(2 * np.pi * time_s))
    speed = followed(time_s, along * np.cos(angle), along * np.sin(angle))
    expected = 80 * np.pi * np.sin(2 * np.pi * (time_s - DELAY_S))
    sign = np.sign(speed[100])
    np.testing.assert_allclose(sign * speed[20:], expected[20:], atol=1.0)


def test_a_circle_keeps_its_speed_and_its_sign() -> None:
    time_s = np.arange(0, 5, 0.002)
    phase = 2 * np.pi * time_s
    speed = followed(time_s, 20 * np.cos(phase), 20 * np.sin(phase))[20:]
    # Over the window of 20 ms the direction turns by 7°; its chord is shorter by 0.1 %.
    np.testing.assert_allclose(np.abs(speed), 40 * np.pi, rtol=2e-3)
    assert len(set(np.sign(speed[500:]))) == 1


def test_a_curved_stroke_flips_its_sign_at_its_ends_only() -> None:
    time_s = np.arange(0, 4, 0.002)
    swing = np.pi / 3 * np.sin(2 * np.pi * time_s)  # the forearm turns about the elbow
    speed = followed(time_s, 150 * np.sin(swing), 150 * np.cos(swing))
    turning = np.gradient(swing, time_s)
    expected = 150 * np.interp(time_s - DELAY_S, time_s, turning)
    sure = (np.abs(expected) > 50) & (time_s > 0.5)
    np.testing.assert_allclose(np.abs(speed[sure]), np.abs(expected[sure]), rtol=0.02)
    assert len(set(np.sign(speed[sure] * expected[sure]))) == 1


def test_at_rest_it_decays_to_0_without_a_jump() -> None:
    tracking = TrackingFilter(DELAY_S)
    for index in range(51):
        tracking.update(index * 0.002, index * 0.2)
    after = [tracking.at(0.1 + later / 1000) for later in range(60)]
    assert after[: int(REST_S * 1000)] == pytest.approx([100.0] * int(REST_S * 1000))
    assert (np.diff(after) <= 1e-9).all()
    assert -np.diff(after).min() < 100 * 1.6 * 0.001 / (2 * DELAY_S)
    assert after[int((REST_S + 2 * DELAY_S) * 1000) + 1 :] == pytest.approx([0.0] * 19)


def test_after_a_gap_and_a_jump_the_hand_starts_from_rest() -> None:
    time_s = np.arange(0, 0.2, 0.002)
    later = time_s + 0.2 + 2 * NEW_STROKE_S
    speed = followed(
        np.concatenate([time_s, later]), np.concatenate([100 * time_s, 500 - 100 * time_s])
    )
    assert np.abs(speed).max() <= 100 + 1e-6
    assert speed[time_s.size] == 0
    np.testing.assert_allclose(speed[-50:], -100)


def test_dropped_positions_change_nothing_at_constant_speed() -> None:
    time_s = np.delete(np.arange(0, 0.3, 0.002), slice(70, 90))
    np.testing.assert_allclose(followed(time_s, 100 * time_s)[15:], 100)


def test_out_of_reach_means_at_rest() -> None:
    tracking = TrackingFilter(DELAY_S)
    for index in range(20):
        tracking.update(index * 0.002, index * 0.2)
    assert tracking.update(0.04, np.nan, np.nan) == 0
    assert tracking.at(0.041) == 0
    assert tracking.update(0.042, 90.0) == 0  # put down elsewhere
    assert abs(tracking.update(0.044, 90.2)) < 100


def test_of_a_mouse_of_8_khz_no_more_positions_are_kept_than_a_window_needs() -> None:
    tracking = TrackingFilter(DELAY_S)
    time_s = np.arange(0, 0.5, 1 / 8000)
    speed = [tracking.update(t, 750 * t**2) for t in time_s]  # 1500 mm/s²
    assert len(tracking._track) <= 2 * 40 + 2  # any two steps are a fortieth of it or more
    np.testing.assert_allclose(speed[400:], 1500 * (time_s[400:] - DELAY_S), rtol=2e-3, atol=0.5)


def test_a_moment_that_comes_twice_replaces_its_position() -> None:
    tracking = TrackingFilter(DELAY_S)
    for index in range(20):
        tracking.update(index * 0.002, index * 0.2)
    tracking.update(0.038, 1e3)
    assert tracking.update(0.038, 3.8) == pytest.approx(100)


steps = st.lists(
    st.tuples(
        st.floats(0, 0.2), st.floats(-1e4, 1e4), st.floats(-1e4, 1e4) | st.just(float("nan"))
    ),
    max_size=40,
)


@settings(max_examples=200, deadline=None)
@given(steps, st.floats(0.0005, 0.1), st.floats(0, 1))
def test_whatever_comes_the_speed_is_finite_and_below_the_steepest_step(
    steps: list[tuple[float, float, float]], delay_s: float, later_s: float
) -> None:
    tracking, time_s, steepest, last = TrackingFilter(delay_s), 0.0, 0.0, None
    for step_s, x_mm, y_mm in steps:
        time_s += step_s
        if last is not None and step_s > 1e-6:
            steepest = max(steepest, np.hypot(x_mm - last[0], y_mm - last[1]) / step_s)
        speed = tracking.update(time_s, x_mm, y_mm)
        assert np.isfinite(speed)
        assert np.isfinite(tracking.at(time_s + later_s))
        if all(step > 1e-5 and np.isfinite(y) for step, _, y in steps):
            assert abs(speed) <= steepest * (1 + 1e-6) + 1e-6
        last = (x_mm, y_mm)
