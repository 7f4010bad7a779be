"""Estimators on spectra without noise, where docs/method/estimation.md has closed answers."""

from __future__ import annotations

import numpy as np
import pytest

from tactileq.modeling import PEQ, InputError, Layers, Spectrum, find_layers
from tactileq.modeling.estimation.paper import find_peak_frequencies, fit_layers, noise_amount
from tests.refusals import refused

FREQUENCY_HZ = np.arange(2501.0)  # 1 s at 5 kHz
FWHM = 2 * np.sqrt(2 * np.log(2))


def spectrum_of(magnitude: np.ndarray) -> Spectrum:
    return Spectrum(FREQUENCY_HZ, np.asarray(magnitude, dtype=float), 5000.0, 5000)


def bump(centre_hz: float, s_hz: float, height: float) -> np.ndarray:
    return height * np.exp(-0.5 * ((FREQUENCY_HZ - centre_hz) / s_hz) ** 2)


def model_of(layers: Layers) -> PEQ:
    return layers.peq(rate_hz=5000.0)


def truth(noise_gain: float, layers: list[tuple[float, float, float]]) -> Spectrum:
    f, b, g = np.array(layers).T
    peq = PEQ(noise_gain=noise_gain, frequencies_hz=f, bandwidths_hz=b, gains=g, rate_hz=5000.0)
    return spectrum_of(peq.response(FREQUENCY_HZ))


def test_noise_amount_is_the_mean_of_the_upper_fifth() -> None:
    magnitude = np.where(FREQUENCY_HZ < 2000, 7.0, 0.2 + 0.1 * (FREQUENCY_HZ - 2250) / 250)
    assert noise_amount(spectrum_of(magnitude)) == pytest.approx(0.2, rel=1e-12)


def test_planted_peaks_are_found_and_only_those() -> None:
    planted = [80.0, 300.0, 700.0, 1500.0]
    magnitude = 0.05 + sum(bump(f, 25, a) for f, a in zip(planted, (1, 0.4, 2, 0.3), strict=True))
    assert find_peak_frequencies(spectrum_of(magnitude)) == pytest.approx(planted, abs=2)


def test_flat_and_falling_spectra_have_no_peaks() -> None:
    assert find_peak_frequencies(spectrum_of(np.full(2501, 0.3))).size == 0
    assert find_peak_frequencies(spectrum_of(1 / (1 + FREQUENCY_HZ / 50))).size == 0


def test_ripples_smaller_than_the_scatter_are_no_peaks() -> None:
    """0.52/√(2√π·30 Hz·1 s) = 5 % of the level: a bump must rise above that."""
    for height, found in ((0.02, 0), (0.2, 1)):
        magnitude = 1 + bump(800, 60, height)
        assert find_peak_frequencies(spectrum_of(magnitude)).size == found


def test_peaks_below_the_noise_amount_are_none() -> None:
    magnitude = np.where(FREQUENCY_HZ < 1900, 0.1 + bump(500, 40, 0.5), 1.0)
    assert find_peak_frequencies(spectrum_of(magnitude)).size == 0


def test_no_peak_is_looked_for_in_the_noise_band() -> None:
    magnitude = 0.1 + bump(600, 40, 1.0) + bump(2200, 40, 1.0)
    assert find_peak_frequencies(spectrum_of(magnitude)) == pytest.approx([600], abs=1)


@pytest.mark.parametrize("s_hz", [10.0, 40.0, 80.0])
def test_paper_reads_full_width_and_height_of_the_smoothed_peak(s_hz: float) -> None:
    """A Gaussian of s smoothed by 30 Hz has √(s²+30²) and the height A·s/√(s²+30²)."""
    layers = find_layers(spectrum_of(bump(600, s_hz, 0.5)), estimator="paper")
    wide = np.hypot(s_hz, 30)
    assert layers.frequencies_hz == pytest.approx([600], abs=0.5)
    assert layers.bandwidths_hz == pytest.approx([FWHM * wide], rel=2e-3)
    assert layers.gains == pytest.approx([0.5 * s_hz / wide], rel=2e-3)
    assert not layers.unresolved.any()


def test_paper_counts_the_floor_into_the_height() -> None:
    layers = find_layers(spectrum_of(0.1 + bump(600, 40, 0.5)), estimator="paper")
    assert layers.noise_gain == pytest.approx(0.1)
    assert layers.gains == pytest.approx([0.1 + 0.5 * 40 / 50], rel=2e-3)


@pytest.mark.parametrize("s_hz", [8.0, 20.0, 40.0, 80.0])
def test_consistent_takes_floor_and_smoothing_out_of_the_width(s_hz: float) -> None:
    """B = 1.36·s with s² = s_fit² − 30²; the floor does not widen it."""
    layers = find_layers(spectrum_of(0.1 + bump(600, s_hz, 0.5)), estimator="paper-consistent")
    assert layers.noise_gain == pytest.approx(0.1)
    assert layers.bandwidths_hz == pytest.approx([1.36 * s_hz], rel=5e-3)
    assert not layers.unresolved.any()


@pytest.mark.parametrize(("s_hz", "unresolved"), [(2.0, True), (4.8, True), (5.3, False)])
def test_widths_below_5_hz_are_marked_unresolved(s_hz: float, unresolved: bool) -> None:
    layers = find_layers(spectrum_of(0.01 + bump(600, s_hz, 5.0)), estimator="paper-consistent")
    assert layers.unresolved.tolist() == [unresolved]
    if unresolved:
        assert layers.bandwidths_hz == pytest.approx([1.36 * 5])


