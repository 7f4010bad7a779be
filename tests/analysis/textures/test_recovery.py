"""Matching estimated layers to planted ones, on models whose offsets are known."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from tactileq.analysis.labels import ALL_LAYERS
from tactileq.analysis.textures.recovery import (
    NO_PARTNER,
    match_layers,
    planted_layers_table,
    planted_truth_table,
    truth_at_rate,
)
from tactileq.modeling import InputError, TextureModel, fit_texture
from tactileq.stimuli.planted.textures import RECORDER_RATE_HZ, planted_texture, record_texture
from tests.refusals import refused


def shifted(
    truth: TextureModel,
    *,
    hz: float = 0.0,
    width: float = 1.0,
    level_db: float = 0.0,
    noise_db: float = 0.0,
) -> TextureModel:
    """An estimate with known errors, of another rate and with all signs positive."""
    there = truth_at_rate(truth, 8000.0)
    return replace(
        there,
        frequencies_hz=there.frequencies_hz + hz,
        bandwidths_hz=there.bandwidths_hz * width,
        gains=np.abs(there.gains) * 10 ** (level_db / 20),
        noise_gains=there.noise_gains * 10 ** (noise_db / 20),
        estimator="shifted",
    )


def with_surplus(model: TextureModel, frequency_hz: float) -> TextureModel:
    """The model with one more layer that was never planted."""
    more = model.with_layers([*range(model.n_layers), 0])
    frequencies = more.frequencies_hz.copy()
    frequencies[:, :, -1] = frequency_hz
    return replace(more, frequencies_hz=frequencies)


def test_at_its_own_rate_and_without_layers_the_truth_is_only_scaled(truth):
    assert_allclose(truth_at_rate(truth, truth.rate_hz).noise_gains, truth.noise_gains, rtol=1e-12)
    floor = truth_at_rate(truth.with_layers([]), 3000.0)
    assert_allclose(floor.noise_gains, truth.noise_gains * np.sqrt(3000 / truth.rate_hz), rtol=1e-5)


def test_the_noise_gain_at_a_lower_rate_is_the_nearest_of_a_thousand():
    """MDF has the highest skirts: at 5 kHz the divergence is least where it is said to be."""
    grid = {"speeds_mm_s": np.array([200.0, 350.0]), "forces_n": np.array([3.5])}
    truth = planted_texture("MDF", **grid, rate_hz=RECORDER_RATE_HZ)
    found = truth_at_rate(truth, 5000.0)
    assert_allclose(found.gains, planted_texture("MDF", **grid).gains)
    hz = np.arange(10.0, 2450.0, 1.0)
    for i, speed in enumerate(truth.speeds_mm_s):
        peq = found.peq(speed, 3.5)
        power = truth.peq(speed, 3.5).response(hz) ** 2 * (5000 / RECORDER_RATE_HZ)
        layers = peq.complex_response(hz) - peq.noise_gain
        tried = found.noise_gains[i, 0] * np.geomspace(0.5, 2, 1001)
        ratio = power / np.abs(tried[:, None] + layers) ** 2
        best = tried[(ratio - np.log(ratio)).sum(axis=1).argmin()]
        assert_allclose(found.noise_gains[i, 0], best, rtol=0.002)


def test_joint_shows_no_bias_of_the_noise_gain_on_records_of_the_recorders_rate():
    """It was 1.5 to 3.7 dB here when the truth was the noise gain planted at 5 kHz."""
    grid = {"speeds_mm_s": np.array([200.0, 350.0]), "forces_n": np.array([2.0, 3.5])}
    truth = planted_texture("wall paper", **grid, rate_hz=RECORDER_RATE_HZ)
    model = fit_texture(record_texture(truth, duration_s=2.0, seed=1), layers=3)
    overall = planted_truth_table(truth, [model]).iloc[-1]
    assert abs(overall["median_noise_gain_error_db"]) < 0.15
    assert abs(overall["worst_noise_gain_error_db"]) < 0.4


def test_known_offsets_come_back(truth):
    estimate = shifted(truth, hz=4.0, width=1.5, level_db=-2.0, noise_db=1.0)
    table = planted_truth_table(truth, [estimate])
    assert table["layer"].tolist() == ["1", "2", "3", "4", ALL_LAYERS]
    assert (table["estimator"] == "shifted").all()
    assert_allclose(table["precision"], 1.0)
    assert_allclose(table["recall"], 1.0)
    assert_allclose(table["median_frequency_error_hz"], 4.0)
    assert_allclose(table["median_bandwidth_ratio"], 1.5)
    assert_allclose(table["median_level_error_db"], -2.0)
    assert_allclose(table["median_absolute_level_error_db"], 2.0)
    assert_allclose(table["median_noise_gain_error_db"].iloc[-1], 1.0)
    assert table["median_noise_gain_error_db"].iloc[:-1].isna().all()


def test_a_missed_layer_lowers_recall_and_a_surplus_one_precision(truth):
    estimate = with_surplus(shifted(truth).with_layers([0, 1, 3]), 1900.0)
    table = planted_truth_table(truth, [estimate]).set_index("layer")
    assert table["recall"].tolist() == [1.0, 1.0, 0.0, 1.0, 0.75]
    # The surplus layer lies nearest to layer 4 and halves its precision; near layer 3 is nothing.
    assert_allclose(table["precision"], [1.0, 1.0, np.nan, 0.5, 0.75])
    assert np.isnan(table.loc["3", "median_frequency_error_hz"])


def test_several_estimators_stand_beneath_each_other(truth):
    table = planted_truth_table(truth, [truth, shifted(truth, level_db=3.0)])
    overall = table[table["layer"] == ALL_LAYERS]
    assert overall["estimator"].tolist() == ["planted", "shifted"]
    assert_allclose(overall["median_level_error_db"], [0.0, 3.0], atol=1e-12)


def test_the_worst_error_and_its_place_stand_beside_the_median(truth):
    frequencies, gains = truth.frequencies_hz.copy(), truth.gains.copy()
    widths, noise = truth.bandwidths_hz.copy(), truth.noise_gains.copy()
    frequencies[1, 0, 2] -= 4.0
    widths[0, 1, 1] /= 3.0  # farther from 1 than a factor of 2
    widths[0, 0, 0] *= 2.0
    gains[0, 0, 3] *= 10 ** (-12 / 20)
    gains[1, 1, 0] *= 10 ** (6 / 20)
    noise[1, 1] *= 10 ** (5 / 20)
    estimate = replace(
        truth, frequencies_hz=frequencies, bandwidths_hz=widths, gains=gains, noise_gains=noise
    )
    table = planted_truth_table(truth, [estimate]).set_index("layer")
    overall = table.loc[ALL_LAYERS]
    assert overall["median_frequency_error_hz"] == 0.0
    assert overall["worst_frequency_error_hz"] == pytest.approx(-4.0)
    assert overall["worst_frequency_error_at"] == "layer 3, 350 mm/s, 1 N"
    assert overall["worst_bandwidth_ratio"] == pytest.approx(1 / 3)
    assert overall["worst_bandwidth_ratio_at"] == "layer 2, 200 mm/s, 3 N"
    assert overall["worst_level_error_db"] == pytest.approx(-12.0)
    assert overall["worst_level_error_at"] == "layer 4, 200 mm/s, 1 N"
    assert overall["worst_noise_gain_error_db"] == pytest.approx(5.0)
    assert overall["worst_noise_gain_error_at"] == "350 mm/s, 3 N"
    assert table.loc["1", "worst_level_error_db"] == pytest.approx(6.0)
    assert table.loc["1", "worst_level_error_at"] == "layer 1, 350 mm/s, 3 N"
    assert table.loc["1", "worst_noise_gain_error_at"] == ""


def test_what_was_not_found_has_no_worst_error(truth):
    overall = planted_truth_table(truth, [truth.with_layers([])]).iloc[-1]
    assert np.isnan(overall["worst_frequency_error_hz"])
    assert overall["worst_frequency_error_at"] == overall["worst_level_error_at"] == ""


def test_interpolated_conditions_are_left_out(truth):
    spoilt = truth.frequencies_hz.copy()
    spoilt[0, 0] += 200.0
    interpolated = np.zeros((2, 2), dtype=bool)
    interpolated[0, 0] = True
    estimate = replace(truth, frequencies_hz=spoilt, interpolated=interpolated)
    overall = planted_truth_table(truth, [estimate]).iloc[-1]
    assert (overall["precision"], overall["recall"]) == (1.0, 1.0)


def test_layer_by_layer_table_shows_misses_and_surplus(truth):
    estimate = with_surplus(shifted(truth, hz=2.0, level_db=6.0).with_layers([0, 1, 3]), 1900.0)
    table = planted_layers_table(truth, estimate, speed_mm_s=350.0, force_n=3.0)
    assert table["layer"].tolist() == ["1", "2", "3", "4", "surplus"]
    assert_allclose(table["true_frequency_hz"].iloc[:4], truth.frequencies_hz[1, 1])
    # Gains are those for unit noise at the estimate's rate, 8 kHz.
    gains = np.abs(truth.gains[1, 1]) * np.sqrt(8000 / truth.rate_hz)
    assert_allclose(table["true_gain"].iloc[:4], gains)
    found = [0, 1, 3]
    assert_allclose(
        table["estimated_frequency_hz"].iloc[found], truth.frequencies_hz[1, 1, found] + 2.0
    )
    assert_allclose(
        table["estimated_gain"].iloc[found],
        gains[found] * 10 ** (6 / 20),
        rtol=1e-9,
    )
    assert table.iloc[2][["estimated_frequency_hz", "estimated_gain"]].isna().all()
    assert table.iloc[4][["true_frequency_hz", "true_gain"]].isna().all()


def test_an_estimate_without_layers_finds_nothing(truth):
    table = planted_truth_table(truth, [truth.with_layers([])])
    assert (table["recall"] == 0).all()
    assert table["precision"].isna().all()


def test_other_grids_and_empty_truths_are_refused(truth):
    with refused(InputError, expected="grid", got="[1.0, 2.0] N"):
        planted_truth_table(truth, [replace(truth, forces_n=np.array([1.0, 2.0]))])
    with refused(InputError, expected="layers", got="none"):
        planted_truth_table(truth.with_layers([]), [truth])


def test_a_pair_may_lie_half_a_bandwidth_or_ten_hertz_apart():
    true, width = np.array([100.0, 500.0]), np.array([4.0, 60.0])
    assert match_layers(true, width, estimated_frequency_hz=np.array([110.0, 530.0])).tolist() == [
        0,
        1,
    ]
    beyond = match_layers(true, width, estimated_frequency_hz=np.array([110.1, 530.1]))
    assert beyond.tolist() == [NO_PARTNER, NO_PARTNER]


def test_more_pairs_go_before_shorter_distances():
    # Greedy pairing of the nearest (100 with 104) would leave the second layer alone.
    true, width = np.array([100.0, 112.0]), np.array([20.0, 20.0])
    partner = match_layers(true, width, estimated_frequency_hz=np.array([104.0, 95.0]))
    assert partner.tolist() == [1, 0]


FREQUENCIES = st.lists(st.floats(10, 150), max_size=4)


@given(FREQUENCIES, FREQUENCIES)
def test_no_assignment_is_better_than_the_chosen_one(true, found):
    widths = np.full(len(true), 40.0)
    partner = match_layers(np.array(true), widths, estimated_frequency_hz=np.array(found))
    used = partner[partner != NO_PARTNER].tolist()
    assert len(used) == len(set(used))

    def score(chosen: tuple[int, ...]) -> tuple[int, float]:
        apart = [abs(true[i] - found[j]) for i, j in enumerate(chosen) if j < len(found)]
        allowed = [d for d in apart if d <= 20.0]
        return -len(allowed), sum(allowed)

    mine = score(tuple(len(found) if j == NO_PARTNER else int(j) for j in partner))
    slots = range(len(found) + len(true))
    best = min(map(score, permutations(slots, len(true))))
    assert mine[0] == best[0]
    assert_allclose(mine[1], best[1], atol=1e-9)
