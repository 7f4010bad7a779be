"""The autoregressive rival: recovery of planted filters, the grid, blends, files."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import freqz, lfilter, welch

from tactileq.modeling import ARFilter, ARModel, GridError, InputError, Recording, fit_ar
from tactileq.modeling.fitting.autoregressive import fit_filter
from tactileq.modeling.models.line_spectral import (
    line_spectral_frequencies,
    prediction_coefficients,
    reflection_coefficients,
)
from tactileq.modeling.recordings.spectrum import spectrum_of_samples
from tests.refusals import refused

RATE_HZ = 5000.0
GRID = [(speed, force) for speed in (100.0, 200.0, 300.0) for force in (1.0, 2.0)]


def resonances(*peaks: tuple[float, float]) -> np.ndarray:
    """Coefficients a₁ … a_p of poles at (frequency, −3 dB width) in Hz."""
    poles = [np.exp(np.pi / RATE_HZ * (-b + 2j * f)) for f, b in peaks]
    return np.poly([*poles, *np.conj(poles)]).real[1:]


PLANTED = resonances((150.0, 60.0), (600.0, 120.0))


def noise_through(
    coefficients: np.ndarray, gain: float, *, seconds: float = 1.0, seed: int = 0
) -> np.ndarray:
    """Gaussian noise of RMS `gain` through 1/A, settled."""
    noise = np.random.default_rng(seed).standard_normal(round(seconds * RATE_HZ) + 2000)
    return lfilter([gain], [1.0, *coefficients], noise)[2000:]


def recording(
    condition: tuple[float, float] = (100.0, 1.0),
    *,
    coefficients: np.ndarray = PLANTED,
    gain: float = 0.02,
    seconds: float = 1.0,
    seed: int = 0,
    **labels: object,
) -> Recording:
    samples = noise_through(coefficients, gain, seconds=seconds, seed=seed)
    return Recording(samples, RATE_HZ, *condition, "planted", **labels)  # type: ignore[arg-type]


def grid_of_recordings(conditions: Sequence[tuple[float, float]] = GRID) -> list[Recording]:
    return [
        recording(c, gain=0.01 * c[1], seed=number, simulated=True)
        for number, c in enumerate(conditions)
    ]


def hand_made(frequencies: np.ndarray, gains: np.ndarray, **other: object) -> ARModel:
    values: dict[str, object] = {
        "texture": "made",
        "rate_hz": RATE_HZ,
        "speeds_mm_s": [100.0, 300.0],
        "forces_n": [1.0, 3.0],
        "line_spectral_frequencies": frequencies,
        "gains": gains,
        "level_sd_db": np.zeros(np.shape(gains)),
    }
    return ARModel(**{**values, **other})  # type: ignore[arg-type]


# --- one condition


def test_planted_filter_is_recovered_from_a_long_record() -> None:
    samples = noise_through(PLANTED, 0.02, seconds=200)
    fitted = fit_filter([spectrum_of_samples(samples, RATE_HZ)], order=4)
    # A million samples: the standard error of a coefficient is about 1e-3.
    assert fitted.coefficients == pytest.approx(PLANTED, abs=0.01)
    assert fitted.gain == pytest.approx(0.02, rel=0.01)


def test_more_orders_than_the_truth_needs_are_nearly_zero() -> None:
    samples = noise_through(PLANTED, 0.02, seconds=200)
    fitted = fit_filter([spectrum_of_samples(samples, RATE_HZ)], order=7)
    reflection = reflection_coefficients(fitted.coefficients)
    assert np.abs(reflection[4:]).max() < 0.01
    assert abs(reflection[3]) > 0.5


def test_yule_walker_equations_hold() -> None:
    """R·a = −r with the circular autocorrelation, straight from the samples."""
    samples = noise_through(PLANTED, 1.0)
    fitted = fit_filter([spectrum_of_samples(samples, RATE_HZ)], order=9)
    r = np.array([np.mean(samples * np.roll(samples, lag)) for lag in range(10)])
    matrix = r[np.abs(np.subtract.outer(np.arange(9), np.arange(9)))]
    assert matrix @ fitted.coefficients == pytest.approx(-r[1:], abs=1e-6 * r[0])
    assert fitted.gain**2 == pytest.approx(r[0] + fitted.coefficients @ r[1:], rel=1e-4)


def test_response_is_gain_over_a_and_the_density_of_the_output() -> None:
    frequency = np.linspace(0, 2500, 501)
    made = ARFilter(coefficients=PLANTED, gain=0.02, rate_hz=RATE_HZ)
    _, expected = freqz([0.02], [1.0, *PLANTED], worN=frequency, fs=RATE_HZ)
    assert made.response(frequency) == pytest.approx(np.abs(expected), rel=1e-12)
    samples = noise_through(PLANTED, 0.02, seconds=200)
    frequency, density = welch(samples, fs=RATE_HZ, nperseg=5000)
    inside = (frequency >= 25) & (frequency < 2475)
    measured = density[inside].reshape(-1, 25).mean(axis=1)
    modelled = (made.response(frequency[inside]) ** 2 * 2 / RATE_HZ).reshape(-1, 25).mean(axis=1)
    # 399 half-overlapping pieces × 25 bins: 1.4 %.
    assert measured == pytest.approx(modelled, rel=0.06)
    assert np.mean(measured / modelled) == pytest.approx(1, abs=0.005)


def test_level_deviation_is_that_of_repeated_records() -> None:
    levels = [
        10 * np.log10(np.mean(noise_through(PLANTED, 1.0, seconds=0.5, seed=seed) ** 2))
        for seed in range(400)
    ]
    records = [recording(c, seconds=0.5, seed=n) for n, c in enumerate(GRID)]
    stated = float(np.mean(fit_ar(records, order=4).level_sd_db))
    # 400 records give their own standard deviation to 3.5 %.
    assert stated == pytest.approx(np.std(levels), rel=0.12)


def test_silent_spectrum_gives_a_silent_filter() -> None:
    spectrum = spectrum_of_samples(np.zeros(1000), RATE_HZ)
    fitted = fit_filter([spectrum], order=5)
    assert fitted.gain == 0
    assert not fitted.coefficients.any()


@pytest.mark.parametrize("order", [1, 2, 39, 40])
def test_pure_tones_and_empty_bands_stay_stable(order: int) -> None:
    time = np.arange(5000) / RATE_HZ
    tones = np.sin(2 * np.pi * 80 * time) + 0.3 * np.sin(2 * np.pi * 700 * time)
    fitted = fit_filter([spectrum_of_samples(tones, RATE_HZ)], order=order)
    assert np.abs(reflection_coefficients(fitted.coefficients)).max() < 1
    assert np.isfinite(fitted.response(np.arange(2500.0))).all()
    assert line_spectral_frequencies(fitted.coefficients).shape == (order,)


# --- the grid


def test_model_over_the_grid() -> None:
    model = fit_ar(grid_of_recordings(), order=6)
    assert (model.order, model.n_parameters) == (6, 7)
    assert model.speeds_mm_s.tolist() == [100, 200, 300]
    assert model.forces_n.tolist() == [1, 2]
    assert model.line_spectral_frequencies.shape == (3, 2, 6)
    assert (model.unit, model.simulated, model.rate_hz) == ("g", True, RATE_HZ)
    assert not model.interpolated.any()
    # The gain doubles with the force as planted; 1 s gives it to about 1 %.
    assert model.gains[:, 1] / model.gains[:, 0] == pytest.approx(2, rel=0.05)


def test_repeats_are_averaged_in_power() -> None:
    once = [recording(c, seed=n) for n, c in enumerate(GRID)]
    louder = [Recording(r.samples * 2, RATE_HZ, *r.condition, r.texture, repeat=2) for r in once]
    alone, together = fit_ar(once, order=4), fit_ar([*once, *louder], order=4)
    assert together.gains == pytest.approx(alone.gains * np.sqrt(2.5), rel=1e-9)
    assert together.line_spectral_frequencies == pytest.approx(
        alone.line_spectral_frequencies, abs=1e-9
    )
    # Twice the data: the level's deviation falls by √2.
    assert together.level_sd_db == pytest.approx(alone.level_sd_db / np.sqrt(2), rel=1e-3)


def test_a_longer_repeat_weighs_more() -> None:
    """Power 1 for 1 s and power 4 for 3 s: 3.25 over all of it."""
    rng = np.random.default_rng(3)
    noises = (rng.standard_normal(count) for count in (5000, 15000))
    levels = [rms * noise / noise.std() for rms, noise in zip((1.0, 2.0), noises, strict=True)]
    fitted = fit_filter([spectrum_of_samples(one, RATE_HZ) for one in levels], order=1)
    # White noise is predicted by nothing, but for what two samples correlate by chance.
    assert fitted.gain**2 == pytest.approx(3.25, rel=1e-3)


def test_holes_are_filled_and_marked() -> None:
    nine = [(speed, force) for speed in (100.0, 200.0, 300.0) for force in (1.0, 2.0, 3.0)]
    hole = (200.0, 2.0)
    model = fit_ar([r for r in grid_of_recordings(nine) if r.condition != hole], order=5)
    assert np.argwhere(model.interpolated).tolist() == [[1, 1]]
    frequencies = model.line_spectral_frequencies
    assert np.all(frequencies[1, 1] >= frequencies.min(axis=(0, 1)))
    assert np.all(frequencies[1, 1] <= frequencies.max(axis=(0, 1)))
    # A plane of gains (0.01 × force) has its middle value in the hole.
    assert model.gains[1, 1] == pytest.approx(0.02, rel=0.05)


def test_floor_is_subtracted() -> None:
    rng = np.random.default_rng(5)
    floor_rms = 0.05
    noisy = [
        Recording(
            r.samples + floor_rms * rng.standard_normal(r.samples.size),
            RATE_HZ,
            *r.condition,
            r.texture,
        )
        for r in grid_of_recordings()
    ]
    still = Recording(floor_rms * rng.standard_normal(20_000), RATE_HZ, 0.0, 0.0, "planted")
    clean = fit_ar(grid_of_recordings(), order=4).filter(300.0, 2.0)
    with_floor = fit_ar(noisy, order=4).filter(300.0, 2.0)
    without = fit_ar([*noisy, still], order=4).filter(300.0, 2.0)
    empty = np.arange(1500.0, 2400.0)  # where the planted texture lies far below the floor
    assert with_floor.response(empty).mean() > 2 * clean.response(empty).mean()
    assert without.response(empty).mean() < 0.5 * with_floor.response(empty).mean()


def test_one_force_suffices() -> None:
    """Every force then sounds as that one."""
    model = fit_ar(grid_of_recordings([c for c in GRID if c[1] == 1.0]), order=4)
    assert model.forces_n.tolist() == [1.0]
    one = model.filter(150.0, 1.0).response(np.arange(20.0, 400.0))
    other = model.filter(150.0, 2.5).response(np.arange(20.0, 400.0))
    assert np.array_equal(one, other)


def test_conditions_on_one_line_are_named() -> None:
    diagonal = [(100.0, 1.0), (200.0, 2.0), (300.0, 3.0)]
    with refused(GridError, names="planted", expected="grid", got=[3, 9]):
        fit_ar(grid_of_recordings(diagonal), order=4)


@pytest.mark.parametrize("order", [0, -1, 41, 2.0, "6"])
def test_unusable_orders_are_refused(order: int) -> None:
    with refused(InputError, expected=["order", 1, 40, 5000], got=order):
        fit_ar(grid_of_recordings(), order=order)


def test_short_records_limit_the_order() -> None:
    short = [recording(c, seconds=0.0128, seed=n) for n, c in enumerate(GRID)]
    assert fit_ar(short, order=31).order == 31
    with refused(InputError, expected=["order", 1, 31, 64], got=32):
        fit_ar(short, order=32)


def test_mixed_units_are_refused() -> None:
    records = grid_of_recordings()
    records[0] = recording(GRID[0], unit="arbitrary")
    with refused(InputError, names="planted", expected="unit", got=["arbitrary", "g"]):
        fit_ar(records, order=4)


# --- between the conditions


def test_parameters_at_the_grid_and_between() -> None:
    model = fit_ar(grid_of_recordings(), order=6)
    at = model.parameters([100.0, 150.0, 300.0], [1.0, 1.5, 2.0])
    assert at.line_spectral_frequencies[0] == pytest.approx(model.line_spectral_frequencies[0, 0])
    assert at.line_spectral_frequencies[2] == pytest.approx(model.line_spectral_frequencies[2, 1])
    middle = model.line_spectral_frequencies[:2].mean(axis=(0, 1))
    assert at.line_spectral_frequencies[1] == pytest.approx(middle)
    assert at.gain[1] == pytest.approx(model.gains[:2].mean())


def test_edges_of_the_grid() -> None:
    """Clamped above, a linear ramp to 0 below, NaN and inf as lift-off.

    docs/method/rendering.md#grid-edges
    """
    model = fit_ar(grid_of_recordings(), order=3)
    speed = [50.0, 50.0, 900.0, 0.0, 100.0, np.nan, 100.0, -100.0]
    force = [1.0, 0.25, 9.0, 1.0, -1.0, 1.0, np.inf, 1.0]
    gain = model.parameters(speed, force).gain
    first, last = model.gains[0, 0], model.gains[-1, -1]
    expected = [first / 2, first / 8, last, 0, 0, 0, 0, first]
    assert gain == pytest.approx(np.array(expected), abs=1e-15)


@given(st.floats(0, 400), st.floats(0, 4), st.integers(0, 1000))
def test_every_blend_is_stable(speed: float, force: float, seed: int) -> None:
    gaps = np.random.default_rng(seed).uniform(0.3, 3.0, (2, 2, 13))
    frequencies = np.pi * np.cumsum(gaps, axis=-1)[..., :-1] / gaps.sum(axis=-1, keepdims=True)
    blend = hand_made(frequencies, np.ones((2, 2))).filter(speed, force)
    assert np.abs(reflection_coefficients(blend.coefficients)).max() < 1
    assert np.isfinite(blend.response(np.arange(0.0, 2501.0, 50.0))).all()


def test_blending_coefficients_goes_unstable_where_frequencies_never_do() -> None:
    """95 of 540 in docs/method/fitting.md#ar-models; here on harsher pairs: narrow resonances
    anywhere, order 6 and 8."""
    rng = np.random.default_rng(0)
    unstable = 0
    for _ in range(300):
        count = int(rng.integers(3, 5))
        pair = [
            resonances(*zip(rng.uniform(20, 2400, count), rng.uniform(2, 40, count), strict=True))
            for _ in range(2)
        ]
        middle = np.mean(pair, axis=0)
        unstable += bool(np.abs(reflection_coefficients(middle)).max() >= 1)
        frequencies = np.mean([line_spectral_frequencies(a) for a in pair], axis=0)
        assert np.abs(np.roots([1.0, *prediction_coefficients(frequencies)])).max() < 1
    assert unstable > 100


# --- files and checks


def test_file_loads_back_equal(tmp_path: Path) -> None:
    model = fit_ar(grid_of_recordings(), order=7)
    model.save(tmp_path / "model.json")
    values = json.loads((tmp_path / "model.json").read_text())
    assert (values["format"], values["version"]) == ("tactileq.ar-model", 1)
    assert ARModel.load(tmp_path / "model.json") == model
    assert model != replace(model, texture="other")
    assert model != "model"


def test_gains_of_another_grid_are_refused() -> None:
    values = fit_ar(grid_of_recordings(), order=2).to_dict()
    with refused(InputError, expected=["gains", "speeds", "forces", "(3, 2)"]):
        ARModel.read(values | {"gains": [[1.0, 2.0]]})


@pytest.mark.parametrize(
    ("frequencies", "gains", "named"),
    [
        (np.full((2, 2, 1), 3.5), np.ones((2, 2)), ["π", "made"]),
        (np.full((2, 2, 2), 1.0), np.ones((2, 2)), ["unstable", "made"]),
        (np.full((2, 2, 0), 1.0), np.ones((2, 2)), ["line_spectral_frequencies", "(2, 2, 0)"]),
        (np.full((2, 2), 1.0), np.ones((2, 2)), ["line_spectral_frequencies", "(2, 2)"]),
        (np.full((2, 2, 1), 1.0), -np.ones((2, 2)), ["gains", -1.0]),
        (np.full((2, 2, 1), 1.0), np.full((2, 2), np.inf), ["gains", "inf"]),
    ],
)
def test_models_out_of_range_are_refused(
    frequencies: np.ndarray, gains: np.ndarray, named: list[object]
) -> None:
    with refused(InputError, names=named):
        hand_made(frequencies, gains)


@pytest.mark.parametrize(
    ("coefficients", "gain", "rate_hz", "expected", "got"),
    [
        ([-2.4, 1.69], 1.0, 5000.0, "stable", ()),
        ([1.0], 1.0, 5000.0, "stable", ()),
        ([np.nan], 1.0, 5000.0, "stable", ()),
        ([], 1.0, 5000.0, "coefficients", "(0,)"),
        ([0.5], -1.0, 5000.0, ["gain", 0], -1.0),
        ([0.5], np.nan, 5000.0, ["gain", 0], "nan"),
        ([0.5], 1.0, 0.0, "rate", 0.0),
    ],
)
def test_filters_out_of_range_are_refused(
    coefficients: list[float], gain: float, rate_hz: float, expected: object, got: object
) -> None:
    with refused(InputError, expected=expected, got=got):
        ARFilter(coefficients=coefficients, gain=gain, rate_hz=rate_hz)
