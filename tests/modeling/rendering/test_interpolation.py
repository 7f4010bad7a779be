"""Interpolation to the output's rate: closed-form responses, known signals, refusals."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import group_delay, upfirdn

import tactileq.modeling.rendering.compiled
from tactileq.modeling import InputError, Renderer
from tactileq.modeling.rendering.interpolation import DOUBLING, PHASE, Interpolation, interpolation
from tactileq.stimuli.planted.textures import planted_texture
from tests.refusals import refused

RATES_HZ = [
    (5000.0, 48_000.0),
    (5000.0, 44_100.0),
    (5000.0, 96_000.0),
    (5000.0, 8000.0),
    (5000.0, 5500.0),
    (2000.0, 48_000.0),
    (22_704.0, 48_000.0),
    (44_100.0, 48_000.0),
]


def way(rates_hz: tuple[float, float]) -> Interpolation:
    found = interpolation(*rates_hz)
    assert found is not None
    return found


@pytest.mark.parametrize("rates_hz", RATES_HZ)
def test_it_is_flat_up_to_0_9_of_nyquist_and_images_are_60_db_down(
    rates_hz: tuple[float, float],
) -> None:
    made, own_hz, rate_hz = way(rates_hz), *rates_hz
    assert made.up / made.down * 2 == pytest.approx(rate_hz / own_hz, rel=1e-15)
    band = np.linspace(0, 0.45, 400)
    passed_db = 20 * np.log10(np.abs(made.response(band)))
    assert passed_db.min() > -0.06
    assert passed_db.max() < 0.01
    images = np.concatenate([[n - band, n + band] for n in range(1, 12)]).ravel()
    # Those of which the combination of both filters has samples: below twice the model's rate · up.
    images = images[images < made.up]
    assert np.abs(made.response(images)).max() < 1e-3


@pytest.mark.parametrize("rates_hz", RATES_HZ)
def test_its_delay_is_the_group_delay_of_both_stages(rates_hz: tuple[float, float]) -> None:
    made = way(rates_hz)
    impulses = made.doubling[::-1].ravel(), made.phases.T[::-1].ravel()
    first, second = (group_delay((h, [1.0]), w=[1e-6])[1][0] for h in impulses)
    assert made.delay_samples == pytest.approx((first + second / made.up) / 2, abs=1e-3)
    assert made.delay_samples < 2.1


@pytest.mark.parametrize("rates_hz", RATES_HZ[:5])
def test_a_held_hand_gives_upfirdn_of_the_models_own_signal(rates_hz: tuple[float, float]) -> None:
    made, model = way(rates_hz), planted_texture("canvas")
    own = Renderer(model, seed=3).render(150.0, 1.5, samples=3000)
    played = Renderer(model, seed=3, rate_hz=rates_hz[1]).render(150.0, 1.5, samples=3000)
    doubled = upfirdn(made.doubling[::-1].ravel(), own, up=2)
    wanted = upfirdn(made.phases.T[::-1].ravel(), doubled, made.up, made.down)[: played.size]
    np.testing.assert_allclose(played, wanted, rtol=0, atol=1e-13)


def test_lengths_are_those_of_the_kernel() -> None:
    lib = tactileq.modeling.rendering.compiled._kernel.lib
    assert lib.TQ_KEPT + lib.TQ_KEPT_DOUBLED == DOUBLING - 1 + PHASE + 1 + 3 * 64


def test_at_the_models_own_rate_there_is_none() -> None:
    assert interpolation(5000.0, 5000.0) is None
    plan = Renderer(planted_texture("MDF")).plan
    assert plan.own is plan
    assert plan.delay_s == 0


@pytest.mark.parametrize(
    ("update_samples", "rate_hz", "own"),
    [(48, 48_000.0, 5), (44, 44_100.0, 5), (1, 48_000.0, 1), (14, 48_000.0, 1), (15, 48_000.0, 2)],
)
def test_updates_are_rounded_to_samples_of_the_model(
    update_samples: int, rate_hz: float, own: int
) -> None:
    model = planted_texture("MDF")
    plan = Renderer(model, rate_hz=rate_hz, update_samples=update_samples).plan
    assert plan.own.update_samples == plan.texture(model)["update_samples"] == own


def test_rates_below_and_without_a_small_ratio_are_refused() -> None:
    with refused(InputError, expected="5000 Hz", got="4000"):
        interpolation(5000.0, 4000.0)
    with refused(InputError, expected="5000 Hz", got="nan"):
        interpolation(5000.0, np.nan)
    with refused(InputError, expected=4000, got=["5000.1 Hz", "48000.0 Hz"]):
        interpolation(5000.1, 48_000.0)
