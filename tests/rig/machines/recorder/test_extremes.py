"""Counters that wrap and numbers that no mechanics have: what the recorder's law makes of them.

tests/test_c_parts.py runs this with everything checked that C leaves undefined.
"""

from __future__ import annotations

from dataclasses import asdict
from math import floor, inf, nan, tau

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactileq.rig.machines.recorder.law import WantedRecord
from tactileq.rig.machines.recorder.virtual import VirtualRecord, VirtualRecorder, compiled_recorder

MODULE = compiled_recorder()
TABLE, ARM = 0, 1
WANTED = WantedRecord(speed_mm_s=200.0, force_n=2.0, run_in_s=0.1, duration_s=0.2)


def recorded(turned: int, *, wanted: WantedRecord = WANTED) -> dict[str, object]:
    """What a record is whose encoders have counted so far before; arrays as lists."""
    made = VirtualRecorder()
    for axis in (TABLE, ARM):
        made._recorder.turned[axis] = turned
    made._recorder.at_mark = turned
    return plain(made.record(wanted))


def plain(record: VirtualRecord) -> dict[str, object]:
    """A record with its arrays as lists."""
    return {name: np.asarray(value).tolist() for name, value in asdict(record).items()}


@pytest.mark.parametrize("before", [1, 10, 1000, 3000, 5000])
def test_counts_that_wrap_change_nothing_of_a_record(before: int) -> None:
    """2³¹ counts are 6 days at 1 turn in a second: within a record, at its index, at its marks."""
    assert recorded(2**31 - before) == recorded(0)


@pytest.mark.parametrize("before", [2**31 - 3, 2**32 - 8])
def test_marks_are_counted_on_beyond_any_number(before: int) -> None:
    seconds = []
    for marks in (20, before):
        made = VirtualRecorder()
        made.record(WANTED)
        made._recorder.marks = marks
        seconds.append(plain(made.record(WANTED)))
    assert seconds[0] == seconds[1]


def counter_at(rad: float) -> int:
    """Of an encoder of 4096 counts at this angle."""
    plant = VirtualRecorder()._plant
    plant.motor_rad = rad
    MODULE.lib.tq_plant_tick(plant, [0.0, 0.0], 0.0)
    return int(plant.counter[TABLE])


@given(st.floats(-1e12, 1e12))
def test_an_encoder_counts_modulo_two_to_the_sixteenth(rad: float) -> None:
    assert counter_at(rad) == floor(rad / tau * 4096) % 65536


@pytest.mark.parametrize("rad", [1e18, -1e18, 1e300, -1e300, inf, -inf, nan])
def test_an_encoder_beyond_all_counts_counts_something(rad: float) -> None:
    assert 0 <= counter_at(rad) < 65536


@given(st.floats(-1e6, 1e6))
def test_every_twelfth_mark_is_the_index(rad: float) -> None:
    plant, index = VirtualRecorder()._plant, MODULE.ffi.new("int *")
    plant.disc_rad = rad
    marks = rad / tau * 12
    mark = MODULE.lib.tq_plant_mark(plant, index)
    assert mark == (marks - floor(marks) < 0.2)
    assert index[0] == (mark and floor(marks) % 12 == 0)


@pytest.mark.parametrize("rad", [1e300, -1e300, inf, nan])
def test_no_angle_has_no_index(rad: float) -> None:
    plant, index = VirtualRecorder()._plant, MODULE.ffi.new("int *")
    plant.disc_rad = rad
    MODULE.lib.tq_plant_mark(plant, index)
    assert index[0] in (0, 1)


@pytest.mark.parametrize("value", [nan, inf, -inf, 1e300, -1e300, 1e-300])
@pytest.mark.parametrize(
    "part", ["motor_rad", "disc_rad", "arm_rad", "motor_rad_s", "disc_rad_s", "arm_rad_s"]
)
def test_mechanics_that_run_away_end_a_record(part: str, value: float) -> None:
    made = VirtualRecorder()
    MODULE.lib.tq_recorder_rest(made._recorder, made._plant, 10)
    setattr(made._plant, part, value)
    assert made.record(WANTED).duration_s <= 60


@pytest.mark.parametrize("counts", [0.0, 1e-300, nan, inf, 1.0])
def test_a_turn_of_no_counts_has_a_place_all_the_same(counts: float) -> None:
    made = VirtualRecorder()
    made._recorder.limits.counts = [counts] * 2
    for turned, at_index in ((2**31 - 1, -(2**31)), (-(2**31), 2**31 - 1), (2**31 - 1, 0)):
        made._recorder.turned[TABLE], made._recorder.at_index = turned, at_index
        MODULE.lib.tq_recorder_place(made._recorder)


def test_a_random_walk_of_counters_marks_and_ticks() -> None:
    """Every counter, at any moment, from any count of ticks."""
    made, rng = VirtualRecorder(), np.random.default_rng(1)
    one, lib = made._recorder, MODULE.lib
    one.tick = 2**32 - 500
    phases = set()
    for _ in range(20_000):
        draw = rng.random()
        if draw < 0.002:
            want = {**asdict(WANTED), "radius_mm": 40.0}
            lib.tq_recorder_want(one, MODULE.ffi.new("tq_wanted *", want))
        elif draw < 0.003:
            one.turned[rng.integers(2)] = int(rng.choice([2**31 - 1, -(2**31), 0]))
        elif draw < 0.02:
            one.phase = int(rng.integers(9))
            one.since = one.still[0] = 2**32 - 1
        phases.add(int(one.phase))
        counters = rng.integers(0, 65536, size=2) if draw < 0.5 else [0, 0x8000]
        lib.tq_recorder_tick(one, [int(n) for n in counters], int(draw * 100) % 2, 1)
    assert len(phases) == 9
