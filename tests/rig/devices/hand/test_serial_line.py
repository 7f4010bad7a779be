"""The serial sensor's lines: published check value, both ends of both languages, any garbage."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactileq.rig.devices.hand.serial_line import (
    CLOCK_US,
    LONGEST_LINE,
    LineReader,
    SensorClock,
    SensorLine,
    crc,
    decode,
    decode_firmware,
    encode,
)
from tests.rig.devices.hand.board import firmware_line

ROOT = Path(__file__).parents[4]
LARGEST = 2**31 - 1

numbers = st.integers(-LARGEST, LARGEST)
lines = st.builds(
    SensorLine,
    st.integers(0, 2**16 - 1),
    st.integers(0, 2**32 - 1),
    st.tuples(numbers) | st.tuples(numbers, numbers),
    st.none() | numbers,
    st.booleans(),
    st.booleans(),
)
PROGRAM = r"""
#include <inttypes.h>
#include <stdio.h>
#include "line.h"
int main(void)
{
    char kind, line[TQ_LINE];
    uint16_t number;
    uint32_t time_us;
    int32_t a, b, force_mn;
    unsigned flags;
    printf("%04X\n", tq_crc("123456789", 9));
    fwrite(line, 1, tq_firmware_line(line, "wheel 1.0"), stdout);
    fwrite(line, 1, tq_firmware_line(line, "a version of more than the forty characters that fit"),
           stdout);
    while (scanf(" %c %" SCNu16 " %" SCNu32 " %" SCNd32 " %" SCNd32 " %" SCNd32 " %u", &kind,
                 &number, &time_us, &a, &b, &force_mn, &flags) == 7) {
        uint8_t length = kind == 'P'
            ? tq_position_line(line, number, time_us, a, b, force_mn, (uint8_t)flags)
            : tq_speed_line(line, number, time_us, a, force_mn, (uint8_t)flags);
        fwrite(line, 1, length, stdout);
    }
    return 0;
}
"""


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Writes the lines of the values on its input, by docs/serial-sensor/line.h."""
    folder = tmp_path_factory.mktemp("line")
    (folder / "program.c").write_text(PROGRAM, encoding="utf-8")
    command = [
        "gcc",
        "-std=c99",
        "-Wall",
        "-Wextra",
        "-Wconversion",
        "-Werror",
        "-fsanitize=undefined",
    ]
    command += [f"-I{ROOT / 'docs/serial-sensor'}", "program.c", "-o", "program"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    return folder / "program"


def test_the_check_value_is_the_published_one() -> None:
    # CRC-16/XMODEM in G. Cook's catalogue of parametrised CRC algorithms: check 0x31C3.
    assert crc(b"123456789") == 0x31C3


def test_the_sketch_and_the_reader_agree(program: Path) -> None:
    rng = np.random.default_rng(1)
    drawn = [
        SensorLine(
            int(rng.integers(2**16)),
            int(rng.integers(2**32)),
            tuple(map(int, rng.integers(-LARGEST, LARGEST, size=1 + index % 2))),
            int(rng.integers(-LARGEST, LARGEST)) if index % 3 else None,
            bool(index & 4),
            bool(index & 8),
        )
        for index in range(500)
    ]
    longest = SensorLine(65535, 2**32 - 1, (-LARGEST, -LARGEST), -LARGEST, True, True)
    drawn += [longest, SensorLine(0, 0, (0, 0), 0, False, False)]
    values = ""
    for line in drawn:
        moved = line.moved_um if len(line.moved_um) == 2 else (*line.moved_um, 0)
        force = -(2**31) if line.force_mn is None else line.force_mn
        kind = "VP"[len(line.moved_um) - 1]
        cells = (kind, line.number, line.time_us, *moved, force, line.contact + 2 * line.button)
        values += " ".join(map(str, cells)) + "\n"
    run = subprocess.run([program], input=values.encode(), capture_output=True, check=True)
    check, stated, longer, written = run.stdout.split(b"\n", 3)
    assert check == b"31C3"
    assert decode_firmware(stated) == "wheel 1.0"
    assert decode_firmware(longer) == "a version of more than the forty charact"
    assert max(map(len, (stated, longer))) <= LONGEST_LINE
    assert run.stderr == b""
    assert LineReader().feed(written) == drawn
    assert written == b"".join(map(encode, drawn))  # byte by byte
    assert max(map(len, written.split(b"\n"))) <= LONGEST_LINE


# As much of Arduino as the sketch uses, so that a compiler can check it.
ARDUINO = r"""
#include <stdint.h>
struct Port { void begin(long); void write(const uint8_t *, unsigned); } Serial;
enum { INPUT_PULLUP, CHANGE, A0 };
int digitalRead(int), analogRead(int), digitalPinToInterrupt(int);
void pinMode(int, int), attachInterrupt(int, void (*)(), int), noInterrupts(), interrupts();
uint32_t micros();
"""


@pytest.mark.skipif(
    shutil.which("g++") is None, reason="g++ is not installed (see tools/system-packages)"
)
def test_the_sketch_for_arduino_compiles(tmp_path: Path) -> None:
    (tmp_path / "Arduino.h").write_text(ARDUINO, encoding="utf-8")
    command = ["g++", "-std=c++11", "-fsyntax-only", "-Wall", "-Wno-unused-function", "-Werror"]
    command += ["-include", str(tmp_path / "Arduino.h"), "-x", "c++"]
    subprocess.run([*command, str(ROOT / "docs/serial-sensor/sensor.ino")], check=True)


def test_an_uno_has_the_sketchs_baud_rate_and_it_carries_the_lines() -> None:
    sketch = (ROOT / "docs/serial-sensor/sensor.ino").read_text(encoding="utf-8")
    page = (ROOT / "docs/serial-sensor.md").read_text(encoding="utf-8")
    baud, period_us = (
        int(re.search(rf"{name} = (\d+);", sketch)[1])  # type: ignore[index]
        for name in ("BAUD", "PERIOD_US")
    )
    assert f"\n    baud = {baud}\n" in page
    # ATmega328P data sheet, table 19-1 (U2X): clock / (8 (UBRR + 1)); UBRR as Arduino rounds it.
    ubrr = (16_000_000 // 4 // baud - 1) // 2
    assert 16e6 / (8 * (ubrr + 1)) == pytest.approx(baud, rel=0.02)
    # A position of 2 m with all else at its longest; a version, twice a second, in addition.
    longest = encode(SensorLine(65535, CLOCK_US - 1, (-2_000_000, 0), -50_000, True, True))
    one_bit_us = 1e6 / baud
    assert (len(longest) + len(firmware_line(b"wheel and load cell 1.0"))) * 10 * one_bit_us < (
        period_us
    )


def test_the_examples_of_the_page_are_lines() -> None:
    page = (ROOT / "docs/serial-sensor.md").read_text(encoding="utf-8")
    examples = re.findall(r"^    (\$.*\*[0-9A-F]{4})$", page, flags=re.MULTILINE)
    assert decode_firmware(examples.pop().encode()) == "wheel and load cell 1.0"
    assert [decode(example.encode()) for example in examples] == [
        SensorLine(0, 1_000_000, (12500, -300), 1500, contact=True, button=False),
        SensorLine(65535, 2**32 - 1, (-120_000,), None, contact=True, button=True),
    ]


@settings(max_examples=100, deadline=None)
@given(lines)
def test_what_is_encoded_is_decoded(line: SensorLine) -> None:
    assert decode(encode(line).rstrip(b"\n")) == line


@settings(max_examples=100, deadline=None)
@given(lines, st.data())
def test_no_single_damaged_character_passes(line: SensorLine, data: st.DataObject) -> None:
    sent = bytearray(encode(line)[:-2])
    sent[data.draw(st.integers(0, len(sent) - 1))] ^= data.draw(st.integers(1, 255))
    assert decode(bytes(sent)) in (None, line)  # a \r at the end says the same


versions = st.text(st.characters(codec="ascii", exclude_categories=["Cc"]), max_size=50)


@settings(max_examples=200, deadline=None)
@given(versions, lines, st.data())
def test_a_version_is_read_and_counts_as_no_line(
    version: str, line: SensorLine, data: st.DataObject
) -> None:
    is_one = 1 <= len(version) <= 40 and not set("$*") & set(version) and version.strip()
    reader = LineReader()
    stream = encode(line) + firmware_line(version.encode()) + encode(line)
    found = [line for piece in cut(data, stream) for line in reader.feed(piece)]
    assert found == [line, line]
    assert reader.firmware == (version.strip() if is_one else "")
    assert (reader.good, reader.bad, reader.missing) == (2, 0 if is_one else 1, 0)


@settings(max_examples=100, deadline=None)
@given(st.data())
def test_no_damaged_version_passes(data: st.DataObject) -> None:
    sent = bytearray(firmware_line(b"wheel 1.0")[:-2])
    sent[data.draw(st.integers(0, len(sent) - 1))] ^= data.draw(st.integers(1, 255))
    assert decode_firmware(bytes(sent)) in ("", "wheel 1.0")


def cut(data: st.DataObject, stream: bytes) -> list[bytes]:
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=6)))
    return [stream[a:b] for a, b in zip([0, *cuts], [*cuts, len(stream)], strict=True)]


