"""A vibrator's compensation against eq. 7, and its identification against planted resonances."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.signal import butter, sosfilt

from tactileq.modeling import (
    PEQ,
    Compensation,
    InputError,
    Renderer,
    Vibrator,
    compensation_for,
    flat_band,
    identify_vibrator,
)
from tactileq.modeling.equalizer.bands import band_response
from tactileq.modeling.errors import shown
from tactileq.stimuli.planted.vibrators import planted_vibrator
from tests.refusals import refused

RATE_HZ = 5000.0
FREQUENCY_HZ = np.geomspace(1.0, 0.999 * RATE_HZ / 2, 3000)
frequencies = st.floats(1.0, 0.49 * RATE_HZ)
widths = st.floats(0.1, 0.45 * RATE_HZ)
heights = st.floats(1.001, 200.0)


def one_resonance(
    frequency_hz: float = 80.0,
    bandwidth_hz: float = 16.0,
    height: float = 5.0,
    *,
    flat_gain: float = 1.0,
    rate_hz: float = RATE_HZ,
) -> Vibrator:
    """A vibrator that is one layer exactly, with curves of its own response."""
    curve_hz = np.geomspace(10.0, 0.49 * rate_hz, 400)
    layer = PEQ(
        noise_gain=flat_gain,
        frequencies_hz=[frequency_hz],
        bandwidths_hz=[bandwidth_hz],
        gains=[flat_gain * (height - 1)],
        rate_hz=rate_hz,
    )
    return Vibrator(
        rate_hz=rate_hz,
        frequency_hz=frequency_hz,
        bandwidth_hz=bandwidth_hz,
        height=height,
        flat_gain=flat_gain,
        coherence=1.0,
        lowest_hz=15.0,
        highest_hz=2000.0,
        curve_hz=curve_hz,
        curve_response=layer.response(curve_hz),
        curve_coherence=np.ones(400),
        simulated=True,
    )


def moved(vibrator: Vibrator, drive: np.ndarray) -> np.ndarray:
    """What the vibrator makes of a drive: docs/method/equalizer.md#recursion, step by step."""
    g, k = (
        math.tan(math.pi / vibrator.rate_hz * f)
        for f in (vibrator.frequency_hz, vibrator.bandwidth_hz)
    )
    K = k * (1 + g * g) / g
    a1 = 1 / (1 + g * (g + K))
    a2, a3 = g * a1, g * g * a1
    drive_gain, tap = math.sqrt(K / g), math.sqrt(K * g)
    s1 = s2 = 0.0
    output = np.empty(drive.size)
    for n, w in enumerate(drive.tolist()):
        v3 = drive_gain * w - s2
        v1 = a1 * s1 + a2 * v3
        v2 = s2 + a2 * s1 + a3 * v3
        s1, s2 = 2 * v1 - s1, 2 * v2 - s2
        output[n] = vibrator.flat_gain * (w + (vibrator.height - 1) * tap * v1)
    return output


def legal_compensation(vibrator: Vibrator) -> Compensation:
    """The compensation; combinations whose notch would be too wide are left out."""
    try:
        return compensation_for(vibrator)
    except InputError:
        assume(False)
        raise


# --- Eq. 7 ------------------------------------------------------------------------------------


@given(frequency_hz=frequencies, bandwidth_hz=widths, height=heights)
def test_compensation_inverts_a_layer_exactly(frequency_hz, bandwidth_hz, height) -> None:
    vibrator = one_resonance(frequency_hz, bandwidth_hz, height, flat_gain=0.3)
    at = np.append(FREQUENCY_HZ, frequency_hz)
    band = band_response(
        at, centres_hz=[frequency_hz], bandwidths_hz=[bandwidth_hz], rate_hz=RATE_HZ
    )[0]
    product = legal_compensation(vibrator).response(at) * 0.3 * (1 + (height - 1) * band)
    # Up to 1/G_w, in magnitude and in phase (docs/method/vibrators.md#compensation).
    assert np.abs(product / 0.3 - 1).max() < 1e-9


@pytest.mark.parametrize(("height", "left_db"), [(3.0, 4.4), (10.0, 14.1)])
def test_a_notch_of_the_measured_width_is_the_trap_of_method_9(height, left_db) -> None:
    vibrator = one_resonance(80.0, 15.0, height)
    at = np.linspace(20.0, 300.0, 20001)
    right = compensation_for(vibrator)
    wrong = replace(right, bandwidth_hz=vibrator.bandwidth_hz)
    for notch, expected_db in ((right, 0.0), (wrong, left_db)):
        product = np.abs(notch.response(at)) * vibrator.peq.response(at)
        assert 20 * np.log10(product).max() == pytest.approx(expected_db, abs=0.05)


