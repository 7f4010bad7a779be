"""The change of power by dropping layers: closed forms and plain sums over frequency."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactileq.modeling import TextureModel, Threshold
from tactileq.modeling.arrays import Floats
from tactileq.modeling.equalizer.bands import band_response
from tactileq.modeling.models.parameter_table import Parameters
from tactileq.modeling.perception.power_changes import PowerChange, PowerChanges

ModelMaker = Callable[..., TextureModel]
RATE_HZ = 5000.0
FLAT = Threshold("flat", np.array([1e-6, 1e6]), np.array([0.1, 0.1]), "planted", "none")
CODEC = Threshold.shipped("codec")
Layer = tuple[float, float, float]


def one_place(noise_gain: float, layers: list[Layer]) -> Parameters:
    values = np.array(layers, dtype=float).T[:, None, :]
    return Parameters(np.array([noise_gain]), *values)


def change(
    noise_gain: float,
    layers: list[Layer],
    other: list[float],
    *,
    threshold: Threshold = FLAT,
    rate_hz: float = RATE_HZ,
    hold_above: bool = True,
    band_hz: tuple[float, float] | None = None,
) -> PowerChange:
    """What other gains change, at one place."""
    changes = PowerChanges(
        one_place(noise_gain, layers),
        rate_hz=rate_hz,
        threshold=threshold,
        hold_above=hold_above,
        band_hz=band_hz,
    )
    return changes.of(np.array([other]))


def by_sum(
    noise_gain: float, layers: list[Layer], other: list[float], *, step_hz: float = 0.02
) -> tuple[Floats, Floats]:
    """Frequencies, and the peak² of the change in steps: by the midpoint rule."""
    frequency = np.arange(0.0, RATE_HZ / 2, step_hz) + step_hz / 2
    centres, widths, gains = np.array(layers).T
    bands = band_response(frequency, centres_hz=centres, bandwidths_hz=widths, rate_hz=RATE_HZ)
    powers = [np.abs(noise_gain + np.array(g) @ bands) ** 2 for g in (gains, other)]
    return frequency, 2 * (2 / RATE_HZ) * np.abs(powers[0] - powers[1]) * step_hz


@settings(deadline=None, max_examples=200)
@given(
    frequency=st.floats(2, 2400),
    bandwidth=st.floats(0.2, 2000),
    gain=st.floats(1e-6, 10).flatmap(lambda gain: st.sampled_from([gain, -gain])),
    noise_share=st.floats(0, 5),
)
def test_a_lone_layer_over_a_flat_threshold(
    frequency: float, bandwidth: float, gain: float, noise_share: float
) -> None:
    """2·|G² + 2·G·G_w|·k/(1 + k): Re H = |H|², so noise adds twice the product of the gains.

    Without noise it is the amplitude √2·G·√(k/(1 + k)).
    """
    k = np.tan(np.pi * bandwidth / RATE_HZ)
    noise_gain = noise_share * abs(gain)
    found = change(noise_gain, [(frequency, bandwidth, gain)], [0.0])
    power = 2 * abs(gain**2 + 2 * gain * noise_gain) * k / (1 + k)
    largest = 2 * gain**2 * (1 + 2 * noise_share) * k / (1 + k)
    assert found.amplitude_g[0] ** 2 == pytest.approx(power, rel=3e-4, abs=1e-9 * largest)
    assert found.known[0] == pytest.approx(power / 0.1**2, rel=3e-4, abs=1e-9 * largest / 0.1**2)
    assert found.held[0] == 0
    assert not found.unknown[0]


def test_a_layer_of_twice_the_noise_and_the_other_sign_changes_no_power() -> None:
    """G_w − 2·G_w·H is an all-pass: the same power with and without the layer."""
    found = change(0.3, [(200.0, 50.0, -0.6)], [0.0])
    assert found.amplitude_g[0] < 1e-7
    assert found.distances_db()[0][0] < -100


@pytest.mark.parametrize(
    ("noise_gain", "layers", "other"),
    [
        (0.01, [(100.0, 30.0, 0.3), (140.0, 60.0, -0.2)], [0.3, 0.0]),
        (0.02, [(100.0, 5.0, 0.3), (105.0, 80.0, 0.1), (900.0, 20.0, -0.3)], [0.0, 0.1, -0.3]),
        (0.1, [(50.0, 20.0, 0.3), (210.0, 60.0, -0.2), (260.0, 30.0, 0.2)], [0.0, 0.2, 0.2]),
    ],
)
def test_a_sum_over_frequency_says_the_same(
    noise_gain: float, layers: list[Layer], other: list[float]
) -> None:
    """Also where the change turns its sign, as it does between layers, and with other signs."""
    found = change(noise_gain, layers, other, threshold=CODEC)
    frequency, power = by_sum(noise_gain, layers, other)
    low, high = CODEC.valid_range_hz
    inside, above = (frequency >= low) & (frequency <= high), frequency > high
    assert found.amplitude_g[0] ** 2 == pytest.approx(power.sum(), rel=1e-3)
    known = np.sum(power[inside] / CODEC.at(frequency[inside]) ** 2)
    assert found.known[0] == pytest.approx(known, rel=2e-3)
    held = power[above].sum() / CODEC.acceleration_g[-1] ** 2
    assert found.held[0] == pytest.approx(held, rel=2e-3)
    assert found.held_share[0] == pytest.approx(power[above].sum() / power.sum(), abs=1e-3)
    unknown = power[frequency < low].sum() / power.sum()
    assert found.unknown_share[0] == pytest.approx(unknown, abs=1e-3)


def test_only_what_is_played_counts() -> None:
    layers, other = [(100.0, 40.0, 0.3), (300.0, 40.0, 0.2)], [0.3, 0.0]
    found = change(0.01, layers, other, threshold=CODEC, band_hz=(150.0, 320.0))
    frequency, power = by_sum(0.01, layers, other)
    inside = (frequency >= 150) & (frequency <= 320)
    known = np.sum(power[inside] / CODEC.at(frequency[inside]) ** 2)
    assert found.known[0] == pytest.approx(known, rel=2e-3)
    assert found.held[0] == 0
    assert found.amplitude_g[0] ** 2 == pytest.approx(power[inside].sum(), rel=1e-3)


def test_two_layers_that_cancel_change_little_together_and_much_alone() -> None:
    """Opposite gains, one 10 % off: what is left is 20 dB below either."""
    layers = [(200.0, 50.0, 1.0), (200.0, 50.0, -0.9)]
    alone = change(0.0, layers, [0.0, 0.0]).amplitude_g[0]
    k = np.tan(np.pi * 50 / RATE_HZ)
    own = np.sqrt(2 * k / (1 + k))
    assert alone == pytest.approx(0.1 * own, rel=1e-4)
    # Without the second one: 1² − 0.1²; without the first one: 0.9² − 0.1².
    for other, power in (([1.0, 0.0], 1 - 0.01), ([0.0, -0.9], 0.81 - 0.01)):
        found = change(0.0, layers, other).amplitude_g[0]
        assert found == pytest.approx(np.sqrt(power) * own, rel=1e-4)


def test_two_layers_that_add_up_change_more_than_their_own_power() -> None:
    """Equal gains: (2² − 1²) instead of 1², 4.8 dB more than each alone."""
    found = change(0.0, [(200.0, 50.0, 0.1)] * 2, [0.1, 0.0])
    lone = change(0.0, [(200.0, 50.0, 0.1)], [0.0])
    assert found.known[0] / lone.known[0] == pytest.approx(3, rel=1e-6)


@settings(deadline=None, max_examples=60)
@given(
    exponent=st.integers(-60, 60),
    gains=st.lists(st.floats(-1, 1), min_size=1, max_size=4),
    noise_gain=st.floats(0, 1),
)
def test_model_and_threshold_may_be_scaled(
    exponent: int, gains: list[float], noise_gain: float
) -> None:
    """By powers of two nothing is rounded."""
    scale = 2.0 ** (exponent / 4 // 1)
    layers = [(80.0 * (n + 1), 40.0, gain) for n, gain in enumerate(gains)]
    other = [0.0, *gains[1:]]
    low = Threshold("low", np.array([10.0, 400.0]), np.array([0.01, 0.02]), "", "")
    high = Threshold("high", low.frequency_hz, low.acceleration_g * scale, "", "")
    larger = [(f, b, scale * gain) for f, b, gain in layers]
    found = change(noise_gain, layers, other, threshold=low)
    scaled = change(scale * noise_gain, larger, [scale * gain for gain in other], threshold=high)
    assert scaled.known == pytest.approx(found.known, rel=1e-9)
    assert scaled.held == pytest.approx(found.held, rel=1e-9)
    assert scaled.amplitude_g == pytest.approx(scale * found.amplitude_g, rel=1e-9)


def test_huge_gains_do_not_overflow() -> None:
    found = change(0.0, [(200.0, 50.0, 1e200)], [0.0])
    lone = change(0.0, [(200.0, 50.0, 1.0)], [0.0])
    assert found.amplitude_g[0] == pytest.approx(1e200 * lone.amplitude_g[0])
    assert found.distances_db()[0][0] > 0


# --- Where the threshold is not known


def of_powers(
    known: float, held: float, *, unknown: float = 0.0, above: float = 0.0
) -> PowerChange:
    return PowerChange(*(np.array([x]) for x in (1.0, known, held, unknown, above)))


@pytest.mark.parametrize(
    ("power", "distance_db", "assumed"),
    [
        (of_powers(2.0, 0.0), 10 * np.log10(2), False),
        (of_powers(2.0, 5.0, unknown=0.9, above=0.1), 10 * np.log10(2), False),  # surely felt
        (of_powers(0.3, 0.2, above=0.4), 10 * np.log10(0.5), False),
        (of_powers(0.1, 0.4, above=0.6), 10 * np.log10(0.5), True),
        (of_powers(0.5, 0.6, above=0.4), np.nan, False),  # felt, if the bound were the threshold
        (of_powers(0.1, 0.0, unknown=0.6), np.nan, False),
        (of_powers(0.0, 0.0), -np.inf, False),
    ],
)
def test_a_distance_is_what_is_known(power: PowerChange, distance_db: float, assumed: bool) -> None:
    distances, is_assumed = power.distances_db()
    assert distances[0] == pytest.approx(distance_db, nan_ok=True)
    assert is_assumed[0] == assumed


def test_a_margin_moves_the_bar_and_not_the_distance() -> None:
    near = of_powers(10**-0.5, 0.0)
    assert near.distances_db(margin_db=4.9)[0][0] == pytest.approx(-5)
    assert near.distances_db(margin_db=5.1)[0][0] == pytest.approx(-5)
    held = of_powers(0.0, 10**-0.5, above=1.0)
    assert held.distances_db(margin_db=4.9)[0][0] == pytest.approx(-5)
    assert np.isnan(held.distances_db(margin_db=5.1)[0][0])


@pytest.mark.parametrize(
    ("frequency_hz", "hold_above", "unknown"),
    [(200.0, False, False), (900.0, True, False), (900.0, False, True), (4.0, True, True)],
)
def test_where_nothing_is_known(frequency_hz: float, hold_above: bool, unknown: bool) -> None:
    table = Threshold("table", np.array([10.0, 400.0]), np.array([0.1, 0.1]), "", "")
    layers = [(frequency_hz, 2.0, 1e-3)]
    found = change(0.0, layers, [0.0], threshold=table, hold_above=hold_above)
    assert found.unknown[0] == unknown
    distances, assumed = found.distances_db()
    assert np.isnan(distances[0]) == unknown
    assert assumed[0] == (frequency_hz > 400 and hold_above)
