"""Random spectra with known layers: their power is what they say, in every kind."""

from __future__ import annotations

import numpy as np
import pytest

from tactileq.modeling import PEQ
from tactileq.stimuli.planted.spectra import KINDS, RATE_HZ, RandomTruth, TruthKind, random_truth

LAYERS = PEQ(
    noise_gain=0.02,
    frequencies_hz=[300.0, 900.0],
    bandwidths_hz=[40.0, 200.0],
    gains=[0.3, 0.1],
    rate_hz=RATE_HZ,
)


@pytest.mark.parametrize("kind", KINDS)
def test_records_have_the_expected_power(kind: TruthKind) -> None:
    """Bands of 100 Hz of 200 records: 20 000 exponential lines each, so 0.7 % scatter."""
    truth = RandomTruth(LAYERS, kind)
    rng = np.random.default_rng(0)
    n = round(RATE_HZ)
    spectra = [np.abs(np.fft.rfft(truth.record(rng=rng))) ** 2 / n for _ in range(200)]
    frequency = np.fft.rfftfreq(n, 1 / RATE_HZ)
    got = np.mean(spectra, axis=0)[1:2401].reshape(24, 100).mean(axis=1)
    expected = truth.expected_power(frequency)[1:2401].reshape(24, 100).mean(axis=1)
    assert got == pytest.approx(expected, rel=0.05)


def test_a_lone_peak_has_its_height_and_width() -> None:
    one = PEQ(
        noise_gain=0.0, frequencies_hz=[600.0], bandwidths_hz=[80.0], gains=[0.5], rate_hz=RATE_HZ
    )
    for kind in KINDS:
        power = RandomTruth(one, kind).expected_power(np.array([560.0, 600.0, 640.0]))
        assert power[1] == pytest.approx(0.25)
        # At the ends of the −3 dB width, up to the band's skew along frequency.
        assert power[[0, 2]] == pytest.approx(0.125, rel=0.08)


def test_kinds_differ_where_layers_overlap() -> None:
    two = PEQ(
        noise_gain=0.0,
        frequencies_hz=[500.0, 700.0],
        bandwidths_hz=[60.0, 60.0],
        gains=[1.0, 1.0],
        rate_hz=RATE_HZ,
    )
    between = np.array([592.0])
    coherent, independent, bells = (
        RandomTruth(two, kind).expected_power(between)[0] for kind in KINDS
    )
    # Equal signs cancel between two peaks, powers add, bells have no skirts to speak of.
    assert coherent < 0.25 * independent
    assert bells < 0.05 * independent


def test_draws_are_legal_and_repeat() -> None:
    rng = np.random.default_rng(5)
    drawn = [random_truth("coherent", rng=rng).layers for _ in range(300)]
    again = random_truth("coherent", rng=np.random.default_rng(5)).layers
    assert again.frequencies_hz.tolist() == drawn[0].frequencies_hz.tolist()
    assert {layers.gains.size for layers in drawn} == {1, 2, 3, 4, 5}
    for layers in drawn:
        assert (np.diff(layers.frequencies_hz) > 0).all()
        assert (layers.frequencies_hz >= 20).all()
        assert (layers.frequencies_hz <= 1500).all()
        assert (layers.bandwidths_hz <= 1.5 * layers.frequencies_hz).all()
        level_db = 20 * np.log10(layers.gains / layers.noise_gain)
        assert (level_db > 6).all()
        assert (level_db < 30).all()
