"""How far responses are apart: against similarity's own measures, closed forms, a metric's laws."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactileq.modeling import InputError, TextureModel, similarity
from tactileq.modeling.models.parameter_table import Parameters
from tactileq.modeling.recordings.spectrum import smooth
from tactileq.modeling.scenes.measures import ComparedBand, Errors, errors_between
from tactileq.modeling.scenes.scene import Bound
from tests.refusals import refused

ModelMaker = Callable[..., TextureModel]
RATE_HZ = 5000.0


def responses(yardstick: ComparedBand, model: TextureModel) -> np.ndarray:
    return np.array(
        [
            model.peq(speed, force).response(yardstick.frequency_hz)
            for speed in model.speeds_mm_s
            for force in model.forces_n
        ]
    )


def nodes(model: TextureModel) -> Parameters:
    grid = np.meshgrid(model.speeds_mm_s, model.forces_n, indexing="ij")
    return model.parameters(grid[0].ravel(), grid[1].ravel())


@pytest.mark.parametrize("rate_hz", [1000.0, 5000.0])
@pytest.mark.parametrize("seed", [0, 1])
def test_responses_are_those_of_the_equalizer(
    seed: int, rate_hz: float, varied_model: ModelMaker
) -> None:
    model = varied_model(seed, rate_hz=rate_hz)
    yardstick = ComparedBand(rate_hz, narrowest_hz=15.0, band_hz=None)
    found = yardstick.responses(nodes(model))
    assert found == pytest.approx(responses(yardstick, model), rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("band_hz", [None, (40.0, 400.0)])
@pytest.mark.parametrize("seeds", [(0, 1), (2, 3), (4, 5)])
def test_errors_are_those_of_similarity(
    seeds: tuple[int, int], band_hz: tuple[float, float] | None, varied_model: ModelMaker
) -> None:
    """GFC30 is read every 10 Hz: its angle to 3 %. Bands and level to rounding."""
    yardstick = ComparedBand(RATE_HZ, narrowest_hz=15.0, band_hz=band_hz)
    a, b = (varied_model(seed) for seed in seeds)
    errors = errors_between(*(yardstick.features(nodes(model)) for model in (a, b)))
    frequency = yardstick.frequency_hz
    low, high = band_hz or (10.0, 0.98 * RATE_HZ / 2)
    inside = (frequency >= low) & (frequency <= high)
    pairs = zip(responses(yardstick, a), responses(yardstick, b), strict=True)
    for place, (ours, truth) in enumerate(pairs):
        smoothed = [smooth(x, 30.0, step_hz=float(frequency[1]))[inside] for x in (ours, truth)]
        angle = np.arccos(similarity.gfc(*smoothed))
        assert errors.angle[place] == pytest.approx(angle, rel=0.03)
        _, bands = similarity.band_energy_error_db(frequency[inside], ours[inside], truth[inside])
        rms = np.sqrt(np.nanmean(bands[:9] ** 2))
        assert errors.bands_db[place] == pytest.approx(rms, rel=1e-9)
        level = 10 * np.log10(np.sum(ours[inside] ** 2) / np.sum(truth[inside] ** 2))
        assert errors.level_db[place] == pytest.approx(abs(level), rel=1e-9)


@settings(max_examples=25)
@given(seeds=st.tuples(*[st.integers(0, 40)] * 3))
def test_errors_add_up_as_distances_do(
    seeds: tuple[int, int, int], varied_model: ModelMaker
) -> None:
    yardstick = ComparedBand(RATE_HZ, narrowest_hz=15.0, band_hz=None)
    a, b, c = (yardstick.features(nodes(varied_model(seed))) for seed in seeds)
    direct, around = errors_between(a, c), errors_between(a, b) + errors_between(b, c)
    for error, bound in zip(direct, around, strict=True):
        assert (error <= bound + 1e-9).all()
    for error, back in zip(direct, errors_between(c, a), strict=True):
        assert np.array_equal(error, back)


def test_a_louder_response_differs_in_level_alone(varied_model: ModelMaker) -> None:
    at = nodes(varied_model(0))
    yardstick = ComparedBand(RATE_HZ, narrowest_hz=15.0, band_hz=None)
    louder = at._replace(noise_gain=2 * at.noise_gain, gains=2 * at.gains)
    errors = errors_between(yardstick.features(louder), yardstick.features(at))
    assert errors.angle == pytest.approx(np.zeros(9), abs=1e-7)
    assert errors.bands_db == pytest.approx(np.full(9, 20 * np.log10(2)))
    assert errors.level_db == pytest.approx(np.full(9, 20 * np.log10(2)))


def test_the_power_of_white_noise_is_that_of_its_band() -> None:
    white = Parameters(np.array([0.3]), *[np.zeros((1, 0))] * 3)
    whole = ComparedBand(RATE_HZ, narrowest_hz=50.0, band_hz=None)
    assert whole.power(white)[0] == pytest.approx(0.09 * 0.98, rel=0.01)
    part = ComparedBand(RATE_HZ, narrowest_hz=50.0, band_hz=(500.0, 1000.0))
    assert part.power(white)[0] == pytest.approx(0.09 * 0.2, rel=0.02)


def test_silence_is_like_silence_and_unlike_all_else() -> None:
    yardstick = ComparedBand(RATE_HZ, narrowest_hz=50.0, band_hz=None)
    gains = np.array([0.0, 0.1])
    features = yardstick.features(Parameters(gains, *[np.zeros((2, 0))] * 3))
    silent, loud = features.at(np.array([0])), features.at(np.array([1]))
    assert all(part[0] == 0 for part in errors_between(silent, silent))
    errors = errors_between(silent, loud)
    assert errors.level_db[0] > 100
    assert not errors.within(Bound(gfc30=0.9, bands_db=10, level_db=10))[0]


def test_shares_of_a_bound_that_allows_nothing() -> None:
    errors = Errors(np.array([0.0, 0.1]), np.array([0.0, 1.0]), np.array([0.0, 0.5]))
    nothing = Bound(gfc30=1, bands_db=0, level_db=0)
    assert errors.shares(nothing).tolist() == [[0, np.inf]] * 3
    assert errors.within(nothing).tolist() == [True, False]
    half = Bound(gfc30=float(np.cos(0.2)), bands_db=2, level_db=0.5)
    assert errors.shares(half)[:, 1] == pytest.approx([0.5, 0.5, 1.0])
    assert errors.within(half, taken=Errors.none(2)).all()
    taken = Errors(np.zeros(2), np.zeros(2), np.full(2, 0.01))
    assert errors.within(half, taken=taken).tolist() == [True, False]


@pytest.mark.parametrize("band_hz", [(1.0, 9.0), (2480.0, 9000.0)])
def test_a_band_without_anything_in_it_is_refused(band_hz: tuple[float, float]) -> None:
    with refused(
        InputError,
        expected=["10…2450 Hz", "5000 Hz"],
        got=["band_hz", f"{max(band_hz[0], 10):g} to {min(band_hz[1], 2450):g} Hz"],
    ):
        ComparedBand(RATE_HZ, narrowest_hz=15.0, band_hz=band_hz)
