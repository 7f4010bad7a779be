"""The atlas as it is: defaults far from edges, and each case where its answer is known."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
import pytest

from tactileq.benches.atlas import blending, filters, hands, vibrators
from tactileq.benches.atlas.case import HOLDS, Case
from tactileq.benches.atlas.cases import CASES, TO_COME
from tactileq.benches.atlas.tables import LEAST_MARGIN
from tactileq.benches.rendering.clicks import hum, this_renderer
from tactileq.benches.rendering.stability import DIRECT, FORMS, OURS, PLAIN
from tactileq.modeling import compensation_for, flat_band

WIDTH = "width, ±1 octave"
KNOWN = ("filters", "blending", "hands", "vibrators")


@pytest.mark.parametrize(
    ("case", "column"),
    [(c, name) for c in CASES if c.ours and c.axis.default is not None for name in c.columns],
    ids=lambda value: value if isinstance(value, str) else " ".join(value.key[:3]),
)
def test_every_default_is_a_factor_of_2_from_the_nearest_edge_or_names_why_not(
    case: Case, column: str
) -> None:
    """It holds there, on the way, and twice as far."""
    axis = case.axis
    within = sorted((axis.mild, axis.severe))
    tried = [axis.farther(factor) for factor in (1.0, math.sqrt(LEAST_MARGIN), LEAST_MARGIN)]
    assert all(within[0] <= value <= within[1] for value in tried) or case.exception
    figures = [case.measure(value, case.columns[column], full=False) for value in tried]
    assert all(case.verdict(figure) == HOLDS for figure in figures) or case.exception, figures


def test_cases_are_told_apart_and_well_formed() -> None:
    assert max(Counter(case.key for case in CASES).values()) == 1
    assert set(KNOWN) <= {case.family for case in CASES}
    assert not set(TO_COME) & {case.family for case in CASES}
    for case in CASES:
        assert case.holds < case.degrades, case.key
        assert (case.theory is None) == (case.source == ""), case.key
        low, high = sorted((case.axis.mild, case.axis.severe))
        assert case.axis.default is None or low <= case.axis.default <= high, case.key
        assert not case.axis.logarithmic or low > 0, case.key


@pytest.mark.parametrize("case", [c for c in CASES if c.family in KNOWN], ids=lambda c: c.method)
def test_the_same_run_gives_the_same_figure(case: Case) -> None:
    at, column = case.axis.at(0.25), next(iter(case.columns.values()))
    first, second = (case.measure(at, column, full=False) for _ in range(2))
    assert first == second


# --- Filters


@pytest.mark.parametrize("depth", [0.1, 1.0])
@pytest.mark.parametrize("speed", [2.0, 50.0, filters.AT_RANDOM])
def test_a_band_of_ours_has_its_level_however_it_is_moved(depth: float, speed: float) -> None:
    assert filters.deeper(depth, speed, form=OURS, full=False) < 1e-6


@pytest.mark.parametrize(("form", "power"), [(PLAIN, 2.0), (DIRECT, 1.0)])
def test_level_follows_frequency_behind_a_high_pass_at_the_width(form: str, power: float) -> None:
    """Small depths: 3 dB per octave times the power, B/√(B² + f²) less (docs/stability.md)."""
    depth, speed = 0.02, 40.0
    expected = 10 * math.log10(2) * power * depth * speed / math.hypot(speed, filters.WIDTH_HZ)
    assert filters.deeper(depth, speed, form=form, full=True) == pytest.approx(expected, rel=0.06)


def test_a_direct_form_is_a_parametric_amplifier_at_twice_its_frequency() -> None:
    """Growth begins where D·f₀ is the width (Landau and Lifshitz, § 27)."""
    threshold = filters.WIDTH_HZ / filters.CENTRE_HZ / math.log(2)
    twice = 2 * filters.CENTRE_HZ
    assert filters.deeper(0.8 * threshold, twice, form=DIRECT, full=False) < 12
    assert filters.deeper(1.3 * threshold, twice, form=DIRECT, full=False) > 40
    assert filters.deeper(1.3 * threshold, twice, form=PLAIN, full=False) < 4


@pytest.mark.parametrize("form", [PLAIN, DIRECT])
@pytest.mark.parametrize(
    ("axis", "column"),
    [("speed of modulation", "±1 octave"), ("depth of modulation", "50 Hz"), (WIDTH, "10 Hz")],
)
def test_levels_of_filters_are_off_by_1_db_where_theory_says(
    form: str, axis: str, column: str
) -> None:
    (case,) = (c for c in CASES if c.key[1:3] == (form, axis))
    assert case.theory is not None
    edge = case.theory(case.columns[column])
    at_edge = case.measure(edge, case.columns[column], full=True)
    assert at_edge == pytest.approx(filters.HOLDS_DB, rel=0.25)


@pytest.mark.parametrize("rate_hz", [20_000.0, 48_000.0])
def test_a_direct_form_in_single_precision_errs_as_its_poles_are_rounded(rate_hz: float) -> None:
    """Above the frequency that theory gives for −60 dB none is larger; far below it, some are."""
    edge = filters._edge_frequency_hz(DIRECT, "float32", rate_hz)
    error = filters.lower(edge / 0.9, rate_hz, form=DIRECT, precision="float32", full=True)
    assert error <= filters.HOLDS_ERROR_DB
    below = filters.lower(edge / 2.5, rate_hz, form=DIRECT, precision="float32", full=True)
    assert below > filters.HOLDS_ERROR_DB
    assert filters.lower(edge, rate_hz, form=OURS, precision="float32", full=True) < -90
    assert filters.lower(edge, rate_hz, form=DIRECT, precision="float64", full=True) < -200


@pytest.mark.parametrize("form", [DIRECT, PLAIN])
def test_recursions_in_double_precision_are_the_same_filter(form: str) -> None:
    """Against the state equations of `stability.FORMS`."""
    from tactileq.benches.rendering.stability import simulate
    from tactileq.modeling.models.parameter_table import Parameters

    noise, ones = np.random.default_rng(0).standard_normal(400), np.ones((400, 1))
    at = Parameters(0 * ones[:, 0], 300 * ones, 40 * ones, ones)
    expected = simulate(at, FORMS[form], noise, rate_hz=5000.0)
    shares = np.array([300 / 5000]), np.array([40 / 5000])
    output = filters.OUTPUTS[form](noise, *shares, precision="float64")
    assert output[0] == pytest.approx(expected, abs=1e-12)


# --- Blending


def test_blends_of_a_power_law_by_powers_and_by_a_chord() -> None:
    """Level ∝ v² between v and 2v: in the middle the chord is 2.5/2 of it in power's square."""
    chord = 20 * math.log10((1 + 3 * (math.sqrt(2) - 1)) / 2)
    linear = blending.equalizer(2.0, 2.0, blending="linear", full=True)
    assert linear == pytest.approx(chord, abs=0.05)
    assert blending.equalizer(2.0, 2.0, blending="logarithmic", full=True) < 0.27


