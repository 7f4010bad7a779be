"""One stimulus: the same level and spectrum at every rate, clean ends, exact samples."""

from __future__ import annotations

import io
from itertools import pairwise

import numpy as np
import pytest
import scipy.fft
import soundfile
from hypothesis import given
from hypothesis import strategies as st
from scipy.io import wavfile
from scipy.signal import firwin, iirpeak, lfilter, resample

from tactileq.modeling import Compensation, Renderer, TextureModel, fit_ar, regressed
from tactileq.modeling.models.loading import AnyModel
from tactileq.modeling.recordings.trajectory import Trajectory
from tactileq.stimuli.planted.textures import planted_texture, record_texture
from tactileq.stimuli.sets.recipe import TrajectoryEntry
from tactileq.stimuli.sets.rendering import (
    at_rate,
    fade_samples,
    highest_peak,
    margin_samples,
    render_with_margins,
    steady_part,
    wav_bytes,
)
from tactileq.stimuli.sets.sources import trajectory_of

SMALL = {"speeds_mm_s": np.array([100.0, 300.0]), "forces_n": np.array([1.0, 3.0])}
RATES_HZ = (5000, 44_100, 48_000)
SECONDS = 2.0


def stroke(duration_s: float = SECONDS) -> Trajectory:
    return trajectory_of(TrajectoryEntry.constant(200.0, 2.0), duration_s=duration_s)


def rendered(model: AnyModel, rate_hz: int, duration_s: float = SECONDS) -> np.ndarray:
    whole = render_with_margins(model, stroke(duration_s), seed=1, stream=2, settling_s=0.5)
    return at_rate(whole, model.rate_hz, rate_hz=rate_hz, duration_s=duration_s, settling_s=0.5)


def third_octaves_db(vibration: np.ndarray) -> np.ndarray:
    """Levels of the third octaves from 16 Hz to 2.4 kHz of a file of `SECONDS`, Hann window."""
    lines = np.abs(np.fft.rfft(vibration * np.hanning(vibration.size))) ** 2 / vibration.size**2
    frequency = np.arange(lines.size) / SECONDS
    edges = np.append(1000 * 2 ** ((np.arange(-18, 5) - 0.5) / 3), 2400.0)
    edges = edges[edges <= 2400.0]
    return np.array(
        [
            10 * np.log10(lines[(frequency >= low) & (frequency < high)].sum())
            for low, high in pairwise(edges)
        ]
    )


@pytest.fixture(scope="module")
def models() -> dict[str, AnyModel]:
    truth = planted_texture("canvas", **SMALL)
    return {
        "layers": truth,
        "regressed": regressed(truth),
        "autoregressive": fit_ar(record_texture(truth, duration_s=0.5), order=8),
    }


@pytest.mark.parametrize("kind", ["layers", "regressed", "autoregressive"])
def test_rates_agree_in_level_and_spectrum(models: dict[str, AnyModel], kind: str) -> None:
    """5, 44.1 and 48 kHz: third octaves and RMS within 0.05 dB, nothing above the model's band."""
    of_rate = {rate_hz: rendered(models[kind], rate_hz) for rate_hz in RATES_HZ}
    reference = third_octaves_db(of_rate[5000])
    for rate_hz in RATES_HZ[1:]:
        vibration = of_rate[rate_hz]
        assert vibration.size == SECONDS * rate_hz
        assert np.abs(third_octaves_db(vibration) - reference).max() < 0.05
        level = 10 * np.log10(np.mean(vibration**2) / np.mean(of_rate[5000] ** 2))
        assert abs(level) < 0.05
        lines = np.abs(np.fft.rfft(vibration * np.blackman(vibration.size))) ** 2
        above = lines[round(2520 * SECONDS) :].sum() / lines.sum()
        assert 10 * np.log10(above) < -80


def test_slow_rates_are_the_renderers_own_samples() -> None:
    """At the model's rate nothing is resampled; only the ends are faded."""
    model = planted_texture("canvas", **SMALL)
    whole = Renderer(model, seed=1, stream=2).render(200.0, 2.0, samples=2500 + 500 + 10_000 + 500)
    found = rendered(model, 5000)
    assert np.array_equal(steady_part(found, 5000), steady_part(whole[3000:13_000], 5000))


