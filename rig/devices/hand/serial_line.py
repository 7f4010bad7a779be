"""The lines of a serial sensor: bytes to lines and back, no port (docs/serial-sensor.md).

The same in C, for a micro-controller: docs/serial-sensor/line.h.
"""

from __future__ import annotations

import re
from binascii import crc_hqx
from collections import deque
from typing import NamedTuple

LONGEST_LINE = 80  # bytes, without its end
CONTACT, BUTTON = 1, 2
NUMBERS = 2**16
CLOCK_US = 2**32
_LARGEST = 2**31 - 1

_FIRMWARE = re.compile(rb"\$(F,([ -#%-)+-~]{1,40}))\*([0-9A-F]{4})\r?")  # no $, no *
_FRAME = re.compile(rb"\$([PV](?:,(?:-?\d{1,10})?){5,6})\*([0-9A-F]{4})\r?")


class SensorLine(NamedTuple):
    """What one line says: a position or a speed, and the force.

    Parameters
    ----------
    number : int
        Count of the line, modulo 65 536.
    time_us : int
        The sensor's clock, modulo 2³².
    moved_um : tuple of int
        Position x, y (µm) or signed speed (µm/s): two numbers or one, within ±(2³¹ − 1).
    force_mn : int or None
        Within ±(2³¹ − 1); None where the sensor measures none.
    """

    number: int
    time_us: int
    moved_um: tuple[int, ...]
    force_mn: int | None
    contact: bool
    button: bool


def encode(line: SensorLine) -> bytes:
    """The bytes of a line, its end included."""
    head = "PV"[len(line.moved_um) == 1]
    moved = ",".join(map(str, line.moved_um))
    force = "" if line.force_mn is None else line.force_mn
    flags = CONTACT * line.contact | BUTTON * line.button
    text = f"{head},{line.number},{line.time_us},{moved},{force},{flags}".encode()
    return b"$%b*%04X\r\n" % (text, crc(text))


def decode(frame: bytes) -> SensorLine | None:
    """What the bytes of a line say, from $ on and without \\n; None where they are damaged."""
    found = _FRAME.fullmatch(frame)
    if found is None or int(found[2], 16) != crc(found[1]):
        return None
    head, *cells = found[1].split(b",")
    *measured, force, flags = cells
    if len(measured) != {b"P": 4, b"V": 3}[head] or not all(measured) or not flags:
        return None
    line = SensorLine(
        int(measured[0]),
        int(measured[1]),
        tuple(map(int, measured[2:])),
        force_mn=int(force) if force else None,
        contact=bool(int(flags) & CONTACT),
        button=bool(int(flags) & BUTTON),
    )
    return line if _is_inside(line) and 0 <= int(flags) <= CONTACT | BUTTON else None


def decode_firmware(frame: bytes) -> str:
    """The version that a line of the kind F states; empty where it is none, or is damaged."""
    found = _FIRMWARE.fullmatch(frame)
    return found[2].decode().strip() if found and int(found[3], 16) == crc(found[1]) else ""


def _is_inside(line: SensorLine) -> bool:
    return (
        0 <= line.number < NUMBERS
        and 0 <= line.time_us < CLOCK_US
        and all(abs(value) <= _LARGEST for value in (*line.moved_um, line.force_mn or 0))
    )


def crc(text: bytes) -> int:
    """CRC-16/XMODEM: polynomial 0x1021, from 0, not reflected; 0x31C3 for b"123456789"."""
    return crc_hqx(text, 0)


