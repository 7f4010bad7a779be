"""Rendering: block sizes, rates, lift-off, ramps and the spectrum that comes out."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter, welch

from tactileq.modeling import (
    ARModel,
    Compensation,
    InputError,
    Limits,
    RegressedModel,
    Renderer,
    TextureModel,
)
from tactileq.modeling.engines import SWITCH
from tactileq.modeling.errors import shown
from tactileq.modeling.hand import Hand
from tactileq.modeling.models.compiled_for import CompiledFor
from tactileq.modeling.models.line_spectral import line_spectral_frequencies
from tactileq.modeling.rendering.compiled import Call, is_compiled
from tactileq.modeling.rendering.reference.hand import Extrapolator
from tactileq.modeling.rendering.reference.lattice import LatticeFilter
from tests.refusals import refused


@pytest.fixture(scope="module", autouse=True, params=["compiled", "python"])
def engine(request: pytest.FixtureRequest) -> Iterator[None]:
    """Everything here holds for the compiled kernel and without it."""
    with pytest.MonkeyPatch.context() as patch:
        if request.param == "python":
            patch.setenv(SWITCH, "1")
        elif Call is None:
            pytest.skip("the kernel was not compiled")
        assert is_compiled() is (request.param == "compiled")
        yield


# Levels and spectra of long signals: one engine tells, since both give the same bits
# (test_kernel.py).
once = pytest.mark.parametrize("engine", ["python" if Call is None else "compiled"], indirect=True)

ModelMaker = Callable[..., TextureModel]
FallingMaker = Callable[..., RegressedModel]


LAYERS = [(80.0, 25.0, 0.5), (300.0, 40.0, -0.3), (900.0, 120.0, 0.4)]


def moving_model(rate_hz: float = 5000.0) -> TextureModel:
    """Three layers whose parameters all depend on speed and force."""
    v = np.array([50.0, 150.0, 350.0])[:, None]
    f = np.array([0.5, 2.0])[None, :]
    one = np.ones((3, 2))
    return TextureModel(
        texture="moving",
        rate_hz=rate_hz,
        speeds_mm_s=v[:, 0],
        forces_n=f[0],
        noise_gains=0.02 + 1e-4 * v * f,
        frequencies_hz=np.stack([0.5 * v * one, 300 + v * f, 900 - 10 * f * one], axis=-1),
        bandwidths_hz=np.stack([20 + 5 * f * one, 40 + 0.1 * v * one, 100 * one], axis=-1),
        gains=np.stack([1e-3 * v * f, -0.2 * f * one, 0.3 * one], axis=-1),
        level_sd_db=np.zeros((3, 2, 3)),
        estimator="planted",
    )


def trajectory(count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.uniform(-500, 500, count), rng.uniform(-1, 5, count)


def blocks_of(size: int) -> int:
    """Samples of six blocks and more, and of ten updates: 48 samples apart at the highest rate."""
    return 1500 if size > 100 else 500


def in_blocks(renderer: Renderer, speed: np.ndarray, force: np.ndarray, size: int) -> np.ndarray:
    starts = range(0, speed.size, size)
    return np.concatenate(
        [renderer.render(speed[i : i + size], force[i : i + size]) for i in starts]
    )


@pytest.mark.parametrize("rate_hz", [5000.0, 44100.0, 48000.0])
@pytest.mark.parametrize("size", [1, 7, 256])
def test_blocks_of_any_size_are_bit_identical(rate_hz: float, size: int) -> None:
    speed, force = trajectory(blocks_of(size))
    whole = Renderer(moving_model(), rate_hz=rate_hz, seed=5).render(speed, force)
    parts = in_blocks(Renderer(moving_model(), rate_hz=rate_hz, seed=5), speed, force, size)
    assert np.array_equal(whole, parts)
    assert np.ptp(whole) > 0


@pytest.mark.parametrize("size", [1, 7, 256])
def test_blocks_are_bit_identical_behind_compensation_and_limits(size: int) -> None:
    def limited() -> Renderer:
        limits = Limits(peak=0.2, rms=0.08, rms_window_s=0.02, duration_s=0.1, pause_s=0.01)
        notch = Compensation(frequency_hz=80.0, bandwidth_hz=60.0, height=3.0, rate_hz=5000.0)
        return Renderer(moving_model(), seed=5, limits=limits, compensation=notch)

    speed, force = np.full(1500, 200.0), np.full(1500, 2.0)
    force[700:900] = 0.0
    whole, parts = limited(), limited()
    assert np.array_equal(whole.render(speed, force), in_blocks(parts, speed, force, size))
    assert whole.counters == parts.counters
    assert whole.counters.limited_peak * whole.counters.limited_rms > 0
    assert whole.counters.limited_duration > 0


@settings(deadline=None, max_examples=30)
@given(st.lists(st.integers(0, 90), min_size=1, max_size=8))
def test_ragged_blocks_are_bit_identical(sizes: list[int]) -> None:
    speed, force = trajectory(sum(sizes), seed=1)
    whole = Renderer(moving_model(), seed=1).render(speed, force)
    renderer, parts, at = Renderer(moving_model(), seed=1), [np.zeros(0)], 0
    for size in sizes:
        parts.append(renderer.render(speed[at : at + size], force[at : at + size]))
        at += size
    assert np.array_equal(whole, np.concatenate(parts))


def test_scalars_equal_constant_arrays() -> None:
    by_scalar = Renderer(moving_model()).render(120.0, 1.1, samples=333)
    by_array = Renderer(moving_model()).render(np.full(333, 120.0), np.full(333, 1.1))
    assert np.array_equal(by_scalar, by_array)


def test_seed_and_stream_choose_the_noise() -> None:
    def render(**which: int) -> np.ndarray:
        return Renderer(moving_model(), **which).render(200.0, 1.0, samples=400)

    assert np.array_equal(render(seed=3, stream=2), render(seed=3, stream=2))
    assert not np.array_equal(render(seed=3), render(seed=4))
    assert not np.array_equal(render(seed=3), render(seed=3, stream=1))


def test_rendering_follows_the_written_recursion() -> None:
    """docs/method/equalizer.md#recursion step by step with numpy's tangent, constant parameters."""
    from tactileq.modeling.rendering.noise import stream_key, white_noise

    model, count = moving_model(), 600
    w = white_noise(stream_key(8), 0, count)
    peq = model.peq(150.0, 2.0)
    expected = peq.noise_gain * w
    for f, b, gain in zip(peq.frequencies_hz, peq.bandwidths_hz, peq.gains, strict=True):
        g = np.tan(np.pi * f / 5000)
        K = 2 * np.tan(np.pi * b / 5000) / np.sin(2 * np.pi * f / 5000)
        a1 = 1 / (1 + g * (g + K))
        s1 = s2 = 0.0
        for n in range(count):
            v3 = np.sqrt(K / g) * w[n] - s2
            v1 = a1 * s1 + g * a1 * v3
            v2 = s2 + g * a1 * s1 + g * g * a1 * v3
            s1, s2 = 2 * v1 - s1, 2 * v2 - s2
            expected[n] += gain * np.sqrt(K * g) * v1
    assert Renderer(model, seed=8).render(150.0, 2.0, samples=count) == pytest.approx(
        expected, abs=1e-11
    )


