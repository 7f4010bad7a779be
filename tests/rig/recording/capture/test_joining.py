"""Joined pieces keep the power of every frequency."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import butter, sosfilt, welch

from tactileq.modeling import InputError
from tactileq.rig.recording.capture.joining import fade_samples, joined, joined_samples
from tests.refusals import refused

RATE_HZ = 5000.0


@given(st.lists(st.integers(200, 900), min_size=1, max_size=6), st.integers(0, 2**31))
def test_every_sample_of_white_noise_keeps_its_variance(sizes, seed) -> None:
    """The weights of each sample, found by joining one unit sample at a time, have squares of 1."""
    fade, place = fade_samples(RATE_HZ), seed % min(sizes)
    power = np.zeros(joined_samples(sizes, RATE_HZ))
    begins = np.cumsum([0, *(size - fade for size in sizes[:-1])])
    for which, (begin, size) in enumerate(zip(begins, sizes, strict=True)):
        pieces = [np.full(n, float(k == which)) for k, n in enumerate(sizes)]
        power += joined(pieces, RATE_HZ) ** 2
        # A sample comes out where it belongs, and nowhere else.
        pieces[which][:] = 0
        pieces[which][place] = 1
        moved = np.flatnonzero(joined(pieces, RATE_HZ))
        assert moved.tolist() == [begin + place]
        assert size - 1 >= place
    assert power == pytest.approx(1.0, abs=1e-12)


def test_one_piece_is_itself() -> None:
    piece = np.random.default_rng(0).normal(size=300)
    assert np.array_equal(joined([piece], RATE_HZ), piece)


def test_a_band_in_pieces_of_100_ms_has_the_levels_of_the_whole() -> None:
    """Of a band of 30 Hz at 200 Hz: total power, the peak, and a floor 40 dB below it."""
    rng = np.random.default_rng(1)
    sections = butter(1, (185, 215), btype="bandpass", fs=RATE_HZ, output="sos")
    whole = sosfilt(sections, rng.normal(size=2_000_000)) + 0.01 * rng.normal(size=2_000_000)
    cut = joined([whole[k : k + 500] for k in range(0, whole.size, 1000)], RATE_HZ)
    assert cut.std() == pytest.approx(whole.std(), rel=0.01)
    frequency, before = welch(whole, RATE_HZ, nperseg=5000)
    _, after = welch(cut, RATE_HZ, nperseg=5000)
    change_db = 10 * np.log10(after / before)
    assert abs(change_db[200]) < 1.5  # pieces of 100 ms see no finer than 10 Hz
    assert np.abs(change_db[(frequency > 10) & (frequency < 130)]).mean() < 0.5
    assert np.abs(change_db[frequency > 400]).mean() < 0.5


def test_pieces_that_are_shorter_than_two_fades_are_refused() -> None:
    with refused(InputError, expected="200 samples", got=199):
        joined([np.ones(300), np.ones(199)], RATE_HZ)
    with refused(InputError, expected="200 samples", got="none"):
        joined([], RATE_HZ)
    assert joined_samples([], RATE_HZ) == 0
