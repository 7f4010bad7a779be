"""FFT-shaped noise: what it renders has the spectrum that its response foretells."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import welch

from tactileq.benches.chart.shaped_noise import ShapedFilter, ShapedNoise, fit_shaped_noise
from tactileq.modeling import PEQ, Recording, spectrum

RATE_HZ = 1000.0
AXES = (np.array([50.0, 100.0]), np.array([1.0, 2.0]))


def noise_of(magnitude: np.ndarray) -> ShapedNoise:
    grid = np.broadcast_to(magnitude, (2, 2, magnitude.size))
    return ShapedNoise(*AXES, grid, RATE_HZ)


@given(st.sampled_from([16, 64, 256]), st.floats(0.01, 10.0))
def test_a_flat_spectrum_is_white_noise(block: int, level: float) -> None:
    flat = ShapedFilter(np.full(block // 2 + 1, level), RATE_HZ)
    response = flat.response(np.linspace(0, RATE_HZ / 2, 77))
    assert response == pytest.approx(np.full(77, level), rel=1e-9)


def test_rendering_has_the_spectrum_of_the_response() -> None:
    noise = noise_of(0.1 + np.abs(np.sin(np.arange(33) / 4)))
    held = noise.filter(60.0, 1.5)
    rendered = noise.render([(60.0, 1.5)] * 20_000, np.random.default_rng(0))
    frequency, density = welch(rendered, RATE_HZ, nperseg=1000)
    band = (frequency > 5) & (frequency < 495)
    expected = held.response(frequency[band])
    ratio_db = 10 * np.log10(density[band] * RATE_HZ / 2 / expected**2)
    # 640 s in 1,279 overlapping segments: each bin scatters by about 4.34/√700 = 0.16 dB.
    assert np.abs(ratio_db.mean()) < 0.03
    assert ratio_db.std() < 0.25
    assert np.mean(rendered**2) == pytest.approx(
        np.mean(held.response(np.linspace(0, RATE_HZ / 2, 2001)) ** 2), rel=0.02
    )


def test_levels_fade_below_the_grid_and_blend_within() -> None:
    noise = ShapedNoise(*AXES, np.arange(1.0, 5.0).reshape(2, 2, 1) * np.ones(9), RATE_HZ)
    assert noise.filter(75.0, 1.5).magnitude == pytest.approx(np.full(9, 2.5))
    assert noise.filter(25.0, 1.0).magnitude == pytest.approx(np.full(9, 0.5))
    assert not noise.filter(0.0, 1.0).magnitude.any()


def test_fitting_finds_the_magnitude_of_long_records() -> None:
    truth = PEQ(
        noise_gain=0.1, frequencies_hz=[120.0], bandwidths_hz=[60.0], gains=[0.5], rate_hz=RATE_HZ
    )
    frequency = np.fft.rfftfreq(200_000, 1 / RATE_HZ)
    rng = np.random.default_rng(3)
    white = np.fft.rfft(rng.standard_normal(200_000))
    samples = np.fft.irfft(white * truth.response(frequency))
    record = Recording(samples, RATE_HZ, 100.0, 1.0, "planted", simulated=True)
    conditions = [(v, f) for v in (50.0, 100.0) for f in (1.0, 2.0)]
    measured = spectrum(record)
    noise = fit_shaped_noise({c: [measured] for c in conditions}, texture="planted", block=64)
    lines = np.arange(2, 32) * RATE_HZ / 64
    found = noise.filter(100.0, 1.0).magnitude[2:32]
    # Lines 16 Hz apart average the power within 8 Hz.
    assert 20 * np.log10(found / truth.response(lines)) == pytest.approx(0, abs=0.3)
    assert noise.block == 64
    assert noise.n_parameters == 33