def mean_spectrum(signal: np.ndarray, size: int) -> np.ndarray:
    """Mean |FFT| over (√(πN)/2) of consecutive pieces."""
    pieces = signal[: signal.size // size * size].reshape(-1, size)
    return np.abs(np.fft.rfft(pieces, axis=1)).mean(axis=0) / (np.sqrt(np.pi * size) / 2)


@once
def test_mean_spectrum_is_the_response(make_model: ModelMaker) -> None:
    model = make_model(0.05, LAYERS)
    signal = Renderer(model, seed=2).render(200.0, 2.0, samples=305_000)[5000:]
    measured = mean_spectrum(signal, 5000)[10:2450].reshape(-1, 20).mean(axis=1)
    expected = model.peq(200.0, 2.0).response(np.arange(10.0, 2450.0)).reshape(-1, 20).mean(axis=1)
    # 60 pieces × 20 bins of Rayleigh spread 0.52: standard error 1.5 %.
    assert measured == pytest.approx(expected, rel=0.07)
    assert np.mean(measured / expected) == pytest.approx(1, abs=0.005)


@once
@pytest.mark.parametrize("rate_hz", [44100.0, 48000.0])
def test_density_does_not_depend_on_the_rate(make_model: ModelMaker, rate_hz: float) -> None:
    model = make_model(0.05, LAYERS)
    peq = model.peq(200.0, 2.0)
    skipped, size = round(rate_hz / 5), round(rate_hz / 2)
    signal = Renderer(model, rate_hz=rate_hz, seed=2).render(
        200.0, 2.0, samples=skipped + 12 * size
    )
    pieces = signal[skipped:].reshape(12, size)
    density = 2 / rate_hz / size * (np.abs(np.fft.rfft(pieces, axis=1)) ** 2).mean(axis=0)
    frequency = np.arange(density.size) * 2.0

    def level_db(low: float, high: float, response: np.ndarray) -> float:
        inside = (frequency >= low) & (frequency < high)
        expected = response[inside] ** 2 * 2 / 5000
        return float(10 * np.log10(density[inside].sum() / expected.sum()))

    own = peq.response(np.minimum(frequency, 2500.0))
    # Standard error 4.34/√(bins · pieces): 0.3 dB in the narrowest band, 0.1 dB in the widest.
    for low, high in ((60, 100), (250, 350), (400, 700), (800, 1000), (1200, 1800), (1900, 2250)):
        assert abs(level_db(low, high, own)) < 0.8
    assert abs(level_db(10, 2250, own)) < 0.3
    # Nothing is left above the model's band.
    place, smooth = welch(signal[skipped:], rate_hz, window="blackmanharris", nperseg=8192)
    assert smooth[place >= 2750].sum() < 1e-6 * smooth.sum()


@once
@pytest.mark.parametrize("rate_hz", [5000.0, 44100.0, 48000.0])
def test_noise_alone_keeps_its_rms_at_any_rate(make_model: ModelMaker, rate_hz: float) -> None:
    signal = Renderer(make_model(0.1, []), rate_hz=rate_hz).render(
        200.0, 2.0, samples=round(4 * rate_hz)
    )
    assert np.sqrt(np.mean(signal**2)) == pytest.approx(0.1, rel=0.02)


@once
def test_band_level_is_right_while_parameters_jump() -> None:
    """20 ↔ 1500 Hz each millisecond: still G²·k/(1+k), where plain filters gain 10 to 33 dB."""
    model = TextureModel(
        texture="jumping",
        rate_hz=5000.0,
        speeds_mm_s=[100.0, 300.0],
        forces_n=[1.0, 3.0],
        noise_gains=np.zeros((2, 2)),
        frequencies_hz=np.broadcast_to(np.array([20.0, 1500.0])[:, None, None], (2, 2, 1)),
        bandwidths_hz=np.full((2, 2, 1), 50.0),
        gains=np.ones((2, 2, 1)),
        level_sd_db=np.zeros((2, 2, 1)),
        estimator="planted",
    )
    count = 150_000
    speed = np.where(np.arange(count) // 5 % 2, 300.0, 100.0)
    signal = Renderer(model, seed=1).render(speed, np.full(count, 2.0))
    k = np.tan(np.pi * 50 / 5000)
    assert 10 * np.log10(np.mean(signal**2) / (k / (1 + k))) == pytest.approx(0, abs=0.3)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_lift_off_is_counted_and_harmless(bad: float) -> None:
    speed, force = np.full(2000, 150.0), np.full(2000, 2.0)
    clean = Renderer(moving_model(), seed=6).render(speed, force)
    speed[500:720], force[715:730] = bad, bad
    renderer = Renderer(moving_model(), seed=6)
    signal = renderer.render(speed, force)
    assert renderer.counters.lift_offs == 230
    held = 500 + 100  # 20 ms from the last reading, at 495, on, to the first update after that
    assert np.array_equal(signal[:held], clean[:held])
    assert np.abs(signal[held : held + 25]).max() < np.abs(clean).max()  # fades within 5 ms
    assert not signal[held + 25 : 730].any()
    assert np.isfinite(signal).all()
    # The poles forget within a fraction of a second; the state was never poisoned.
    assert signal[-200:] == pytest.approx(clean[-200:], abs=1e-6)


def test_nothing_is_clamped_or_counted_in_a_legal_stroke() -> None:
    model = moving_model(rate_hz=5000.0)
    renderer = Renderer(model)
    renderer.render(150.0, 2.0, samples=50)
    assert renderer.counters.clamped == 0
    assert renderer.counters.lift_offs == 0


def test_direction_of_motion_does_not_matter() -> None:
    speed, force = trajectory(700)
    forth = Renderer(moving_model()).render(speed, force)
    assert np.array_equal(forth, Renderer(moving_model()).render(-speed, force))


@pytest.mark.parametrize(("speed", "force"), [(0.0, 2.0), (200.0, 0.0), (200.0, -1.0), (0, 0)])
def test_silence_at_rest_and_off_the_surface(speed: float, force: float) -> None:
    assert not Renderer(moving_model()).render(speed, force, samples=200).any()


@pytest.mark.parametrize(
    ("rate_hz", "period"), [(5000.0, 5), (48000.0, 48)], ids=["5 kHz", "48 kHz"]
)
def test_parameters_are_read_once_a_millisecond(rate_hz: float, period: int) -> None:
    speed, force = trajectory(10 * period)
    held = np.arange(speed.size) // period * period
    whole = Renderer(moving_model(), rate_hz=rate_hz).render(speed, force)
    assert np.array_equal(
        whole, Renderer(moving_model(), rate_hz=rate_hz).render(speed[held], force[held])
    )
    speed[7 * period] += 40.0
    changed = Renderer(moving_model(), rate_hz=rate_hz).render(speed, force)
    assert np.flatnonzero(changed != whole)[0] >= 7 * period
    assert np.flatnonzero(changed != whole)[0] <= 7 * period + 1


def test_no_layers_renders_the_noise_alone(make_model: ModelMaker) -> None:
    from tactileq.modeling.rendering.noise import stream_key, white_noise

    signal = Renderer(make_model(0.3, []), seed=4).render(200.0, 2.0, samples=100)
    assert signal == pytest.approx(0.3 * white_noise(stream_key(4), 0, 100), rel=1e-14)


def test_zero_samples_give_an_empty_signal() -> None:
    assert Renderer(moving_model()).render([], []).shape == (0,)
    assert Renderer(moving_model()).render(1.0, 1.0, samples=0).shape == (0,)


@pytest.mark.parametrize("rate_hz", [4999.0, 0.0, np.nan, np.inf])
def test_rates_below_the_models_are_refused(rate_hz: float) -> None:
    with refused(InputError, expected="5000 Hz", got=f"{rate_hz:g}"):
        Renderer(moving_model(), rate_hz=rate_hz)


@pytest.mark.parametrize(
    ("speed", "force", "samples", "got"),
    [
        (1.0, 1.0, None, ["()", "samples=None"]),
        ([1.0, 2.0], [1.0], None, ["(2,)", "(1,)"]),
        ([1.0], 1.0, None, ["(1,)", "()"]),
        ([1.0], [1.0], 1, ["(1,)", "samples=1"]),
        ([[1.0]], [[1.0]], None, "(1, 1)"),
    ],
)
def test_mismatched_trajectories_are_refused(
    speed: float | Sequence[float],
    force: float | Sequence[float],
    samples: int | None,
    got: object,
) -> None:
    with refused(InputError, expected=["speed", "force", "samples"], got=got):
        Renderer(moving_model()).render(speed, force, samples=samples)


def test_a_compiled_model_is_updated_as_its_scene_allows() -> None:
    note = CompiledFor("planted", "", "", {}, 3e-3, False)
    model = replace(moving_model(), compiled_for=note)
    assert Renderer(moving_model()).update_samples == 5
    assert Renderer(model).update_samples == 15
    assert Renderer(model, rate_hz=48000.0).update_samples == 144
    assert Renderer(model, update_samples=5).update_samples == 5
    often = replace(model, compiled_for=replace(note, update_s=1e-9))
    assert Renderer(often).update_samples == 1


@pytest.mark.parametrize("update_samples", [0, -1, 2.5, 2**31])
def test_update_periods_out_of_range_are_refused(update_samples: int) -> None:
    with refused(InputError, expected=[1, 1000000], got=[update_samples, "update_samples"]):
        Renderer(moving_model(), update_samples=update_samples)


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, 1e-200])
@pytest.mark.parametrize("name", ["peak", "rms", "rms_window_s", "duration_s", "pause_s"])
def test_limits_that_limit_nothing_or_all_are_refused(name: str, value: float) -> None:
    with refused(InputError, expected=[name, 0], got=value):
        Limits(**{name: value})