def test_resampling_passes_through_the_models_samples() -> None:
    """48 of 5 samples: every 48th sample of the fast file is one of the model's."""
    model = planted_texture("canvas", **SMALL)
    slow, fast = rendered(model, 5000), rendered(model, 48_000)
    inside = slice(100, -100)
    assert fast[::48][inside] == pytest.approx(slow[::5][inside], abs=1e-12)


def test_a_sinusoid_stays_one_up_to_the_ends() -> None:
    """At 0.88 of the Nyquist frequency: what the seam of the circle leaks stays below −110 dB."""
    for rate_hz in (44_100, 48_000, 5003):
        margin = margin_samples(5000.0)
        time_s = (np.arange(5000 + 2 * margin) - margin) / 5000.0
        tone = np.sin(2 * np.pi * 2200 * time_s)
        found = at_rate(tone, 5000.0, rate_hz=rate_hz, duration_s=1.0, settling_s=0.0)
        expected = np.sin(2 * np.pi * 2200 * np.arange(rate_hz) / rate_hz)
        error = steady_part(found - expected, rate_hz)
        assert 20 * np.log10(np.abs(error).max()) < -110


def circle_of(with_margins: np.ndarray, step: int) -> np.ndarray:
    """5 kHz with faded margins of 0.1 s, and no more zeros than the ratio of the rates needs."""
    ends = 0.5 - 0.5 * np.cos(np.pi * (np.arange(500) + 0.5) / 500)
    faded = with_margins.copy()
    faded[:500] *= ends
    faded[-500:] *= ends[::-1]
    return np.pad(faded, (0, -faded.size % step))


