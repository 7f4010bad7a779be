"""Accuracy of rendering under a moving hand, on the planted textures."""

from __future__ import annotations

import numpy as np
import pytest

from tactileq.benches.rendering.accuracy import (
    FASTEST_MM_S,
    FORCE_N,
    SpeedErrors,
    level_errors,
    rendered_parameters,
    speed_errors,
    stroke,
    update_error_db,
)
from tactileq.benches.rendering.clicks import (
    hum,
    loudest_above_click_hz_db,
    switched,
    this_renderer,
    times_s,
)
from tactileq.benches.rendering.stability import FORMS, OURS, PLAIN, STROKE_HZ, simulate
from tactileq.modeling import Recording, Renderer, TextureModel, similarity
from tactileq.modeling.hand import Hand
from tactileq.modeling.rendering.noise import stream_key, white_noise
from tactileq.modeling.rendering.plan import RELEASE_S, RenderPlan
from tactileq.stimuli.planted.textures import TEXTURES, planted_texture

RATE_HZ = 5000.0


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
def test_updates_each_millisecond_are_40_db_below_the_signal(texture: str) -> None:
    model, hand = planted_texture(texture), stroke(RATE_HZ)
    every_5, every_32 = (update_error_db(model, hand, every) for every in (5, 32))
    assert every_5 <= -40
    assert every_5 + 10 < every_32 < -25  # −26 dB in docs/method/rendering.md#accuracy


@pytest.mark.parametrize("texture", TEXTURES)
def test_level_is_the_models_own_at_every_speed_of_the_stroke(texture: str) -> None:
    model, hand = planted_texture(texture), stroke(RATE_HZ)
    every_5, every_1 = (level_errors(model, hand, every) for every in (5, 1))
    assert every_5.within_grid_db <= 0.5
    assert every_1.within_grid_db <= 0.01
    # Towards rest: of the level at the lowest speed; a millisecond of this stroke is 8 % of it.
    assert every_5.below_grid <= 0.1


@pytest.mark.parametrize("reading_hz", [1000.0, 125.0])
@pytest.mark.parametrize("noise_mm_s", [0.0, 2.0, 10.0])
def test_readings_with_noise_or_seldom_are_no_worse_than_used_as_they_are(
    reading_hz: float, noise_mm_s: float
) -> None:
    model, hand, period = planted_texture("canvas"), stroke(RATE_HZ), round(RATE_HZ / reading_hz)
    noise = np.random.default_rng(0).normal(0, noise_mm_s, hand.speed_mm_s.size)
    held = np.arange(noise.size) // period * period
    readings = Hand((hand.speed_mm_s + noise)[held], hand.force_n)
    every_1, every_5, as_read = (
        update_error_db(model, hand, every, readings=readings) for every in (1, 5, period)
    )
    assert every_5 <= every_1 + 1
    assert as_read <= every_5 + 0.01


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


@pytest.mark.parametrize("period", [5, 10, 20, 40])
def test_signed_readings_are_followed_where_the_hand_turns(period: int) -> None:
    """docs/method/rendering.md#extrapolation"""
    hand, plan = stroke(RATE_HZ), RenderPlan(rate_hz=RATE_HZ, update_samples=period)
    unsigned = Hand(np.abs(hand.speed_mm_s), hand.force_n)
    signed_errors, errors = (speed_errors(hand, read, plan=plan) for read in (hand, unsigned))
    as_read = FASTEST_MM_S * np.sin(2 * np.pi * STROKE_HZ * (period - 1) / RATE_HZ)
    assert errors.as_read == pytest.approx(as_read)
    assert signed_errors.extrapolated < 0.1 * as_read
    assert errors.extrapolated > 1.25 * as_read
    if period == 5:
        assert errors.extrapolated == pytest.approx(5.1, abs=0.05)
    model = planted_texture("canvas")
    signed_db, unsigned_db = (
        update_error_db(model, hand, period, readings=read) for read in (hand, unsigned)
    )
    assert unsigned_db > signed_db + 3


def held_gfc30(model: TextureModel, speed_mm_s: float) -> tuple[float, float]:
    """GFC30 of the second after a stroke in which the speed is held, and its expected value."""
    renderer = Renderer(model)
    renderer.render(*stroke(model.rate_hz, duration_s=0.6))
    held = renderer.render(speed_mm_s, FORCE_N, samples=round(model.rate_hz))
    recording = Recording(held, model.rate_hz, speed_mm_s, FORCE_N, model.texture, simulated=True)
    report = similarity.report(recording, model)
    return report.gfc30, report.expected_gfc30


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


STEPS = {
    "pressed, 0 → 2 N": ((100.0, 0.0), (100.0, 2.0)),
    "lifted, 2 → 0 N": ((100.0, 2.0), (100.0, 0.0)),
    "faster, 100 → 200 mm/s": ((100.0, 2.0), (200.0, 2.0)),
}


@pytest.mark.parametrize("step", STEPS)
def test_steps_add_nothing_to_what_the_layer_itself_has_above_1_khz(step: str) -> None:
    before, after = STEPS[step]
    louder = after if step != "lifted, 2 → 0 N" else before
    ours, steady = (
        loudest_above_click_hz_db(this_renderer(*ends, streams=400), ends[0], after=ends[1])
        for ends in ((before, after), (louder, louder))
    )
    assert ours < steady + 0.5


def test_the_measure_of_clicks_sees_them() -> None:
    """A gain that jumps, and a filter whose state does not fit its new coefficients."""
    before, after = STEPS["lifted, 2 → 0 N"]
    for form in FORMS:
        signals = switched(before, after, form=form, streams=100)
        assert loudest_above_click_hz_db(signals, before, after=after) > 15
    before, after = STEPS["faster, 100 → 200 mm/s"]
    high_db = {
        form: loudest_above_click_hz_db(
            switched(before, after, form=form, streams=100), before, after=after
        )
        for form in (PLAIN, OURS)
    }
    assert high_db[PLAIN] > 10
    assert high_db[OURS] < 1.5


@pytest.mark.parametrize("step", STEPS)
def test_streams_of_a_step_are_the_same_until_the_hand_steps(step: str) -> None:
    ours, at_once = (
        this_renderer(*STEPS[step], streams=5),
        switched(*STEPS[step], form=OURS, streams=5),
    )
    assert np.abs(at_once - ours)[:, times_s() < 0].max() < 1e-9
    assert np.abs(at_once - ours)[:, times_s() > 0.005 + RELEASE_S].max() < 1e-9  # faded
