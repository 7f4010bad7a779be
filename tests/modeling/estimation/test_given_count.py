"""A given number of layers: planted ones come back, signs are chosen, nothing is dropped."""

from __future__ import annotations

import numpy as np
import pytest

from tactileq.modeling import PEQ, InputError
from tactileq.modeling.estimation.given_count import fit_layer_count
from tactileq.modeling.recordings.spectrum import Spectrum
from tests.refusals import refused

FREQUENCY_HZ = np.arange(2501.0)
LAYERS = {"frequencies_hz": [150.0, 700.0], "bandwidths_hz": [60.0, 150.0]}


def planted(gains: list[float]) -> PEQ:
    return PEQ(noise_gain=0.01, gains=gains, rate_hz=5000.0, **LAYERS)  # type: ignore[arg-type]


def draw(peq: PEQ, seed: int) -> Spectrum:
    """One second of it: Rayleigh-distributed magnitudes about its response."""
    scatter = np.random.default_rng(seed).rayleigh(np.sqrt(2 / np.pi), FREQUENCY_HZ.size)
    return Spectrum(FREQUENCY_HZ, peq.response(FREQUENCY_HZ) * scatter, 5000.0, 5000)


@pytest.mark.parametrize("gains", [[0.5, 0.3], [0.5, -0.3], [-0.5, 0.3]])
def test_planted_layers_and_signs_come_back(gains: list[float]) -> None:
    fitted = fit_layer_count(draw(planted(gains), 1), 2)
    assert fitted.frequencies_hz == pytest.approx([150, 700], rel=0.04)
    # A width of 60 Hz over one second is told to about 15 %.
    assert fitted.bandwidths_hz == pytest.approx([60, 150], rel=0.35)
    assert np.abs(fitted.gains) == pytest.approx(np.abs(gains), rel=0.3)
    # Noise far below the layers hardly tells one of them, so the signs are told up to both.
    assert np.sign(fitted.gains).prod() == np.sign(gains).prod()


def test_chosen_signs_fill_the_hole_that_equal_ones_dig() -> None:
    truth = planted([0.5, -0.3])
    between = np.arange(250.0, 500.0)

    def distance_db(peq: PEQ) -> float:
        ratio = peq.response(between) / truth.response(between)
        return float(np.sqrt(np.mean((20 * np.log10(ratio)) ** 2)))

    assert distance_db(fit_layer_count(draw(truth, 2), 2)) < 0.8
    assert distance_db(planted([0.5, 0.3])) > 2


@pytest.mark.parametrize("count", [1, 2, 5])
def test_the_count_is_kept_whatever_the_spectrum(count: int) -> None:
    fitted = fit_layer_count(draw(planted([0.5, 0.3]), 3), count)
    assert fitted.gains.shape == (count,)
    assert (np.diff(fitted.frequencies_hz) >= 0).all()


@pytest.mark.parametrize("rate_hz", [200.0, 1000.0, 5000.0])
def test_a_spectrum_that_rises_to_its_end_has_a_legal_layer(rate_hz: float) -> None:
    frequency_hz = np.linspace(0.0, rate_hz / 2, 2501)
    rising = Spectrum(frequency_hz, 2 * frequency_hz / rate_hz, rate_hz, 5000)
    fitted = fit_layer_count(rising, 1)
    assert fitted.frequencies_hz == pytest.approx([0.49 * rate_hz], rel=1e-6)
    assert fitted.frequencies_hz[0] <= 0.49 * rate_hz


def test_silence_and_no_layers_are_refused() -> None:
    silent = Spectrum(FREQUENCY_HZ, np.zeros(2501), 5000.0, 5000)
    with refused(InputError, expected=["spectrum", "power"], got="silence"):
        fit_layer_count(silent, 2)
    with refused(InputError, expected="layer", got="0 layers"):
        fit_layer_count(draw(planted([0.5, 0.3]), 0), 0)