def test_coefficients_of_order_20_become_unstable_and_line_spectral_frequencies_do_not() -> None:
    far = 10.0
    assert blending.predictor(far, 20.0, spectral=False, full=True) == math.inf
    assert blending.predictor(far, 20.0, spectral=True, full=True) < 6
    # Of two coefficients the stable ones are a triangle, in which every mean of two lies.
    assert blending.predictor(far, 2.0, spectral=False, full=True) < 6


@pytest.mark.parametrize(("alternating", "sign"), [(False, 1), (True, -1)])
@pytest.mark.parametrize("widths", [0.5, 2.0])
def test_two_bands_of_one_noise_have_the_level_of_their_correlation(
    alternating: bool, sign: int, widths: float
) -> None:
    expected = abs(10 * math.log10(1 + sign / (1 + widths**2)))
    measured = blending.signs(widths, math.nan, alternating=alternating, full=False)
    assert measured == pytest.approx(expected, rel=0.1)  # narrow, but not without width


# --- Hands


@pytest.mark.parametrize("read", [hands.SIGNED, hands.UNSIGNED, hands.AS_READ])
def test_speeds_are_followed_as_far_as_theory_says(read: str) -> None:
    edge_ms = hands._followed_edge_ms(read, math.nan)
    at_edge = hands.followed(edge_ms, math.nan, read=read, full=True)
    assert at_edge == pytest.approx(hands.HOLDS_MM_S, rel=0.15)


@pytest.mark.parametrize("interval_ms", [1.0, 4.0])
def test_rendering_differs_least_where_the_speed_has_its_sign(interval_ms: float) -> None:
    errors = {
        read: hands.rendered(interval_ms, math.nan, read=read, full=True)
        for read in (hands.SIGNED, hands.UNSIGNED, hands.AS_READ)
    }
    assert errors[hands.SIGNED] + 3 < errors[hands.UNSIGNED] < errors[hands.AS_READ] - 3
    assert hands.rendered(0.2, math.nan, read=hands.SIGNED, full=True) < -190


