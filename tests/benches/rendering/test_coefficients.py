"""Filters by coefficients from a table: what they are at nodes, between them, and of layers."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from tactileq.benches.rendering.coefficients import (
    CoefficientTable,
    fit_sections,
    tabled,
    tabled_bands,
    tabled_predictor,
)
from tactileq.benches.rendering.rivals import (
    BANDS,
    COEFFICIENTS,
    CompiledStream,
    layered_texture,
    predictor_of,
)
from tactileq.modeling import PEQ, ARModel, InputError, Renderer, Spectrum
from tactileq.modeling.models.line_spectral import line_spectral_frequencies
from tactileq.modeling.rendering.noise import stream_key, white_noise
from tactileq.modeling.similarity import log_spectral_distance_db
from tests.refusals import refused

RATE_HZ = 5000.0
FREQUENCY_HZ = np.linspace(10.0, 2450.0, 500)


@pytest.fixture(scope="module")
def predictor() -> ARModel:
    return predictor_of(layered_texture(3))


def test_at_and_half_way_between_conditions_spectral_frequencies_are_blended(
    predictor: ARModel,
) -> None:
    table = tabled_predictor(predictor)
    speeds, forces = predictor.speeds_mm_s, predictor.forces_n
    for speed in (speeds[2], (speeds[2] + speeds[3]) / 2):
        for force in (forces[1], (forces[1] + forces[2]) / 2):
            expected = predictor.filter(speed, force)
            found = table.filter(speed, force)
            assert found.poles == pytest.approx(expected.coefficients, abs=1e-9)
            assert found.gain == pytest.approx(expected.gain)
            assert found.response(FREQUENCY_HZ) == pytest.approx(
                expected.response(FREQUENCY_HZ), rel=1e-9
            )


@given(speed=st.floats(0, 500), force=st.floats(0, 5))
@settings(max_examples=50)
def test_anywhere_it_is_within_a_decibel_of_blended_spectral_frequencies(
    predictor: ARModel, speed: float, force: float
) -> None:
    expected, found = (
        model.filter(speed, force).response(FREQUENCY_HZ)
        for model in (predictor, tabled_predictor(predictor))
    )
    assert (found.max() == 0) == (expected.max() == 0)
    if expected.max():
        assert log_spectral_distance_db(found, expected) < 1.0


@pytest.mark.parametrize("layers", [1, 3, 8])
def test_bands_by_coefficients_have_the_layers_response(layers: int) -> None:
    texture = layered_texture(layers)
    table = tabled_bands(texture)
    assert table.layers == layers
    for speed in texture.speeds_mm_s[:3]:
        for force in texture.forces_n[-2:]:
            expected = texture.peq(float(speed), float(force)).response(FREQUENCY_HZ)
            found = table.filter(float(speed), float(force)).response(FREQUENCY_HZ)
            assert found == pytest.approx(expected, rel=1e-9)


def test_bands_by_coefficients_are_rendered_as_by_the_kernel() -> None:
    texture = layered_texture(3)
    hand = np.full(700, float(texture.speeds_mm_s[2])), np.full(700, float(texture.forces_n[3]))
    stream = CompiledStream(BANDS, tabled_bands(texture), update_samples=5, seed=3)
    expected = Renderer(texture, seed=3).render(*hand)
    assert np.abs(stream.render(*hand) - expected).max() <= 1e-9 * expected.std()


def test_poles_and_zeros_are_rendered_as_by_scipy() -> None:
    values = np.broadcast_to([0.5, -1.2, 0.5, 0.1, -0.05, 0.4, 0.2, -0.3, 0.1], (2, 2, 9))
    axes = np.array([50.0, 350.0]), np.array([0.5, 3.5])
    table = CoefficientTable(
        speeds_mm_s=axes[0], forces_n=axes[1], values=values, poles=4, rate_hz=RATE_HZ
    )
    hand = np.full(700, 150.0), np.full(700, 1.5)
    found = CompiledStream(COEFFICIENTS, table, update_samples=5, seed=3).render(*hand)
    noise = white_noise(stream_key(3), 0, 700)
    expected = 0.5 * lfilter([1.0, *values[0, 0, 5:]], [1.0, *values[0, 0, 1:5]], noise)
    assert np.abs(found - expected).max() <= 1e-9 * expected.std()


def of_poles(radius: float, hertz: float) -> np.ndarray:
    """Line spectral frequencies of two equal pairs of poles."""
    pair = [1.0, -2 * radius * np.cos(2 * np.pi * hertz / RATE_HZ), radius**2]
    return line_spectral_frequencies(np.convolve(pair, pair)[1:])


def test_where_coefficients_would_be_unstable_between_nodes_the_table_is_finer() -> None:
    axes = np.array([50.0, 350.0]), np.array([0.5, 3.5])
    low, high = (np.append(1.0, of_poles(0.95, hertz)) for hertz in (100.0, 600.0))
    values = np.array([[low, low], [high, high]])
    table = tabled(axes, values, poles=4, rate_hz=RATE_HZ)
    assert table.speeds_mm_s.size > 3
    with refused(InputError, expected=["order 4", "stable"], got="unstable"):
        CoefficientTable(
            speeds_mm_s=table.speeds_mm_s[[0, -1]],
            forces_n=table.forces_n[[0, -1]],
            values=table.values[[0, -1]][:, [0, -1]],
            poles=4,
            rate_hz=RATE_HZ,
        )


@pytest.mark.parametrize("sections", [2, 4])
def test_sections_find_a_filter_of_their_own_kind(sections: int) -> None:
    """Planted: two layers, which are a filter of four poles and zeros, with the noise of 60 s."""
    peq = PEQ(
        noise_gain=0.02,
        frequencies_hz=[120.0, 900.0],
        bandwidths_hz=[80.0, 250.0],
        gains=[0.1, -0.06],
        rate_hz=RATE_HZ,
    )
    frequency = np.linspace(0.0, RATE_HZ / 2, 2501)
    rng = np.random.default_rng(5)
    scatter = np.sqrt(rng.chisquare(120, frequency.size) / 120)
    magnitude = peq.response(frequency) * scatter * 2 / np.sqrt(np.pi)
    values = fit_sections(Spectrum(frequency, magnitude, RATE_HZ, 5000), order=2 * sections)
    grid = np.broadcast_to(values, (2, 2, values.size))
    axes = np.array([50.0, 350.0]), np.array([0.5, 3.5])
    table = tabled(axes, grid, poles=2 * sections, rate_hz=RATE_HZ)
    found = table.filter(100.0, 1.0).response(FREQUENCY_HZ)
    assert log_spectral_distance_db(found, peq.response(FREQUENCY_HZ)) < 0.5
