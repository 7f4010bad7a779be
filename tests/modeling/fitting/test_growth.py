"""Missing layers along laws over the grid, and the solutions that a search makes of them."""

from __future__ import annotations

import numpy as np
import pytest

from tactileq.modeling import PEQ, Recording
from tactileq.modeling.arrays import Floats
from tactileq.modeling.estimation.coherent import response
from tactileq.modeling.estimation.likelihood import split
from tactileq.modeling.fitting.growth import _along, candidates, inserted, inserted_independently
from tactileq.modeling.fitting.layer_search import fitted, in_frequency_order, search
from tactileq.modeling.fitting.texture_grid import TextureGrid, texture_grid
from tactileq.modeling.recordings.spectrum import spectrum

RATE_HZ = 5000.0
SPEEDS = (60.0, 100.0, 160.0, 250.0)


def planted(*layers: tuple[float, float, float], noise_gain: float = 0.02) -> PEQ:
    frequency, bandwidth, gain = np.array(layers, dtype=float).reshape(-1, 3).T
    return PEQ(
        noise_gain=noise_gain,
        frequencies_hz=frequency,
        bandwidths_hz=bandwidth,
        gains=gain,
        rate_hz=RATE_HZ,
    )


def grid_of(
    layers: list[tuple[float, float, float, float]],
    *,
    speeds: tuple[float, ...] = SPEEDS,
    forces: tuple[float, ...] = (1.0, 2.0),
    seed: int = 0,
) -> TextureGrid:
    """Layers of (Hz at 100 mm/s, exponent of speed, bandwidth, gain) at every condition."""
    rng = np.random.default_rng(seed)
    spectra = {}
    for v in speeds:
        peq = planted(*[(f * (v / 100) ** p, b, g) for f, p, b, g in layers])
        for force in forces:
            frequency = np.fft.rfftfreq(20_000, 1 / RATE_HZ)
            noise = np.fft.rfft(rng.standard_normal(20_000))
            samples = np.fft.irfft(noise * peq.complex_response(frequency))[:5000]
            spectra[v, force] = spectrum(Recording(samples, RATE_HZ, v, force, "planted"))
    return texture_grid(spectra)


def flat(grid: TextureGrid) -> Floats:
    """Noise alone, as quiet as it was planted."""
    return np.full((len(grid.conditions), 1), np.log(0.02 / grid.scale))


def test_gains_are_summed_at_the_shifts_of_each_condition() -> None:
    gain, shifts = np.array([[1.0, 2.0, 4.0], [8.0, 16.0, 32.0]]), np.array([[0, 0], [1, -1]])
    expected = [[0, 9, 18, 36, 0], [1, 2, 4 + 8, 16, 32]]
    assert _along(gain, shifts, 1).tolist() == expected


@pytest.mark.parametrize("exponent", [0.0, 0.5, 1.0])
def test_the_law_of_a_missing_layer(exponent: float) -> None:
    """Of a layer 10 dB above the noise; of louder ones the skirts suffice for laws nearby."""
    grid = grid_of([(300.0, exponent, 40.0, 0.06)])
    first = candidates(grid, flat(grid), None)[0]
    speed = np.array(grid.conditions)[:, 0]
    expected = 300 * (speed / 100) ** exponent
    assert first.frequencies_hz == pytest.approx(expected, abs=40)  # within its width
    assert np.median(first.bandwidths_hz) == pytest.approx(40, rel=1.0)
    assert (first.raised > 2).all()


def test_a_layer_that_one_condition_lacks_is_found_all_the_same() -> None:
    grid = grid_of([(300.0, 1.0, 40.0, 0.06)])
    powers = [power if row != 3 else None for row, power in enumerate(grid.powers)]
    holed = TextureGrid(grid.conditions, powers, grid.rows, grid.columns)
    first = candidates(holed, flat(grid), None)[0]
    speed = np.array(grid.conditions)[:, 0]
    assert first.frequencies_hz == pytest.approx(3 * speed, abs=40)


def test_what_is_explained_is_not_missing() -> None:
    grid = grid_of([(300.0, 1.0, 40.0, 0.06), (900.0, 0.0, 60.0, 0.06)])
    speed = np.array(grid.conditions)[:, 0]
    one = np.log(np.tile([40.0, 0.06 / grid.scale], (len(speed), 1)))
    theta = np.column_stack((flat(grid), np.log(3 * speed), one))
    first, *others = candidates(grid, theta, np.ones(1))
    assert np.median(first.frequencies_hz) == pytest.approx(900, rel=0.1)
    for other in others:  # the same by another width, or nothing to speak of
        near = np.median(other.frequencies_hz) == pytest.approx(900, rel=0.1)
        assert near or other.evidence < 0.3 * first.evidence


