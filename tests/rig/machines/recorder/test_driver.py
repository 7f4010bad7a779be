"""The recorder over the wire, in virtual time: records, refusals, stops, hosts that are gone."""

from __future__ import annotations

import numpy as np
import pytest

from tactileq.modeling import InputError
from tactileq.modeling.arrays import Floats
from tactileq.rig.machines.board.virtual import TICK_HZ
from tactileq.rig.machines.recorder.driver import Recorder, RecordRefused, VirtualWire
from tactileq.rig.machines.recorder.law import RecorderLaw, WantedRecord
from tactileq.rig.machines.recorder.registers import (
    RecorderCause,
    RecorderCommand,
    RecorderSimulation,
    RecorderState,
    RecorderStatus,
)
from tactileq.rig.shared.wire.conversation import DeviceRefused
from tactileq.rig.shared.wire.transports import TransportLost

MIDDLE = WantedRecord(speed_mm_s=200.0, force_n=2.0)
HASTY = RecorderLaw(patience_s=1.5)
CAUSES = {
    RecorderSimulation.TABLE_STUCK: RecorderCause.STUCK,
    RecorderSimulation.ARM_STUCK: RecorderCause.STUCK,
    RecorderSimulation.SLIPPING: RecorderCause.SLIPS,
    RecorderSimulation.MOTOR: RecorderCause.NOT_WRITTEN,
    RecorderSimulation.NO_SAMPLE: RecorderCause.NO_TOUCH,
}
MOVES = [
    RecorderState.SPINS,
    RecorderState.LOWERS,
    RecorderState.SETTLES,
    RecorderState.RUNS_IN,
    RecorderState.RECORDS,
    RecorderState.LIFTS,
]


def currents(wire: VirtualWire) -> list[float]:
    return [wire.transport.board.given(axis) for axis in range(2)]


def run_to(wire: VirtualWire, state: RecorderState) -> None:
    """Begin a record, and go on until it is in this phase."""
    wire.write("Wanted", (200.0, 2.0, 40.0, 0.5, 1.0))
    wire.write("Command", RecorderCommand.START)
    for _ in range(5000):
        if wire.read("State") == state:
            return
        wire.pause(0.005)
    raise AssertionError(f"{state.name} was not reached")


def test_records_over_the_wire_hold_what_was_asked_for() -> None:
    """Judged by the mechanics' own means; the law is the one that was written."""
    recorder = Recorder(VirtualWire(), RecorderLaw())
    assert recorder.simulated
    for speed in (50.0, 350.0):
        for force in (0.5, 3.5):
            found = recorder.record(WantedRecord(speed_mm_s=speed, force_n=force))
            true_speed, true_force = recorder.emerged()
            assert found.speed_mm_s == pytest.approx(true_speed, rel=0.02)
            assert found.force_n == pytest.approx(true_force, rel=0.02)
            assert true_speed == pytest.approx(speed, rel=0.02)
            turned = (found.end_turn - found.start_turn) % 1
            expected = speed * 1.0 / (2 * np.pi * 40.0)
            assert turned == pytest.approx(expected % 1, abs=5e-3)


class Watching:
    """A sensor that has enough after some looks."""

    rate_hz = 1000.0

    def __init__(self, wire: VirtualWire, looks: int) -> None:
        self.wire, self.left = wire, looks
        self.seen: list[object] = []

    def hold_s(self, duration_s: float) -> float:
        return duration_s + 5.0

    def begin(self, duration_s: float) -> None:
        self.seen.append(self.wire.read("State"))

    def enough(self) -> bool:
        self.left -= 1
        return self.left == 0

    def samples(self, condition: object) -> Floats:
        raise NotImplementedError

    def clock_s(self) -> None:
        return None


def test_the_sensor_is_told_once_and_ends_the_record() -> None:
    wire = VirtualWire()
    recorder = Recorder(wire, RecorderLaw())
    sensor = Watching(wire, 10)
    whole = recorder.record(MIDDLE)
    found = recorder.record(MIDDLE, sensor)
    assert sensor.seen == [RecorderState.RECORDS]
    turned = (found.end_turn - found.start_turn) % 1
    assert turned == pytest.approx(200.0 * 0.55 / (2 * np.pi * 40.0), abs=0.05)
    assert found.duration_s < whole.duration_s


