"""The `joint` estimator on one spectrum: planted layers, signs, extremes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import butter, sosfilt

from tactileq.modeling import PEQ, InputError, Layers, Recording, find_layers, spectrum
from tactileq.modeling.arrays import Floats
from tactileq.modeling.equalizer.bands import band_response
from tactileq.modeling.equalizer.signs import neighbouring_patterns, sign_patterns
from tactileq.modeling.estimation.joint import fit_jointly
from tactileq.modeling.estimation.likelihood import signal_power
from tactileq.modeling.estimation.peaks import MOST_LAYERS, PENALTY, find_peaks_jointly
from tactileq.modeling.recordings.spectrum import spectrum_of_samples, subtract_floor
from tests.refusals import refused

RATE_HZ = 5000.0


def planted(*layers: tuple[float, float, float], noise_gain: float = 0.05) -> PEQ:
    frequency, bandwidth, gain = np.array(layers, dtype=float).reshape(-1, 3).T
    return PEQ(
        noise_gain=noise_gain,
        frequencies_hz=frequency,
        bandwidths_hz=bandwidth,
        gains=gain,
        rate_hz=RATE_HZ,
    )


def noise_through(branches: Floats, n: int, *, seed: int) -> Floats:
    """(n,) samples of independent noises through (k, 2n+1) responses, cut from a longer circle."""
    drawn = np.random.default_rng(seed).standard_normal((len(branches), 4 * n))
    whole: Floats = np.fft.irfft((np.fft.rfft(drawn) * branches).sum(axis=0), 4 * n)
    return whole[:n]


def frequencies(n: int) -> Floats:
    return np.fft.rfftfreq(4 * n, 1 / RATE_HZ)


def coherent_record(peq: PEQ, *, seed: int, n: int = 5000) -> Floats:
    return noise_through(peq.complex_response(frequencies(n))[None, :], n, seed=seed)


def independent_record(peq: PEQ, *, seed: int, n: int = 5000) -> Floats:
    bands = band_response(
        frequencies(n),
        centres_hz=peq.frequencies_hz,
        bandwidths_hz=peq.bandwidths_hz,
        rate_hz=RATE_HZ,
    )
    floor = np.full((1, bands.shape[1]), peq.noise_gain, dtype=complex)
    return noise_through(np.concatenate((floor, peq.gains[:, None] * bands)), n, seed=seed)


def fit(samples: Floats, *, rate_hz: float = RATE_HZ) -> Layers:
    return fit_jointly(spectrum_of_samples(samples, rate_hz))


def model_of(layers: Layers, *, rate_hz: float = RATE_HZ) -> PEQ:
    """The layers as a PEQ, which refuses what is not finite or out of range."""
    assert np.isfinite(layers.level_sd_db).all()
    assert (layers.level_sd_db >= 0).all()
    assert (np.diff(layers.frequencies_hz) >= 0).all()
    return layers.peq(rate_hz=rate_hz)


def level_db(peq: PEQ) -> Floats:
    levels: Floats = 20 * np.log10(peq.band_rms)
    return levels


# --- noise alone


def test_white_noise_has_hardly_ever_a_layer() -> None:
    """Chance gains the penalty with e⁻⁶ in each of some 50 places of a record's own.

    A box takes half an octave to its neighbours and all widths overlap, so a few hundred boxes
    are worth about 50 independent ones: 0.12 false layers per record, and three deviations.
    """
    counts = [fit(np.random.default_rng(s).standard_normal(5000)) for s in range(50)]
    false = sum(layers.gains.size for layers in counts)
    expected = 50 * 50 * np.exp(-PENALTY)
    assert false <= expected + 3 * np.sqrt(expected)
    noise = np.array([layers.noise_gain for layers in counts])
    # 2450 lines fix a power to 1/√2450.
    assert noise.mean() == pytest.approx(1.0, abs=4 * 0.5 / np.sqrt(2450 * 50))
    assert noise.std() < 2 * 0.5 / np.sqrt(2450)


@pytest.mark.parametrize(("n", "rate_hz"), [(1250, 5000.0), (1000, 1000.0), (48000, 48000.0)])
def test_other_lengths_and_rates_bring_no_more_layers(n: int, rate_hz: float) -> None:
    false = sum(
        fit(np.random.default_rng(s).standard_normal(n), rate_hz=rate_hz).gains.size
        for s in range(20)
    )
    assert false <= 0.15 * 20 + 3 * np.sqrt(0.15 * 20)


# --- planted layers


@pytest.mark.parametrize(
    ("frequency_hz", "bandwidth_hz", "gain"),
    [
        (40.0, 15.0, 1.0),
        (60.0, 40.0, 0.5),
        (200.0, 8.0, 0.5),
        (200.0, 50.0, 0.3),
        (300.0, 200.0, 1.0),
        (700.0, 60.0, 0.5),
        (1300.0, 300.0, 0.3),
        (2200.0, 100.0, 0.5),
    ],
)
def test_one_layer_is_recovered(frequency_hz: float, bandwidth_hz: float, gain: float) -> None:
    # Far above the noise: the sign of a layer alone rescales its gain by twice the noise gain.
    truth = planted((frequency_hz, bandwidth_hz, gain), noise_gain=0.01)
    errors = []
    for seed in range(6):
        found = fit(coherent_record(truth, seed=seed))
        mine = int(np.argmin(np.abs(found.frequencies_hz - frequency_hz)))
        # A record fixes a band's centre to about its width over the root of what it holds of it.
        scatter_hz = bandwidth_hz / np.sqrt(np.pi * bandwidth_hz)
        assert found.frequencies_hz[mine] == pytest.approx(frequency_hz, abs=4 * scatter_hz)
        error_db = level_db(model_of(found))[mine] - level_db(truth)[0]
        assert abs(error_db) < 4 * found.level_sd_db[mine]
        errors.append(error_db / found.level_sd_db[mine])
    assert abs(np.mean(errors)) < 4 / np.sqrt(6)


def test_the_sign_of_a_layer_alone_only_rescales_it() -> None:
    """|G_w + G·H|² is ((G_w + G)² + G_w²u²)/(1 + u²): −0.5 at a noise of 0.05 looks like 0.4."""
    frequency = np.arange(15.0, 2400.0)
    down, up = planted((700.0, 60.0, -0.5)), planted((700.0, 60.0, 0.4))
    assert down.response(frequency) == pytest.approx(up.response(frequency), rel=1e-9)
    found = fit(coherent_record(down, seed=0))
    assert abs(0.05 + found.gains[0]) == pytest.approx(0.45, rel=0.15)


@pytest.mark.parametrize("signs", [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0)])
def test_two_overlapping_layers(signs: tuple[float, float]) -> None:
    """The response comes back to less than a dB, hole or none; two layers are told apart."""
    truth = planted((300.0, 60.0, signs[0]), (500.0, 80.0, 0.8 * signs[1]))
    frequency = np.arange(220.0, 600.0)
    two = 0
    for seed in range(10):
        found = fit(coherent_record(truth, seed=seed))
        distance_db = 20 * np.log10(model_of(found).response(frequency) / truth.response(frequency))
        assert np.sqrt(np.mean(distance_db**2)) < 1.0
        for centre, width in zip(truth.frequencies_hz, truth.bandwidths_hz, strict=True):
            assert np.abs(found.frequencies_hz - centre).min() < width / 2
        two += found.gains.size == 2
    assert two >= 8


def test_equal_signs_are_told_from_alternating_ones() -> None:
    """Between two layers 150 Hz apart equal signs dig a hole of 20 dB, which is no layer's work."""
    truth = planted((300.0, 60.0, 1.0), (450.0, 80.0, 0.8))
    signs = [np.sign(fit(coherent_record(truth, seed=seed)).gains) for seed in range(10)]
    assert sum(s.tolist() == [1.0, 1.0] for s in signs) >= 7


