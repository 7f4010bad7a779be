"""Exact variances under moving parameters: against closed forms, against impulse responses."""

from __future__ import annotations

import numpy as np
import pytest

from tactileq.benches.rendering.accuracy import stroke
from tactileq.benches.rendering.stability import (
    CENTRES_HZ,
    DIRECT,
    FORMS,
    OURS,
    PLAIN,
    WIDTHS_HZ,
    Variances,
    excess_db,
    held_variances,
    moving_variances,
    simulate,
)
from tactileq.modeling import PEQ
from tactileq.modeling.arrays import Floats
from tactileq.modeling.equalizer.bands import band_response, band_rms
from tactileq.modeling.models.parameter_table import Parameters
from tactileq.stimuli.planted.textures import planted_texture

RATE_HZ = 5000.0
JUMPS, ANYWHERE = "jumping 20 ↔ 1500 Hz", "random jumps"


def drawn(count: int, *, widest_hz: float = 2250.0, seed: int = 0) -> Parameters:
    rng = np.random.default_rng(seed)
    octaves = rng.uniform(np.log(100), np.log(2400), (count, 3))
    widths = np.exp(rng.uniform(np.log(20), np.log(widest_hz), (count, 3)))
    return Parameters(
        rng.uniform(0, 1, count), np.exp(octaves), widths, rng.normal(0, 1, (count, 3))
    )


def motions(*, samples: int = 2000) -> dict[str, Parameters]:
    """Three bands of equal level that jump, jitter by 30 % or go anywhere, at every sample."""
    rng = np.random.default_rng(1)
    odd = (np.arange(samples) % 2 == 1)[:, None]
    jitter = np.exp(0.3 * rng.standard_normal((2, samples, 3)))
    anywhere = np.exp(rng.uniform(np.log([1, 0.1]), np.log([2450, 2250]), (samples, 3, 2)))
    moved = {
        JUMPS: (
            np.where(odd, [20.0, 1500.0, 300.0], [1500.0, 20.0, 300.0]),
            np.full((samples, 3), 50.0),
        ),
        "30 % jitter": (np.array(CENTRES_HZ) * jitter[0], np.array(WIDTHS_HZ) * jitter[1]),
        ANYWHERE: (anywhere[..., 0], anywhere[..., 1]),
    }
    return {name: equally_loud(*bands) for name, bands in moved.items()}


def equally_loud(frequency_hz: Floats, width_hz: Floats) -> Parameters:
    gains = np.array([1.0, -1.0, 1.0]) / band_rms(1.0, width_hz, rate_hz=RATE_HZ)
    return Parameters(np.full(len(gains), 10**-0.5), frequency_hz, width_hz, gains)


def excess_of(at: Parameters, form: str) -> Variances:
    return excess_db(
        moving_variances(at, FORMS[form], rate_hz=RATE_HZ),
        held_variances(at, FORMS[form], rate_hz=RATE_HZ),
    )


@pytest.mark.parametrize("form", FORMS)
def test_every_form_is_the_same_filter(form: str) -> None:
    at = drawn(1)
    centres, widths = at.frequencies_hz[0], at.bandwidths_hz[0]
    bands = FORMS[form](centres, widths, rate_hz=RATE_HZ)
    frequency = np.linspace(1, 2499, 400)
    z = np.exp(2j * np.pi * frequency / RATE_HZ)[:, None, None, None]
    states = np.linalg.solve(z * np.eye(2) - bands.matrix, bands.drive[..., None])[..., 0]
    response = (np.sum(bands.readout * states, axis=-1) + bands.through).T
    expected = band_response(frequency, centres_hz=centres, bandwidths_hz=widths, rate_hz=RATE_HZ)
    assert response == pytest.approx(expected, abs=1e-10)


