"""Regressions of a model's parameters against planted coefficients and independent formulas."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy import stats

from tactileq.modeling import InputError, TextureModel
from tactileq.modeling.models.terms import FORCE, SPEED, SPEED_FORCE, TERMS
from tactileq.modeling.regression.centroid import (
    centroid_correlations,
    centroid_observations,
    centroid_regression,
    spectral_centroid_hz,
)
from tactileq.modeling.regression.least_squares import (
    ALPHA,
    condition_predictors,
    reduced_regression,
    regress,
)
from tactileq.modeling.regression.parameters import parameter_observations, parameter_regressions
from tests.refusals import refused

ModelMaker = Callable[..., TextureModel]
SPEEDS, FORCES = np.linspace(50, 350, 7), np.linspace(0.5, 3.5, 7)


def grid_of(
    speeds: np.ndarray = SPEEDS, forces: np.ndarray = FORCES
) -> tuple[np.ndarray, np.ndarray]:
    speed, force = np.meshgrid(speeds, forces, indexing="ij")
    return speed.ravel(), force.ravel()


def planted(coefficients: tuple[float, ...], speed: np.ndarray, force: np.ndarray) -> np.ndarray:
    constant, a1, a2, a3 = coefficients
    return constant + a1 * speed + a2 * force + a3 * speed * force


coefficient = st.floats(-10, 10).map(lambda x: round(x, 3))


@settings(deadline=None, max_examples=50)
@given(st.tuples(coefficient, coefficient, coefficient, coefficient))
def test_planted_coefficients_are_recovered_without_noise(wanted: tuple[float, ...]) -> None:
    assume(any(wanted[1:]))
    speed, force = grid_of()
    values = planted(wanted, speed, force)
    for fit in (
        regress(values, condition_predictors(speed, force)),
        reduced_regression(values, condition_predictors(speed, force)),
    ):
        found = [fit.coefficients[0], *(fit.coefficient(term) for term in TERMS)]
        reach = np.array([1, 300, 3, 1225])
        assert np.abs((found - np.array(wanted)) * reach).max() <= 1e-9 * np.abs(values).max()
        assert fit.multiple_r == pytest.approx(1)
        assert (fit.adjusted_r_squared, fit.p) == (1, 0)


@settings(deadline=None, max_examples=50)
@given(st.tuples(coefficient, coefficient, coefficient, coefficient))
def test_terms_that_were_not_planted_are_pruned(wanted: tuple[float, ...]) -> None:
    speed, force = grid_of()
    fit = reduced_regression(planted(wanted, speed, force), condition_predictors(speed, force))
    assert fit.terms == tuple(t for t, a in zip(TERMS, wanted[1:], strict=True) if a)


@pytest.mark.parametrize("wanted", [(40.0, 0.4, 0, 0), (0.1, 0, 0, 3e-4), (50.0, 0, -6.0, 0)])
def test_terms_are_pruned_and_coefficients_kept_under_noise(wanted: tuple[float, ...]) -> None:
    speed, force = grid_of()
    values = planted(wanted, speed, force)
    noisy = values + 0.05 * np.ptp(values) * np.random.default_rng(3).standard_normal(speed.size)
    fit = reduced_regression(noisy, condition_predictors(speed, force))
    assert fit.terms == tuple(t for t, a in zip(TERMS, wanted[1:], strict=True) if a)
    alone = stats.linregress(condition_predictors(speed, force)[fit.terms[0]], noisy)
    assert fit.coefficients == pytest.approx([alone.intercept, alone.slope], rel=1e-9)
    assert fit.p_values == pytest.approx(
        [2 * stats.t.sf(abs(alone.intercept / alone.intercept_stderr), 47), alone.pvalue]
    )
    assert fit.coefficients[1] == pytest.approx(max(wanted[1:], key=abs), rel=0.1)


@settings(deadline=None, max_examples=50)
@given(st.integers(0, 2**31), st.floats(0, 2))
def test_whatever_the_reduced_model_keeps_is_significant(seed: int, slope: float) -> None:
    speed, force = grid_of()
    values = slope * speed / 350 + np.random.default_rng(seed).standard_normal(speed.size)
    fit = reduced_regression(values, condition_predictors(speed, force))
    assert (fit.p_values[1:] < ALPHA).all()
    assert fit.coefficients.size == 1 + len(fit.terms)


def test_p_values_are_uniform_where_nothing_responds() -> None:
    speed, force = grid_of()
    rng = np.random.default_rng(11)
    fits = [
        regress(rng.standard_normal(speed.size), condition_predictors(speed, force))
        for _ in range(500)
    ]
    for term in TERMS:
        assert stats.kstest([fit.p_value(term) for fit in fits], "uniform").pvalue > 0.01
    assert stats.kstest([fit.p for fit in fits], "uniform").pvalue > 0.01


def test_r_its_adjustment_and_the_f_test_follow_their_formulas() -> None:
    speed, force = grid_of()
    values = 0.1 * speed + 3 * force + np.random.default_rng(1).normal(0, 8, speed.size)
    design = np.column_stack([np.ones_like(speed), speed, force, speed * force])
    solution, (residual,), _, _ = np.linalg.lstsq(design, values, rcond=None)
    r_squared = 1 - residual / ((values - values.mean()) ** 2).sum()
    fit = regress(values, condition_predictors(speed, force))
    assert fit.coefficients == pytest.approx(solution)
    assert fit.multiple_r == pytest.approx(np.corrcoef(design @ solution, values)[0, 1])
    assert fit.multiple_r**2 == pytest.approx(r_squared)
    assert fit.adjusted_r_squared == pytest.approx(1 - (1 - r_squared) * 48 / 45)
    assert fit.p == pytest.approx(stats.f.sf(r_squared / 3 / ((1 - r_squared) / 45), 3, 45))


def test_a_two_by_two_grid_leaves_nothing_to_test_with() -> None:
    speed, force = grid_of(np.array([50.0, 350.0]), np.array([1.0, 3.0]))
    values = np.array([1.0, 5.0, 2.0, 31.0])
    for fit in (
        regress(values, condition_predictors(speed, force)),
        reduced_regression(values, condition_predictors(speed, force)),
    ):
        assert (fit.terms, fit.residual_degrees) == (TERMS, 0)
        assert np.isnan([*fit.p_values, fit.p, fit.adjusted_r_squared]).all()
        assert planted(tuple(fit.coefficients), speed, force) == pytest.approx(values)


def test_three_corners_say_nothing_about_the_interaction() -> None:
    speed, force = np.array([50.0, 350.0, 50.0]), np.array([1.0, 1.0, 3.0])
    fit = regress([1.0, 4.0, 2.0], condition_predictors(speed, force))
    assert fit.terms == (SPEED, FORCE)
    assert fit.coefficient(SPEED) == pytest.approx(0.01)
    assert fit.coefficient(FORCE) == pytest.approx(0.5)
    assert fit.coefficient(SPEED_FORCE) == 0
    assert np.isnan(fit.p_value(SPEED_FORCE))


def test_one_speed_says_nothing_about_speed() -> None:
    force = FORCES
    speed = np.full(force.size, 100.0)
    values = 3 * force + np.random.default_rng(2).standard_normal(force.size)
    fit = regress(values, condition_predictors(speed, force))
    alone = stats.linregress(force, values)
    assert fit.terms == (FORCE,)
    assert fit.residual_degrees == 5
    assert (fit.coefficient(FORCE), fit.p_value(FORCE)) == pytest.approx(
        (alone.slope, alone.pvalue)
    )
    assert fit.p == pytest.approx(alone.pvalue)


def test_a_constant_responds_to_nothing() -> None:
    speed, force = grid_of()
    fit = regress(np.full(speed.size, 52.3), condition_predictors(speed, force))
    assert fit.coefficients.tolist() == pytest.approx([52.3, 0, 0, 0])
    assert np.isnan([*fit.p_values, fit.p, fit.multiple_r, fit.adjusted_r_squared]).all()
    reduced = reduced_regression(np.full(speed.size, 52.3), condition_predictors(speed, force))
    assert reduced.terms == ()
    assert reduced.coefficients == pytest.approx([52.3])


def test_noise_alone_is_reduced_to_its_mean() -> None:
    speed, force = grid_of()
    values = 7 + np.random.default_rng(5).standard_normal(speed.size)
    fit = reduced_regression(values, condition_predictors(speed, force))
    assert fit.terms == ()
    assert fit.coefficients == pytest.approx([values.mean()])
    assert (fit.multiple_r, np.isnan(fit.p)) == (0, True)
    assert fit.p_values == pytest.approx([stats.ttest_1samp(values, 0).pvalue])


@pytest.mark.parametrize(
    ("values", "speed", "expected", "got"),
    [
        ([], [], "parameter", "(0,)"),
        ([1.0, 2.0], [1.0], "parameter", ["(2,)", "(1,)"]),
        ([[1.0], [2.0]], [[1.0], [2.0]], "parameter", "(2, 1)"),
        ([1.0, np.nan], [1.0, 2.0], "parameter", "NaN"),
        ([1.0, 2.0], [1.0, np.inf], "parameter", "inf"),
    ],
)
def test_bad_observations_are_refused(
    values: list, speed: list, expected: str, got: object
) -> None:
    with refused(InputError, expected=expected, got=got):
        regress(values, {SPEED: speed})


def test_only_conditions_that_were_observed_count(make_model: ModelMaker) -> None:
    model = make_model(0.1, [(100.0, 20.0, 1.0), (300.0, 40.0, -2.0)], speeds_mm_s=(50, 100, 200))
    interpolated = np.zeros((3, 2), dtype=bool)
    interpolated[1, 1] = True
    inherited = np.zeros((3, 2, 2), dtype=bool)
    inherited[0, :, 1] = True
    found = parameter_observations(replace(model, interpolated=interpolated, inherited=inherited))
    assert [(o.parameter, o.layer) for o in found] == [
        ("noise_gain", 0),
        *((p, layer) for layer in (1, 2) for p in ("frequency_hz", "amplitude", "bandwidth_hz")),
    ]
    second_frequency, second_amplitude = found[4], found[5]
    assert [o.values.size for o in found] == [5, 5, 5, 5, 3, 5, 5]
    assert [o.inherited for o in found] == [0, 0, 0, 0, 2, 0, 0]
    assert second_frequency.speed_mm_s.tolist() == [100, 200, 200]
    assert second_amplitude.values.tolist() == [2.0] * 5
    assert (100.0, 3.0) not in set(zip(found[0].speed_mm_s, found[0].force_n, strict=True))


def test_every_parameter_is_regressed(make_model: ModelMaker) -> None:
    model = make_model(0.1, [(100.0, 20.0, -1.0)], speeds_mm_s=SPEEDS, forces_n=FORCES)
    speed, force = (x.reshape(7, 7) for x in grid_of())
    model = replace(
        model,
        noise_gains=0.2 - 1e-4 * speed,
        frequencies_hz=(30 + 0.5 * speed)[:, :, None],
        gains=-(0.1 + 1e-4 * speed * force)[:, :, None],
    )
    noise, frequency, amplitude, bandwidth = parameter_regressions(model)
    assert noise.reduced.coefficients == pytest.approx([0.2, -1e-4])
    assert frequency.reduced.coefficients == pytest.approx([30, 0.5])
    assert amplitude.reduced.terms == (SPEED_FORCE,)
    assert amplitude.reduced.coefficients == pytest.approx([0.1, 1e-4])
    assert bandwidth.reduced.coefficients == pytest.approx([20])
    assert frequency.full.n_conditions == 49


def test_centroid_in_closed_form(make_model: ModelMaker) -> None:
    model = make_model(0.1, [(100.0, 20.0, 3.0), (500.0, 20.0, -1.0)])
    assert spectral_centroid_hz(model) == pytest.approx(np.full((2, 2), (9 * 100 + 500) / 10))
    assert spectral_centroid_hz(model.with_layers([1])) == pytest.approx(np.full((2, 2), 500.0))


def test_centroid_only_where_there_is_one(make_model: ModelMaker) -> None:
    model = make_model(0.1, [(100.0, 20.0, 3.0)], speeds_mm_s=(50, 100, 200))
    gains = model.gains.copy()
    gains[0, 0] = 0
    interpolated = np.zeros((3, 2), dtype=bool)
    interpolated[2, 1] = True
    centroid, speed, force = centroid_observations(
        replace(model, gains=gains, interpolated=interpolated)
    )
    assert centroid == pytest.approx([100.0] * 4)
    assert list(zip(speed, force, strict=True)) == [(50, 3), (100, 1), (100, 3), (200, 1)]
    for silent in (model.with_layers([]), replace(model, gains=np.zeros(gains.shape))):
        assert np.isnan(spectral_centroid_hz(silent)).all()
        for use in (centroid_observations, centroid_regression, centroid_correlations):
            with refused(InputError, names="planted", expected="layer", got="none"):
                use(silent)


def test_centroid_regressions_find_what_was_planted(make_model: ModelMaker) -> None:
    speed, force = (x.reshape(7, 7) for x in grid_of())
    model = make_model(0.1, [(100.0, 20.0, 1.0)], speeds_mm_s=SPEEDS, forces_n=FORCES)
    moving = replace(model, frequencies_hz=(60 + 0.4 * speed - 5 * force)[:, :, None])
    full, alone = centroid_regression(moving)
    assert full.coefficients == pytest.approx([60, 0.4, -5, 0], abs=1e-9)
    # The grid is balanced, so leaving the force out only moves the intercept.
    assert alone.coefficients == pytest.approx([60 - 5 * 2, 0.4])


def test_centroid_and_amplitude_correlate_as_planted(make_model: ModelMaker) -> None:
    speed, force = (x.reshape(7, 7) for x in grid_of())
    model = make_model(
        0.1, [(100.0, 20.0, 1.0), (400.0, 20.0, -1.0)], speeds_mm_s=SPEEDS, forces_n=FORCES
    )
    gains = np.stack([np.ones((7, 7)), -(0.1 + 0.001 * speed + 0.02 * force**2)], axis=-1)
    moving = replace(model, gains=gains)
    total, first, second = centroid_correlations(moving)
    centroid = spectral_centroid_hz(moving).ravel()
    wanted = stats.pearsonr(centroid, np.sqrt((gains**2).sum(axis=2)).ravel())
    assert (total.r, total.p, total.n_conditions) == pytest.approx((*wanted, 49))
    assert np.isnan([first.r, first.p]).all()
    assert second.r == pytest.approx(np.corrcoef(centroid, np.abs(gains[:, :, 1]).ravel())[0, 1])
    assert second.r > 0.9