def test_independent_layers_keep_their_frequencies() -> None:
    """No coherent response has their power sum; forced to fit, the layers would move."""
    truth = planted((300.0, 80.0, 1.0), (500.0, 80.0, 1.0), (700.0, 60.0, 0.7))
    frequency = np.arange(15.0, 2400.0)
    bands = band_response(
        frequency,
        centres_hz=truth.frequencies_hz,
        bandwidths_hz=truth.bandwidths_hz,
        rate_hz=RATE_HZ,
    )
    power = truth.noise_gain**2 + truth.gains**2 @ np.abs(bands) ** 2
    for seed in range(6):
        found = fit(independent_record(truth, seed=seed))
        distance = np.abs(found.frequencies_hz[:, None] - truth.frequencies_hz).min(axis=0)
        assert (distance < truth.bandwidths_hz / 2).all()
        total = model_of(found).response(frequency) ** 2
        assert 10 * np.log10(total.sum() / power.sum()) == pytest.approx(0.0, abs=1.0)


def test_a_bell_is_not_split() -> None:
    """One Gaussian peak, whose skirts no Lorentzian has, is one layer in most records."""
    s = 60.0 / (2 * np.sqrt(np.log(2)))
    bell = 0.05 + np.exp(-0.5 * ((frequencies(5000) - 400) / s) ** 2)
    counts = []
    for seed in range(10):
        spectrum_ = spectrum_of_samples(noise_through(bell[None, :], 5000, seed=seed), RATE_HZ)
        power = signal_power(spectrum_)
        assert power is not None
        peaks = find_peaks_jointly(power)
        strongest = int(np.argmax(peaks.gains))
        assert peaks.frequencies_hz[strongest] == pytest.approx(400, abs=15)
        assert peaks.shape > 2  # Lorentzian is 1
        counts.append(peaks.gains.size)
    assert np.median(counts) == 1