@pytest.mark.parametrize("form", FORMS)
def test_held_variances_are_those_of_the_response(form: str) -> None:
    at = drawn(5)
    held = held_variances(at, FORMS[form], rate_hz=RATE_HZ)
    assert held.bands == pytest.approx(
        band_rms(at.gains, at.bandwidths_hz, rate_hz=RATE_HZ) ** 2, rel=1e-9
    )
    circle = np.arange(20_000) * RATE_HZ / 2 / 20_000 + RATE_HZ / 80_000
    for n in range(5):
        peq = PEQ(
            noise_gain=at.noise_gain[n],
            frequencies_hz=at.frequencies_hz[n],
            bandwidths_hz=at.bandwidths_hz[n],
            gains=at.gains[n],
            rate_hz=RATE_HZ,
        )
        assert held.total[n] == pytest.approx(np.mean(peq.response(circle) ** 2), rel=1e-9)


@pytest.mark.parametrize("form", FORMS)
def test_moving_variances_are_the_sums_of_all_squared_impulse_responses(form: str) -> None:
    """An impulse at each sample in turn; before the motion, long enough to be stationary."""
    moving = drawn(60, widest_hz=400.0)
    first = np.zeros(1200, dtype=int)
    at = Parameters(*(np.concatenate([part[first], part]) for part in moving))
    responses = simulate(at, FORMS[form], np.eye(1260), rate_hz=RATE_HZ)
    variances = moving_variances(at, FORMS[form], rate_hz=RATE_HZ)
    assert variances.total[1200:] == pytest.approx(np.sum(responses**2, axis=0)[1200:], rel=1e-8)
    alone = Parameters(
        np.zeros(1260), *(part[:, 1:2] for part in (at.frequencies_hz, at.bandwidths_hz, at.gains))
    )
    one_band = simulate(alone, FORMS[form], np.eye(1260), rate_hz=RATE_HZ)
    assert variances.bands[1200:, 1] == pytest.approx(np.sum(one_band**2, axis=0)[1200:], rel=1e-8)


@pytest.mark.parametrize("motion", motions(samples=2))
def test_each_band_is_exactly_as_loud_as_it_should_be(motion: str) -> None:
    """≤ 0.1 dB is asked for; it is exact however parameters move."""
    assert np.abs(excess_of(motions()[motion], OURS).bands).max() < 1e-6


def test_the_sum_of_bands_is_nearly_right_on_smooth_strokes() -> None:
    """±0.15 dB is the preliminary figure of docs/method/equalizer.md#stability."""
    at = planted_texture("polyester").parameters(*stroke(RATE_HZ, duration_s=0.5))
    moving = np.abs(stroke(RATE_HZ, duration_s=0.5).speed_mm_s) > 50
    assert np.abs(excess_of(at, OURS).total[moving]).max() < 0.15


def test_the_sum_is_never_louder_than_bands_in_step_would_be() -> None:
    """√var ≤ G_w + Σ|G_i|·√(k/(1+k)) at every sample of every motion."""
    for motion, at in motions().items():
        rms = band_rms(at.gains, at.bandwidths_hz, rate_hz=RATE_HZ).sum(axis=1) + at.noise_gain
        total = moving_variances(at, FORMS[OURS], rate_hz=RATE_HZ).total
        assert (np.sqrt(total) <= rms * (1 + 1e-9)).all(), motion


def test_other_forms_are_not() -> None:
    """A direct form grows without bound on jumps, and jitter is costly for both.

    Preliminary figures: docs/method/equalizer.md#stability.
    """
    highest = {
        motion: {form: excess_of(at, form).bands.max() for form in (DIRECT, PLAIN)}
        for motion, at in motions(samples=4000).items()
    }
    for motion in (JUMPS, ANYWHERE):
        assert highest[motion][DIRECT] == np.inf
        assert highest[motion][PLAIN] > 30
    assert highest["30 % jitter"][PLAIN] > 10
    assert highest["30 % jitter"][DIRECT] > highest["30 % jitter"][PLAIN]


def test_the_state_variable_filter_costs_33_db_on_jumps() -> None:
    """One band jumping 20 ↔ 1500 Hz each sample (docs/method/equalizer.md#stability)."""
    count = 3000
    jumping = np.where(np.arange(count) % 2, 1500.0, 20.0)[:, None]
    at = Parameters(np.zeros(count), jumping, np.full((count, 1), 50.0), np.ones((count, 1)))
    assert excess_of(at, PLAIN).bands.max() == pytest.approx(33, abs=0.5)