@given(frequency_hz=frequencies, bandwidth_hz=widths, height=heights)
def test_compensation_is_eq_7_and_never_louder(frequency_hz, bandwidth_hz, height) -> None:
    compensation = Compensation(
        frequency_hz=frequency_hz, bandwidth_hz=bandwidth_hz, height=height, rate_hz=RATE_HZ
    )
    band_pass = band_response(
        FREQUENCY_HZ, centres_hz=[frequency_hz], bandwidths_hz=[bandwidth_hz], rate_hz=RATE_HZ
    )[0]
    response = compensation.response(FREQUENCY_HZ)
    eq_7 = compensation.output_gain + compensation.band_share * (1 - band_pass)
    assert response == pytest.approx(eq_7, abs=1e-12)
    assert compensation.output_gain == pytest.approx(1 / height)
    assert np.abs(response).max() <= 1 + 1e-12
    assert np.abs(response).min() >= 1 / height - 1e-12
    assert np.abs(compensation.response([frequency_hz])) == pytest.approx([1 / height])


@pytest.mark.parametrize("rate_hz", [5000.0, 48000.0])
@pytest.mark.parametrize(("frequency_hz", "bandwidth_hz", "height"), [(80, 16, 5), (250, 4, 30)])
def test_a_compensated_drive_arrives_as_it_was_meant(
    frequency_hz, bandwidth_hz, height, rate_hz
) -> None:
    vibrator = one_resonance(frequency_hz, bandwidth_hz, height, flat_gain=0.5, rate_hz=rate_hz)
    meant = np.random.default_rng(2).standard_normal(4000)
    drive = compensation_for(vibrator).apply(meant)
    assert moved(vibrator, drive) == pytest.approx(0.5 * meant, abs=1e-9)
    assert np.abs(moved(vibrator, meant) - 0.5 * meant).max() > 0.1


@pytest.mark.parametrize(
    ("frequency_hz", "bandwidth_hz", "rate_hz"),
    [(80.0, 100.0, 48_000.0), (80.0, 2.0, 8000.0), (10.0, 60.0, 8000.0), (900.0, 1500.0, 5000.0)],
)
def test_a_compensation_forgets_within_its_time_to_settle(
    frequency_hz: float, bandwidth_hz: float, rate_hz: float
) -> None:
    """Its slowest mode, read from what an impulse leaves behind, falls to a thousandth then."""
    compensation = Compensation(
        frequency_hz=frequency_hz, bandwidth_hz=bandwidth_hz, height=4.0, rate_hz=rate_hz
    )
    left = compensation.apply(np.eye(1, 200)[0])[1:]
    # Two modes: each sample follows from the two before it.
    recursion = np.linalg.lstsq(np.stack([left[1:-1], left[:-2]], axis=1), left[2:], rcond=None)[0]
    slowest = np.abs(np.roots([1.0, *-recursion])).max()
    assert slowest ** (compensation.settling_s * rate_hz) == pytest.approx(1e-3, rel=1e-3)


def test_a_narrow_notch_settles_as_its_envelope_does() -> None:
    """exp(−πB·t) = 1/1000, with B = 2 Hz after 1.0994 s."""
    narrow = Compensation(frequency_hz=80.0, bandwidth_hz=2.0, height=4.0, rate_hz=8000.0)
    assert narrow.settling_s == pytest.approx(math.log(1000) / (math.pi * 2.0), rel=1e-3)


@pytest.mark.parametrize("rate_hz", [5000.0, 48000.0])
def test_the_renderer_compensates_as_apply_does(make_model, rate_hz) -> None:
    model = make_model(0.02, [(60.0, 20.0, 0.3), (250.0, 60.0, -0.2)])
    compensation = compensation_for(one_resonance(), rate_hz=rate_hz)
    plain, compensated = (
        Renderer(model, rate_hz=rate_hz, seed=3, compensation=c).render(200.0, 2.0, samples=3000)
        for c in (None, compensation)
    )
    assert compensated == pytest.approx(compensation.apply(plain), abs=1e-12)
    assert compensated.std() < plain.std()