# --- signs


@settings(deadline=None)
@given(st.lists(st.floats(20, 2000), max_size=7, unique=True))
def test_sign_patterns_are_equal_and_alternating(values: list[float]) -> None:
    frequency = np.array(values)
    patterns = sign_patterns(frequency)
    m = frequency.size
    assert patterns.shape == (3 if m > 1 else 1, m)
    assert (patterns[0] == 1).all()
    if m > 1:
        along = patterns[1:, np.argsort(frequency)]
        assert (along[:, 1:] == -along[:, :-1]).all()
        assert along[:, 0].tolist() == [1, -1]


@settings(deadline=None)
@given(st.lists(st.floats(20, 2000), min_size=1, max_size=7, unique=True))
def test_neighbouring_patterns_turn_one_relation(values: list[float]) -> None:
    frequency = np.array(values)
    m = frequency.size
    patterns = neighbouring_patterns(frequency)[:, np.argsort(frequency)]
    relations = {(*(p[1:] * p[:-1]), p[0]) for p in patterns}
    assert len(relations) == len(patterns)  # none twice
    # The three patterns' relations are all +1 or all −1; at most one of them is turned.
    turned = [min((p[1:] != p[:-1]).sum(), (p[1:] == p[:-1]).sum()) for p in patterns]
    assert max(turned) <= 1
    firsts = (1.0,) if m == 1 else (1.0, -1.0)
    expected = {
        (*np.where(np.arange(m - 1) == turn, -kind, kind), first)
        for kind in (1.0, -1.0)
        for turn in range(-1, m - 1)
        for first in firsts
        # All equal comes with positive signs only.
        if not (kind == 1.0 and first == -1.0)
    }
    assert relations == expected


# --- extremes


def fits_legally(samples: Floats, *, rate_hz: float = RATE_HZ) -> Layers:
    found = fit(samples, rate_hz=rate_hz)
    assert model_of(found, rate_hz=rate_hz).gains.size <= MOST_LAYERS
    return found


