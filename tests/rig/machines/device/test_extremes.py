"""Counters that wrap and numbers that no mechanics have: what the cable device makes of them.

tests/test_c_parts.py runs this with everything checked that C leaves undefined.
"""

from __future__ import annotations

from math import inf, nan
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactileq.rig.machines.device.registers import DeviceSource
from tactileq.rig.machines.device.virtual import compiled_device
from tests.rig.machines.device.talking import Talk
from tests.rig.machines.device.test_mechanics import LEFT, RIGHT, Mechanics

MODULE = compiled_device()
MOST = 2**31


def counted(paid_mm: float) -> int:
    """By the encoder of a motor that has paid out so much cable."""
    one = Mechanics()
    one.state.paid_mm[LEFT] = paid_mm
    return int(MODULE.lib.tq_mechanics_counted(one.state, one.cables, LEFT))


@given(st.floats(-3e7, 3e7))
def test_an_encoder_counts_the_cable_to_the_nearest(paid_mm: float) -> None:
    exact = paid_mm / MODULE.lib.tq_usual_cables().mm_per_count
    assert abs(counted(paid_mm) - exact) <= 0.5


@pytest.mark.parametrize(
    ("paid_mm", "count"),
    [(1e9, MOST - 1), (-1e9, -MOST), (1e300, MOST - 1), (inf, MOST - 1), (-inf, -MOST), (nan, 0)],
)
def test_beyond_its_range_an_encoder_stands_at_the_end_of_it(paid_mm: float, count: int) -> None:
    assert counted(paid_mm) == count


@pytest.mark.parametrize("value", [nan, inf, -inf, 1e300, -1e300, 1e-300])
@pytest.mark.parametrize("name", ["x_mm", "z_mm", "vx_mm_s", "vz_mm_s", "mass", "mass_s"])
def test_mechanics_that_run_away_go_on(name: str, value: float) -> None:
    one = Mechanics()
    setattr(one.state, name, value)
    for _ in range(20):
        one.tick((1.0, 1.0), (0.0, -1.0), drive_g=value)
    for motor in (LEFT, RIGHT):
        assert -MOST <= MODULE.lib.tq_mechanics_counted(one.state, one.cables, motor) < MOST


def rest_of(sample: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """What five such samples leave below a millionth, in single precision as the device has it."""
    square = np.zeros_like(sample)
    for _ in range(5):
        square += sample * sample
    whole = np.floor(square * np.float32(1e6))
    return square - whole * np.float32(1e-6)


def test_a_rest_below_nothing_is_carried_on_in_silence() -> None:
    """Of 1 in 10 000 loud sums rounding leaves a rest below −1e-6: no whole number without sign."""
    drawn = np.random.default_rng(1).uniform(1, 5, 500_000).astype(np.float32)
    loud = drawn[rest_of(drawn) < -1e-6][:30]
    assert loud.size == 30
    talk = Talk()
    for sample in loud:
        talk.write("Samples", [float(sample)] * 5 + [0.0] * 20)
    talk.write("Source", DeviceSource.HOST)
    talk.wire.step(740)
    assert talk.number("SamplesMissed") == 0
    squares = 5 * np.sum(loud.astype(np.float64) ** 2)
    assert talk.number("Played")[1] * 1e-6 == pytest.approx(squares, abs=1e-3)
