"""SplitMix64 noise against a big-integer implementation and published numbers."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactileq.modeling.rendering.noise import stream_key, white_noise

WORD = 2**64
SQRT_3 = 3**0.5
# First outputs of SplitMix64 seeded with 1234567, as printed in its published test vectors.
PUBLISHED = (
    6457827717110365317,
    3203168211198807973,
    9817491932198370423,
    4593380528125082431,
    16408922859458223821,
)


def splitmix64(state: int) -> int:
    """The output function, in Python integers."""
    z = ((state ^ (state >> 30)) * 0xBF58476D1CE4E5B9) % WORD
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) % WORD
    return z ^ (z >> 31)


def sample(key: int, position: int) -> float:
    """Sample `position` (0-based) of the generator whose seed is `key`, uniform on ±√3."""
    bits = splitmix64((key + (position + 1) * 0x9E3779B97F4A7C15) % WORD)
    return ((bits >> 11) * 2.0**-52 - 1.0) * SQRT_3


def test_published_vectors() -> None:
    expected = [((word >> 11) * 2.0**-52 - 1.0) * SQRT_3 for word in PUBLISHED]
    assert white_noise(np.uint64(1234567), 0, 5).tolist() == expected


@settings(deadline=None)
@given(st.integers(0, WORD - 1), st.integers(-(2**62), 2**62))
def test_numpy_agrees_with_integers_to_the_bit(key: int, start: int) -> None:
    expected = [sample(key, start + n) for n in range(4)]
    assert white_noise(np.uint64(key), start, 4).tolist() == expected


def test_moments_of_the_uniform_distribution() -> None:
    n = 400_000
    noise = white_noise(stream_key(3), 0, n)
    assert abs(noise.mean()) < 4 / np.sqrt(n)
    assert noise.var() == pytest.approx(1, abs=4 * np.sqrt(0.8 / n))  # Var w² = 9/5 − 1
    assert np.mean(noise**4) == pytest.approx(1.8, abs=0.02)
    assert np.abs(noise).max() <= SQRT_3
    assert np.abs(noise).max() > SQRT_3 * (1 - 1e-4)


def test_noise_is_white() -> None:
    n = 2**18
    noise = white_noise(stream_key(4), 0, n)
    lags = [noise[:-lag] @ noise[lag:] / n for lag in range(1, 41)]
    assert np.abs(lags).max() < 4.5 / np.sqrt(n)
    power = np.abs(np.fft.rfft(noise)[1:-1]) ** 2 / n
    bands = power[: power.size // 64 * 64].reshape(64, -1).mean(axis=1)
    assert bands == pytest.approx(1, abs=4.5 / np.sqrt(power.size / 64))


def test_streams_and_seeds_are_independent() -> None:
    n = 100_000
    pairs = [(0, 0), (0, 1), (1, 0), (1, 1), (2**64 - 1, 5), (12, 2**64 - 1)]
    keys = [stream_key(*pair) for pair in pairs]
    assert len({int(key) for key in keys}) == len(pairs)
    table = np.array([white_noise(key, 0, n) for key in keys])
    correlations = (table @ table.T / n)[np.triu_indices(len(pairs), 1)]
    assert np.abs(correlations).max() < 4.5 / np.sqrt(n)


def test_streams_do_not_overlap_shortly() -> None:
    first = set(white_noise(stream_key(0, 0), 0, 5000).tolist())
    for other in range(1, 5):
        assert not first & set(white_noise(stream_key(0, other), -2500, 5000).tolist())


@settings(deadline=None)
@given(st.integers(-300, 300), st.integers(0, 200))
def test_random_access_equals_sequence(start: int, count: int) -> None:
    whole = white_noise(stream_key(9), -300, 900)
    part = white_noise(stream_key(9), start, count)
    assert np.array_equal(part, whole[start + 300 : start + 300 + count])
