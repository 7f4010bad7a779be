"""What holds for every model, every hand and every limit, through the compiled kernel."""

from __future__ import annotations

import re
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.optimize import elementwise

from tactileq.modeling import Limits, Renderer, TextureModel
from tactileq.modeling.arrays import Floats
from tactileq.modeling.rendering.compiled import _kernel, is_compiled
from tactileq.modeling.rendering.noise import stream_key, white_noise
from tactileq.modeling.rendering.plan import FADE_S, HOLD_S, RELEASE_S, plan_for

MODEL_RATE_HZ = 5000.0
RATES_HZ = (5000.0, 48000.0)
HAND = st.floats(width=64) | st.floats(-500, 500) | st.sampled_from([0.0, 5e-324, 50.0, 0.5])
HANDS = arrays(np.float64, st.tuples(st.just(2), st.integers(1, 300)), elements=HAND)
SEEDS = st.integers(0, 2**64 - 1)
TOUCHING = np.array([[50.0], [0.5]])  # a corner: nothing is blended


@pytest.fixture(autouse=True)
def _compiled() -> None:
    assert is_compiled()


@st.composite
def models(draw: st.DrawFn, *, loudest: float = 1e6) -> TextureModel:
    """Legal corners that have nothing to do with each other."""
    layers = draw(st.integers(0, 4))

    def corners(lowest: float, highest: float) -> Floats:
        drawn = arrays(np.float64, (2, 2, layers), elements=st.floats(lowest, highest))
        return draw(drawn)

    return TextureModel(
        texture="any",
        rate_hz=MODEL_RATE_HZ,
        speeds_mm_s=[50.0, 350.0],
        forces_n=[0.5, 3.5],
        noise_gains=draw(arrays(np.float64, (2, 2), elements=st.floats(0, loudest))),
        frequencies_hz=corners(1, 0.49 * MODEL_RATE_HZ),
        bandwidths_hz=corners(0.1, 0.45 * MODEL_RATE_HZ),
        gains=corners(-loudest, loudest),
        level_sd_db=np.zeros((2, 2, layers)),
        estimator="planted",
    )


def two_layers(noise_gain: float, gain: float) -> TextureModel:
    """A wide layer and a narrow one, which subtracts, over a floor; the same in all conditions."""
    shape = (2, 2, 2)
    return TextureModel(
        texture="humming",
        rate_hz=MODEL_RATE_HZ,
        speeds_mm_s=[50.0, 350.0],
        forces_n=[0.5, 3.5],
        noise_gains=np.full((2, 2), noise_gain),
        frequencies_hz=np.broadcast_to([90.0, 600.0], shape),
        bandwidths_hz=np.broadcast_to([20.0, 400.0], shape),
        gains=np.broadcast_to([-gain, gain], shape),
        level_sd_db=np.zeros(shape),
        estimator="planted",
    )


def output_bound(model: TextureModel, rate_hz: float, *, seed: int, count: int) -> Floats:
    """The most that any motion over a model's grid can bring forth, at each of (count,) samples.

    A band's output is √k/(1+k)·(cos θ·s1 − sin θ·s2) + k/(1+k)·w, at most
    √(k/(1+k))·√(‖s‖² + w²), and ‖s‖² is at most the sum of all w² before.
    """
    w = white_noise(stream_key(seed), 0, count)
    k = np.tan(np.pi * model.bandwidths_hz.max(axis=(0, 1)) / MODEL_RATE_HZ)
    gain = np.abs(model.gains).max(axis=(0, 1)) @ np.sqrt(k / (1 + k))
    way = plan_for(MODEL_RATE_HZ, rate_hz=rate_hz).interpolation
    most = 1.0
    if way is not None:  # the largest sums of absolute weights
        most = float(np.abs(way.doubling).sum(axis=0).max() * np.abs(way.phases).sum(axis=1).max())
    floor = model.noise_gains.max() * np.sqrt(3)
    bound: Floats = most * (gain * np.sqrt(np.cumsum(w**2)) + floor)
    return bound