pieces = st.lists(
    st.binary(max_size=200) | lines.map(encode) | st.sampled_from([b"\n", b"$P,", b"*0000\r\n"]),
    max_size=12,
).map(b"".join)


@settings(max_examples=200, deadline=None)
@given(pieces, st.data())
def test_any_bytes_in_any_pieces_give_the_same_lines(stream: bytes, data: st.DataObject) -> None:
    whole, cuts = LineReader(), LineReader()
    expected = whole.feed(stream)
    assert [line for piece in cut(data, stream) for line in cuts.feed(piece)] == expected
    assert (cuts.good, cuts.bad, cuts.missing) == (whole.good, whole.bad, whole.missing)
    assert whole.good == len(expected)


@settings(max_examples=100, deadline=None)
@given(st.binary(max_size=300), lines, lines)
def test_after_garbage_the_next_line_is_read(garbage: bytes, a: SensorLine, b: SensorLine) -> None:
    assert LineReader().feed(garbage + b"\n" + encode(a) + encode(b))[-2:] == [a, b]


def numbered(number: int) -> bytes:
    return encode(SensorLine(number, 0, (1,), None, contact=True, button=False))


def test_bad_and_missing_lines_are_counted() -> None:
    reader = LineReader()
    reader.feed(b"P,half a line*1234\r\n")  # opened in the middle of it
    for number in (65534, 65535, 0, 3, 4):
        reader.feed(numbered(number))
    reader.feed(numbered(5).replace(b"5", b"6", 1) + b"\r\n")
    reader.feed(b"$" + b"9" * 1000 + b"\n")
    reader.feed(numbered(7))
    assert (reader.good, reader.bad, reader.missing) == (6, 2, 4)
    reader.feed(numbered(0))  # the board was reset
    assert reader.missing == 4


