"""A sensor at a serial port that sends lines (docs/serial-sensor.md)."""

from __future__ import annotations

import os
import time

from tactileq.modeling.errors import InputError
from tactileq.modeling.extras import extra
from tactileq.rig.devices.hand.sample import LOST_S, ConnectedDevice, DeviceLost, Sample
from tactileq.rig.devices.hand.serial_line import LineReader, SensorClock, SensorLine
from tactileq.rig.devices.hand.settings import HandSettings
from tactileq.rig.shared.live.clock import now_s, readable
from tactileq.rig.shared.wire.ports import opened_port, port_names, ports_listed

with extra("rig"):
    import serial

FIRST_LINE_S = 3.0  # many boards restart when their port is opened
_POLL_S = 0.001


class SerialSensor:
    """A serial port from which lines come.

    Parameters
    ----------
    port : serial.Serial
        Open, without waiting (timeout 0).
    """

    rest_s = LOST_S

    def __init__(self, port: serial.Serial) -> None:
        self.name = f"serial sensor at {port.port}"
        self._port = port
        self._lines = LineReader()
        self._clock = SensorClock()
        self._late = 0
        self._asked_s = now_s()
        self._line_s = self._fresh_s = self._asked_s  # of the last line, of the last fresh sample

    @classmethod
    def open(cls, settings: HandSettings) -> SerialSensor:
        """The sensor of these settings, once it has sent a line.

        Raises
        ------
        InputError
            Without the port, permission, or a line; or where another program reads it.
        """
        sensor = cls(opened_port(settings.device or _only_port(), settings.baud))
        try:
            sensor._wait_for_first(settings.baud)
        except BaseException:
            sensor.close()
            raise
        return sensor

    def wait(self, seconds: float) -> None:
        """Until bytes come."""
        if os.name == "posix":
            readable(self._port.fileno(), seconds)
        else:
            time.sleep(min(seconds, _POLL_S))

    def read(self) -> list[Sample]:
        """The samples of all whole lines, without those over 0.1 s old, which are counted.

        DeviceLost where for 0.1 s no good line came, or none that was not so old by the sensor's
        clock. Time in which this was not called says nothing about the sensor.
        """
        asked_s = now_s()
        if asked_s - self._asked_s > LOST_S:
            self._start_waiting(asked_s)
        self._asked_s = asked_s
        lines = self._lines.feed(self._received())
        arrived_s = now_s()
        samples = [_sample(line, self._clock.time_s(line.time_us, arrived_s)) for line in lines]
        fresh = [sample for sample in samples if arrived_s - sample.time_s <= LOST_S]
        self._late += len(samples) - len(fresh)
        if lines:
            self._line_s = asked_s
        if fresh:
            self._fresh_s = asked_s
        self._check_waiting(asked_s)
        return fresh

    def _start_waiting(self, since_s: float) -> None:
        self._line_s = self._fresh_s = since_s

    def _check_waiting(self, asked_s: float) -> None:
        if asked_s - self._line_s > LOST_S:
            raise DeviceLost(
                f"expected good lines from the {self.name}, got none for {LOST_S:g} s "
                f"({self._lines.bad} were damaged so far); check its cable, its power and its baud "
                "rate."
            )
        if asked_s - self._fresh_s > LOST_S:
            raise DeviceLost(
                f"expected a clock within {SensorClock.DRIFT:.1%} from the {self.name}, got one "
                "that falls behind; have TIME count microseconds of a crystal."
            )

    @property
    def firmware(self) -> str:
        """See `Device`."""
        return self._lines.firmware

    def counts(self) -> dict[str, int]:
        """Lines that were read, were damaged, are missing; of the first, those read too late."""
        found = self._lines
        return {
            "lines": found.good,
            "bad": found.bad,
            "missing": found.missing,
            "late": self._late,
        }

    def close(self) -> None:
        """Give the port back."""
        self._port.close()

    def _received(self) -> bytes:
        try:
            return bytes(self._port.read(65536))
        except (OSError, serial.SerialException):
            raise DeviceLost(f"the {self.name} was unplugged.") from None

    def _wait_for_first(self, baud: int) -> None:
        end_s = now_s() + FIRST_LINE_S
        while not self._lines.good:
            if now_s() > end_s:
                raise self._refused(baud)
            self.wait(0.05)
            try:
                self._lines.feed(self._received())
            except DeviceLost as lost:
                raise InputError(
                    f"expected a sensor that stays at its port, got an end: {lost}"
                ) from None
        self._asked_s = now_s()
        self._start_waiting(self._asked_s)

    def _refused(self, baud: int) -> InputError:
        if self._lines.bad:
            return InputError(
                f"expected lines with a matching CRC from the {self.name}, got "
                f"{self._lines.bad} without; check that it sends {baud} baud and the lines of "
                "docs/serial-sensor.md."
            )
        return InputError(
            f"expected lines from the {self.name} within {FIRST_LINE_S:g} s, got none; check its "
            f"program, its power and that it sends {baud} baud."
        )


def serial_ports() -> tuple[ConnectedDevice, ...]:
    """All serial ports, whatever is connected to them."""
    return tuple(
        ConnectedDevice(path, name, "serial", os.access(path, os.R_OK))
        for path, name in port_names()
    )


def _sample(line: SensorLine, time_s: float) -> Sample:
    force_n = None if line.force_mn is None else line.force_mn / 1000
    sample = Sample(time_s, force_n=force_n, contact=line.contact, button=line.button)
    moved_mm = [value / 1000 for value in line.moved_um]
    if len(moved_mm) == 1:
        return sample._replace(speed_mm_s=moved_mm[0])
    return sample._replace(x_mm=moved_mm[0], y_mm=moved_mm[1])


def _only_port() -> str:
    ports = port_names()
    if len(ports) != 1:
        raise InputError(
            f"expected one serial port, or device under [hand], got {ports_listed()}; plug the "
            "sensor in or name its port."
        )
    return ports[0][0]
