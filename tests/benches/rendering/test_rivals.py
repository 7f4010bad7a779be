"""The rivals of the render bench compute what they should: else their times mean nothing."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from tactileq.benches.rendering.coefficients import tabled_predictor
from tactileq.benches.rendering.rivals import (
    AR,
    COMPILED,
    DIRECT_FORM_I,
    KERNEL,
    ORDER,
    RATE_HZ,
    RIVAL_FORMS,
    TPT,
    TRANSPOSED,
    CompiledStream,
    LfilterStream,
    SosfiltStream,
    compiled_parts,
    layered_texture,
    predictor_of,
)
from tactileq.modeling import InputError, Renderer, TextureModel
from tactileq.modeling.arrays import Floats
from tactileq.modeling.rendering.noise import stream_key, white_noise
from tests.refusals import refused

KEY = stream_key(3)
SAMPLES = 700
SAMPLE_COUNTS = st.sampled_from([1, 5, 32])


@pytest.fixture(scope="module")
def predictor():
    return predictor_of(layered_texture(3))


def stream(name: str, texture: TextureModel, update_samples: int) -> CompiledStream:
    model = tabled_predictor(predictor_of(texture)) if name == AR else texture
    return CompiledStream(name, model, update_samples=update_samples, seed=3)


def held(speed_mm_s: float, force_n: float) -> tuple[Floats, Floats]:
    return np.full(SAMPLES, speed_mm_s), np.full(SAMPLES, force_n)


def moving() -> tuple[Floats, Floats]:
    time_s = np.arange(SAMPLES) / RATE_HZ
    return 320 * np.sin(2 * np.pi * 8 * time_s), 1.5 + np.cos(2 * np.pi * 5 * time_s)


@given(
    layers=st.integers(1, 16),
    update=SAMPLE_COUNTS,
    speed=st.floats(5, 500),
    force=st.floats(0.05, 5),
)
@settings(max_examples=30)
def test_all_layered_filters_agree_while_the_hand_is_held(
    layers: int, update: int, speed: float, force: float
) -> None:
    texture, hand = layered_texture(layers), held(speed, force)
    expected = Renderer(texture, seed=3, update_samples=update).render(*hand)
    assert np.array_equal(stream(KERNEL, texture, update).render(*hand), expected)
    scale = expected.std()
    for name in (*RIVAL_FORMS, TPT):
        found = stream(name, texture, update).render(*hand)
        assert np.abs(found - expected).max() <= 1e-9 * scale
    noise = white_noise(KEY, 0, SAMPLES)
    for kind in (SosfiltStream, LfilterStream):
        filters = kind(texture, np.random.default_rng(0))
        blocks = [
            filters.filter(noise[start : start + 32], speed, force_n=force)
            for start in range(0, SAMPLES, 32)
        ]
        assert np.abs(np.concatenate(blocks) - expected).max() <= 1e-9 * scale


def at_updates(texture: TextureModel, update: int):
    """Noise of each stretch between updates, and tangents, gains and noise gain that hold in it."""
    speed, force = moving()
    noise = white_noise(KEY, 0, SAMPLES)
    for start in range(0, SAMPLES, update):
        at = texture.parameters(speed[start : start + 1], force[start : start + 1])
        g = np.tan(np.pi / RATE_HZ * at.frequencies_hz[0])
        k = np.tan(np.pi / RATE_HZ * at.bandwidths_hz[0])
        yield noise[start : start + update], g, k, at.gains[0], at.noise_gain[0]


def simper(texture: TextureModel, update: int) -> list[float]:
    """The state-variable filter as its author wrote it, of resonance 1/Q = k (1 + g²) / g."""
    ic1eq, ic2eq, output = 0.0, 0.0, []
    for noise, g, k, gains, noise_gain in at_updates(texture, update):
        damping = k * (1 + g * g) / g
        a1 = 1 / (1 + g * (g + damping))
        a2 = g * a1
        a3 = g * a2
        for v0 in noise:
            v3 = v0 - ic2eq
            v1 = a1 * ic1eq + a2 * v3
            v2 = ic2eq + a2 * ic1eq + a3 * v3
            ic1eq = 2 * v1 - ic1eq
            ic2eq = 2 * v2 - ic2eq
            output.append(noise_gain * v0 + gains @ (damping * v1))
    return output


def transposed(texture: TextureModel, update: int) -> list[float]:
    """The same band-pass in the transposed form II, its two states carried on."""
    z1 = z2 = np.zeros(texture.n_layers)
    output = []
    for noise, g, k, gains, noise_gain in at_updates(texture, update):
        b0, a1, a2 = gains * k / (1 + k), -2 * np.cos(2 * np.arctan(g)) / (1 + k), (1 - k) / (1 + k)
        for x in noise:
            y = b0 * x + z1
            z1, z2 = z2 - a1 * y, -b0 * x - a2 * y
            output.append(noise_gain * x + y.sum())
    return output


def cookbook(texture: TextureModel, update: int) -> list[float]:
    """Form I of the audio cookbook's band-pass of peak 0 dB, α = sin(ω) / 2Q = k."""
    x1 = x2 = 0.0
    y1 = y2 = np.zeros(texture.n_layers)
    output = []
    for noise, g, k, gains, noise_gain in at_updates(texture, update):
        cosine = np.cos(2 * np.arctan(g))
        for x in noise:
            y = (gains * k * (x - x2) + 2 * cosine * y1 - (1 - k) * y2) / (1 + k)
            x1, x2, y1, y2 = x, x1, y, y1
            output.append(noise_gain * x + y.sum())
    return output