def test_a_line_that_never_ends_fills_no_memory() -> None:
    reader = LineReader()
    for _ in range(1000):
        reader.feed(b"x" * 1000)
    assert len(reader._rest) <= LONGEST_LINE


def test_the_clock_finds_the_shortest_delay_and_wraps_around() -> None:
    clock, rng = SensorClock(), np.random.default_rng(4)
    start_us, times = 2**32 - 3_000_000, np.arange(0, 20, 0.002)
    found = [
        clock.time_s(
            (start_us + round(t * 1e6)) % 2**32, 500.0 + t + 0.001 + rng.exponential(0.002)
        )
        for t in times
    ]
    error = np.array(found) - (500.0 + times)
    # 1 ms is the shortest delay.
    assert (error[500:] > 0.0009).all()
    assert np.median(error[500:]) < 0.0012
    assert error[500:].max() < 0.002
    assert (np.diff(found[500:]) > 0).all()


@pytest.mark.parametrize("drift", [-0.004, -1e-4, 1e-4, 0.004])
def test_the_clock_follows_one_that_is_fast_or_slow(drift: float) -> None:
    clock, times = SensorClock(), np.arange(0, 100, 0.005)
    found = [clock.time_s(round(t * 1e6 * (1 + drift)), 50 + t) for t in times]
    np.testing.assert_allclose(found, 50 + times, atol=5e-5)


def test_a_board_that_starts_anew_starts_its_clock_anew() -> None:
    clock = SensorClock()
    assert clock.time_s(9_000_000, 20.0) == 20.0
    assert clock.time_s(9_100_000, 20.1) == pytest.approx(20.1)
    assert clock.time_s(1_000, 23.0) == 23.0


@pytest.mark.parametrize("step_us", [1_000_000, 2**32 - 40 * 60_000_000])
def test_a_clock_that_leaps_forward_is_followed_at_once(step_us: int) -> None:
    """As after the computer slept, or of a board that starts anew after 40 minutes."""
    clock, times = SensorClock(), np.arange(0, 20, 0.005)
    leap = np.where(times >= 10, step_us, 0)
    late_s = np.random.default_rng(6).uniform(0, 1e-3, times.size)
    found = [
        clock.time_s((round(t * 1e6) + int(more)) % 2**32, 50 + t + late)
        for t, more, late in zip(times, leap, late_s, strict=True)
    ]
    error_s = np.array(found) - (50 + times)
    assert np.abs(error_s[times > 1]).max() < 2e-3
    assert np.abs(error_s[(times > 3) & (times < 10) | (times > 12)]).max() < 1e-4


@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 2**32 - 1), st.floats(0, 1)), max_size=30))
def test_no_line_is_older_than_its_arrival(steps: list[tuple[int, float]]) -> None:
    clock, arrived_s = SensorClock(), 1000.0
    for time_us, step_s in steps:
        arrived_s += step_s
        assert clock.time_s(time_us, arrived_s) <= arrived_s + 1e-9