def test_an_inserted_layer_reaches_the_raised_power() -> None:
    grid = grid_of([(300.0, 0.0, 40.0, 0.3)])
    found = candidates(grid, flat(grid), None)[0]
    for sign in (1.0, -1.0):
        theta, signs = inserted(flat(grid), np.zeros(0), found, sign=sign, rate_hz=RATE_HZ)
        assert signs.tolist() == [sign]
        noise, frequency, _, gain = (np.exp(part) for part in split(theta, 1))
        assert frequency[:, 0] == pytest.approx(found.frequencies_hz)
        top = (noise[:, 0] + sign * gain[:, 0]) ** 2 / noise[:, 0] ** 2
        assert top == pytest.approx(found.raised, rel=1e-6)
    alone = inserted_independently(flat(grid), found, rate_hz=RATE_HZ)
    assert alone.shape == (len(grid.conditions), 4)
    assert (np.exp(alone[:, 3]) > 3 * np.exp(alone[:, 0])).all()


@pytest.mark.parametrize(
    "layers",
    [
        [(300.0, 1.0, 40.0, 0.3)],
        [(200.0, 0.0, 40.0, 0.3), (420.0, 0.5, 60.0, -0.2)],
        [(150.0, 1.0, 25.0, 0.2), (500.0, 0.0, 50.0, 0.3), (1200.0, 0.3, 90.0, -0.2)],
    ],
)
def test_the_best_solution_has_the_planted_layers(
    layers: list[tuple[float, float, float, float]],
) -> None:
    grid = grid_of(layers)
    best = search(grid)[0]
    assert best.count == len(layers)
    speed = np.array(grid.conditions)[:, 0]
    _, frequency, _, _ = split(best.theta, best.count)
    order = np.argsort(frequency[0])
    for layer, (f, p, b, _) in zip(order, sorted(layers, key=lambda x: x[0]), strict=True):
        expected = f * (speed / 100) ** p
        assert np.abs(np.exp(frequency[:, layer]) - expected).max() < b / 2


def test_a_prescribed_number_is_kept() -> None:
    grid = grid_of([(300.0, 1.0, 40.0, 0.3), (900.0, 0.0, 60.0, 0.2)])
    for count in (1, 2, 3, 4):
        solutions = search(grid, count=count)
        assert {s.count for s in solutions} == {count}


def test_layers_of_two_speeds_are_named_in_the_order_of_their_frequencies() -> None:
    """600 → 1300 and 1300 → 600 Hz explain two speeds as well as none that moves."""
    grid = grid_of([(600.0, 0.0, 60.0, 0.3), (1300.0, 0.0, 90.0, 0.3)], speeds=(100.0, 300.0))
    best = next(s for s in search(grid) if s.count == 2)
    theta = best.theta.copy()
    theta[2:, [1, 2]], theta[2:, [3, 4]], theta[2:, [5, 6]] = (
        theta[2:, [2, 1]],
        theta[2:, [4, 3]],
        theta[2:, [6, 5]],
    )
    frequency = np.exp(theta[:, 1:3])
    crossed = theta if abs(frequency[0, 0] - frequency[-1, 0]) > 300 else best.theta
    solution = fitted(grid, crossed, best.signs)
    named = in_frequency_order(grid, solution)
    low, high = np.exp(np.sort(named.theta[:, 1:3], axis=1)).T
    assert low == pytest.approx(600, abs=30)
    assert high == pytest.approx(1300, abs=40)
    order = np.argsort(named.theta[:, 1:3], axis=1)
    assert (order == order[0]).all()
    power = response(named.theta, named.signs, named.observed).power
    before = response(solution.theta, solution.signs, named.observed).power
    assert np.median(np.abs(np.log(power / before))) < 0.1


def test_three_speeds_may_cross() -> None:
    """A grating's line at 6 cycles per mm passes a resonance at 900 Hz."""
    speeds = (60.0, 100.0, 200.0, 300.0)
    grid = grid_of([(600.0, 1.0, 40.0, 0.3), (900.0, 0.0, 60.0, 0.3)], speeds=speeds)
    best = next(s for s in search(grid) if s.count == 2)
    frequency = np.exp(best.theta[:, 1:3])
    moving = int(np.argmax(np.ptp(frequency, axis=0)))
    speed = np.array(grid.conditions)[:, 0]
    assert frequency[:, moving] == pytest.approx(6 * speed, rel=0.1)
    assert frequency[:, 1 - moving] == pytest.approx(900, rel=0.1)
    assert in_frequency_order(grid, best) is best