@pytest.mark.parametrize("state", [s for s in RecorderState if s != RecorderState.RECORDS])
def test_nothing_can_be_finished_but_a_record(state: RecorderState) -> None:
    wire = VirtualWire()
    recorder = Recorder(wire, HASTY)
    if state == RecorderState.FAILS:
        run_to(wire, RecorderState.SPINS)
        recorder.stop()
    elif state != RecorderState.RESTS:
        run_to(wire, state)
    with pytest.raises(DeviceRefused) as told:
        wire.write("Command", RecorderCommand.FINISH)
    assert told.value.status == RecorderStatus.STATE
    assert wire.read("State") == state


def test_a_sensor_that_fails_leaves_no_current() -> None:
    class Broken(Watching):
        def begin(self, duration_s: float) -> None:
            raise InputError("expected a cable, got none; plug it in.")

    wire = VirtualWire()
    recorder = Recorder(wire, RecorderLaw())
    with pytest.raises(InputError, match="cable"):
        recorder.record(MIDDLE, Broken(wire, 1))
    assert currents(wire) == [0.0, 0.0]
    assert recorder.record(MIDDLE).force_n == pytest.approx(2.0, rel=0.02)


@pytest.mark.parametrize("what", CAUSES)
def test_a_recorder_that_goes_wrong_refuses_and_is_usable_once_mended(
    what: RecorderSimulation,
) -> None:
    wire = VirtualWire()
    recorder = Recorder(wire, HASTY)
    assert recorder.record(MIDDLE).force_n == pytest.approx(2.0, rel=0.02)
    recorder.spoil(what)
    with pytest.raises(RecordRefused) as told:
        recorder.record(MIDDLE)
    assert told.value.cause == CAUSES[what]
    assert currents(wire) == [0.0, 0.0]
    recorder.spoil(RecorderSimulation.NONE)
    for _ in range(120):  # it runs down
        wire.pause(0.09)
    assert recorder.record(MIDDLE).force_n == pytest.approx(2.0, rel=0.02)


@pytest.mark.parametrize("state", MOVES)
def test_a_stop_ends_every_phase_without_current(state: RecorderState) -> None:
    wire = VirtualWire()
    Recorder(wire, HASTY)
    run_to(wire, state)
    wire.write("Command", RecorderCommand.STOP)
    assert wire.read("State") == RecorderState.FAILS
    assert wire.read("Cause") == RecorderCause.STOPPED
    wire.pause(0.01)
    assert currents(wire) == [0.0, 0.0]
    with pytest.raises(DeviceRefused) as told:  # latched
        wire.write("Command", RecorderCommand.START)
    assert told.value.status == RecorderStatus.STATE


@pytest.mark.parametrize("state", MOVES)
def test_a_host_that_is_gone_costs_a_tenth_of_a_second(state: RecorderState) -> None:
    wire = VirtualWire()
    Recorder(wire, HASTY)
    run_to(wire, state)
    wire.transport.step(TICK_HZ // 5)
    assert currents(wire) == [0.0, 0.0]
    assert wire.read("Cause") == RecorderCause.LINK
    fault, heard, zero = (wire.read(name) for name in ("FaultTick", "HeardTick", "ZeroTick"))
    assert fault - heard == TICK_HZ // 10 + 1  # type: ignore[operator]
    assert zero == fault


def test_a_control_loop_that_hangs_is_noticed() -> None:
    wire = VirtualWire()
    Recorder(wire, HASTY)
    run_to(wire, RecorderState.SPINS)
    begun_s = wire.transport.now_s()
    while wire.read("State") not in (RecorderState.FAILS, RecorderState.RECORDED):
        wire.transport.step(50)
    assert wire.read("Cause") == RecorderCause.HEARTBEAT
    assert wire.transport.now_s() - begun_s == pytest.approx(1.0, abs=0.1)


def test_a_processor_that_starts_anew_moves_nothing() -> None:
    wire = VirtualWire()
    recorder = Recorder(wire, HASTY)
    run_to(wire, RecorderState.SETTLES)
    recorder.spoil(RecorderSimulation.BROWN_OUT)
    with pytest.raises(TransportLost):
        [*map(wire.read, ["State"] * 3)]
    assert currents(wire) == [0.0, 0.0]


def test_numbers_that_no_motor_has_are_refused_before_they_are_sent() -> None:
    wire = VirtualWire()
    with pytest.raises(InputError):
        wire.write("Wanted", (200.0, float("nan"), 40.0, 1.0, 1.0))
    with pytest.raises(DeviceRefused) as told:
        wire.write("CurrentLimits", (1.0, 2.0, 10.0))  # nominal above the largest
    assert told.value.status == RecorderStatus.RANGE
