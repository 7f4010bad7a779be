"""A serial sensor at a pseudo-terminal: lines to readings, and every way to be lost."""

from __future__ import annotations

import os
import re
import signal
from collections.abc import Callable, Iterator
from contextlib import suppress

import numpy as np
import pytest

from tactileq.modeling import InputError
from tactileq.rig.devices.hand import serial_sensor
from tactileq.rig.devices.hand.loop import HandLoop
from tactileq.rig.devices.hand.reader import HandReader
from tactileq.rig.devices.hand.sample import DeviceLost
from tactileq.rig.devices.hand.serial_line import SensorLine, encode
from tactileq.rig.devices.hand.serial_sensor import SerialSensor
from tactileq.rig.devices.hand.settings import HandSettings
from tactileq.rig.shared.live.clock import sleep
from tactileq.rig.shared.live.memory import BUTTON, CONTACT, FORCE_ASSUMED, GONE, Live
from tactileq.rig.shared.wire import ports
from tests.refusals import refused
from tests.rig.devices.hand.board import PERIOD_US, Board, at_constant_speed, stating
from tests.rig.waiting import is_gone, wait_until


@pytest.fixture
def board(given_clock: None) -> Iterator[Board]:
    board = Board()
    yield board
    board.unplug()


@pytest.fixture
def live() -> Iterator[Live]:
    with Live.create() as memory:
        yield memory


def settings_of(board: Board, **others: float) -> HandSettings:
    return HandSettings(kind="serial", device=board.path, **others)  # type: ignore[arg-type]


def at_four_fifths(number: int) -> bytes:
    """Of a clock that is slow by a fifth."""
    time_us = number * PERIOD_US * 4 // 5
    return encode(SensorLine(number % 2**16, time_us, (0, 0), 1500, contact=True, button=False))


class ScriptedPort:
    """A port whose other end sends a line every 2 ms; its clock goes on where the test says so."""

    port = "scripted"
    ROOM = 4096  # what nobody has read beyond it is lost

    def __init__(self, monkeypatch: pytest.MonkeyPatch, line: Callable[[int], bytes]) -> None:
        self.now_s, self.sent, self.speaks = 0.0, 0, True
        self._line, self.waits, self._whole_s = line, b"", list[float]()
        self.whole = self.late = self.torn = 0  # lines that were read, that were over 0.1 s old
        monkeypatch.setattr(serial_sensor, "now_s", lambda: self.now_s)

    def read(self, size: int) -> bytes:
        waited, self.waits = self.waits, b""
        self.whole += len(self._whole_s)
        self.late += sum(self.now_s - sent_s > 0.1 for sent_s in self._whole_s)
        self._whole_s = []
        return waited

    def pass_by(self, seconds: float) -> None:
        """Time in which nobody reads."""
        self.now_s += seconds
        while (sent_s := self.sent * PERIOD_US * 1e-6) <= self.now_s:
            line = self._line(self.sent) if self.speaks else b""
            fits = line[: self.ROOM - len(self.waits)]
            if fits and fits == line:
                self._whole_s.append(sent_s)
            self.torn += 0 < len(fits) < len(line)
            self.waits += fits
            self.sent += 1


def read_for(sensor: SerialSensor, port: ScriptedPort, seconds: float) -> list[tuple[float, float]]:
    """Ages of the samples when they are read (s), and how far their positions are off (mm)."""
    found, end_s = [], port.now_s + seconds
    while port.now_s < end_s:
        port.pass_by(0.002)
        for sample in sensor.read():
            found.append((port.now_s - sample.time_s, sample.x_mm - 100 * sample.time_s))
    return found


