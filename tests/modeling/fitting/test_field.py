"""The smooth field over the grid: its equations in dense form, what it learns, what it mends."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactileq.modeling.arrays import Floats
from tactileq.modeling.estimation.coherent import limits_of, observe, response
from tactileq.modeling.estimation.likelihood import Power, signal_power
from tactileq.modeling.fitting.equations import Blocks, Corners
from tactileq.modeling.fitting.field import (
    FAINTEST,
    TREND_SHARE,
    Field,
    covariances,
    fit_field,
    log_evidence,
    prior_covariance,
    solve,
    updated_precision,
)
from tactileq.modeling.recordings.spectrum import spectrum_of_samples

SHAPES = [(1, 1), (1, 5), (5, 1), (2, 2), (3, 4), (4, 3)]
RATE_HZ = 5000.0


def random_field(rows: int, columns: int, p: int, *, seed: int = 0) -> Field:
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((p, p))
    places = np.array([(0.3 * i, 0.2 * j**1.2) for i in range(rows) for j in range(columns)])
    trend = rng.standard_normal((2, p))
    return Field(rows, columns, places, root @ root.T + np.eye(p), trend, at_nodes(rows * columns))


def at_nodes(count: int) -> Corners:
    """Records at the nodes themselves."""
    nodes = np.repeat(np.arange(count)[:, None], 4, axis=1)
    return Corners(nodes, np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)), count)


def neighbours(rows: int, columns: int) -> list[tuple[int, int]]:
    index = np.arange(rows * columns).reshape(rows, columns)
    down = list(zip(index[:-1].ravel(), index[1:].ravel(), strict=True))
    return down + list(zip(index[:, :-1].ravel(), index[:, 1:].ravel(), strict=True))


def dense(field: Field, blocks: Floats) -> Floats:
    """Blocks + penalty as one matrix, from the list of neighbours."""
    count, p = blocks.shape[:2]
    laplacian = np.zeros((count, count))
    for a, b in neighbours(field.rows, field.columns):
        laplacian[[a, b], [a, b]] += 1
        laplacian[[a, b], [b, a]] -= 1
    matrix = np.kron(laplacian, field.precision)
    for c in range(count):
        matrix[c * p : (c + 1) * p, c * p : (c + 1) * p] += blocks[c]
    return matrix


def positive(count: int, p: int, seed: int = 1) -> Floats:
    root = np.random.default_rng(seed).standard_normal((count, p, p))
    return root @ root.transpose(0, 2, 1) + 0.5 * np.eye(p)


@pytest.mark.parametrize(("rows", "columns"), SHAPES)
@pytest.mark.parametrize("p", [1, 4, 7])
def test_banded_equations_are_the_dense_ones(rows: int, columns: int, p: int) -> None:
    field, blocks = random_field(rows, columns, p), positive(rows * columns, p)
    right = np.random.default_rng(2).standard_normal((rows * columns, p))
    expected = np.linalg.solve(dense(field, blocks), right.ravel())
    assert solve(field, Blocks(blocks), right).ravel() == pytest.approx(
        expected, rel=1e-9, abs=1e-12
    )


@pytest.mark.parametrize(("rows", "columns"), SHAPES)
@pytest.mark.parametrize("p", [1, 4])
def test_covariances_are_those_of_the_dense_inverse(rows: int, columns: int, p: int) -> None:
    field, blocks = random_field(rows, columns, p), positive(rows * columns, p)
    count = rows * columns
    inverse = np.linalg.inv(dense(field, blocks + FAINTEST * np.eye(p)))
    inverse = inverse.reshape(count, p, count, p)
    found = covariances(field, Blocks(blocks))
    expected = np.array([inverse[c, :, c] for c in range(count)])
    assert found.conditions == pytest.approx(expected, rel=1e-8, abs=1e-12)
    pairs = neighbours(rows, columns)
    of_pairs = [
        inverse[a, :, a] + inverse[b, :, b] - inverse[a, :, b] - inverse[b, :, a] for a, b in pairs
    ]
    assert found.differences == pytest.approx(np.sum(of_pairs, axis=0) if pairs else 0, abs=1e-9)


@settings(deadline=None, max_examples=30)
@given(st.sampled_from(SHAPES), st.integers(0, 1000))
def test_the_penalty_is_that_of_the_differences_and_the_trend(
    shape: tuple[int, int], seed: int
) -> None:
    field = random_field(*shape, 4, seed=seed)
    theta = np.random.default_rng(seed).standard_normal((shape[0] * shape[1], 4))
    rest = theta - field.places @ field.trend
    expected = TREND_SHARE * 0.5 * np.sum(field.trend * (field.trend @ field.precision)) + sum(
        0.5 * (rest[a] - rest[b]) @ field.precision @ (rest[a] - rest[b])
        for a, b in neighbours(*shape)
    )
    assert field.penalty(theta) == pytest.approx(expected, rel=1e-9, abs=1e-12)
    step = 1e-6 * np.random.default_rng(seed + 1).standard_normal(theta.shape)
    slope = (field.penalty(theta + step) - field.penalty(theta - step)) / 2
    assert slope == pytest.approx(float(np.sum(field.pull(theta) * step)), rel=1e-4, abs=1e-12)


@pytest.mark.parametrize(("rows", "columns"), SHAPES)
def test_a_power_law_costs_little(rows: int, columns: int) -> None:
    """No more than its trend does, whose prior pulls it a little towards none."""
    field = random_field(rows, columns, 4)
    trend = np.array([[1.0, 0.3, 0.0, 0.5], [0.0, -0.1, 0.2, 0.4]])
    theta = 3.0 + field.places @ trend
    given = replace(field, trend=trend)
    following = field.following(theta)
    assert following.penalty(theta) <= given.penalty(theta)
    cost = 0.5 * TREND_SHARE * np.sum(trend * (trend @ field.precision))
    assert given.penalty(theta) == pytest.approx(cost, rel=1e-9)
    if min(rows, columns) > 2:
        assert following.predicted(theta) == pytest.approx(theta, abs=0.05)


def test_foretold_is_the_mean_of_the_neighbours() -> None:
    field = replace(random_field(3, 3, 1), trend=np.zeros((2, 1)))
    theta = np.arange(9.0)[:, None] ** 2
    told = field.predicted(theta)[:, 0]
    assert told[4] == pytest.approx(np.mean([1, 9, 25, 49]))
    assert told[0] == pytest.approx(np.mean([1, 9]))


# --- fits


def textured(
    seed: int, law: float, *, rows: int = 4, columns: int = 3
) -> tuple[list[Power], Floats]:
    """Records of one layer at 300 Hz·(v/v0)^law over a grid, and the true parameters."""
    rng = np.random.default_rng(seed)
    powers, truth = [], []
    for row in range(rows):
        for column in range(columns):
            f, g = 300.0 * (1.3**row) ** law, 0.5 * 1.1**column
            theta = np.log([0.05, f, 40.0, g])
            frequency = np.arange(1.0, 2501.0)
            tangent = np.tan(np.pi * np.minimum(frequency, 2499.0) / RATE_HZ)[None]
            one = np.ones(tangent.shape)
            from tactileq.modeling.estimation.coherent import Observed

            lines = Observed(one, one, one, tangent, 1 / tangent, np.zeros(1), RATE_HZ)
            shape = np.sqrt(response(theta[None], np.ones(1), lines).power[0])
            draw = rng.standard_normal(2501) + 1j * rng.standard_normal(2501)
            spectrum = np.concatenate(([0.0], shape)) * np.concatenate(([0.0], draw[1:]))
            samples = np.fft.irfft(spectrum * np.sqrt(2500), 5000)
            power = signal_power(spectrum_of_samples(samples, RATE_HZ))
            assert power is not None
            powers.append(power)
            truth.append(theta)
    return powers, np.array(truth)


def field_of(rows: int, columns: int, m: int) -> Field:
    places = np.log([(1.3**i, 1.5**j) for i in range(rows) for j in range(columns)])
    precision = np.linalg.inv(prior_covariance(m))
    p = 1 + 3 * m
    centred = places - places.mean(axis=0)
    return Field(rows, columns, centred, precision, np.zeros((2, p)), at_nodes(len(places)))


def observed_near(powers: list[Power], theta: Floats) -> object:
    return observe(powers, np.exp(theta[:, 1:2]), np.exp(theta[:, 2:3]), scale=1.0)


def test_neighbours_lower_the_error_of_a_record() -> None:
    """Of the fit in each condition alone; the truth is a power law, as the field expects."""
    errors = {"field": [], "alone": []}
    for seed in range(6):
        powers, truth = textured(seed, 1.0)
        observed = observed_near(powers, truth)
        limits = limits_of(1, rate_hz=RATE_HZ, step_hz=1.0)
        for name, precision in (("field", 1.0), ("alone", 1e-9)):
            field = field_of(4, 3, 1)
            field = replace(field, precision=precision * field.precision)
            fit = fit_field(truth, np.ones(1), observed, field, limits=limits, steps=30)
            errors[name].append(fit.theta - truth)
    spread = {
        name: np.sqrt(np.mean(np.square(found), axis=(0, 1))) for name, found in errors.items()
    }
    # Noise and frequency are told well enough by each record.
    assert (spread["field"] < [1, 1, 0.65, 0.65] * spread["alone"]).all()


def test_a_condition_without_a_record_is_told_by_its_neighbours() -> None:
    powers, truth = textured(3, 1.0)
    without: list[Power | None] = [None if i == 4 else p for i, p in enumerate(powers)]
    observed = observe(without, np.exp(truth[:, 1:2]), np.exp(truth[:, 2:3]), scale=1.0)
    start = truth.copy()
    start[4] += 1.0
    limits = limits_of(1, rate_hz=RATE_HZ, step_hz=1.0)
    fit = fit_field(start, np.ones(1), observed, field_of(4, 3, 1), limits=limits, steps=30)
    assert np.abs(fit.theta[4] - truth[4]).max() < 0.25
    assert fit.theta[4] == pytest.approx(fit.field.predicted(fit.theta)[4], abs=1e-3)


def test_no_condition_stays_worse_than_its_neighbours_foretell() -> None:
    """Begun far off in one condition, from where climbing alone does not come back."""
    powers, truth = textured(5, 0.0)
    observed = observed_near(powers, truth)
    start = truth.copy()
    start[7, 1] = np.log(2300.0)
    limits = limits_of(1, rate_hz=RATE_HZ, step_hz=1.0)
    fit = fit_field(start, np.ones(1), observed, field_of(4, 3, 1), limits=limits, steps=30)
    assert np.exp(fit.theta[7, 1]) == pytest.approx(300.0, abs=15)
    from tactileq.modeling.estimation.coherent import slopes

    predicted = slopes(fit.field.predicted(fit.theta), np.ones(1), observed)
    assert (fit.slopes.objective <= predicted.objective + 0.3).all()


def test_the_field_learns_how_smooth_a_texture_is() -> None:
    """Levels that jump by 6 dB from condition to condition, and such as do not."""
    limits = limits_of(1, rate_hz=RATE_HZ, step_hz=1.0)
    learnt = {}
    for jump in (0.0, 0.7):
        powers, truth = textured(8, 0.0)
        jumps = jump * np.random.default_rng(9).standard_normal(len(powers))
        powers = [
            replace(p, power=p.power * np.exp(2 * j)) for p, j in zip(powers, jumps, strict=True)
        ]
        truth = truth + jumps[:, None] * np.array([1.0, 0.0, 0.0, 1.0])
        observed, field = observed_near(powers, truth), field_of(4, 3, 1)
        for _ in range(4):
            fit = fit_field(truth, np.ones(1), observed, field, limits=limits, steps=30)
            field = replace(field, precision=updated_precision(fit))
        learnt[jump] = np.sqrt(np.diag(np.linalg.inv(field.precision)))
    assert learnt[0.7][3] > 2 * learnt[0.0][3]
    assert learnt[0.7][3] == pytest.approx(0.7 * np.sqrt(2), rel=0.4)
    assert learnt[0.7][1] < 0.3  # frequencies do not jump


def test_evidence_prefers_the_layer_that_is_there_to_one_more() -> None:
    powers, truth = textured(11, 0.0)
    limits = limits_of(2, rate_hz=RATE_HZ, step_hz=1.0)
    more = np.concatenate(
        (truth[:, :2], np.full((12, 1), np.log(900.0)), truth[:, 2:3], np.full((12, 1), 4.0)),
        axis=1,
    )
    more = np.concatenate((more, truth[:, 3:], np.full((12, 1), np.log(0.02))), axis=1)
    evidence = []
    for theta, m in ((truth[:, :1], 0), (truth, 1), (more, 2)):
        places = np.exp(theta[:, 1 : 1 + m]), np.exp(theta[:, 1 + m : 1 + 2 * m])
        observed = observe(powers, *places, scale=1.0)
        limits = limits_of(m, rate_hz=RATE_HZ, step_hz=1.0)
        field = field_of(4, 3, m)
        fit = fit_field(theta, np.ones(m), observed, field, limits=limits, steps=40)
        evidence.append(log_evidence(fit) + float(observed.scatter.sum()))
    assert evidence[1] > evidence[2] + 10
    assert evidence[1] > evidence[0] + 100


def test_evidence_of_a_linear_field_is_that_of_its_normal_distribution() -> None:
    """One parameter, quadratic misfit: log ∫ N(y; θ)·prior(θ) dθ is known in closed form."""
    from tactileq.modeling.estimation.coherent import Slopes
    from tactileq.modeling.fitting.field import FieldFit

    field = replace(random_field(3, 2, 1), trend=np.zeros((2, 1)))
    information = np.array([3.0, 5.0, 2.0, 4.0, 1.0, 2.5])
    data = np.array([0.3, -0.2, 0.5, 0.1, 0.0, -0.4])
    precision = dense(field, np.zeros((6, 1, 1))) + FAINTEST * np.eye(6)
    both = precision + np.diag(information)
    best = np.linalg.solve(both, information * data)
    value = 0.5 * np.sum(information * (data - best) ** 2)
    slopes_there = Slopes(np.zeros(6), np.zeros(6), information[:, None, None], np.zeros((6, 1)))
    penalty = field.penalty(best[:, None])
    records = Blocks(slopes_there.information)
    fit = FieldFit(best[:, None], np.zeros(6), slopes_there, value + penalty, records, field)
    # The common level's own prior is all but flat; its cost is the same in every field.
    covariance = np.linalg.inv(precision) + np.diag(1 / information)
    exact = -0.5 * (data @ np.linalg.solve(covariance, data) + np.linalg.slogdet(covariance)[1])
    exact += 0.5 * np.sum(np.log(1 / information))
    laplacian = dense(replace(field, precision=np.eye(1)), np.zeros((6, 1, 1)))
    structure = np.sum(np.log(np.linalg.eigvalsh(laplacian)[1:]))
    assert log_evidence(fit) + 0.5 * structure == pytest.approx(exact, abs=0.05)
