"""Levels at other rates: against closed forms and exact covariances."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from tactileq.benches.rendering.other_rates import RateErrors, rate_errors
from tactileq.modeling import PEQ
from tactileq.modeling.rendering.interpolation import interpolation
from tactileq.stimuli.planted.textures import TEXTURES, planted_texture

MODEL_RATE_HZ = 5000.0
RATES_HZ = [44_100, 48_000]


def peq(noise_gain: float, *bands: tuple[float, float, float]) -> PEQ:
    frequencies, widths, gains = np.array(bands).reshape(-1, 3).T
    return PEQ(
        noise_gain=noise_gain,
        frequencies_hz=frequencies,
        bandwidths_hz=widths,
        gains=gains,
        rate_hz=MODEL_RATE_HZ,
    )


def errors_of(condition: PEQ, rate_hz: float) -> RateErrors:
    return rate_errors([condition], model_rate_hz=MODEL_RATE_HZ, rate_hz=rate_hz)


def grid_errors(texture: str, rate_hz: float) -> RateErrors:
    """Of all conditions of a planted texture."""
    model = planted_texture(texture)
    grid = [model.peq(*at) for at in product(model.speeds_mm_s, model.forces_n)]
    return rate_errors(grid, model_rate_hz=model.rate_hz, rate_hz=rate_hz)


@pytest.fixture(scope="module")
def at_48_khz() -> dict[str, RateErrors]:
    return {name: grid_errors(name, 48_000) for name in TEXTURES}


def test_at_the_models_rate_nothing_differs() -> None:
    errors = errors_of(peq(0.1, (300, 40, 1.0), (1500, 200, -1.0)), MODEL_RATE_HZ)
    for error in errors:
        assert error == pytest.approx(0, abs=1e-9)
    assert errors.third_octaves_db.shape == (1, 22)


@pytest.mark.parametrize("rate_hz", RATES_HZ)
@pytest.mark.parametrize("gains", [(0.2, 0.0), (0.0, 0.3)])
def test_level_is_the_sum_over_phases_of_the_output(
    rate_hz: float, gains: tuple[float, float]
) -> None:
    """Σ over phases of the variance that the model's covariances give, without frequencies."""
    condition = peq(gains[0], (900, 100, gains[1]))
    way = interpolation(MODEL_RATE_HZ, rate_hz)
    assert way is not None
    first, second = way.doubling[::-1].ravel(), way.phases.T[::-1].ravel()
    whole = np.convolve(
        np.repeat(first, way.up) * (np.arange(first.size * way.up) % way.up == 0), second
    )
    lags = np.arange(-80, 81)
    frequency = (np.arange(8192) + 0.5) / 8192 / 2
    power = condition.response(frequency * MODEL_RATE_HZ) ** 2
    covariance = np.cos(2 * np.pi * np.outer(lags, frequency)) @ power / 8192
    phases = np.pad(whole, (0, -whole.size % (2 * way.up))).reshape(-1, 2 * way.up)
    by_lag = np.array([np.convolve(p, p[::-1]) for p in phases.T]).mean(axis=0)
    middle = by_lag.size // 2
    variance = by_lag @ covariance[80 - middle : 81 + middle]
    own = power.mean()
    errors = errors_of(condition, rate_hz)
    # The output has only what is below its Nyquist frequency: that is all but images.
    assert errors.whole_db == pytest.approx(10 * np.log10(variance / own), abs=2e-3)


def test_levels_at_48_khz_are_those_that_the_pages_state(at_48_khz: dict[str, RateErrors]) -> None:
    """docs/method/rendering.md#other-rates."""

    def extremes(which: str) -> tuple[float, float]:
        values = [getattr(errors, which) for errors in at_48_khz.values()]
        return min(v.min() for v in values), max(v.max() for v in values)

    assert extremes("within_band_db") == pytest.approx((-0.11, -0.02), abs=0.005)
    assert extremes("whole_db") == pytest.approx((-0.10, -0.02), abs=0.005)
    assert extremes("third_octaves_db") == pytest.approx((-0.05, 0.0), abs=0.005)


def test_44_1_khz_is_as_48_khz(at_48_khz: dict[str, RateErrors]) -> None:
    for one, other in zip(grid_errors("MDF", 44_100), at_48_khz["MDF"], strict=True):
        assert one.min() == pytest.approx(other.min(), abs=0.01)
        assert one.max() == pytest.approx(other.max(), abs=0.01)