@pytest.mark.parametrize(
    "planted",
    [
        [(600.0, 50.0, 0.5)],
        [(150.0, 20.0, 0.8), (600.0, 60.0, 0.3), (1300.0, 100.0, 0.5)],
        [(200.0, 3.0, 2.0), (330.0, 40.0, 0.3)],
        [(100.0, 40.0, 0.4), (230.0, 40.0, 0.4)],
    ],
    ids=["one", "three", "narrow", "close"],
)
def test_smoothed_consistent_model_has_the_measured_heights(
    planted: list[tuple[float, float, float]],
) -> None:
    """The definition itself: smoothed alike, model and data agree at each peak above the floor."""
    spectrum = truth(0.05, planted)
    layers = find_layers(spectrum, estimator="paper-consistent")
    assert layers.gains.size == len(planted)
    assert (layers.gains > 0).all()
    smoothed = spectrum_of(model_of(layers).response(FREQUENCY_HZ)).smoothed()
    at = np.rint(layers.frequencies_hz).astype(int)
    measured = spectrum.smoothed()[at] - layers.noise_gain
    assert smoothed[at] - layers.noise_gain == pytest.approx(measured, rel=0.01)


def test_paper_overestimates_what_consistent_gets_right() -> None:
    """Level of one band over its true level; +4.6 dB in docs/method/estimation.md#paper."""
    spectrum = truth(0.05, [(600.0, 50.0, 0.5)])

    def level_error_db(estimator: str) -> float:
        rms = model_of(find_layers(spectrum, estimator=estimator)).band_rms[0]
        k = np.tan(np.pi * 50 / 5000)
        return float(20 * np.log10(rms / (0.5 * np.sqrt(k / (1 + k)))))

    assert abs(level_error_db("paper-consistent")) < 0.6
    assert level_error_db("paper") > 2.0


@pytest.mark.parametrize("estimator", ["paper", "paper-consistent"])
def test_level_deviation_is_no_less_than_a_record_allows(estimator: str) -> None:
    """10·log10(e)/√(πBT) is the bound: 0.35 dB at 50 Hz and 1 s.

    docs/method/estimation.md#level-deviations
    """
    layers = find_layers(truth(0.05, [(600.0, 50.0, 0.5)]), estimator=estimator)
    assert 4.342945 / np.sqrt(np.pi * 50) == pytest.approx(0.35, abs=0.01)
    assert 0.3 < layers.level_sd_db[0] < 0.7


def test_level_deviation_is_that_of_fresh_noise() -> None:
    """Band levels of 1 s draws scatter by 4.34/√(πBT)."""
    rng = np.random.default_rng(0)
    peq = PEQ(
        noise_gain=0.0,
        frequencies_hz=[600.0],
        bandwidths_hz=[50.0],
        gains=[1.0],
        rate_hz=5000.0,
    )
    power = peq.response(FREQUENCY_HZ) ** 2 * rng.exponential(size=(4000, 2501))
    level_db = 10 * np.log10(power.sum(axis=1))
    assert level_db.std() == pytest.approx(4.342945 / np.sqrt(np.pi * 50), rel=0.06)


def test_failed_widths_fall_back() -> None:
    """Where nothing rises above the floor the reference's width is taken, or the smoothing's."""
    spectrum = spectrum_of(np.full(2501, 0.2))
    for fallback, expected in ((33.0, 33.0), (np.nan, FWHM * 30)):
        layers = fit_layers(
            spectrum,
            np.array([600.0]),
            fallback_bandwidths_hz=np.array([fallback]),
            estimator="paper-consistent",
        )
        assert layers.bandwidths_hz == pytest.approx([expected])
        assert layers.gains == pytest.approx([0.0], abs=1e-12)


@pytest.mark.parametrize("estimator", ["paper", "paper-consistent"])
def test_no_layers_leave_the_noise(estimator: str) -> None:
    layers = find_layers(spectrum_of(np.full(2501, 0.2)), estimator=estimator)
    assert layers.noise_gain == pytest.approx(0.2)
    assert layers.gains.shape == layers.level_sd_db.shape == layers.unresolved.shape == (0,)


@pytest.mark.parametrize("estimator", ["paper", "paper-consistent"])
def test_all_numbers_stay_legal_on_noise(estimator: str) -> None:
    rng = np.random.default_rng(4)
    for level in (1e-12, 1.0, 1e6):
        for _ in range(5):
            layers = find_layers(spectrum_of(level * rng.rayleigh(size=2501)), estimator=estimator)
            # A PEQ refuses what is not finite or out of range.
            assert model_of(layers).gains.size == layers.frequencies_hz.size
            assert (layers.gains >= 0).all()


def test_unknown_estimators_are_refused() -> None:
    with refused(InputError, expected=["joint", "paper", "paper-consistent"], got="'magic'"):
        find_layers(spectrum_of(np.ones(2501)), estimator="magic")


def test_a_layer_hidden_under_skirts_keeps_half_its_own_gain_and_is_marked() -> None:
    frequency = np.arange(0.0, 2501.0)
    lone = PEQ(
        noise_gain=0.02,
        frequencies_hz=np.array([400.0]),
        bandwidths_hz=np.array([100.0]),
        gains=np.array([0.5]),
        rate_hz=5000.0,
    )
    spectrum = Spectrum(frequency, lone.response(frequency), 5000.0, 5000)
    unknown = np.full(2, np.nan)

    def fit(frequencies_hz: list[float]) -> Layers:
        return fit_layers(
            spectrum,
            np.array(frequencies_hz),
            fallback_bandwidths_hz=unknown[: len(frequencies_hz)],
            estimator="paper-consistent",
        )

    # At 460 Hz there is nothing but the skirt of the layer at 400 Hz.
    both = fit([400.0, 460.0])
    alone = fit([460.0])
    assert both.unresolved.tolist() == [False, True]
    assert both.gains[1] == pytest.approx(0.5 * alone.gains[0], rel=0.02)
    assert not alone.unresolved[0]
