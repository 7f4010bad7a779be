"""Accuracy of rendering under a moving hand, on the planted textures."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from analysis.benches.accuracy import (
    FASTEST_MM_S,
    PERIODS_SAMPLES,
    READINGS,
    Hand,
    SpeedErrors,
    accuracy_row,
    held_gfc30,
    reading_rows,
    rendered_parameters,
    speed_errors,
    stroke,
    turning_rows,
)
from analysis.benches.clicks import (
    STEADY,
    STEPS,
    THIS_RENDERER,
    StepSignals,
    click_table,
    hum,
    level_above_click_hz,
    step_signals,
)
from analysis.benches.stability import FORMS, OURS, STROKE_HZ, simulate
from analysis.figures.stability import figure_clicks
from modeling import Renderer
from modeling.rendering.noise import stream_key, white_noise
from modeling.rendering.plan import RenderPlan
from stimuli.planted.textures import TEXTURES, planted_texture

RATE_HZ = 5000.0


@pytest.fixture(scope="module")
def accuracy() -> pd.DataFrame:
    rows = [accuracy_row(planted_texture(name)) for name in TEXTURES]
    return pd.DataFrame(rows).set_index("texture")


@pytest.fixture(scope="module", params=list(STEPS))
def signals(request: pytest.FixtureRequest) -> StepSignals:
    return step_signals(request.param)


def jerky_hand(count: int) -> Hand:
    """A stroke with lift-offs and steps, which no hand makes, in between."""
    rng = np.random.default_rng(0)
    speed = stroke(RATE_HZ, duration_s=count / RATE_HZ).speed_mm_s
    jumps = np.repeat(rng.choice([0.0, 0.0, 80.0, -200.0], count // 40 + 1), 40)[:count]
    force = np.repeat(rng.choice([0.0, 1.0, 3.0], count // 90 + 1), 90)[:count]
    return Hand(speed + jumps, force)


@pytest.mark.parametrize("update_samples", [1, 4, 5, 32])
def test_rendered_parameters_are_those_of_the_renderer(update_samples: int) -> None:
    """Put through the recursion (docs/method/equalizer.md#recursion) with the same noise, they give
    the renderer's output."""
    model, hand = planted_texture("canvas"), jerky_hand(2000)
    at = rendered_parameters(model, hand, update_samples)
    noise = white_noise(stream_key(3), 0, 2000)
    expected = Renderer(model, seed=3, update_samples=update_samples).render(*hand)
    assert simulate(at, FORMS[OURS], noise, rate_hz=RATE_HZ) == pytest.approx(expected, abs=1e-13)
    assert np.abs(expected).max() > 0.1


@pytest.mark.parametrize("texture", TEXTURES)
def test_updates_each_millisecond_are_40_db_below_the_signal(
    accuracy: pd.DataFrame, texture: str
) -> None:
    every_5, every_32 = accuracy.loc[texture, ["error_db_every_5", "error_db_every_32"]]
    assert every_5 <= -40
    assert every_5 + 10 < every_32 < -25  # −26 dB in docs/method/rendering.md#accuracy


@pytest.mark.parametrize("texture", TEXTURES)
def test_level_is_the_models_own_at_every_speed_of_the_stroke(
    accuracy: pd.DataFrame, texture: str
) -> None:
    assert accuracy.loc[texture, "level_error_db_every_5"] <= 0.5
    assert accuracy.loc[texture, "level_error_db_every_1"] <= 0.01
    # Towards rest: of the level at the lowest speed; a millisecond of this stroke is 8 % of it.
    assert accuracy.loc[texture, "level_error_below_grid_every_5"] <= 0.1


def test_readings_with_noise_or_seldom_are_no_worse_than_used_as_they_are() -> None:
    rows = pd.DataFrame(reading_rows(planted_texture("canvas")))
    assert rows["simulated"].all()
    assert list(zip(rows["reading_hz"], rows["noise_mm_s"], strict=True)) == list(READINGS)
    clean = rows.iloc[0]
    assert clean["error_db_every_5"] < -50
    assert (rows["error_db_every_5"] <= rows["error_db_every_1"] + 1).all()
    assert (rows["error_db_as_read"] <= rows["error_db_every_5"] + 0.01).all()


def turning_errors(*, beside_0: float) -> tuple[SpeedErrors, SpeedErrors]:
    """Of |v| read with and without its sign, updates every 5 samples, 0.5 mm/s more each sample."""
    speed = 0.5 * (np.arange(1000) - 500.0) + beside_0
    force = np.full(speed.size, 2.0)
    hand, plan = Hand(speed, force), RenderPlan(rate_hz=RATE_HZ, update_samples=5)
    unsigned = Hand(np.abs(speed), force)
    return speed_errors(hand, hand, plan=plan), speed_errors(hand, unsigned, plan=plan)


def test_speed_without_its_sign_is_extrapolated_past_the_reversal() -> None:
    """Speed changes by c each sample: the smoothed slope of |v| is −5c per update before the
    reversal. j samples behind it the reading is cj and the slope −5c + cj/2, so the end of the
    update is set to |1.4j − 4|·c instead of (j + 4)·c: off by 6.8c for j = 3.
    """
    signed, unsigned = turning_errors(beside_0=1e-6)
    assert signed.as_read == pytest.approx(4 * 0.5, rel=1e-5)
    assert unsigned.as_read == pytest.approx(4 * 0.5, rel=1e-5)
    # Of the slope before the reversal 0.75^20 is not there yet where errors begin to count.
    assert signed.extrapolated < 0.01 * signed.as_read
    assert unsigned.extrapolated == pytest.approx(6.8 * 0.5, rel=1e-3)


def test_a_reading_of_0_is_not_extrapolated_and_no_worse_than_as_read() -> None:
    signed, unsigned = turning_errors(beside_0=0.0)
    assert signed.extrapolated == pytest.approx(signed.as_read)
    assert signed.extrapolated < 0.6 * unsigned.extrapolated


def test_signed_readings_are_followed_where_the_hand_turns() -> None:
    """docs/method/rendering.md#extrapolation"""
    rows = pd.DataFrame(turning_rows(planted_texture("canvas")))
    assert list(rows["update_samples"]) == list(PERIODS_SAMPLES)
    assert rows["simulated"].all()
    late_s = (rows["update_samples"] - 1) / RATE_HZ
    as_read = FASTEST_MM_S * np.sin(2 * np.pi * STROKE_HZ * late_s)
    assert list(rows["speed_error_mm_s_as_read"]) == pytest.approx(list(as_read))
    assert (rows["speed_error_mm_s_signed"] < 0.1 * as_read).all()
    assert (rows["speed_error_mm_s_unsigned"] > 1.25 * as_read).all()
    assert rows["speed_error_mm_s_unsigned"].iloc[0] == pytest.approx(5.1, abs=0.05)
    assert (rows["error_db_unsigned"] > rows["error_db_signed"] + 3).all()


@pytest.mark.parametrize("texture", TEXTURES)
@pytest.mark.parametrize("speed_mm_s", [80.0, 200.0, 330.0])
def test_gfc30_is_as_expected_once_the_speed_is_held(texture: str, speed_mm_s: float) -> None:
    gfc30, expected = held_gfc30(planted_texture(texture), speed_mm_s)
    assert gfc30 == pytest.approx(expected, abs=0.005)


def test_a_hand_that_comes_to_rest_fades_along_the_ramp_to_exactly_nothing() -> None:
    """The same noise and the same filter: the ratio to a rendering without the fade is the gain."""
    model, fading = hum(), 1000
    speed = np.concatenate([np.full(1500, 50.0), np.linspace(50, 0, fading), np.zeros(500)])
    force = np.full(speed.size, 2.0)
    signal = Renderer(model).render(speed, force)
    whole = Renderer(model).render(np.full(speed.size, 50.0), force)
    heard = np.abs(whole) > 0.1
    one_update = 50 / fading * 5
    gain_mm_s = 50 * signal[heard] / whole[heard]
    assert gain_mm_s == pytest.approx(speed[heard], abs=one_update)
    assert np.array_equal(signal[:1500], whole[:1500])
    assert not signal[1500 + fading + 25 :].any()  # 5 ms


def test_steps_add_nothing_to_what_the_layer_itself_has_above_1_khz(signals: StepSignals) -> None:
    table = click_table(signals).set_index("rendering")
    ours, steady = table.loc[THIS_RENDERER], table.loc[STEADY]
    assert ours["high_db"] < steady["high_db"] + 0.5
    assert ours["energy_db"] < steady["energy_db"] + 0.5
    assert ours["second_difference_db"] < steady["second_difference_db"] + 1
    assert table["simulated"].all()


def test_the_measure_of_clicks_sees_them() -> None:
    """A gain that jumps, and a filter whose state does not fit its new coefficients."""
    lifted = click_table(step_signals("lifted, 2 → 0 N", streams=100)).set_index("rendering")
    for form in FORMS:
        assert lifted.loc[f"{form}, switched", "high_db"] > 15
        assert lifted.loc[f"{form}, switched", "second_difference_db"] > 15
    faster = click_table(step_signals("faster, 100 → 200 mm/s", streams=100))
    high_db = faster.set_index("rendering")["high_db"]
    assert high_db["plain state-variable, switched"] > 10
    assert high_db[f"{OURS}, switched"] < 1.5


def test_streams_of_a_step_are_the_same_until_the_hand_steps(signals: StepSignals) -> None:
    before = signals.time_s < 0
    ours = signals.renderings[THIS_RENDERER]
    for name, other in signals.renderings.items():
        assert np.abs(other - ours)[:, before].max() < 1e-9, name
    faded = signals.time_s > 0.005
    switched = signals.renderings[f"{OURS}, switched"]
    assert np.abs(ours - switched)[:, faded].max() < 1e-9


def test_figure_shows_the_levels_and_says_that_it_is_simulated(signals: StepSignals) -> None:
    levels = level_above_click_hz(signals)
    figure = figure_clicks([(signals, levels)], shown={signals.step: [THIS_RENDERER]})
    assert figure.get_suptitle().startswith("Simulated")
    signal, level = figure.axes
    near = (signals.time_s >= -0.01) & (signals.time_s <= 0.015)
    assert signal.get_lines()[0].get_ydata() == pytest.approx(
        signals.renderings[THIS_RENDERER][0, near]
    )
    labels = [line.get_label() for line in level.get_lines()]
    assert labels[:2] == [THIS_RENDERER, STEADY]
    assert level.get_lines()[1].get_ydata() == pytest.approx(levels[STEADY][near])