def test_a_vibrator_is_compensated_at_another_rate() -> None:
    vibrator = one_resonance(80.0, 16.0, 5.0)
    fast = compensation_for(vibrator, rate_hz=48000.0)
    assert fast.rate_hz == 48000.0
    band = band_response(FREQUENCY_HZ, centres_hz=[80.0], bandwidths_hz=[16.0], rate_hz=48000.0)[0]
    assert np.abs(fast.response(FREQUENCY_HZ) * (1 + 4 * band) - 1).max() < 1e-12
    assert compensation_for(vibrator).apply([]).shape == (0,)


@pytest.mark.parametrize(
    ("vibrator", "rate_hz", "expected", "got"),
    [
        (one_resonance(800.0, 700.0, 20.0), None, ["notch", "2250 Hz"], "2331.52 Hz"),
        (one_resonance(800.0), 1000.0, ["frequency", "1…490 Hz", "1000 Hz"], 800),
        (one_resonance(), float("nan"), ["rate", 1, "10000000 Hz"], "nan"),
    ],
)
def test_impossible_compensations_are_refused(vibrator, rate_hz, expected, got) -> None:
    with refused(InputError, expected=expected, got=got):
        compensation_for(vibrator, rate_hz=rate_hz)


@pytest.mark.parametrize("height", [1.0, 0.5, -2.0, float("nan"), float("inf")])
def test_only_a_resonance_has_a_compensation(height) -> None:
    with refused(InputError, expected="R > 1", got=f"R = {height:g}"):
        Compensation(frequency_hz=80.0, bandwidth_hz=50.0, height=height, rate_hz=RATE_HZ)


# --- The flat band ----------------------------------------------------------------------------


def test_the_flat_band_is_the_widest_in_octaves() -> None:
    frequency = np.array([10.0, 20.0, 40.0, 80.0, 100.0, 200.0, 300.0, 400.0])
    # 2 octaves from 10 Hz against 1.3 from 80 Hz, which are more in Hz.
    response = np.array([1.4, 0.72, 1.0, 9.0, 1.0, 1.0, 1.0, 1e-3])
    assert flat_band(frequency, response, level=1.0) == (10.0, 40.0)
    assert flat_band(frequency, 5 * response * 1j, level=5.0) == (10.0, 40.0)
    assert flat_band(frequency, response, level=1.0, within_db=1.0) == (100.0, 300.0)
    assert flat_band(frequency, 0 * response + 1, level=1.0) == (10.0, 400.0)
    with refused(InputError, expected=["3 dB", 99], got="none"):
        flat_band(frequency, response, level=99.0)


def test_silent_lines_are_not_flat() -> None:
    with np.errstate(all="raise"):
        assert flat_band([10.0, 20.0, 30.0], [0.0, 1.0, 1.0], level=1.0) == (20.0, 30.0)


# --- Identification ---------------------------------------------------------------------------