def test_silence_is_no_noise_and_no_layers() -> None:
    found = fits_legally(np.zeros(5000))
    assert found.noise_gain == 0.0
    assert found.gains.size == 0


def test_what_is_no_vibration_is_refused_before_it_comes_here() -> None:
    with refused(InputError, names="planted", expected="vibration", got=3):
        find_layers(spectrum(Recording(np.full(5000, 3.0), RATE_HZ, 100.0, 1.0, "planted")))
    samples = np.ones(5000)
    samples[7] = np.nan
    with refused(InputError, names="planted", expected="finite", got=[1, "NaN", "sample 7"]):
        Recording(samples, RATE_HZ, 100.0, 1.0, "planted")


@pytest.mark.parametrize("frequency_hz", [200.0, 200.37])
def test_a_pure_tone_is_one_narrow_layer(frequency_hz: float) -> None:
    tone = np.sin(2 * np.pi * frequency_hz * np.arange(5000) / RATE_HZ)
    found = fits_legally(tone)
    loudest = int(np.argmax(np.abs(found.gains)))
    assert found.frequencies_hz[loudest] == pytest.approx(frequency_hz, abs=1.0)
    assert found.bandwidths_hz[loudest] < 3.0
    assert found.unresolved[loudest]


def test_clipping_leaves_harmonics() -> None:
    tone = np.sin(2 * np.pi * 200.37 * np.arange(5000) / RATE_HZ)
    noise = np.random.default_rng(0).standard_normal(5000)
    found = fits_legally(np.clip(3 * tone, -1, 1) + 0.01 * noise)
    assert np.abs(found.frequencies_hz - 200).min() < 2
    assert np.abs(found.frequencies_hz - 601).min() < 3
    assert fits_legally(np.clip(5 * noise, -1, 1)).gains.size <= 1


@pytest.mark.parametrize(
    ("n", "rate_hz"),
    [(64, 1000.0), (64, 5000.0), (1250, 5000.0), (50000, 5000.0), (1000, 1000.0), (48000, 48000.0)],
)
def test_lengths_and_rates(n: int, rate_hz: float) -> None:
    truth = PEQ(
        noise_gain=0.05,
        frequencies_hz=[0.15 * rate_hz],
        bandwidths_hz=[0.05 * rate_hz],
        gains=[1.0],
        rate_hz=rate_hz,
    )
    response = truth.complex_response(np.fft.rfftfreq(4 * n, 1 / rate_hz))
    found = fits_legally(noise_through(response[None, :], n, seed=1), rate_hz=rate_hz)
    loudest = int(np.argmax(np.abs(found.gains)))
    assert found.frequencies_hz[loudest] == pytest.approx(0.15 * rate_hz, rel=0.15)
    assert abs(found.gains[loudest]) == pytest.approx(1.0, rel=0.5)


def test_very_long_records_stay_legal() -> None:
    """A line of a 30 s record is narrower than any band may be."""
    t = np.arange(30000) / 1000.0
    noise = np.random.default_rng(0).standard_normal(t.size)
    found = fits_legally(np.sin(2 * np.pi * 100 * t) + 0.1 * noise, rate_hz=1000.0)
    assert found.bandwidths_hz.min() >= 0.1


def test_an_empty_band_and_a_huge_line() -> None:
    rng = np.random.default_rng(0)
    lines = np.fft.rfft(rng.standard_normal(5000))
    huge = lines.copy()
    huge[700] = 1e7
    found = fits_legally(np.fft.irfft(huge))
    assert found.frequencies_hz[np.argmax(np.abs(found.gains))] == pytest.approx(700, abs=1)
    lines[300:800] = 0
    empty = fits_legally(np.fft.irfft(lines))
    response = model_of(empty).response(np.array([100.0, 550.0, 1500.0]))
    assert response[1] < 0.1 * min(response[0], response[2])


