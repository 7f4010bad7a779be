"""Peak finding in the atlas: troubles are what they say, and figures are right where known."""

from __future__ import annotations

import numpy as np
import pytest

from tactileq.benches.atlas import peaks
from tactileq.benches.atlas.case import FAILS, HOLDS, Case
from tactileq.benches.atlas.edges import examine
from tactileq.benches.atlas.peaks import CASES, JOINT, generator, planted
from tactileq.modeling.estimation.layers import Layers, no_layers
from tactileq.stimuli.planted.spectra import RATE_HZ, RandomTruth

OURS = [case for case in CASES if case.ours]


def found_as(
    truth: RandomTruth, *, frequencies_hz: np.ndarray | None = None, factor: float = 1.0
) -> Layers:
    planted_layers = truth.layers
    frequency = planted_layers.frequencies_hz if frequencies_hz is None else frequencies_hz
    m = frequency.size
    return Layers(
        planted_layers.noise_gain,
        frequency,
        np.resize(planted_layers.bandwidths_hz, m),
        np.resize(planted_layers.gains * factor, m),
        np.ones(m),
        np.zeros(m, dtype=bool),
    )


def case_of(name: str, method: str = JOINT, figure: str = "") -> Case:
    return next(
        c
        for c in CASES
        if (c.axis.name, c.method) == (name, method) and c.figure.startswith(figure)
    )


@pytest.mark.parametrize("case", OURS, ids=[f"{c.axis.name}, {c.figure}" for c in OURS])
def test_the_default_estimator_holds_where_it_is_easy(case: Case) -> None:
    for column in case.columns.values():
        figure = case.measure(case.axis.mild, column, full=False)
        assert case.verdict(figure) == HOLDS, figure


@pytest.mark.parametrize(
    ("name", "figure"),
    [
        ("spacing of two layers", ""),
        ("RMS over the sensor's limit", ""),
        ("error of the declared rate", ""),
        ("first over last amplitude", ""),
        ("fall of all frequencies", ""),
    ],
)
def test_it_fails_where_it_must(name: str, figure: str) -> None:
    case = case_of(name, figure=figure)
    for column in case.columns.values():
        assert case.verdict(case.measure(case.axis.severe, column, full=False)) == FAILS


def test_hum_is_taken_out_only_where_two_speeds_tell_it() -> None:
    case = case_of("hum over vibration (RMS)")
    two, one = (case.measure(2.0, case.columns[c], full=False) for c in ("two speeds", "one speed"))
    assert two < 0.5 * one
    assert case.verdict(one) != HOLDS


def test_a_wrong_rate_is_an_error_of_the_same_size() -> None:
    figure = case_of("error of the declared rate").measure(10.0, np.nan, full=True)
    assert figure == pytest.approx(10.0, abs=1.0)


def test_a_limiter_turns_levels_down_as_bussgang_says() -> None:
    case = case_of("RMS over the sensor's limit")
    assert case.theory is not None
    edge = case.theory(np.nan)
    assert edge == pytest.approx(0.6235, abs=1e-4)
    found = examine(case, "", full=False)
    assert 0.6 * edge < found.holds_to < 1.4 * edge
    assert case.measure(1.5 * edge, np.nan, full=False) > 1.5 * peaks.LEVEL_DB


def test_the_papers_pairs_merge_where_two_gaussians_do() -> None:
    case = case_of("spacing of two layers", peaks.EITHER)
    assert peaks.spacing_of_merging(15.0) == pytest.approx(2 * np.hypot(30, 15 / 1.36) / 15)
    for width in case.columns.values():
        edge = peaks.spacing_of_merging(width)
        assert case.measure(0.7 * edge, width, full=False) == 1.0
        assert case.measure(2.0 * edge, width, full=False) == 0.0


def test_evidence_falls_to_what_is_asked_for_at_theorys_edges() -> None:
    assert peaks.evidence(np.array([2.0, 1.0]), np.ones(2)) == pytest.approx(1 - np.log(2))
    floor = peaks.floor_of_no_evidence(np.nan)
    # Around its centre a band of width B has |H|² = 1/(1 + (2Δ/B)²), real part the same.
    offset = np.arange(-4000.0, 4001.0)
    square = 1 / (1 + (2 * offset / 20) ** 2)
    q = 1 + 2 * square / floor + square / floor**2
    assert np.sum(q - 1 - np.log(q)) == pytest.approx(peaks.PENALTY, rel=0.1)
    narrow, wide = (peaks.spacing_of_no_evidence(w) for w in (15.0, 60.0))
    assert 0.5 < wide < narrow < 2  # more lines in a width tell more


