"""Hands that stroke to and fro, as readings, and what a planted surface does under them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tactileq.rig.shared.live.memory import CONTACT, READING, SIMULATED

READINGS_HZ = 500.0


def _readings_of(
    speed_mm_s: NDArray[np.float64],
    force_n: NDArray[np.float64],
    *,
    flags: int = CONTACT | SIMULATED,
    begin_s: float = 0.0,
    rate_hz: float = READINGS_HZ,
) -> NDArray[np.void]:
    """Readings at even times."""
    rows = np.zeros(speed_mm_s.size, dtype=READING)
    rows["time_s"] = begin_s + np.arange(rows.size) / rate_hz
    rows["speed_mm_s"], rows["force_n"], rows["flags"] = speed_mm_s, force_n, flags
    return rows


def _stroking(
    seconds: float, speeds_mm_s: Any, forces_n: Any, *, seed: int = 0
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """A person who strokes to and fro, aims at conditions and misses them a little.

    Each stroke lasts 0.3 to 0.6 s, a sixth of it to start and to stop; its speed is off by up to
    12 % and wavers by 6 %, its force by up to 15 % and 8 %.
    """
    rng = np.random.default_rng(seed)
    speed, force = [], []
    while sum(map(len, speed)) < seconds * READINGS_HZ:
        share = np.linspace(0, 1, round(rng.uniform(0.3, 0.6) * READINGS_HZ))
        shape = np.clip(np.minimum(share, 1 - share) / 0.15, 0, 1)
        wave = 1 + 0.06 * np.sin(2 * np.pi * (2 * share + rng.uniform()))
        aim = rng.choice(speeds_mm_s) * rng.uniform(0.88, 1.12) * rng.choice([-1, 1])
        speed.append(aim * shape * wave)
        press = 1 + 0.08 * np.sin(2 * np.pi * (share + rng.uniform()))
        force.append(rng.choice(forces_n) * rng.uniform(0.85, 1.15) * press)
    count = round(seconds * READINGS_HZ)
    return np.concatenate(speed)[:count], np.concatenate(force)[:count]


@pytest.fixture(scope="session")
def readings_of() -> Callable[..., NDArray[np.void]]:
    return _readings_of


@pytest.fixture(scope="session")
def stroking() -> Callable[..., tuple[NDArray[np.float64], NDArray[np.float64]]]:
    return _stroking