def test_a_steep_low_pass_does_not_spoil_the_layer_below_it() -> None:
    samples = coherent_record(planted((150.0, 40.0, 1.0)), seed=2)
    found = fits_legally(sosfilt(butter(8, 600, fs=RATE_HZ, output="sos"), samples))
    nearest = int(np.argmin(np.abs(found.frequencies_hz - 150)))
    assert found.frequencies_hz[nearest] == pytest.approx(150, abs=8)


def test_a_sensors_floor_brings_no_layers() -> None:
    """What subtraction leaves of a floor that is louder than the noise is no texture."""
    counts = []
    for seed in range(10):
        rng = np.random.default_rng(seed)
        signal = coherent_record(planted((200.0, 40.0, 1.0), noise_gain=0.02), seed=seed)
        measured = spectrum_of_samples(signal + 0.1 * rng.standard_normal(5000), RATE_HZ)
        floor = spectrum_of_samples(0.1 * rng.standard_normal(5000), RATE_HZ)
        found = fit_jointly(subtract_floor(measured, floor))
        model_of(found)
        loudest = int(np.argmax(np.abs(found.gains)))
        assert found.frequencies_hz[loudest] == pytest.approx(200, abs=12)
        assert found.noise_gain < 0.1  # below the floor
        counts.append(found.gains.size)
    assert np.mean(counts) <= 1.3


@st.composite
def records(draw: st.DrawFn) -> Floats:
    """Noise, impulses, tones, steps and their like, at any scale."""
    n = draw(st.integers(64, 1200))
    rng = np.random.default_rng(draw(st.integers(0, 1000)))
    kind = draw(st.sampled_from(["noise", "sparse", "tones", "lines", "walk", "step"]))
    if kind == "noise":
        samples = rng.standard_normal(n)
    elif kind == "sparse":
        samples = rng.standard_normal(n) * (rng.random(n) < draw(st.floats(0.001, 0.3)))
    elif kind == "tones":
        places = np.arange(n)[:, None] * rng.random(draw(st.integers(1, 20)))
        samples = np.sin(np.pi * places).sum(axis=1)
    elif kind == "lines":
        spectrum_ = np.zeros(n // 2 + 1, dtype=complex)
        spectrum_[rng.integers(0, n // 2 + 1, draw(st.integers(1, 10)))] = 1.0
        samples = np.fft.irfft(spectrum_, n)
    elif kind == "walk":
        samples = np.cumsum(rng.standard_normal(n))
    else:
        samples = np.where(np.arange(n) < rng.integers(n), 1.0, 0.0)
    scaled: Floats = samples * 10.0 ** draw(st.integers(-320, 290))
    return scaled


@settings(deadline=None, max_examples=150)
@given(records(), st.sampled_from([100.0, 1000.0, 5000.0, 48000.0]))
def test_any_record_gives_a_legal_model(samples: Floats, rate_hz: float) -> None:
    with np.errstate(divide="raise", over="raise", invalid="raise"):
        found = fits_legally(samples, rate_hz=rate_hz)
    assert found.noise_gain >= 0


@pytest.mark.parametrize("factor", [1e-200, 1e-9, 0.3, 7.0, 1e12, 1e200])
def test_gains_follow_the_unit_and_nothing_else_does(factor: float) -> None:
    def check(layers: Sequence[tuple[float, float, float]], seed: int) -> None:
        measured = spectrum_of_samples(coherent_record(planted(*layers), seed=seed), RATE_HZ)
        one = fit_jointly(measured)
        other = fit_jointly(replace(measured, magnitude=factor * measured.magnitude))
        assert other.noise_gain == pytest.approx(factor * one.noise_gain, rel=1e-6)
        assert other.gains == pytest.approx(factor * one.gains, rel=1e-6)
        for name in ("frequencies_hz", "bandwidths_hz", "level_sd_db"):
            assert getattr(other, name) == pytest.approx(getattr(one, name), rel=1e-6)

    check([(200.0, 40.0, 1.0), (700.0, 90.0, -0.4)], 0)
    check([], 1)