@settings(max_examples=150, deadline=None)
@given(models(), HANDS, st.sampled_from(RATES_HZ), st.integers(1, 60), SEEDS)
def test_output_stays_within_the_closed_form_bound(
    model: TextureModel, hand: Floats, rate_hz: float, update_samples: int, seed: int
) -> None:
    renderer = Renderer(model, rate_hz=rate_hz, seed=seed, update_samples=update_samples)
    signal = renderer.render(*hand)
    assert np.isfinite(signal).all()
    bound = output_bound(model, rate_hz, seed=seed, count=signal.size)
    assert (np.abs(signal) <= bound * (1 + 1e-12)).all()
    # Every lift-off is counted, and nothing is clamped inside a legal grid at the model's rate.
    assert renderer.counters.lift_offs == np.count_nonzero(~np.isfinite(hand).all(axis=0))
    assert renderer.counters.clamped == 0


@settings(max_examples=100, deadline=None)
@given(
    models(),
    HANDS,
    st.sampled_from([(0.0, 2.0), (-0.0, 2.0), (200.0, 0.0), (200.0, -3.0), (np.nan, 1.0)]),
    st.sampled_from(RATES_HZ),
    st.integers(1, 60),
)
# Gains of which no ramp can be made; the first one was found by hypothesis.
@example(two_layers(5e-324, 0.0), TOUCHING, (0.0, 2.0), 5000.0, 1)
@example(two_layers(0.0, 1e-320), TOUCHING, (200.0, 0.0), 48000.0, 1)
def test_at_rest_it_fades_within_5_ms_and_is_exactly_silent(
    model: TextureModel,
    hand: Floats,
    rest: tuple[float, float],
    rate_hz: float,
    update_samples: int,
) -> None:
    """5 ms after the update that sees it, in whole updates, and what is interpolated.

    A missing hand is held for 20 ms and contact for 3 ms more, or for one update.
    """
    renderer = Renderer(model, rate_hz=rate_hz, update_samples=update_samples)
    renderer.render(*hand)
    own, share = renderer.plan.own, rate_hz / MODEL_RATE_HZ
    period = own.update_samples
    seen_at = -(-hand.shape[1] // (period * share)) * period
    held = HOLD_S if np.isnan(rest[0]) else RELEASE_S if rest[1] <= 0 else 0.0
    seen_at += (int(held * MODEL_RATE_HZ) // period + 1) * period if held else 0
    fade = np.ceil(FADE_S * MODEL_RATE_HZ / period) * period
    kept = 0 if rate_hz == MODEL_RATE_HZ else 37
    silent = int((seen_at + fade + kept) * share) + 1 - hand.shape[1]
    signal = renderer.render(*rest, samples=silent + 400)
    assert not signal[silent:].any()


@st.composite
def strokes(draw: st.DrawFn) -> Floats:
    """(2, n) speeds and forces with lift-offs of all lengths."""
    pieces = draw(st.lists(st.tuples(st.booleans(), st.integers(1, 250)), min_size=2, max_size=8))
    lengths = [length for _, length in pieces]
    forces = [2.0 if down else 0.0 for down, _ in pieces]
    return np.stack([np.full(sum(lengths), 200.0), np.repeat(forces, lengths)])


def mean_squares(signal: Floats, window_s: float) -> Floats:
    """The running mean square of `Limits`, as a sum over the whole past at each sample."""
    age = np.arange(signal.size) / (window_s * MODEL_RATE_HZ)
    weights = np.exp(-age) * -np.expm1(-1 / (window_s * MODEL_RATE_HZ))
    running: Floats = np.convolve(signal**2, weights)[: signal.size]
    return running


def longest_vibration(signal: Floats, unlimited: Floats, pause: int) -> int:
    """Samples from the start of a vibration to its last sound; a pause of the input ends it."""
    heard = "".join("1" if abs(sample) > SILENCE else "0" for sample in unlimited)
    begin = len(heard) - len(heard.lstrip("0"))
    pauses = [m.span() for m in re.finditer(f"0{{{pause},}}", heard) if m.end() > begin]
    spans = [
        (end, start) for (_, end), (start, _) in pairwise([(0, begin), *pauses, (len(heard), 0)])
    ]
    sounds = [np.flatnonzero(np.abs(signal[start:stop]) > SILENCE) for start, stop in spans]
    return max((int(sound[-1]) + 1 for sound in sounds if sound.size), default=0)


def check_within(signal: Floats, unlimited: Floats, limits: Limits) -> None:
    assert np.isfinite(signal).all()
    assert np.abs(signal).max() <= limits.peak
    if np.isfinite(limits.rms):
        assert mean_squares(signal, limits.rms_window_s).max() <= limits.rms**2 * (1 + 1e-9)
        sums = np.cumsum(np.concatenate([[0.0], signal**2]))
        for count in {1, min(7, signal.size), signal.size}:  # samples on end
            most = limits.largest_rms(count / MODEL_RATE_HZ) ** 2 * count
            assert (sums[count:] - sums[:-count]).max() <= most * (1 + 1e-9)
    if np.isfinite(limits.duration_s):
        pause = max(1, round(limits.pause_s * MODEL_RATE_HZ))
        longest = max(1, round(limits.duration_s * MODEL_RATE_HZ))
        assert longest_vibration(signal, unlimited, pause) <= longest


SILENCE = Limits().silence
LEVELS = st.floats(-3, 1).map(lambda exponent: 10**exponent)
SECONDS = st.floats(1e-4, 0.1)


@settings(max_examples=100, deadline=None)
@given(strokes(), LEVELS, LEVELS, SECONDS, SECONDS, SECONDS, SEEDS)
def test_all_limits_hold_at_once(
    stroke: Floats,
    peak: float,
    rms: float,
    window_s: float,
    duration_s: float,
    pause_s: float,
    seed: int,
) -> None:
    unlimited = Renderer(two_layers(0.1, 1.0), seed=seed).render(*stroke)
    limits = Limits(
        peak=peak, rms=rms, rms_window_s=window_s, duration_s=duration_s, pause_s=pause_s
    )
    signal = Renderer(two_layers(0.1, 1.0), seed=seed, limits=limits).render(*stroke)
    check_within(signal, unlimited, limits)


@settings(max_examples=100, deadline=None)
@given(strokes(), st.sampled_from(["peak", "rms", "duration"]), LEVELS, SECONDS, SECONDS, SEEDS)
def test_counters_tell_how_many_samples_a_limit_changed(
    stroke: Floats, which: str, level: float, seconds: float, pause_s: float, seed: int
) -> None:
    limits = {
        "peak": Limits(peak=level),
        "rms": Limits(rms=level, rms_window_s=seconds),
        "duration": Limits(duration_s=seconds, pause_s=pause_s),
    }[which]
    unlimited = Renderer(two_layers(0.1, 1.0), seed=seed).render(*stroke)
    renderer = Renderer(two_layers(0.1, 1.0), seed=seed, limits=limits)
    signal = renderer.render(*stroke)
    changed = int(np.count_nonzero(signal != unlimited))
    counters = vars(renderer.counters)
    assert counters.pop(f"limited_{which}") == changed
    assert not any(counters.values())
    check_within(signal, unlimited, limits)
    assert (np.abs(signal) <= np.abs(unlimited)).all()


@settings(max_examples=60, deadline=None)
@given(models(loudest=1.7e308), HANDS, LEVELS, LEVELS, SEEDS)
def test_limits_hold_where_the_sum_of_the_layers_overflows(
    model: TextureModel, hand: Floats, peak: float, rms: float, seed: int
) -> None:
    with np.errstate(over="ignore"):
        limits = Limits(peak=peak, rms=rms)
        signal = Renderer(model, seed=seed, limits=limits, update_samples=3).render(*hand)
        check_within(signal, signal, limits)
        only_rms = Renderer(model, seed=seed, limits=Limits(rms=rms)).render(*hand)
        check_within(only_rms, only_rms, Limits(rms=rms))


def test_an_overflow_is_limited_and_counted_and_leaves_nothing_behind() -> None:
    shape = (2, 2, 3)
    model = TextureModel(
        texture="overflowing",
        rate_hz=MODEL_RATE_HZ,
        speeds_mm_s=[50.0, 350.0],
        forces_n=[0.5, 3.5],
        noise_gains=np.full((2, 2), 1.7e308),
        frequencies_hz=np.broadcast_to([90.0, 600.0, 1500.0], shape),
        bandwidths_hz=np.full(shape, 2000.0),
        gains=np.broadcast_to([-1.7e308, 1.7e308, 1.7e308], shape),
        level_sd_db=np.zeros(shape),
        estimator="planted",
    )
    unlimited = Renderer(model, seed=1).render(200.0, 2.0, samples=500)
    assert np.isnan(unlimited).any()
    assert np.isinf(unlimited).any()
    renderer = Renderer(model, seed=1, limits=Limits(peak=2.0))
    signal = renderer.render(200.0, 2.0, samples=500)
    loud = ~(np.abs(unlimited) <= 2.0)
    assert renderer.counters.limited_peak == loud.sum()
    assert (signal[loud] == np.nan_to_num(2.0 * np.sign(unlimited[loud]))).all()
    assert not renderer.render(0.0, 2.0, samples=100)[30:].any()


# --- Realised peak and width


def realised_bands(frequency_hz: Floats, bandwidth_hz: Floats, rate_hz: float) -> Floats:
    """The kernel's own coefficients (p, q, r, b1, b2, tap) of n bands, (6, n)."""
    angle = np.pi / rate_hz
    pairs = zip(frequency_hz.tolist(), bandwidth_hz.tolist(), strict=True)
    bands = [_kernel.lib.tq_band_of(angle * f, angle * b) for f, b in pairs]
    return np.array([[b.p, b.q, b.r, b.b1, b.b2, b.tap] for b in bands]).T


def power_response(angle: Floats, bands: Floats) -> Floats:
    """|H|² of the state equations at (n,) angles 2πf/rate, one for each of n bands.

    band = tap·(s1 + s1′) with (zI − A)·s = b·w and A = I + (p, −q; q, r).
    """
    p, q, r, b1, b2, tap = bands
    beyond = 2j * np.sin(angle / 2) * np.exp(0.5j * angle)  # z − 1, without cancellation
    to_p, to_r = beyond - p, beyond - r
    s1 = (to_r * b1 - q * b2) / (to_p * to_r + q * q)
    response: Floats = np.abs(tap * (1 + np.exp(1j * angle)) * s1) ** 2
    return response


@pytest.mark.parametrize("rate_hz", RATES_HZ)
def test_realised_width_and_peak_are_those_asked_for(rate_hz: float) -> None:
    """Solved from the state equations, over the whole legal range with its edges."""
    frequency_hz, bandwidth_hz = (
        grid.ravel()
        for grid in np.meshgrid(
            np.geomspace(1, 0.49 * rate_hz, 60), np.geomspace(0.1, 0.45 * rate_hz, 60)
        )
    )
    bands = realised_bands(frequency_hz, bandwidth_hz, rate_hz)
    centre = 2 * np.pi * frequency_hz / rate_hz

    def above_half(angle: Floats, *values: Floats) -> Floats:
        return power_response(angle, np.array(values)) - 0.5

    def edge_from(end: float) -> Floats:
        found = elementwise.find_root(
            above_half, (np.full_like(centre, end), centre), args=(*bands,)
        )
        assert found.success.all()
        return found.x

    lower, upper = edge_from(1e-12), edge_from(np.pi - 1e-12)
    width_hz = (upper - lower) * rate_hz / (2 * np.pi)
    inside = lower + (upper - lower) * np.linspace(0, 1, 201)[:, None]
    peak = np.sqrt(
        np.maximum(
            power_response(inside, bands[:, None]).max(axis=0), power_response(centre, bands)
        )
    )
    print(
        f"\n{rate_hz:g} Hz: width within {np.abs(width_hz / bandwidth_hz - 1).max():.1e}, "
        f"peak within {np.abs(peak - 1).max():.1e}"
    )
    assert width_hz == pytest.approx(bandwidth_hz, rel=1e-8)
    assert peak == pytest.approx(1, abs=1e-8)