@pytest.mark.parametrize("name", ["rms_window_s", "pause_s", "silence"])
def test_times_of_limits_are_finite(name: str) -> None:
    with refused(InputError, expected=[name, 0, "finite"], got="inf"):
        Limits(**{name: np.inf})


def test_limits_that_are_never_reached_touch_nothing() -> None:
    speed, force = trajectory(1200)
    renderer = Renderer(moving_model(), limits=Limits(peak=1e150, rms=1e150, duration_s=1e300))
    assert np.array_equal(
        renderer.render(speed, force), Renderer(moving_model()).render(speed, force)
    )
    counters = renderer.counters
    assert counters.limited_peak == counters.limited_rms == counters.limited_duration == 0


def test_a_compensation_for_another_rate_is_refused() -> None:
    class Notch:
        rate_hz, frequency_hz, bandwidth_hz, band_share = 48000.0, 80.0, 20.0, 0.5

    with refused(InputError, expected=["compensation", "5000 Hz"], got="48000 Hz"):
        Renderer(moving_model(), compensation=Notch())


@pytest.mark.parametrize("noise_mm_s", [0.0, 0.01])
def test_a_device_that_was_muted_sounds_again_after_a_rest(noise_mm_s: float) -> None:
    """With a compensation that rings on, and speeds that are never quite 0."""
    notch = Compensation(frequency_hz=80.0, bandwidth_hz=60.0, height=3.0, rate_hz=5000.0)
    limits = Limits(duration_s=0.5, pause_s=0.1)
    renderer = Renderer(moving_model(), limits=limits, compensation=notch)
    assert np.ptp(renderer.render(150.0, 2.0, samples=2500)) > 0
    assert not renderer.render(150.0, 2.0, samples=2500).any()
    touched = renderer.counters.limited_duration
    assert touched >= 2500 - 1
    rest = np.random.default_rng(0).normal(0, 1, 2000) * noise_mm_s
    renderer.render(rest, np.full(2000, 2.0))
    assert np.ptp(renderer.render(150.0, 2.0, samples=2000)) > 0.1
    renderer.render(0.0, 2.0, samples=20_000)
    assert not renderer.render(0.0, 2.0, samples=100).any()  # no ringing among subnormal numbers


