"""A serial sensor at a pseudo-terminal: a micro-controller as far as its lines tell."""

from __future__ import annotations

import os
import threading
import tty
from collections.abc import Callable
from contextlib import suppress
from itertools import count

from tactileq.rig.devices.hand.serial_line import SensorLine, crc, encode
from tactileq.rig.shared.live.clock import now_s, sleep, taking_part

PERIOD_US = 2000


def at_constant_speed(number: int) -> bytes:
    """100 mm/s, 1.5 N; the clock wraps around after half a second."""
    time_us = (2**32 - 500_000 + number * PERIOD_US) % 2**32
    line = SensorLine(
        number % 2**16, time_us, (number * 200, 0), 1500, contact=True, button=number % 100 > 50
    )
    return encode(line)


def firmware_line(version: bytes) -> bytes:
    """By docs/serial-sensor.md."""
    return b"$F,%b*%04X\r\n" % (version, crc(b"F," + version))


def stating(version: bytes) -> Callable[[int], bytes]:
    """Lines at constant speed; of every 250 one says which firmware the board has."""
    told = firmware_line(version)
    return lambda number: told * (number % 250 == 40) + at_constant_speed(number)


class Board:
    """A micro-controller that sends lines at the other end of a pseudo-terminal."""

    def __init__(self) -> None:
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.path = os.ttyname(self._slave)
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    def write(self, text: bytes) -> None:
        """Send; as by a real one, what nobody reads in time is lost."""
        with suppress(BlockingIOError):
            os.write(self._master, text)

    def send(self, line: Callable[[int], bytes]) -> None:
        """Send line 0, 1, 2 … every 2 ms, until `quiet` or `unplug`."""
        self.quiet()
        self._stop.clear()
        self._thread = threading.Thread(target=self._run, args=(line,), daemon=True)
        self._thread.start()

    def _run(self, line: Callable[[int], bytes]) -> None:
        start_s = now_s()
        with taking_part():
            for number in count():
                sleep(start_s + number * PERIOD_US * 1e-6 - now_s())
                if self._stop.is_set():
                    return
                self.write(line(number))

    def quiet(self) -> None:
        self._stop.set()
        if self._thread is not None:
            self._thread.join()

    def unplug(self) -> None:
        self.quiet()
        for end in (self._master, self._slave):
            with suppress(OSError):
                os.close(end)
