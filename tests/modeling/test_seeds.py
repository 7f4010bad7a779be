"""Published seeds go on giving the same bits: each recipe against what it is made of."""

from __future__ import annotations

import hashlib

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tactileq.modeling.seeds import generator, noise_seed, noise_stream, number_of

seeds = st.integers(0, 2**63)
keys = st.lists(st.integers(0, 2**32 - 1), max_size=3)


def bits(rng: np.random.Generator) -> list[int]:
    return rng.integers(0, 2**63, 4).tolist()


def test_a_name_is_its_crc_32() -> None:
    # The check value of CRC-32/ISO-HDLC in the catalogue of CRC algorithms.
    assert number_of("123456789") == 0xCBF43926


@given(seeds, keys)
def test_a_generator_is_the_child_that_numpy_would_spawn(seed: int, key: list[int]) -> None:
    parent = np.random.SeedSequence(seed, spawn_key=key)
    assert bits(generator(seed, *key)) == bits(np.random.default_rng(parent))
    for number, child in enumerate(parent.spawn(3)):
        assert bits(generator(seed, *key, number)) == bits(np.random.default_rng(child))


@given(seeds, seeds)
def test_a_sequence_of_numbers_is_a_seed(first: int, second: int) -> None:
    assert bits(generator([first, second])) == bits(np.random.default_rng([first, second]))


@given(st.integers(0, 2**31), st.text(max_size=12))
def test_noise_of_a_name_is_seed_and_name_side_by_side(seed: int, name: str) -> None:
    found = noise_seed(seed, name)
    assert (found >> 32, found % 2**32) == (seed, number_of(name))


def test_a_stream_is_the_beginning_of_a_hash() -> None:
    digest = hashlib.sha256(b"canvas\nfull\n100 mm/s at 1 N").hexdigest()
    found = noise_stream("canvas", "full", "100 mm/s at 1 N")
    assert f"{found:012x}" == digest[:12]
    assert found != noise_stream("canvas", "full", "100 mm/s at 2 N")