def test_levels_and_noise_of_readings_are_those_of_the_pages() -> None:
    """docs/stability.md#hands"""
    assert hands.late_level(1.0, math.nan, full=True) == pytest.approx(0.11, abs=0.01)
    assert hands.noisy(2.0, math.nan, every=5, full=True) == pytest.approx(-39.7, abs=1)
    assert hands.noisy(10.0, math.nan, every=5, full=True) == pytest.approx(-26.6, abs=1)


def test_a_step_clicks_where_gains_are_switched_and_not_here() -> None:
    whole = 1.0
    assert hands.lifted(whole, math.nan, form=OURS, full=True) == pytest.approx(18.9, abs=0.5)
    assert hands.lifted(whole, math.nan, form="", full=True) < 1.5
    assert hands.shifted(2.0, math.nan, form=PLAIN, full=True) > 10
    assert hands.shifted(2.0, math.nan, form="", full=True) < 1.5
    assert this_renderer((100.0, 0.5), (100.0, 0.5), streams=2).shape[0] == 2
    assert hum().parameters([100.0], [0.25]).gains[0, 0] == pytest.approx(
        hum().parameters([100.0], [0.5]).gains[0, 0] / 2
    )


def test_other_rates_keep_the_level_and_the_third_octaves() -> None:
    assert hands.at_rate(48e3, hands.WHOLE_LEVEL, full=True) < 0.12
    assert hands.at_rate(48e3, hands.THIRD_OCTAVES, full=True) == pytest.approx(0.05, abs=0.005)
    assert hands.at_rate(5e3, hands.THIRD_OCTAVES, full=True) < 1e-9


def test_uniform_noise_is_less_peaky_as_its_kurtosis_says() -> None:
    edge = hands._peaky_edge_hz(1.0)
    assert hands.peaky(edge, 1.0, full=True) == pytest.approx(1.0, abs=0.2)
    assert abs(hands.peaky(10.0, 1.0, full=True)) < 0.4


# --- Vibrators


@pytest.mark.parametrize("quality", [5.0, 20.0])
@pytest.mark.parametrize("off", [0.03, 0.1])
def test_a_notch_beside_its_resonance_leaves_asinh_of_quality_times_share(
    quality: float, off: float
) -> None:
    expected = 20 / math.log(10) * math.asinh(quality * off)
    left = vibrators.mistuned(off, quality, which=vibrators.ONE_LAYER, full=True)
    assert left == pytest.approx(expected, rel=0.1)


def test_tuned_compensation_of_one_layer_leaves_nothing() -> None:
    assert vibrators.mistuned(1e-9, 5.0, which=vibrators.ONE_LAYER, full=True) < 1e-6


def test_a_resonance_is_as_high_as_its_quality_without_compensation() -> None:
    for quality in (3.0, 10.0):
        peak = quality / math.sqrt(1 - 1 / (4 * quality**2))
        left = vibrators.of_quality(quality, math.nan, how=vibrators.WITHOUT, full=True)
        assert left == pytest.approx(20 * math.log10(peak), abs=0.05)
        ours = vibrators.of_quality(quality, math.nan, how=vibrators.COMPENSATED, full=True)
        narrow = vibrators.of_quality(quality, math.nan, how=vibrators.OWN_WIDTH, full=True)
        assert ours < 3 < narrow < left


def test_tests_of_poor_coherence_are_refused() -> None:
    assert vibrators.badly_measured(0.2, 5.0, full=False) < 3
    assert vibrators.badly_measured(1.0, 5.0, full=False) == math.inf


def test_of_a_low_quality_there_is_no_flat_part_to_be_found() -> None:
    assert vibrators.of_quality(1.2, math.nan, how=vibrators.COMPENSATED, full=True) == math.inf


@pytest.mark.parametrize("quality", [3.0, 5.0, 10.0])
def test_the_flat_band_begins_below_the_resonance(quality: float) -> None:
    """docs/method/vibrators.md#flat-band"""
    truth = vibrators.SimulatedVibrator(vibrators.RESONANCE_HZ, quality, vibrators.RATE_HZ)
    frequency = np.geomspace(10.0, 2450.0, 4000)
    notch = compensation_for(vibrators._identified(quality))
    before = np.abs(truth.response(frequency))
    begins = [
        flat_band(frequency, r, level=1.0)[0] / vibrators.RESONANCE_HZ
        for r in (before, before * np.abs(notch.response(frequency)))
    ]
    assert 1.75 < begins[0] < 1.95
    assert 0.70 < begins[1] < 0.77
