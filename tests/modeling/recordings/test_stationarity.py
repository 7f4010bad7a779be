"""Drift that was put in is found and corrected; steady records are left alone."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactileq.modeling import PEQ
from tactileq.modeling.recordings.stationarity import drift_of, without_drift

RATE_HZ = 5000.0
FINE = 8


def peq(noise_gain: float = 0.02) -> PEQ:
    return PEQ(
        noise_gain=noise_gain,
        frequencies_hz=np.array([180.0, 460.0]),
        bandwidths_hz=np.array([20.0, 40.0]),
        gains=np.array([1.0, 0.5]),
        rate_hz=RATE_HZ,
    )


def steady(seed: int, n: int = 5000, *, noise_gain: float = 0.02) -> np.ndarray:
    rng = np.random.default_rng(seed)
    longer = np.fft.rfft(rng.standard_normal(2 * n))
    response = peq(noise_gain).complex_response(np.fft.rfftfreq(2 * n, 1 / RATE_HZ))
    return np.asarray(np.fft.irfft(longer * response)[:n])


def drifting(seed: int, drift: float, n: int = 5000) -> np.ndarray:
    """A steady record played ever faster: at share s its frequencies are 1 + drift·(s − ½)."""
    longer = np.fft.rfft(steady(seed, 2 * n))
    fine = np.fft.irfft(np.pad(longer, (0, (FINE - 1) * n)), 2 * n * FINE) * FINE
    share = np.arange(n) / n
    at = (share + drift * (share**2 - share) / 2) * n + n / 4
    return np.asarray(np.interp(at * FINE, np.arange(2 * n * FINE), fine))


def test_steady_records_do_not_drift() -> None:
    found = [drift_of(steady(seed), RATE_HZ) for seed in range(150)]
    assert [d.frequency for d in found] == [0.0] * 150
    assert [d.level_db for d in found] == [0.0] * 150


@pytest.mark.parametrize("n", [640, 1250, 20_000])
def test_steady_records_of_other_lengths_do_not_drift(n: int) -> None:
    found = [drift_of(steady(seed, n), RATE_HZ) for seed in range(30)]
    assert [d.frequency for d in found] == [0.0] * 30


def test_white_noise_and_silence_do_not_drift() -> None:
    rng = np.random.default_rng(0)
    for samples in (rng.standard_normal(5000), np.zeros(5000), np.zeros(64)):
        assert drift_of(samples, RATE_HZ) == (0.0, 0.0)


@pytest.mark.parametrize(("drift", "share"), [(-0.2, 0.9), (0.2, 0.9), (0.1, 0.4)])
def test_drift_is_found(drift: float, share: float) -> None:
    """In nine of ten records of 20 %; of 10 % in somewhat less than half, none of them wrong."""
    found = np.array([drift_of(drifting(seed, drift), RATE_HZ).frequency for seed in range(40)])
    told = found[found != 0]
    assert told.size >= share * found.size
    assert np.median(told) == pytest.approx(drift, abs=0.02)
    assert told == pytest.approx(drift, abs=0.1)


@settings(deadline=None, max_examples=20)
@given(st.floats(-0.25, 0.25), st.integers(0, 100))
def test_straightened_frequencies_stand_still(drift: float, seed: int) -> None:
    """The peaks of a drifting record are as narrow as those of the steady one it was made of."""
    mended = without_drift(drifting(seed, drift), drift)
    middle = steady(seed, 10_000)[1250 : 1250 + 5000]  # what the drifting record was read from
    mended, middle = mended[250:-250], middle[250:-250]
    assert np.corrcoef(mended, middle)[0, 1] > 0.98


def test_no_drift_leaves_the_record() -> None:
    x = steady(0)
    assert without_drift(x, 0.0) == pytest.approx(x, abs=1e-9)


def test_a_level_that_doubles_is_told() -> None:
    rise = np.where(np.arange(5000) < 2500, 1.0, 2.0)
    found = [drift_of(steady(seed) * rise, RATE_HZ).level_db for seed in range(20)]
    assert np.count_nonzero(found) >= 19
    assert np.median(found) == pytest.approx(6.0, abs=1.5)