@pytest.mark.parametrize(("rate_hz", "ratio"), [(44_100, (441, 50)), (48_000, (48, 5))])
@pytest.mark.parametrize("duration_s", [1.0, 1.6846, 1.3131])
def test_more_zeros_change_only_what_lies_at_nyquist(
    rate_hz: int, ratio: tuple[int, int], duration_s: float
) -> None:
    """White noise as by SciPy on the shortest circle, but at the model's Nyquist frequency itself,
    where a sampled signal says too little; and one band up to 2.2 kHz everywhere."""
    faster, step = ratio
    count = round(duration_s * 5000) + 1000
    white = np.random.default_rng(1).standard_normal(count + 1000)
    lowpass = firwin(1001, 2200.0, fs=5000, window=("kaiser", 20))
    for noise, largest in ((white, 1e-2), (np.convolve(white, lowpass, "same"), 1e-7)):
        with_margins = noise[500:-500]
        found = at_rate(
            with_margins, 5000.0, rate_hz=rate_hz, duration_s=duration_s, settling_s=0.0
        )
        circle = circle_of(with_margins, step)
        whole = resample(circle, circle.size // step * faster)
        expected = steady_part(whole[faster * 500 // step :][: found.size], rate_hz)
        error = steady_part(found, rate_hz) - expected
        assert np.abs(error).max() < largest * np.abs(expected).max()
        lines = np.abs(np.fft.rfft(error * np.blackman(error.size))) ** 2
        near = np.abs(np.fft.rfftfreq(error.size, 1 / rate_hz) - 2500.0) <= 10.0
        assert lines[~near].sum() <= 1e-4 * lines.sum()
    if circle.size == 7000:  # fast already
        assert np.abs(error).max() < 1e-12


@pytest.mark.parametrize("samples", [5000, 7919, 28_537])
@pytest.mark.parametrize("rate_hz", [6000, 44_100, 48_000])
def test_ffts_have_lengths_without_large_prime_factors(
    monkeypatch: pytest.MonkeyPatch, samples: int, rate_hz: int
) -> None:
    """Forth and back, whatever the duration; a length like 10 × 5707 takes ten times as long."""
    lengths = []
    rfft, irfft = scipy.fft.rfft, scipy.fft.irfft

    def forth(values: np.ndarray) -> np.ndarray:
        lengths.append(values.size)
        return rfft(values)

    def back(spectrum: np.ndarray, n: int, **options: bool) -> np.ndarray:
        lengths.append(n)
        return irfft(spectrum, n, **options)

    monkeypatch.setattr(scipy.fft, "rfft", forth)
    monkeypatch.setattr(scipy.fft, "irfft", back)
    at_rate(
        np.ones(samples + 1000), 5000.0, rate_hz=rate_hz, duration_s=samples / 5000, settling_s=0.0
    )
    assert len(lengths) == 2
    for length in lengths:
        for prime in (2, 3, 5, 7):
            while length % prime == 0:
                length //= prime
        assert length == 1


def test_odd_model_rates_keep_their_frequencies() -> None:
    """A rate that came from time stamps: the ratio is met within 2 parts in a million."""
    model_rate_hz = 3333.271
    margin = margin_samples(model_rate_hz)
    time_s = (np.arange(round(2 * model_rate_hz) + 2 * margin) - margin) / model_rate_hz
    found = at_rate(
        np.sin(2 * np.pi * 1000 * time_s),
        model_rate_hz,
        rate_hz=48_000,
        duration_s=2.0,
        settling_s=0.0,
    )
    expected = np.sin(2 * np.pi * 1000 * np.arange(96_000) / 48_000)
    # 2e-6 of 1 kHz over 2 s is 0.025 rad.
    assert np.abs(steady_part(found - expected, 48_000)).max() < 0.026


def test_fades_and_settled_start() -> None:
    vibration = rendered(planted_texture("wall paper", **SMALL), 8000, duration_s=1.0)
    fade = fade_samples(vibration.size, 8000)
    assert fade == 80
    middle = steady_part(vibration, 8000)
    assert middle.size == vibration.size - 160
    assert np.abs(vibration[[0, -1]]).max() < 0.01 * np.abs(middle).max()
    assert np.sqrt(np.mean(middle[:720] ** 2)) > 0.5 * np.sqrt(np.mean(middle**2))


@pytest.mark.parametrize("samples", [1, 2, 3, 7, 40])
def test_short_files_keep_a_steady_part(samples: int) -> None:
    vibration = rendered(planted_texture("PVC", **SMALL), 8000, duration_s=samples / 8000)
    assert vibration.size == samples
    assert steady_part(vibration, 8000).size >= samples / 2


def test_a_moving_hand_moves_the_spectrum() -> None:
    """Main layer at v/λ: 80 Hz at 100 mm/s in the first half, 240 Hz at 300 mm/s in the second."""
    base = planted_texture("wall paper", **SMALL)
    one = TextureModel(
        texture="one",
        rate_hz=5000.0,
        speeds_mm_s=base.speeds_mm_s,
        forces_n=base.forces_n,
        noise_gains=np.zeros((2, 2)),
        frequencies_hz=np.array([[[80.0], [80.0]], [[240.0], [240.0]]]),
        bandwidths_hz=np.full((2, 2, 1), 10.0),
        gains=np.full((2, 2, 1), 0.5),
        level_sd_db=np.zeros((2, 2, 1)),
        estimator="planted",
        simulated=True,
    )
    hand = Trajectory("step", [5.0, 6.0, 6.001, 7.0], [100.0, 100.0, 300.0, 300.0], [2.0] * 4)
    whole = render_with_margins(one, hand, seed=3, stream=0, settling_s=0.5)
    found = at_rate(whole, 5000.0, rate_hz=5000, duration_s=2.0, settling_s=0.5)
    for half, frequency_hz in ((found[500:5000], 80.0), (found[5500:], 240.0)):
        lines = np.abs(np.fft.rfft(half)) ** 2
        frequency = np.fft.rfftfreq(half.size, 1 / 5000)
        centroid = (lines * frequency).sum() / lines.sum()
        assert centroid == pytest.approx(frequency_hz, abs=15)


def test_lift_off_is_silent() -> None:
    hand = Trajectory("off", [0.0, 1.0], [np.nan] * 2, [np.nan] * 2)
    model = planted_texture("PVC", **SMALL)
    whole = render_with_margins(model, hand, seed=0, stream=0, settling_s=0.5)
    assert not at_rate(whole, 5000.0, rate_hz=48_000, duration_s=1.0, settling_s=0.5).any()


@pytest.mark.parametrize("rate_hz", RATES_HZ)
def test_the_drive_gives_the_vibration_meant(rate_hz: int) -> None:
    """A vibrator of one layer, flat gain 0.3, answers it with 0.3 times the vibration."""
    frequency_hz, bandwidth_hz, height = 80.0, 25.0, 4.0
    whole = render_with_margins(
        planted_texture("canvas", **SMALL), stroke(), seed=1, stream=2, settling_s=0.5
    )
    vibration, drive = (
        at_rate(
            whole,
            5000.0,
            rate_hz=rate_hz,
            duration_s=SECONDS,
            settling_s=0.5,
            compensation=compensation,
        )
        for compensation in (None, notch(frequency_hz, bandwidth_hz, height, rate_hz=rate_hz))
    )
    b, a = iirpeak(frequency_hz, frequency_hz / bandwidth_hz, fs=rate_hz)
    answer = 0.3 * (drive + (height - 1) * lfilter(b, a, drive))
    # The test's own vibrator starts at rest; 0.4 s later its 25 Hz wide band has forgotten that.
    late = slice(round(0.4 * rate_hz), -fade_samples(vibration.size, rate_hz))
    assert np.abs(answer - 0.3 * vibration)[late].max() < 1e-9
    assert np.abs(drive - vibration)[late].max() > 0.05


def notch(frequency_hz: float, bandwidth_hz: float, height: float, *, rate_hz: int) -> Compensation:
    """The notch whose tan(πB/fs) is that of the resonance times its height.

    docs/method/vibrators.md#compensation
    """
    widened = height * np.tan(np.pi * bandwidth_hz / rate_hz)
    return Compensation(
        frequency_hz=frequency_hz,
        bandwidth_hz=rate_hz / np.pi * np.arctan(widened),
        height=height,
        rate_hz=rate_hz,
    )


def test_a_drive_has_settled_where_it_begins() -> None:
    """After the compensation's own time to settle as after any longer time, to a thousandth."""
    compensation = notch(80.0, 1.5, 4.0, rate_hz=8000)
    whole = render_with_margins(
        planted_texture("canvas", **SMALL), stroke(), seed=1, stream=2, settling_s=5.0
    )

    def driven(settling_s: float) -> np.ndarray:
        return at_rate(
            whole[round((5.0 - settling_s) * 5000) :],
            5000.0,
            rate_hz=8000,
            duration_s=SECONDS,
            settling_s=settling_s,
            compensation=compensation,
        )

    assert 0.3 < compensation.settling_s < 0.4
    settled = driven(5.0)
    error = [np.abs(driven(s) - settled).max() for s in (0.0, compensation.settling_s)]
    largest = np.abs(settled).max()
    assert error[1] < 1e-3 * largest < error[0]


@given(
    values=st.lists(st.floats(-1, 1 - 2**-23), min_size=1, max_size=200),
    full_scale_g=st.floats(1e-3, 1e3),
)
def test_24_bit_samples_are_rounded_steps(values: list[float], full_scale_g: float) -> None:
    """What stands in the file is round(x/full_scale·2²³), read back as whole numbers."""
    vibration = np.clip(np.array(values) * full_scale_g, None, highest_peak(full_scale_g))
    data = wav_bytes(vibration, 44_100, full_scale_g=full_scale_g)
    found, rate_hz = soundfile.read(io.BytesIO(data), dtype="int32")
    info = soundfile.info(io.BytesIO(data))
    assert (info.subtype, info.format, rate_hz) == ("PCM_24", "WAV", 44_100)
    assert (found % 256 == 0).all()
    exact = vibration / full_scale_g * 2**23
    assert np.abs(found // 256 - exact).max() <= 0.5 * (1 + 1e-9)


def test_float_samples_are_g() -> None:
    vibration = np.array([0.0, 1.5, -120.0, 1e-9])
    data = wav_bytes(vibration, 48_000, full_scale_g=None)
    rate_hz, found = wavfile.read(io.BytesIO(data))
    assert rate_hz == 48_000
    assert found.dtype == np.float32
    assert np.array_equal(found, vibration.astype(np.float32))
    # libsndfile's float files carry a PEAK chunk with the time of writing.
    assert b"PEAK" not in data
