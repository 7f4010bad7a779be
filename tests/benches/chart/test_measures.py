"""The chart's measures where their values are known in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactileq.benches.chart.measures import (
    Accuracy,
    ReferenceMagnitude,
    frequencies_hz,
    over_conditions,
)
from tactileq.modeling import PEQ

TRUTH = PEQ(
    noise_gain=0.02, frequencies_hz=[80.0], bandwidths_hz=[30.0], gains=[0.4], rate_hz=1000.0
)
FREQUENCY = frequencies_hz(1000.0)
YARDSTICK = ReferenceMagnitude(TRUTH.response(FREQUENCY), FREQUENCY)


@given(st.floats(0.01, 100.0))
def test_a_louder_truth_errs_by_its_level_alone(factor: float) -> None:
    found = YARDSTICK.accuracy(factor * TRUTH.response(FREQUENCY))
    level_db = 20 * np.log10(factor)
    assert found.gfc30 == pytest.approx(1)
    assert found.gfc5 == pytest.approx(1)
    assert found.level_db == pytest.approx(level_db, abs=1e-9)
    assert found.distance_db == pytest.approx(abs(level_db), abs=1e-9)
    assert found.bands_db == pytest.approx(abs(level_db), abs=1e-9)


def test_silence_counts_as_60_db_below() -> None:
    found = YARDSTICK.accuracy(np.zeros(FREQUENCY.size))
    assert found.level_db == pytest.approx(-60)
    assert found.distance_db == pytest.approx(60)
    assert found.bands_db == pytest.approx(60)


def test_white_noise_of_equal_power_is_right_in_level_alone() -> None:
    band = (FREQUENCY >= 10) & (FREQUENCY <= 490)
    power = np.mean(TRUTH.response(FREQUENCY[band]) ** 2)
    found = YARDSTICK.accuracy(np.full(FREQUENCY.size, np.sqrt(power)))
    assert found.level_db == pytest.approx(0, abs=1e-9)
    assert found.distance_db > 10
    assert found.gfc30 < 0.95


def test_over_conditions_means_and_worst() -> None:
    found = [Accuracy(0.9, 0.8, 3.0, 1.0, -2.0), Accuracy(0.7, 0.6, 4.0, 1.0, 1.0)]
    assert over_conditions(found) == pytest.approx(
        {
            "gfc30": 0.8,
            "gfc5": 0.7,
            "distance_db": np.sqrt(12.5),
            "bands_db": 1.0,
            "level_db": np.sqrt(2.5),
            "worst_level_db": 2.0,
        }
    )
    assert all(np.isnan(value) for value in over_conditions([]).values())


@pytest.mark.parametrize("rate_hz", [200.0, 1000.0, 5000.0, 22704.0])
def test_frequencies_reach_from_0_to_nyquist(rate_hz: float) -> None:
    frequency = frequencies_hz(rate_hz)
    assert frequency[0] == 0
    assert frequency[-1] == rate_hz / 2
    assert np.diff(frequency) == pytest.approx(frequency[1])