class LineReader:
    """Finds lines in a stream of bytes, whatever else is in it.

    Attributes
    ----------
    good, bad, missing : int
        Lines that were read; that were damaged; that are missing, as the numbers of the others say.
        What comes before the first line end, in the middle of a line, is not counted.
    firmware : str
        What the sensor stated last; empty before.
    """

    def __init__(self) -> None:
        self.good = self.bad = self.missing = 0
        self.firmware = ""
        self._rest = b""
        self._began = False
        self._last: int | None = None

    def feed(self, piece: bytes) -> list[SensorLine]:
        """The lines that end in this piece of the stream, however it is cut."""
        *ended, rest = (self._rest + piece).split(b"\n")
        self._rest = rest[-LONGEST_LINE:]  # of what never ends no more is kept
        lines = [self._line(text[-LONGEST_LINE:]) for text in ended]
        return [line for line in lines if line is not None]

    def _line(self, text: bytes) -> SensorLine | None:
        frame = text[max(text.rfind(b"$"), 0) :]
        line = decode(frame)
        if line is None and (stated := decode_firmware(frame)):
            self.firmware = stated
        elif line is None:
            self.bad += self._began and bool(text.strip())
        else:
            self.good += 1
            self._count_missing(line.number)
        self._began = True
        return line

    def _count_missing(self, number: int) -> None:
        step = 1 if self._last is None else (number - self._last) % NUMBERS
        # A step of half the circle or more is a step back: the sensor has restarted.
        if 1 < step < NUMBERS // 2:
            self.missing += step - 1
        self._last = number


class SensorClock:
    """From a sensor's clock, which wraps around and drifts, to that of the rig.

    A line arrives after it was written, never before. So the clocks' relation is a straight line
    that no arrival lies below: the edge of the lower convex hull of arrivals that spans the middle
    of the last half minute (Zhang, Liu and Xia 2002, "Clock synchronization algorithms for network
    measurements", IEEE INFOCOM). Its slope is that of a clock within `DRIFT`; in the first second,
    which says too little of it, the sensor's clock is taken to be that slow.
    """

    DRIFT = 0.005  # that of a ceramic resonator; a crystal's is a hundredth of it
    SPAN_S = 30.0
    SETTLED_S = 1.0
    MOST = 64  # corners of the hull; usually there are a few

    def __init__(self) -> None:
        self._last_us: int | None = None
        self._elapsed_us = 0
        self._hull: deque[tuple[float, float]] = deque()  # elapsed time, how much later it arrived

    def time_s(self, time_us: int, arrived_s: float) -> float:
        """When a line was written, on the clock on which it arrived."""
        step_us = 0 if self._last_us is None else (time_us - self._last_us) % CLOCK_US
        if self._last_us is None or step_us >= CLOCK_US // 2:  # restarted
            self._elapsed_us = 0
            self._hull.clear()
        else:
            self._elapsed_us += step_us
        self._last_us = time_us
        elapsed_s = self._elapsed_us * 1e-6
        self._add(elapsed_s, arrived_s - elapsed_s)
        drift = self._drift()
        offset_s = min(later_s - drift * at_s for at_s, later_s in self._hull)
        return min(elapsed_s + offset_s + drift * elapsed_s, arrived_s)

    def _add(self, at_s: float, later_s: float) -> None:
        hull = self._hull
        if hull and at_s <= hull[-1][0]:
            if later_s >= hull[-1][1]:
                return
            hull.pop()
        while len(hull) > 1 and _is_above(hull[-1], hull[-2], (at_s, later_s)):
            hull.pop()
        hull.append((at_s, later_s))
        while len(hull) > 1 and self._is_of_no_use(at_s):
            hull.popleft()

    def _is_of_no_use(self, at_s: float) -> bool:
        """Whether the oldest arrival is too old, or of before a step of the sensor's clock."""
        (t0, later0), (t1, later1) = self._hull[0], self._hull[1]
        stepped = later1 - later0 < -self.DRIFT * (t1 - t0)
        return stepped or t1 < at_s - self.SPAN_S or len(self._hull) > self.MOST

    def _drift(self) -> float:
        """Seconds by which the sensor's clock falls behind in one of its own."""
        hull = self._hull
        (first_s, _), (last_s, _) = hull[0], hull[-1]
        if last_s - first_s < self.SETTLED_S:
            return self.DRIFT
        middle_s = (first_s + last_s) / 2
        for index in range(1, len(hull)):
            (t0, later0), (t1, later1) = hull[index - 1], hull[index]
            if t1 >= middle_s:
                break
        return min(max((later1 - later0) / (t1 - t0), -self.DRIFT), self.DRIFT)


def _is_above(
    point: tuple[float, float], before: tuple[float, float], after: tuple[float, float]
) -> bool:
    """Whether a point lies on or above the line between two others."""
    (x0, y0), (x, y), (x1, y1) = before, point, after
    return (y - y0) * (x1 - x0) >= (y1 - y0) * (x - x0)