def test_the_clock_of_the_duration_starts_with_the_sound() -> None:
    renderer = Renderer(moving_model(), limits=Limits(duration_s=0.2, pause_s=0.1))
    renderer.render(0.0, 2.0, samples=400)  # shorter than a pause
    heard = renderer.render(150.0, 2.0, samples=2000)
    assert np.flatnonzero(heard)[-1] - np.flatnonzero(np.abs(heard) > Limits().silence)[0] == 999


def test_an_overflow_does_not_stay_in_the_compensation() -> None:
    model = moving_model()
    loud = replace(model, gains=model.gains * 1e308, noise_gains=model.noise_gains * 1e308)
    notch = Compensation(frequency_hz=80.0, bandwidth_hz=60.0, height=3.0, rate_hz=5000.0)
    renderer = Renderer(loud, limits=Limits(peak=1.0), compensation=notch)
    with np.errstate(over="ignore"):
        signal = renderer.render(150.0, 2.0, samples=3000)
    assert np.isfinite(signal).all()
    # From 1e308 to nothing in 8 s: 632 powers of ten at π·60 Hz nepers a second.
    after = renderer.render(0.0, 2.0, samples=40_000)
    assert not after[-100:].any()


@once
def test_noise_of_the_readings_is_not_carried_on() -> None:
    """2 mm/s of it, read at every update or 125 times a second; against the clean stroke."""
    time_s = np.arange(10_000) / 5000
    clean = 300 * np.sin(4 * np.pi * time_s)
    noisy = clean + np.random.default_rng(1).normal(0, 2, clean.size)
    force = np.full(clean.size, 1.5)
    exact = Renderer(moving_model(), update_samples=1).render(clean, force)

    def error_db(speed: np.ndarray, update_samples: int = 5) -> float:
        renderer = Renderer(moving_model(), update_samples=update_samples)
        rendered = renderer.render(speed, force)
        return float(20 * np.log10(np.std(rendered - exact) / np.std(exact)))

    assert error_db(clean) < -50
    assert error_db(noisy) < -34
    held = noisy[np.arange(clean.size) // 40 * 40]  # a device that reads 125 times a second
    assert error_db(held) < error_db(held, update_samples=1) + 0.5
    assert error_db(held, update_samples=40) < error_db(held) - 5


@once
def test_a_steady_hand_with_noise_is_as_loud_as_without() -> None:
    speed = 150 + np.random.default_rng(2).normal(0, 5, 50_000)
    force = np.full(speed.size, 1.5)
    noisy = Renderer(moving_model()).render(speed, force)
    assert np.std(noisy) == pytest.approx(
        np.std(Renderer(moving_model()).render(150.0, 1.5, samples=speed.size)), rel=0.02
    )


@pytest.mark.parametrize("edge", [1.0, 2450.0])
def test_legal_edges_are_not_counted_as_clamped(edge: float) -> None:
    model = moving_model()
    frequencies = np.full_like(model.frequencies_hz, edge)
    renderer = Renderer(replace(model, frequencies_hz=frequencies))
    renderer.render(*np.abs(trajectory(3000)))
    assert renderer.counters.clamped == 0


def test_a_gain_that_its_regression_stops_at_0_fades_as_slowly_as_others(
    make_falling: FallingMaker,
) -> None:
    """What the corners of the table have beyond 0 is never reached and makes no fade faster."""
    table = make_falling().table
    assert table.values[..., 0].min() < -0.1
    assert table.largest_gains == pytest.approx([0.15, 1.5])


def test_a_table_of_parameters_that_overflow_is_refused(make_falling: FallingMaker) -> None:
    huge = make_falling(amplitudes=[[1e308], [1e308], [0], [0]])
    with (
        refused(InputError, expected="parameters", got=["NaN", "inf"]),
        np.errstate(over="ignore"),
    ):
        Renderer(huge)


@pytest.mark.parametrize("seed", [1.5, -1, 2**64, "a", True])
def test_seeds_are_whole_numbers(seed: object) -> None:
    with refused(InputError, expected=["seed", 0, "2⁶⁴"], got=shown(seed)):
        Renderer(moving_model(), seed=seed)


def test_arrays_of_any_layout_and_kind_are_taken() -> None:
    speed, force = trajectory(600)
    expected = Renderer(moving_model()).render(speed[::2].copy(), force[::-2].copy())
    speed.setflags(write=False)
    assert np.array_equal(Renderer(moving_model()).render(speed[::2], force[::-2]), expected)
    whole = Renderer(moving_model()).render([100, 200], np.array([1, 2], dtype=np.int16))
    assert np.array_equal(whole, Renderer(moving_model()).render([100.0, 200.0], [1.0, 2.0]))


# --- autoregressive models


def ar_model(order: int = 6) -> ARModel:
    """Frequencies that move with speed, gains that grow with force."""
    even = np.pi * np.arange(1, order + 1) / (order + 1)
    towards = np.linspace(0.2, 0.6, 3)[:, None, None] * np.ones((3, 2, 1))
    # Warped towards 0: a resonance at low frequencies, stronger for faster strokes.
    return ARModel(
        texture="all-pole",
        rate_hz=5000.0,
        speeds_mm_s=[50.0, 150.0, 350.0],
        forces_n=[0.5, 2.0],
        line_spectral_frequencies=(1 - towards) * even + towards * even**2 / np.pi,
        gains=0.1 * np.array([[1.0, 2.0]] * 3),
        level_sd_db=np.zeros((3, 2)),
    )


def jumping_ar_model() -> ARModel:
    """A resonance of 10 Hz width at 20 Hz or at 2300 Hz, by speed."""
    poles = [np.exp(np.pi / 5000 * (-10 + 2j * f)) for f in (20.0, 2300.0)]
    frequencies = [line_spectral_frequencies(np.poly([z, z.conj()]).real[1:]) for z in poles]
    return ARModel(
        texture="jumping",
        rate_hz=5000.0,
        speeds_mm_s=[100.0, 300.0],
        forces_n=[1.0, 3.0],
        line_spectral_frequencies=np.stack([frequencies] * 2, axis=1),
        gains=np.ones((2, 2)),
        level_sd_db=np.zeros((2, 2)),
    )


@pytest.mark.parametrize("size", [1, 7, 256])
@pytest.mark.parametrize("order", [1, 6, 21])
def test_ar_blocks_of_any_size_are_bit_identical(order: int, size: int) -> None:
    speed, force = trajectory(blocks_of(size))
    whole = Renderer(ar_model(order), seed=5).render(speed, force)
    assert np.array_equal(whole, in_blocks(Renderer(ar_model(order), seed=5), speed, force, size))
    assert np.ptp(whole) > 0


@pytest.mark.parametrize("order", [1, 2, 7, 20])
def test_ar_rendering_is_the_recursion_of_its_filter(order: int) -> None:
    """scipy's direct form on the same noise, constant parameters."""
    from tactileq.modeling.rendering.noise import stream_key, white_noise

    fitted = ar_model(order).filter(150.0, 2.0)
    noise = white_noise(stream_key(8, 3), 0, 2000)
    expected = lfilter([fitted.gain], [1.0, *fitted.coefficients], noise)
    rendered = Renderer(ar_model(order), seed=8, stream=3).render(150.0, 2.0, samples=2000)
    assert rendered == pytest.approx(expected, abs=1e-11)


def test_ar_parameters_are_foreseen_as_those_of_layers_are() -> None:
    """A 2 Hz stroke with updates each millisecond, against updates at every sample."""
    time_s = np.arange(5000) / 5000
    speed, force = 250 * np.sin(4 * np.pi * time_s), np.full(5000, 1.5)
    exact = Renderer(ar_model(), update_samples=1).render(speed, force)
    error = Renderer(ar_model()).render(speed, force) - exact
    assert 20 * np.log10(np.std(error) / np.std(exact)) < -40


def test_models_of_both_kinds_are_driven_by_the_same_noise() -> None:
    from tactileq.modeling.rendering.noise import stream_key, white_noise

    flat = np.pi * np.arange(1, 4) / 4  # a₁ = a₂ = a₃ = 0
    model = replace(
        ar_model(3),
        line_spectral_frequencies=np.broadcast_to(flat, (3, 2, 3)),
        gains=np.ones((3, 2)),
    )
    assert Renderer(model, seed=4).render(200.0, 2.0, samples=100) == pytest.approx(
        white_noise(stream_key(4), 0, 100), abs=1e-12
    )


@once
def test_ar_level_is_right_while_poles_jump() -> None:
    """20 ↔ 2300 Hz each millisecond: a direct form explodes, the lattice keeps its level."""
    model, count = jumping_ar_model(), 100_000
    speed = np.where(np.arange(count) // 5 % 2, 300.0, 100.0)
    signal = Renderer(model, seed=1).render(speed, np.full(count, 2.0))
    filters = [model.filter(v, 2.0) for v in (100.0, 300.0)]
    impulse = np.zeros(20_000)
    impulse[0] = 1
    variances = [np.sum(lfilter([1.0], [1.0, *f.coefficients], impulse) ** 2) for f in filters]
    for which, variance in enumerate(variances):
        part = signal[np.arange(count) // 5 % 2 == which]
        assert 10 * np.log10(np.mean(part**2) / variance) == pytest.approx(0, abs=0.5)
    # What is avoided: the same filters switched in a direct form on its past outputs.
    noise = np.random.default_rng(0).uniform(-1.7, 1.7, 200)
    past = [0.0, 0.0]
    for n, w in enumerate(noise):
        a1, a2 = filters[n // 5 % 2].coefficients
        past = [w - a1 * past[0] - a2 * past[1], past[0]]
    assert abs(past[0]) > 1e20


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_ar_lift_off_is_counted_and_harmless(bad: float) -> None:
    speed, force = np.full(2000, 150.0), np.full(2000, 2.0)
    clean = Renderer(ar_model(), seed=6).render(speed, force)
    speed[500:720], force[715:730] = bad, bad
    renderer = Renderer(ar_model(), seed=6)
    signal = renderer.render(speed, force)
    assert renderer.counters.lift_offs == 230
    assert np.array_equal(signal[:600], clean[:600])  # held for 20 ms
    assert not signal[625:730].any()  # fades within 5 ms
    assert signal[-200:] == pytest.approx(clean[-200:], abs=1e-6)


@pytest.mark.parametrize(("speed", "force"), [(0.0, 2.0), (200.0, 0.0), (200.0, -1.0)])
def test_ar_silence_at_rest_and_off_the_surface(speed: float, force: float) -> None:
    assert not Renderer(ar_model()).render(speed, force, samples=200).any()


@settings(max_examples=25)
@given(st.integers(0, 10_000))
def test_ar_output_stays_bounded_under_any_motion(seed: int) -> None:
    """The states hold no more energy than the noise brought: |y| ≤ RMS · √Σw²."""
    speed, force = trajectory(400, seed)
    signal = Renderer(jumping_ar_model(), seed=seed).render(speed, force)
    plan = Renderer(jumping_ar_model()).plan
    lattice = LatticeFilter(jumping_ar_model(), plan)
    settings = lattice.settings(*Extrapolator(plan, lattice.axes)(Hand(speed, force)))
    bound = max(gain for gain, *_ in settings) * max(rms for _, rms, _ in settings)
    bound *= np.sqrt(3 * 400)
    assert np.isfinite(signal).all()
    assert np.abs(signal).max() <= bound


@pytest.mark.parametrize("rate_hz", [4000.0, np.nan])
def test_ar_models_are_not_rendered_below_their_rate(rate_hz: float) -> None:
    with refused(InputError, expected="5000 Hz", got=f"{rate_hz:g}"):
        Renderer(ar_model(), rate_hz=rate_hz)


def test_any_layered_model_is_rendered() -> None:
    """Only rate_hz and table are asked for."""

    class Borrowed:
        rate_hz, table = 5000.0, moving_model().table

    speed, force = trajectory(300)
    assert np.array_equal(
        Renderer(Borrowed(), seed=2).render(speed, force),
        Renderer(moving_model(), seed=2).render(speed, force),
    )
