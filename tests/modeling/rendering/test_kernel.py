"""The compiled kernel gives the bits of the Python renderer."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import tactileq.modeling.rendering.compiled
from tactileq.modeling import Limits, Renderer, TextureModel, regressed
from tactileq.modeling.engines import SWITCH
from tactileq.modeling.equalizer.bands import band_coefficients
from tactileq.modeling.rendering.noise import stream_key, white_noise
from tactileq.stimuli.planted.textures import CATALOGUE, planted_texture

pytestmark = pytest.mark.skipif(
    tactileq.modeling.rendering.compiled.Call is None, reason="no kernel was compiled"
)


def wild_model(layers: int, seed: int = 0, *, rate_hz: float = 5000.0) -> TextureModel:
    """Layers all over the legal range, from corner to corner of the grid, gains of either sign."""
    rng = np.random.default_rng(seed)
    shape = (3, 4, layers)
    return TextureModel(
        texture="wild",
        rate_hz=rate_hz,
        speeds_mm_s=[20.0, 150.0, 351.3],
        forces_n=[0.3, 1.1, 2.2, 3.5],
        noise_gains=rng.uniform(0, 0.2, shape[:2]),
        frequencies_hz=np.exp(rng.uniform(0, np.log(0.49 * rate_hz), shape)),
        bandwidths_hz=np.exp(rng.uniform(np.log(0.1), np.log(0.45 * rate_hz), shape)),
        gains=rng.normal(0, 1, shape),
        level_sd_db=np.zeros(shape),
        estimator="planted",
    )


@dataclass(frozen=True)
class Notch:
    rate_hz: float = 5000.0
    frequency_hz: float = 80.0
    bandwidth_hz: float = 60.0
    band_share: float = 0.7


def assert_same_bits(
    make: Callable[[], Renderer], speed: np.ndarray, force: np.ndarray
) -> list[Renderer]:
    """The same stroke by kernel and in Python: equal bits, equal counters. The renderers."""
    compiled = make()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(SWITCH, "1")
        python = make()
    assert type(compiled._engine) is not type(python._engine)
    one, other = compiled.render(speed, force), python.render(speed, force)
    assert np.array_equal(one, other)
    assert np.isfinite(one).all()
    assert compiled.counters == python.counters
    return [compiled, python]


ANY_HAND = st.floats(width=64) | st.floats(-400, 400) | st.sampled_from([0.0, 5e-324, np.nan])


@settings(max_examples=60, deadline=None)
@given(
    layers=st.integers(0, 9),
    hand=arrays(np.float64, st.tuples(st.just(2), st.integers(0, 150)), elements=ANY_HAND),
    update_samples=st.integers(1, 40),
    seed=st.integers(0, 2**64 - 1),
)
def test_bits_are_equal_whatever_the_hand_does(
    layers: int, hand: np.ndarray, update_samples: int, seed: int
) -> None:
    model = wild_model(layers, seed % 7)
    assert_same_bits(lambda: Renderer(model, seed=seed, update_samples=update_samples), *hand)


@settings(max_examples=20, deadline=None)
@given(
    seed=st.integers(0, 100),
    speeds=st.integers(1, 3),
    forces=st.integers(1, 4),
    hand=arrays(np.float64, st.tuples(st.just(2), st.integers(0, 150)), elements=ANY_HAND),
)
def test_bits_are_equal_in_logarithms_and_of_one_speed_or_force(
    seed: int, speeds: int, forces: int, hand: np.ndarray
) -> None:
    """Gains of one sign per layer, some of them 0; grids of 1 × n and n × 1."""
    wild = wild_model(3, seed)
    grid = np.ix_(range(speeds), range(forces))
    signs = np.sign(wild.gains[0, 0])
    gains = np.where(np.abs(wild.gains) < 0.2, 0.0, signs * np.abs(wild.gains))[grid]
    model = replace(
        wild,
        speeds_mm_s=wild.speeds_mm_s[:speeds],
        forces_n=wild.forces_n[:forces],
        noise_gains=wild.noise_gains[grid],
        frequencies_hz=wild.frequencies_hz[grid],
        bandwidths_hz=wild.bandwidths_hz[grid],
        gains=gains,
        level_sd_db=np.zeros_like(gains),
        inherited=np.zeros(gains.shape, dtype=bool),
        unresolved=np.zeros(gains.shape, dtype=bool),
        interpolated=np.zeros(gains.shape[:2], dtype=bool),
        blending="logarithmic",
    )
    assert_same_bits(lambda: Renderer(model, seed=seed), *hand)


@pytest.mark.parametrize("rate_hz", [5000.0, 5500.0, 8000.0, 44100.0, 48000.0, 96000.0])
@pytest.mark.parametrize("texture", sorted(CATALOGUE))
def test_bits_are_equal_at_other_rates(texture: str, rate_hz: float) -> None:
    stroke = 200 * np.sin(np.linspace(0, 12, 900)), np.linspace(-0.2, 4, 900)
    assert_same_bits(lambda: Renderer(planted_texture(texture), rate_hz=rate_hz, seed=1), *stroke)


def test_bits_are_equal_for_regressions() -> None:
    for by in ("conditions", "centroid"):
        model = regressed(planted_texture("canvas"), by=by)
        stroke = 300 * np.sin(np.linspace(0, 9, 2000)), np.linspace(0, 4, 2000)
        assert_same_bits(lambda model=model: Renderer(model, seed=1), *stroke)


def test_bits_are_equal_with_compensation_and_limits() -> None:
    model = wild_model(3)
    limits = Limits(peak=0.9, rms=0.4, rms_window_s=0.05, duration_s=0.3, pause_s=0.01)
    speed, force = np.full(6000, 200.0), np.full(6000, 2.0)
    force[2500:2700] = 0.0
    renderers = assert_same_bits(
        lambda: Renderer(model, seed=3, limits=limits, compensation=Notch()), speed, force
    )
    counters = renderers[0].counters
    assert counters.limited_peak > 0
    assert counters.limited_rms > 0
    assert counters.limited_duration > 0


@given(st.floats(1, 2450), st.floats(0.1, 2250))
def test_coefficients_are_equal(frequency_hz: float, bandwidth_hz: float) -> None:
    python = band_coefficients(frequency_hz, bandwidth_hz, rate_hz=5000.0)
    angle = np.pi / 5000.0
    band = tactileq.modeling.rendering.compiled._kernel.lib.tq_band_of(
        angle * frequency_hz, angle * bandwidth_hz
    )
    assert [float(value) for value in python] == [getattr(band, name) for name in python._fields]


def test_noise_streams_are_independent_and_any_position_is_reached() -> None:
    """Streams of one seed, and seeds of one stream, correlate no more than chance lets them."""
    count = 20_000
    keys = [stream_key(seed, stream) for seed in range(6) for stream in range(6)]
    noise = np.array([white_noise(key, 0, count) for key in keys])
    assert np.array_equal(white_noise(keys[5], 12_345, 50), noise[5, 12_345:12_395])
    correlation = np.corrcoef(noise)[np.triu_indices(len(keys), 1)] * np.sqrt(count)
    # 630 correlations of unit variance: the largest is beyond 4.8 once in a thousand times.
    assert np.abs(correlation).max() < 4.8
    assert np.std(correlation) == pytest.approx(1, abs=0.1)
    lagged = [np.mean(noise[i, :-1] * noise[i, 1:]) * np.sqrt(count) for i in range(len(keys))]
    assert np.abs(lagged).max() < 4.8


def test_states_are_exposed_and_hold_no_more_than_the_noise_brought() -> None:
    """‖s′‖² ≤ ‖s‖² + w² at every step, for every layer, however the hand jumps."""
    model, rng = wild_model(4), np.random.default_rng(5)
    renderer = Renderer(model, seed=2, update_samples=1)
    w = white_noise(stream_key(2), 0, 3000)
    before = np.zeros(4)
    for n in range(3000):
        hand = rng.choice([rng.uniform(-400, 400), 0.0, np.nan, np.inf, 1e-310])
        renderer.render([hand], [rng.uniform(-1, 5)])
        energy = (renderer._engine.states**2).sum(axis=1)
        assert (energy <= (before + w[n] ** 2) * (1 + 1e-14)).all()
        before = energy


def test_without_a_kernel_it_says_so_once_and_renders_the_same() -> None:
    """A fresh process in which the extension cannot be imported."""
    program = """