def noise(seconds: float, *, rate_hz: float = RATE_HZ, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(round(seconds * rate_hz))


@pytest.fixture(scope="module")
def white() -> np.ndarray:
    return noise(20.0)


@pytest.mark.parametrize(
    ("frequency_hz", "bandwidth_hz", "height"),
    [(80.0, 16.0, 5.0), (40.0, 10.0, 3.0), (60.0, 15.0, 1.6), (200.0, 10.0, 20.0), (500, 90, 8)],
)
def test_a_planted_resonance_comes_back(white, frequency_hz, bandwidth_hz, height) -> None:
    truth = one_resonance(frequency_hz, bandwidth_hz, height, flat_gain=0.02)
    sensed = moved(truth, white) + 0.005 * noise(20.0, seed=7)
    found = identify_vibrator(white, sensed, rate_hz=RATE_HZ)
    assert found.frequency_hz == pytest.approx(frequency_hz, rel=0.01)
    assert found.bandwidth_hz == pytest.approx(bandwidth_hz, rel=0.1)
    assert found.height == pytest.approx(height, rel=0.05)
    assert found.flat_gain == pytest.approx(0.02, rel=0.02)
    assert not found.simulated
    product = compensation_for(found).response(FREQUENCY_HZ) * truth.peq.complex_response(
        FREQUENCY_HZ
    )
    assert np.abs(20 * np.log10(np.abs(product) / 0.02)).max() < 0.6


def test_a_test_at_48_khz_gives_what_one_at_5_khz_gives() -> None:
    drive = noise(10.0, rate_hz=48000.0)
    truth = one_resonance(rate_hz=48000.0)
    found = identify_vibrator(drive, moved(truth, drive), rate_hz=48000.0)
    assert found.rate_hz == 5000.0
    assert found.frequency_hz == pytest.approx(80.0, rel=0.01)
    assert found.height == pytest.approx(5.0, rel=0.05)
    assert found.flat_gain == pytest.approx(1.0, rel=0.02)
    assert found.curve_hz[-1] < 2500


@pytest.mark.parametrize(("drive_scale", "scale"), [(1e-3, 1e3), (1e40, 1e-40), (1e-45, 1e-45)])
def test_units_and_offsets_do_not_matter(white, drive_scale, scale) -> None:
    sensed = moved(one_resonance(), white)
    plain = identify_vibrator(white, sensed, rate_hz=RATE_HZ)
    scaled = identify_vibrator(
        drive_scale * (white + 0.5), scale * (sensed - 2.0), rate_hz=RATE_HZ, simulated=True
    )
    assert scaled.simulated
    for name in ("frequency_hz", "bandwidth_hz", "height", "coherence"):
        assert getattr(scaled, name) == pytest.approx(getattr(plain, name), rel=1e-4)
    assert scaled.flat_gain * drive_scale / scale == pytest.approx(plain.flat_gain, rel=1e-4)


@pytest.mark.parametrize("sensor_noise", [0.1, 0.3, 0.45])
def test_coherence_is_the_share_that_the_drive_explains(white, sensor_noise) -> None:
    sensed = moved(one_resonance(), white) + sensor_noise * noise(20.0, seed=3)
    found = identify_vibrator(white, sensed, rate_hz=RATE_HZ)
    flat = found.curve_hz > 500
    truth = 1 / (1 + sensor_noise**2)
    assert found.curve_coherence[flat].mean() == pytest.approx(truth, abs=0.005)
    # The curve, like the fit, is not raised by the sensor's noise.
    assert np.sqrt(np.mean(found.curve_response[flat] ** 2)) == pytest.approx(1.0, rel=0.01)


def test_lines_without_drive_tell_nothing(white) -> None:
    drive = sosfilt(butter(8, 500.0, fs=RATE_HZ, output="sos"), white)
    sensed = moved(one_resonance(), drive) + 1e-3 * noise(20.0, seed=5)
    found = identify_vibrator(drive, sensed, rate_hz=RATE_HZ)
    assert found.height == pytest.approx(5.0, rel=0.05)
    assert not found.curve_response[found.curve_hz > 2000].any()
    assert not found.curve_coherence[found.curve_hz > 2000].any()


def test_a_response_that_falls_off_high_up_keeps_its_resonance(white) -> None:
    falling = butter(2, 700.0, fs=RATE_HZ, output="sos")
    found = identify_vibrator(
        white, sosfilt(falling, moved(one_resonance(), white)), rate_hz=RATE_HZ
    )
    assert found.frequency_hz == pytest.approx(80.0, rel=0.02)
    assert found.height == pytest.approx(5.0, rel=0.1)


def test_the_length_that_is_asked_for_is_enough() -> None:
    truth = one_resonance(80.0, 6.0, 10.0)
    drive = noise(40.0)
    sensed = moved(truth, drive)
    short = round(12 * RATE_HZ)
    with refused(InputError, expected="6.1 Hz", got="12.0 s") as refusal:
        identify_vibrator(drive[:short], sensed[:short], rate_hz=RATE_HZ)
    asked_s = float(str(refusal.value).split("at least ")[1].split(" s")[0])
    enough = round(1.1 * asked_s * RATE_HZ)
    found = identify_vibrator(drive[:enough], sensed[:enough], rate_hz=RATE_HZ)
    assert found.height == pytest.approx(10.0, rel=0.05)


def spoiled(records: np.ndarray, value: float) -> np.ndarray:
    records = records.copy()
    records[100] = value
    return records


@pytest.fixture(scope="module")
def no_tests(white: np.ndarray) -> list[tuple[np.ndarray, np.ndarray, object, object]]:
    """Records that are no test of a resonance, and what is to be said of them."""
    sensed = moved(one_resonance(), white)
    other = noise(20.0, seed=9)
    second = moved(one_resonance(), other)
    time_s = np.arange(white.size) / RATE_HZ
    tone = np.sin(2 * np.pi * 83.0 * time_s)
    return [
        (white, sensed[:-1], "length", sensed.size - 1),
        (white[None], sensed[None], "length", f"(1, {white.size})"),
        (white[:8000], sensed[:8000], "8.25 s", "1.6 s"),
        (white[:0], sensed[:0], "8.25 s", "0 s"),
        (spoiled(white, np.nan), sensed, ["finite", "drive"], "nan"),
        (white, spoiled(sensed, -np.inf), ["finite", "acceleration"], "-inf"),
        (0 * white, sensed, ["noise", "drive"], 0),
        (white, 0 * sensed + 3, ["noise", "acceleration"], 3),
        (1e60 * white, sensed, ["drive", "1e-50"], ()),
        (white, np.clip(sensed, -1, 1), ["1%", "acceleration"], ()),
        (np.clip(white, -1, 1), sensed, ["1%", "drive"], ()),
        (white, second, ["coherence", 0.8], ()),
        (white, sensed + 3 * other, ["coherence", 0.8], ()),
        (tone, moved(one_resonance(), tone), ["coherence", 0.8], ()),
        (white, 0.5 * white, ["resonance", "40 dB"], ()),
        (sensed, white, ["resonance", "40 dB"], "drive"),
        (white, np.cumsum(white), "resonance", ()),
        (white, moved(one_resonance(2000.0, 300.0), white), ["resonance", 21], ()),
    ]


@pytest.mark.parametrize("number", range(18))
def test_what_is_no_test_is_refused_in_one_sentence(no_tests, number) -> None:
    drive, acceleration, expected, got = no_tests[number]
    with refused(InputError, expected=expected, got=got) as refusal:
        identify_vibrator(drive, acceleration, rate_hz=RATE_HZ)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("rate_hz", [0.0, -5.0, float("nan"), 50.0, True])
def test_rates_that_show_no_vibrator_are_refused(white, rate_hz) -> None:
    with refused(
        InputError, expected="Hz", got=f"{rate_hz:g}" if rate_hz == 50 else shown(rate_hz)
    ):
        identify_vibrator(white, white, rate_hz=rate_hz)


def test_a_click_after_the_last_segment_is_no_drive(white) -> None:
    drive = np.zeros(2000)
    drive[1951] = 1.0
    with (
        np.errstate(all="raise", under="ignore"),
        refused(InputError, expected=["coherence", 0.8], got="0.00"),
    ):
        identify_vibrator(drive, white[:2000], rate_hz=200.0)


@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_any_records_end_in_a_vibrator_or_in_one_sentence(data) -> None:
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32)))
    drive = rng.standard_normal(2000)
    coefficients = data.draw(st.lists(st.floats(-2, 2), min_size=1, max_size=5))
    response = np.convolve(drive, coefficients)[: drive.size]
    response += data.draw(st.floats(0, 1)) * rng.standard_normal(drive.size)
    extreme = st.sampled_from([1e-310, 1e-160, 1.0, 1e12, 1e300])
    drive, response = data.draw(extreme) * drive, data.draw(extreme) * response
    for record in (drive, response):
        record[data.draw(st.lists(st.integers(0, 1999), max_size=3))] = data.draw(st.floats())
    with np.errstate(all="raise", under="ignore"), suppress(InputError):
        found = identify_vibrator(drive, response, rate_hz=200.0)
        assert found.height > 1
        assert np.isfinite(found.curve_response).all()


# --- What is saved ----------------------------------------------------------------------------


def test_a_vibrator_loads_back_equal(tmp_path: Path) -> None:
    vibrator = one_resonance()
    vibrator.save(tmp_path / "vibrator.json")
    assert Vibrator.load(tmp_path / "vibrator.json") == vibrator


@pytest.mark.parametrize(
    ("changed", "facts"),
    [
        ({"height": 0.9}, "R > 1"),
        ({"bandwidth_hz": 2400.0}, ["bandwidth", "0.1…2250 Hz"]),
        ({"curve_hz": [1.0, 2.0]}, ["shape", "steps"]),
    ],
)
def test_values_that_do_not_fit_are_refused(changed: dict[str, object], facts: object) -> None:
    with refused(InputError, expected=facts):
        Vibrator.read(one_resonance().to_dict() | changed)


def test_numbers_of_numpy_are_saved_as_numbers(tmp_path: Path) -> None:
    found = planted_vibrator(np.float32(80.5), np.int64(25))  # type: ignore[arg-type]
    found.save(tmp_path / "pen.json")
    assert Vibrator.load(tmp_path / "pen.json") == found == planted_vibrator(80.5, 25.0)