@pytest.mark.parametrize("update", [1, 5, 32])
@pytest.mark.parametrize(
    ("name", "textbook"), [(TPT, simper), (DIRECT_FORM_I, cookbook), (TRANSPOSED, transposed)]
)
def test_layered_rivals_follow_a_moving_hand_as_in_the_textbook(
    name: str, textbook, update: int
) -> None:
    texture = layered_texture(3)
    expected = np.array(textbook(texture, update))
    found = stream(name, texture, update).render(*moving())
    assert np.abs(found - expected).max() <= 1e-9 * expected.std()


@given(update=SAMPLE_COUNTS, speed=st.floats(5, 500), force=st.floats(0.05, 5))
@settings(max_examples=10)
def test_the_predictor_is_the_all_pole_filter(
    predictor, update: int, speed: float, force: float
) -> None:
    table = tabled_predictor(predictor)
    found = CompiledStream(AR, table, update_samples=update, seed=3).render(*held(speed, force))
    chosen = table.filter(speed, force)
    noise = white_noise(KEY, 0, SAMPLES)
    expected = lfilter([chosen.gain], [1.0, *chosen.poles], noise)
    assert np.abs(found - expected).max() <= 1e-9 * expected.std()


def test_the_predictor_is_the_lattice_where_it_was_fitted(predictor) -> None:
    hand = held(float(predictor.speeds_mm_s[3]), float(predictor.forces_n[2]))
    stream = CompiledStream(AR, tabled_predictor(predictor), update_samples=5, seed=3)
    lattice = Renderer(predictor, seed=3).render(*hand)
    assert np.abs(stream.render(*hand) - lattice).max() <= 1e-9 * lattice.std()


@pytest.mark.parametrize("update", [1, 5, 32])
def test_the_predictor_follows_a_moving_hand(predictor, update: int) -> None:
    speed, force = moving()
    table = tabled_predictor(predictor)
    noise, past = white_noise(KEY, 0, SAMPLES), np.zeros(ORDER)
    expected = []
    for start in range(0, SAMPLES, update):
        at = table.filter(speed[start], force[start])
        for w in noise[start : start + update]:
            y = at.gain * w - at.poles @ past
            past = np.concatenate([[y], past[:-1]])
            expected.append(y)
    found = CompiledStream(AR, table, update_samples=update, seed=3).render(speed, force)
    assert np.abs(found - np.array(expected)).max() <= 1e-9 * np.std(expected)


@pytest.mark.parametrize("layers", [1, 3, 8])
def test_the_predictor_has_the_textures_autocorrelation(layers: int) -> None:
    """What Yule and Walker's equations say: lags 0 … 20 are equal."""
    texture = layered_texture(layers)
    frequency = np.linspace(0, RATE_HZ / 2, 40001)
    wanted, found = (
        np.fft.irfft(model.response(frequency) ** 2)[: ORDER + 1]
        for model in (texture.peq(150.0, 1.5), predictor_of(texture).filter(150.0, 1.5))
    )
    assert np.abs(found - wanted).max() <= 1e-4 * wanted[0]


@pytest.mark.parametrize("name", COMPILED)
@pytest.mark.parametrize("block", [1, 7, 256])
def test_blocks_make_no_difference(name: str, block: int) -> None:
    texture, (speed, force) = layered_texture(3), moving()
    output = np.empty(SAMPLES)
    stream(name, texture, 5).calls(speed, force, output, block=block)()
    assert np.array_equal(output, stream(name, texture, 5).render(speed, force))


def test_the_kernel_moves_as_the_renderer_does() -> None:
    texture, hand = layered_texture(8), moving()
    expected = Renderer(texture, seed=3, update_samples=5).render(*hand)
    assert np.array_equal(stream(KERNEL, texture, 5).render(*hand), expected)


def test_sosfilt_draws_unit_noise_and_goes_on_where_it_stopped() -> None:
    texture = layered_texture(3)

    def rendered(block: int) -> Floats:
        rng = np.random.default_rng(4)
        sosfilt = SosfiltStream(texture, rng)
        return np.concatenate([sosfilt.render(150.0, 1.5, block) for _ in range(8192 // block)])

    whole = rendered(8192)
    assert np.abs(rendered(64) - whole).max() <= 1e-12
    peq = texture.peq(150.0, 1.5)
    response = peq.response(np.linspace(0, RATE_HZ / 2, 4001))
    # Bands of 20 Hz and more over 1.6 s: the level scatters by some 5 %.
    assert whole.std() == pytest.approx(np.sqrt(np.mean(response**2)), rel=0.2)


def test_memory_grows_by_whole_layers() -> None:
    few, more, many = (stream(KERNEL, layered_texture(m), 5).kernel_bytes for m in (4, 8, 16))
    ffi, lib = compiled_parts("tactileq.modeling.rendering._kernel")
    assert more - few == 4 * lib.TQ_ROWS * ffi.sizeof("double")
    assert many - more == 2 * (more - few)
    assert few > 4 * lib.TQ_ROWS * ffi.sizeof("double")


def test_without_a_compiler_the_sentence_says_what_to_do() -> None:
    with refused(InputError, expected="tactileq.analysis._absent", got=["none", "C compiler"]):
        compiled_parts("tactileq.analysis._absent")
