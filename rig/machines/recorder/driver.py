"""A recorder that is asked for one record after another (docs/recorder.md#a-record)."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import Protocol

from tactileq.modeling.errors import InputError
from tactileq.rig.machines.board.virtual import TICK_HZ, VirtualBoard, VirtualTransport
from tactileq.rig.machines.recorder.definition import RECORDER
from tactileq.rig.machines.recorder.law import RecorderLaw, WantedRecord
from tactileq.rig.machines.recorder.registers import (
    RecorderCause,
    RecorderCommand,
    RecorderSimulation,
    RecorderState,
    RecorderStatus,
)
from tactileq.rig.machines.recorder.sensors import Sensor
from tactileq.rig.machines.recorder.virtual import compiled_recorder
from tactileq.rig.shared.live.clock import sleep
from tactileq.rig.shared.wire.conversation import Conversation, DeviceRefused
from tactileq.rig.shared.wire.definition import Value
from tactileq.rig.shared.wire.link import Link

LOOK_S = 0.05
SLACK_S = 5.0  # beyond the patience of all phases


class RecorderWire(Protocol):
    """What a driver needs of the wire."""

    def read(self, name: str) -> Value:
        """What a register holds."""

    def write(self, name: str, value: Value) -> Value:
        """Write a register; the value that was applied."""

    def pause(self, seconds: float) -> None:
        """Let time pass with heartbeats."""


class VirtualWire:
    """A simulated recorder in virtual time.

    Parameters
    ----------
    entropy : int
        Of the board's start.
    """

    def __init__(self, *, entropy: int = 1) -> None:
        self.transport = VirtualTransport(VirtualBoard(compiled_recorder(), entropy=entropy))
        self._talk = Conversation(self.transport, RECORDER)
        self._talk.hello()

    def read(self, name: str) -> Value:
        """See `RecorderWire`."""
        return self._talk.read(name)

    def write(self, name: str, value: Value) -> Value:
        """See `RecorderWire`."""
        return self._talk.write(name, value)

    def pause(self, seconds: float) -> None:
        """See `RecorderWire`."""
        self._talk.write("Heartbeat", 1)
        self.transport.step(round(seconds * TICK_HZ))


class LinkedWire:
    """A recorder at the other end of a link, in real time.

    Parameters
    ----------
    link : Link
        Open.
    """

    def __init__(self, link: Link) -> None:
        self._link = link

    def read(self, name: str) -> Value:
        """See `RecorderWire`."""
        return self._link.read(name)

    def write(self, name: str, value: Value) -> Value:
        """See `RecorderWire`."""
        return self._link.write(name, value)

    def pause(self, seconds: float) -> None:
        """See `RecorderWire`."""
        self._link.beat()
        sleep(seconds)


@dataclass(frozen=True, kw_only=True)
class DriverRecord:
    """What the recorder says of a record.

    Parameters
    ----------
    speed_mm_s, force_n, speed_sd_mm_s, force_sd_n : float
        Means and standard deviations of its estimates.
    start_turn, end_turn : float
        Place of the ball on the sample, turns since the index, 0 … 1.
    hottest_a2_s, duration_s : float
        Largest heat of a motor; duration with all phases.
    """

    wanted: WantedRecord
    speed_mm_s: float
    force_n: float
    speed_sd_mm_s: float
    force_sd_n: float
    start_turn: float
    end_turn: float
    hottest_a2_s: float
    duration_s: float


class RecordRefused(InputError):
    """A record that must not be used; `cause` says why."""

    def __init__(self, sentence: str, cause: RecorderCause) -> None:
        super().__init__(sentence)
        self.cause = cause


class Recorder:
    """A recorder that is ready.

    Parameters
    ----------
    wire : RecorderWire
    law : RecorderLaw
        Is written to it.
    """

    def __init__(self, wire: RecorderWire, law: RecorderLaw) -> None:
        self._wire, self.law = wire, law
        self._write_law()

    def _write_law(self) -> None:
        for name, value in self.law.registers().items():
            self._wire.write(name, value)

    @property
    def simulated(self) -> bool:
        """Whether there is no recorder."""
        return bool(self._wire.read("Simulated"))

    @property
    def state(self) -> RecorderState:
        """Of the present record."""
        return RecorderState(self._number("State"))

    def emerged(self) -> tuple[float, float]:
        """Of a simulated recorder: true mean speed (mm/s) and force (N) of the last record."""
        speed, force = self._wire.read("Emerged")  # type: ignore[misc]
        return speed, force

    def spoil(self, what: RecorderSimulation) -> None:
        """Something goes wrong with a simulated recorder."""
        self._wire.write("Simulate", what)

    def stop(self) -> None:
        """No current from now on."""
        self._wire.write("Command", RecorderCommand.STOP)

    def clock_s(self) -> float:
        """How long the recorder has been on, modulo 2³² ticks."""
        return self._number("Tick") / TICK_HZ

    def record(self, wanted: WantedRecord, sensor: Sensor | None = None) -> DriverRecord:
        """One record; after a failure the recorder is ready for the next one.

        Parameters
        ----------
        sensor : Sensor, optional
            Begins once speed and force are held; they are held until it has enough.

        Raises
        ------
        RecordRefused
            Where speed or force were not held, or something is wrong with the recorder.
        InputError
            Of the sensor; then no current flows any more.
        """
        if self.state not in (RecorderState.RESTS, RecorderState.RECORDED):
            self._wire.write("Command", RecorderCommand.CLEAR)
        self._write_law()  # one that has started anew has forgotten it
        hold_s = wanted.duration_s if sensor is None else sensor.hold_s(wanted.duration_s)
        row = (wanted.speed_mm_s, wanted.force_n, self.law.radius_mm)
        self._wire.write("Wanted", (*row, wanted.run_in_s, hold_s))
        try:
            self._wire.write("Command", RecorderCommand.START)
        except DeviceRefused as refused:  # it failed just now
            if refused.status != RecorderStatus.STATE:
                raise
        number = self._number("Number")
        try:
            self._wait(3 * self.law.patience_s + wanted.run_in_s + hold_s + SLACK_S, wanted, sensor)
        except BaseException:
            with suppress(InputError):
                self.stop()
            raise
        return self._found(wanted, number)

    def _wait(self, patience_s: float, wanted: WantedRecord, sensor: Sensor | None) -> None:
        """Until the record is done or failed."""
        began = finished = sensor is None
        for _ in range(round(patience_s / LOOK_S)):
            self._wire.pause(LOOK_S)
            state = self.state
            if state in (RecorderState.RECORDED, RecorderState.FAILS, RecorderState.RESTS):
                return
            if sensor is None or state != RecorderState.RECORDS:
                continue
            if not began:
                began = True
                sensor.begin(wanted.duration_s)
            elif not finished and sensor.enough():
                finished = True
                self._finish()

    def _finish(self) -> None:
        try:
            self._wire.write("Command", RecorderCommand.FINISH)
        except DeviceRefused as refused:  # it has ended just now
            if refused.status != RecorderStatus.STATE:
                raise

    def _found(self, wanted: WantedRecord, number: int) -> DriverRecord:
        cause = RecorderCause(self._number("Cause"))
        state = self.state
        if state == RecorderState.RECORDED and self._number("Number") != number:
            cause = RecorderCause.HOST
        elif state not in (RecorderState.RECORDED, RecorderState.FAILS):
            cause = RecorderCause.STOPPED
        if cause != RecorderCause.NONE:
            if state == RecorderState.FAILS:
                self._wire.write("Command", RecorderCommand.CLEAR)
            raise RecordRefused(
                f"expected a record of {wanted.speed_mm_s:g} mm/s and {wanted.force_n:g} N, got a "
                f"refusal of the recorder ({_MEANINGS[cause.name]}); mend that, then record again.",
                cause,
            )
        speed, force, speed_sd, force_sd, start, end, hottest, duration = self._wire.read("Found")  # type: ignore[misc]
        return DriverRecord(
            wanted=wanted,
            speed_mm_s=speed,
            force_n=force,
            speed_sd_mm_s=speed_sd,
            force_sd_n=force_sd,
            start_turn=start,
            end_turn=end,
            hottest_a2_s=hottest,
            duration_s=duration,
        )

    def _number(self, name: str) -> int:
        value = self._wire.read(name)
        assert isinstance(value, int)
        return value


_MEANINGS = {name: said for name, (_, said) in RECORDER.masks["Cause"].members.items()}
