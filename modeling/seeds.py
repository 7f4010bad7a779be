"""Every way in which random numbers follow from a seed and from what they are for.

One seed gives each surface, each participant and each stimulus random numbers of its own, which
stay the same when others are added. The recipes differ because published seeds must go on giving
the same bits.
"""

from __future__ import annotations

import hashlib
import zlib
from collections.abc import Sequence

import numpy as np

_STREAM_BYTES = 6  # what a 64-bit floating-point number holds exactly


def number_of(name: str) -> int:
    """A name as a whole number of 32 bits (CRC-32)."""
    return zlib.crc32(name.encode())


def generator(seed: int | Sequence[int], *key: int) -> np.random.Generator:
    """The generator of one thing under a seed.

    Parameters
    ----------
    seed : int or sequence of int
        Each at least 0.
    key : int
        Which thing, such as subject and session; each at least 0.
    """
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))


def noise_seed(seed: int, name: str) -> int:
    """The seed of the noise (`rendering.noise`) of what is called `name`, 0 … 2⁶⁴ − 1."""
    return ((seed << 32) | number_of(name)) % 2**64


def noise_stream(*names: str) -> int:
    """A stream of noise by names (SHA-256 of their lines), 0 … 2⁴⁸ − 1."""
    digest = hashlib.sha256("\n".join(names).encode()).digest()
    return int.from_bytes(digest[:_STREAM_BYTES], "big")