def test_the_bound_of_a_level_falls_with_the_root_of_the_length() -> None:
    bounds = 10 / np.log(10) / np.sqrt(np.pi * np.array(peaks.WIDTHS_HZ))
    length = peaks.length_of_one_db(np.nan)
    assert np.sqrt(np.mean(bounds**2) / length) == pytest.approx(1.0)


def test_troubles_are_as_large_as_they_say() -> None:
    def spoilt(trouble: peaks.Trouble, value: float, column: float = np.nan) -> np.ndarray:
        return trouble(generator(1), value, column)[1][0].samples

    clean = spoilt(peaks.short, 1.0)
    humming = spoilt(peaks.with_hum, 3.0, 1.0)
    assert (humming - clean).std() == pytest.approx(3 * clean.std(), rel=0.02)
    faded = spoilt(peaks.fading, 4.0)
    envelope = faded / clean
    assert envelope[0] / envelope[-1] == pytest.approx(4.0)
    assert np.mean(envelope**2) == pytest.approx(1.0)
    limited = spoilt(peaks.clipped, 2.0)
    assert np.abs(limited).max() == pytest.approx(clean.std() / 2)
    assert spoilt(peaks.short, 0.3).size == round(0.3 * RATE_HZ)
    truth, recordings = peaks.at_wrong_rate(generator(1), 4.0, np.nan)
    assert recordings[0].rate_hz == pytest.approx(1.04 * RATE_HZ)
    weakest = truth.layers.gains.min() / truth.layers.noise_gain
    assert 1 / weakest <= peaks.USUAL_FLOOR
    pair = peaks.crowded(generator(1), 3.0, 20.0)[0].layers
    assert np.diff(pair.frequencies_hz)[::2] == pytest.approx(60.0)


def test_frequencies_fall_by_what_is_said() -> None:
    """Played from a ramp instead of a vibration, the record tells the moments it was read at."""
    drift = 20.0

    class Ramp:
        def record(self, **_: object) -> np.ndarray:
            return np.arange(1.5 * RATE_HZ) / RATE_HZ

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(peaks, "planted", lambda rng: Ramp())
        moments = peaks.slowing(generator(1), drift, np.nan)[1][0].samples
    pace = np.diff(moments) * RATE_HZ
    assert pace[pace.size // 2] == pytest.approx(1.0, abs=1e-3)
    assert pace[-1] - pace[0] == pytest.approx(-drift / 100, abs=1e-3)


def test_figures_count_what_was_missed_and_what_was_invented() -> None:
    truth = planted(generator(1))
    places = truth.layers.frequencies_hz
    perfect = [(truth, found_as(truth))]
    assert peaks.wrong_share(perfect) == 0
    assert peaks.level_error_db(perfect) == pytest.approx(0, abs=1e-12)
    assert peaks.frequency_error_percent(perfect) == 0
    assert peaks.wrong_share([(truth, no_layers(0.02))]) == 1
    assert peaks.level_error_db([(truth, no_layers(0.02))]) == np.inf
    assert peaks.frequency_error_percent([(truth, no_layers(0.02))]) == np.inf
    one_more = [(truth, found_as(truth, frequencies_hz=np.append(places, 2000.0)))]
    assert peaks.wrong_share(one_more) == pytest.approx(1 - 6 / 7)
    louder = [(truth, found_as(truth, factor=2.0))]
    assert peaks.level_error_db(louder) == pytest.approx(20 * np.log10(2))
    higher = [(truth, found_as(truth, frequencies_hz=places * 1.03))]
    assert peaks.frequency_error_percent(higher) == pytest.approx(3.0)
    pairs = peaks.crowded(generator(1), 3.0, 20.0)[0]
    middles = pairs.layers.frequencies_hz.reshape(2, 2).mean(axis=1)
    half = np.append(pairs.layers.frequencies_hz[:2], middles[1])
    assert peaks.not_separated([(pairs, found_as(pairs))]) == 0
    assert peaks.not_separated([(pairs, found_as(pairs, frequencies_hz=half))]) == 0.5