def test_what_waited_while_the_computer_was_held_up_is_dropped_and_counted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    port = ScriptedPort(monkeypatch, at_constant_speed)
    sensor = SerialSensor(port)  # type: ignore[arg-type]
    found = read_for(sensor, port, 1.0)
    for stall_s in (*[0.4] * 7, 3.0, *np.random.default_rng(3).uniform(0.01, 1.0, 20)):
        port.pass_by(stall_s)
        found += read_for(sensor, port, 0.05)
        # The clock is let grow by 0.5 % of what waited: a line more or less of each time.
        assert sensor.counts()["late"] == pytest.approx(port.late, rel=0.01)
    ages_s, off_mm = np.transpose(found)
    assert 0 <= ages_s.min() <= ages_s.max() <= 0.1
    assert np.abs(off_mm).max() < 0.3  # 2 ms between two reads, and 0.5 % of what waited
    told = sensor.counts()
    assert told["late"] > 1000
    assert told["lines"] == port.whole
    assert told["lines"] + told["missing"] == port.sent
    assert port.torn > 20
    assert told["bad"] <= port.torn  # none where the next line's $ follows


def test_after_it_was_held_up_a_silent_sensor_and_a_slow_clock_are_told_as_ever(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    port = ScriptedPort(monkeypatch, at_constant_speed)
    sensor = SerialSensor(port)  # type: ignore[arg-type]
    read_for(sensor, port, 0.5)
    port.speaks = False
    port.pass_by(0.4)
    began_s = port.now_s
    with refused(DeviceLost, names="scripted", got="0.1 s"):
        read_for(sensor, port, 1.0)
    assert port.now_s - began_s == pytest.approx(0.1, abs=0.005)
    port = ScriptedPort(monkeypatch, at_four_fifths)
    sensor = SerialSensor(port)  # type: ignore[arg-type]

    def read_with_stalls() -> None:
        for _ in range(10):
            read_for(sensor, port, 0.3)
            port.pass_by(0.4)

    with refused(DeviceLost, names="scripted", expected=["clock", "0.5%"]):
        read_with_stalls()
    assert sensor.counts()["lines"] > 100


def five_at_once(number: int) -> bytes:
    """2500 lines a second: in 0.4 s more than a pseudo-terminal has room for."""
    lines = (
        SensorLine(n % 2**16, n * PERIOD_US // 5, (0, 0), 1500, contact=True, button=False)
        for n in range(5 * number, 5 * number + 5)
    )
    return b"".join(map(encode, lines))


def hold_up(reader: HandReader, live: Live, *, seconds: float) -> list[str]:
    """Stop the hand's process, let it go on, and wait for readings; what was told meanwhile."""
    assert reader.pid is not None
    os.kill(reader.pid, signal.SIGSTOP)
    sleep(seconds)
    written, told = live.readings_written, list[str]()
    os.kill(reader.pid, signal.SIGCONT)
    wait_until(lambda: bool(told.extend(reader.faults()) or told))
    wait_until(lambda: live.readings_written > written + 50)
    return told


def test_held_up_again_and_again_the_hands_process_blames_no_clock(
    board: Board, live: Live
) -> None:
    board.send(five_at_once)
    with HandReader(live, settings_of(board)) as reader:
        wait_until(lambda: live.readings_written > 50)
        first = reader.pid
        told = [fault for _ in range(3) for fault in hold_up(reader, live, seconds=0.4)]
        wait_until(lambda: not is_gone(live))
        assert reader.pid == first
        wait_until(lambda: reader.counts()["missing"] > 0)
    late = r"expected the readings of the serial sensor at .*, got \d+ that came later and were"
    assert any(re.match(late, fault) for fault in told)
    # The board's thread may be held up, too: then it was silent.
    assert all(re.match(late, fault) or "got none for 0.1 s" in fault for fault in told)


def test_positions_become_speed_and_force_across_the_wrap_of_the_clock(
    board: Board, live: Live
) -> None:
    board.send(at_constant_speed)
    with HandReader(live, settings_of(board)) as reader:
        assert reader.device_name == f"serial sensor at {board.path}"
        wait_until(lambda: reader.counts().get("lines", 0) > 700)
        _, rows = live.readings_since(0)
        assert reader.counts()["bad"] == 0
        assert reader.counts()["missing"] == 0
    rows = rows[rows["flags"] & GONE == 0]  # a board that is held up for 0.1 s counts as gone
    after = rows[rows["time_s"] > rows["time_s"][0] + 0.6]  # the clock has wrapped around
    assert np.median(after["speed_mm_s"]) == pytest.approx(100, rel=0.02)
    assert set(after["force_n"]) == {1.5}
    assert set(after["flags"]) == {CONTACT, CONTACT | BUTTON}


def test_the_firmware_that_a_sensor_states_is_told(board: Board, live: Live) -> None:
    board.send(stating(b"wheel 1.0"))
    with HandReader(live, settings_of(board)) as reader:
        assert reader.firmware() == "wheel 1.0"
        assert reader.counts().get("bad", 0) == reader.counts().get("missing", 0) == 0
        board.send(stating(b"wheel 1.1"))  # started anew, with another program
        wait_until(lambda: reader.firmware() == "wheel 1.1")
        board.send(at_constant_speed)
        reader.unplug()
        wait_until(lambda: is_gone(live))
        reader.unplug(False)
        wait_until(lambda: reader.firmware() == "")


def test_a_sensor_that_states_no_firmware_has_none(board: Board, live: Live) -> None:
    board.send(at_constant_speed)
    with HandReader(live, settings_of(board)) as reader:
        assert reader.firmware() == ""
        assert reader.counts().get("bad", 0) == 0


def test_a_speed_is_taken_as_it_is(board: Board, live: Live) -> None:
    board.send(
        lambda n: encode(SensorLine(n, n * 2000, (-80_000,), None, contact=True, button=False))
    )
    with HandReader(live, settings_of(board, assumed_force_n=2.0)):
        wait_until(lambda: live.readings_written > 20)
        latest = live.latest()
        assert latest is not None
        assert latest["speed_mm_s"] == -80
        assert latest["force_n"] == 2
        assert latest["flags"] == CONTACT | FORCE_ASSUMED
        assert np.isnan(latest["x_mm"])


def test_a_force_that_is_neither_measured_nor_assumed_is_said(board: Board, live: Live) -> None:
    board.send(lambda n: encode(SensorLine(n, n * 2000, (1,), None, contact=True, button=False)))
    with HandReader(live, settings_of(board)) as reader:
        faults: list[str] = []
        wait_until(lambda: bool(faults.extend(reader.faults()) or faults))
        assert "expected force from the device of the hand, got none" in faults[0]
        wait_until(lambda: is_gone(live))
        written = live.readings_written
        wait_until(lambda: live.readings_written > written + 600)  # meanwhile it is opened again
        assert reader.faults() == ()


def test_a_force_below_the_least_is_no_contact(board: Board, live: Live) -> None:
    board.send(lambda n: encode(SensorLine(n, n * 2000, (9,), 40, contact=True, button=False)))
    with HandReader(live, settings_of(board)):
        wait_until(lambda: live.readings_written > 20)
        latest = live.latest()
        assert latest is not None
        assert (latest["force_n"], latest["flags"]) == (0, 0)


def test_unplugged_it_is_gone_and_said_once(board: Board, live: Live) -> None:
    board.send(at_constant_speed)
    with HandReader(live, settings_of(board)) as reader:
        wait_until(lambda: live.readings_written > 50)
        board.unplug()
        wait_until(lambda: is_gone(live))
        written = live.readings_written
        wait_until(lambda: live.readings_written > written + 300)  # one attempt at least
        assert reader.faults()[-1] == f"the serial sensor at {board.path} was unplugged."


def test_silent_it_is_gone_and_comes_back(board: Board, live: Live) -> None:
    board.send(at_constant_speed)
    with HandReader(live, settings_of(board)) as reader:
        wait_until(lambda: live.readings_written > 50)
        board.quiet()
        wait_until(lambda: is_gone(live))
        first = reader.pid
        written = live.readings_written
        wait_until(lambda: live.readings_written > written + 800)  # also while it is opened again
        told = f"expected good lines from the serial sensor at {board.path}, got none"
        assert any(told in fault for fault in reader.faults())
        board.send(at_constant_speed)
        wait_until(lambda: not is_gone(live))
        assert reader.pid == first


def test_two_readers_of_one_port_are_refused(board: Board, live: Live) -> None:
    board.send(at_constant_speed)
    first = SerialSensor.open(settings_of(board))
    second = HandReader(live, settings_of(board))
    with refused(InputError, expected=board.path):
        second.open()
    first.close()
    second.open()
    second.close()


def test_damaged_and_missing_lines_are_counted_and_survived(board: Board) -> None:
    def damaged(number: int) -> bytes:
        if number % 10 == 3:
            return b""
        line = at_constant_speed(number)
        return line.replace(b"$", b"#") if number % 10 == 7 else line

    board.send(damaged)
    sensor = SerialSensor.open(settings_of(board))
    with suppress(DeviceLost):
        while sensor.counts()["lines"] < 100:
            sensor.wait(0.1)
            assert all(sample.force_n == 1.5 for sample in sensor.read())
    sensor.close()
    told = sensor.counts()
    assert told["bad"] == pytest.approx(told["lines"] / 8, abs=3)
    assert told["missing"] == pytest.approx(2 * told["lines"] / 8, abs=4)


@pytest.mark.parametrize(
    ("line", "expected", "got"),
    [
        (lambda n: b"", "0.3 s", ["none", "115200 baud"]),
        (lambda n: b"hello world\r\n", "CRC", "115200 baud"),
        (lambda n: at_constant_speed(n).replace(b",1500,", b",1501,"), "CRC", "115200 baud"),
    ],
)
def test_a_board_that_sends_no_good_line_is_refused(
    board: Board,
    monkeypatch: pytest.MonkeyPatch,
    line: Callable[[int], bytes],
    expected: str,
    got: object,
) -> None:
    monkeypatch.setattr(serial_sensor, "FIRST_LINE_S", 0.3)
    board.send(line)
    with refused(InputError, names=board.path, expected=expected, got=got):
        SerialSensor.open(settings_of(board))


def test_ports_that_cannot_be_opened_are_refused(
    tmp_path: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ports, "port_names", lambda: (("/dev/ttyX", "a board"),))
    with refused(InputError, expected="/dev/ttyNONE", got=["nothing", "/dev/ttyX", "a board"]):
        SerialSensor.open(HandSettings(kind="serial", device="/dev/ttyNONE"))
    with refused(InputError, expected="/dev/null", got="Could not configure port"):
        SerialSensor.open(HandSettings(kind="serial", device="/dev/null"))
    monkeypatch.setattr(serial_sensor, "port_names", lambda: ())
    monkeypatch.setattr(ports, "port_names", lambda: ())
    with refused(InputError, expected=["serial port", "[hand]"], got="none"):
        SerialSensor.open(HandSettings(kind="serial"))


@pytest.mark.parametrize(
    ("raised", "expected", "got"),
    [
        (PermissionError(13, "denied"), "permission", "`sudo usermod -aG dialout $USER`"),
        (ValueError("Invalid baud rate: 1234"), "baud rate", [115200, 500000]),
    ],
)
def test_what_the_system_refuses_is_said_with_what_to_do(
    board: Board, monkeypatch: pytest.MonkeyPatch, raised: Exception, expected: str, got: object
) -> None:
    def refuse(*arguments: object, **options: object) -> None:
        raise raised

    monkeypatch.setattr(ports.serial, "Serial", refuse)
    with refused(InputError, names=board.path, expected=expected, got=got):
        SerialSensor.open(settings_of(board))


def test_the_only_port_is_taken(board: Board, monkeypatch: pytest.MonkeyPatch, live: Live) -> None:
    monkeypatch.setattr(serial_sensor, "port_names", lambda: ((board.path, "a board"),))
    board.send(at_constant_speed)
    loop = HandLoop(live, HandSettings(kind="serial"), send=lambda told: None)
    assert loop.open() == f"serial sensor at {board.path}"
    loop.close()
    assert is_gone(live)