import sys, warnings
sys.modules["tactileq.modeling.rendering._kernel"] = None
with warnings.catch_warnings(record=True) as told:
    warnings.simplefilter("default")
    from tactileq.modeling import Renderer
    from tactileq.stimuli.planted.textures import planted_texture
    Renderer(planted_texture("MDF"))
    Renderer(planted_texture("PVC"))
    signal = Renderer(planted_texture("canvas")).render(100.0, 1.0, samples=400)
print(len(told), "expected the compiled rendering kernel, got none" in str(told[0].message))
print(signal.tobytes().hex())
"""
    run = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    told, rendered = run.stdout.split("\n", 1)
    assert told == "1 True"
    expected = Renderer(planted_texture("canvas")).render(100.0, 1.0, samples=400)
    assert bytes.fromhex(rendered) == expected.tobytes()


@pytest.mark.parametrize("layers", [0, 1, 2, 3, 4, 5, 8, 13])
def test_bits_do_not_depend_on_how_many_layers_run_side_by_side(layers: int) -> None:
    """A layer of gain 0 more changes nothing, wherever it stands."""
    model = wild_model(layers + 1)
    gains = model.gains.copy()
    gains[..., 0] = 0
    quiet = replace(model, gains=gains)
    rest = model.with_layers(list(range(1, layers + 1)))
    stroke = np.linspace(0, 400, 1000), np.linspace(0, 4, 1000)
    assert np.array_equal(
        Renderer(quiet, seed=1).render(*stroke), Renderer(rest, seed=1).render(*stroke)
    )
