"""From a hand to what is played: readings at any times, blocks that come late, a replay."""

from __future__ import annotations

import os
import select
import tty
from collections.abc import Iterable, Iterator
from contextlib import closing
from typing import NamedTuple

import numpy as np
import pytest
import serial

from tactileq.modeling import Renderer
from tactileq.modeling.arrays import Floats
from tactileq.modeling.rendering.limits import Limits
from tactileq.rig.devices.hand import loop, serial_sensor
from tactileq.rig.devices.hand.loop import HandLoop
from tactileq.rig.devices.hand.serial_line import SensorLine, encode
from tactileq.rig.devices.hand.serial_sensor import SerialSensor
from tactileq.rig.devices.hand.settings import HandSettings
from tactileq.rig.shared.live.memory import Live
from tactileq.stimuli.planted.textures import planted_texture
from tests.rig.shared.live.callback import FADE, RATE_HZ, Array, Callback
from tests.rig.shared.live.replay import Log, engine_of

FRAMES = 128
LIMITS = Limits(peak=50.0)
SETTLED_S, SECONDS = 1.5, 3.0  # the sensor's clock is known after a second
FORCE_N = 2.0
DELAY_S = 0.005  # of the tracking filter


@pytest.fixture
def live() -> Iterator[Live]:
    with Live.create() as made:
        yield made


def stroke_mm(time_s: Floats) -> Floats:
    """To and fro at 2 Hz, up to 300 mm/s."""
    return 300 / (4 * np.pi) * (1 - np.cos(4 * np.pi * time_s))


def stroke_mm_s(time_s: Floats) -> Floats:
    return 300 * np.sin(4 * np.pi * np.maximum(time_s, 0))


class Lines(NamedTuple):
    """When the hand was measured, and when each line arrives."""

    measured_s: Floats
    arrives_s: Floats


class Sensor:
    """A serial sensor at a pseudo-terminal, read by the hand's loop when the test says so."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, live: Live) -> None:
        self._master, slave = os.openpty()
        tty.setraw(slave)
        path = os.ttyname(slave)
        self._port = serial.Serial(path, timeout=0)
        os.close(slave)
        self._now_s = 0.0
        monkeypatch.setattr(serial_sensor, "now_s", lambda: self._now_s)
        monkeypatch.setattr(loop, "now_s", lambda: self._now_s)
        device = SerialSensor(self._port)
        monkeypatch.setattr(device, "wait", lambda seconds: None)
        settings = HandSettings(kind="serial", device=path, filter_delay_s=DELAY_S)
        self._loop = HandLoop(live, settings, send=lambda told: None, opening=lambda _: device)
        self._loop.open()

    def arrive(self, number: int, measured_s: float) -> None:
        """A line arrives, to be read."""
        x_um = round(1000 * float(stroke_mm(np.asarray(measured_s))))
        force_mn = round(1000 * FORCE_N)
        line = SensorLine(
            number % 2**16,
            round(1e6 * measured_s),
            (x_um, 0),
            force_mn,
            contact=True,
            button=False,
        )
        waiting, text = self._port.in_waiting, encode(line)
        os.write(self._master, text)
        while self._port.in_waiting < waiting + len(text):
            select.select([self._port], [], [], 1)  # a thread of the kernel passes bytes on

    def step(self, at_s: float) -> None:
        """The hand's process looks."""
        self._now_s = at_s
        self._loop.step()

    def close(self) -> None:
        self._loop.close()
        os.close(self._master)


def played(
    callback: Callback, sensor: Sensor, lines: Lines, *, late_s: Floats | None = None
) -> Array:
    """Canvas under a sensor's hand; blocks are called so late, (n,)."""
    callback.texture(1, LIMITS, name="canvas")
    start_s = callback.time_s
    count = int(SECONDS * RATE_HZ) // FRAMES
    delays_s = np.zeros(count) if late_s is None else late_s
    parts, done, arrives_s = list[Array](), 0, start_s + lines.arrives_s
    for late in delays_s.tolist():
        now_s = callback.time_s + late
        while done < arrives_s.size and arrives_s[done] <= now_s:
            at_s = float(arrives_s[done])
            while done < arrives_s.size and arrives_s[done] == at_s:
                sensor.arrive(done, float(lines.measured_s[done]))
                done += 1
            sensor.step(at_s)
        sensor.step(now_s)
        callback.look(0.0)
        parts.append(callback.play_on(FRAMES, late_s=late))
    return np.concatenate(parts)


def error_db(rendered: Array, delay_s: float) -> float:
    """Against the hand itself, later by so much, in dB of its vibration."""
    exact = Renderer(planted_texture("canvas"), rate_hz=RATE_HZ, update_samples=10)
    time_s = np.arange(rendered.size) / RATE_HZ - delay_s
    wanted = exact.render(stroke_mm_s(time_s), np.full(rendered.size, FORCE_N))
    settled = slice(int(SETTLED_S * RATE_HZ), None)
    error = (rendered - wanted)[settled]
    return float(10 * np.log10(np.mean(error**2) / np.mean(wanted[settled] ** 2)))


def held_error_db(live: Live, later_ms: Iterable[int] = range(6)) -> float:
    """The same for the latest reading, held for each block, at the delay that flatters it most."""
    _, readings = live.readings_since(0)
    _, blocks = live.blocks_since(0)
    blocks = blocks[: int(SECONDS * RATE_HZ) // FRAMES]
    latest = np.maximum(blocks["readings"].astype(int) - 1, 0)
    speeds = np.repeat(readings["speed_mm_s"][latest], FRAMES)
    renderer = Renderer(planted_texture("canvas"), rate_hz=RATE_HZ)
    rendered = renderer.render(speeds, np.full(speeds.size, FORCE_N))
    return min(error_db(rendered, DELAY_S + late * 1e-3) for late in later_ms)


BEAT_S = np.arange(0, SECONDS, 1e-3)


def regular(rng: np.random.Generator) -> Lines:
    return Lines(BEAT_S, BEAT_S)


def irregular(rng: np.random.Generator) -> Lines:
    measured_s = BEAT_S + rng.uniform(0, 1e-3, BEAT_S.size)
    return Lines(measured_s, measured_s)


def late(rng: np.random.Generator) -> Lines:
    return Lines(BEAT_S, BEAT_S + rng.uniform(0, 1e-3, BEAT_S.size))


def missing(rng: np.random.Generator) -> Lines:
    kept = BEAT_S[rng.uniform(size=BEAT_S.size) > 0.05]
    return Lines(kept, kept)


def all_at_once(rng: np.random.Generator) -> Lines:
    measured_s = BEAT_S[rng.uniform(size=BEAT_S.size) > 0.05]
    measured_s = measured_s + rng.uniform(0, 1e-3, measured_s.size)
    arrives_s = measured_s + rng.uniform(0, 1e-3, measured_s.size)
    return Lines(measured_s, np.maximum.accumulate(arrives_s))


@pytest.mark.parametrize("batch_s", [0.004, 0.016])
def test_lines_that_arrive_in_batches_keep_their_times(
    monkeypatch: pytest.MonkeyPatch, live: Live, batch_s: float
) -> None:
    """As through an adapter that passes bytes on every 16 ms."""
    lines = Lines(BEAT_S, np.ceil(BEAT_S / batch_s) * batch_s)
    with closing(Sensor(monkeypatch, live)) as sensor:
        rendered = played(Callback(live, scale=1.0), sensor, lines)
    assert error_db(rendered, DELAY_S) < held_error_db(live, range(0, 20, 2)) - 6


def test_irregular_late_and_missing_lines_play_within_6_db_of_regular_and_whole_ones(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rng, errors = np.random.default_rng(1), {}
    for lines_of in (regular, irregular, late, missing, all_at_once):
        with Live.create() as live, closing(Sensor(monkeypatch, live)) as sensor:
            rendered = played(Callback(live, scale=1.0), sensor, lines_of(rng))
            errors[lines_of] = error_db(rendered, DELAY_S)
            assert errors[lines_of] < held_error_db(live) - 10
    assert max(errors.values()) <= errors[regular] + 6


def calls(kind: str) -> Floats:
    """How late each block is called (s)."""
    rng, count = np.random.default_rng(2), int(SECONDS * RATE_HZ) // FRAMES
    if kind == "by a busy system":
        return rng.exponential(3e-4, count) + np.where(rng.uniform(size=count) < 0.01, 3e-3, 0)
    return np.resize([3.0, 2.0, 1.0, 0.0], count) * FRAMES / RATE_HZ


@pytest.mark.parametrize("kind", ["by a busy system", "four at once"])
def test_blocks_that_are_called_late_move_the_hand_evenly(
    monkeypatch: pytest.MonkeyPatch, live: Live, kind: str
) -> None:
    late_s, lines = calls(kind), Lines(BEAT_S, BEAT_S)
    with closing(Sensor(monkeypatch, live)) as sensor:
        rendered = played(Callback(live, scale=1.0), sensor, lines, late_s=late_s)
    _, rows = live.blocks_since(0)
    ahead_s = float(np.median(rows["hand_s"] - (rows["time_s"] - late_s)))
    # In time −52 dB; of four at once the last one's hand is extrapolated by 8 ms.
    assert error_db(rendered, DELAY_S - ahead_s) < -45
    assert 0 < ahead_s < late_s.max()


def test_what_was_played_is_rendered_again_from_the_log_bit_by_bit(
    monkeypatch: pytest.MonkeyPatch, live: Live
) -> None:
    lines = all_at_once(np.random.default_rng(3))
    with closing(Sensor(monkeypatch, live)) as sensor:
        callback = Callback(live, scale=1.0)
        rendered = played(callback, sensor, lines, late_s=calls("by a busy system"))
    _, blocks = live.blocks_since(0)
    made = planted_texture("canvas")
    engine = engine_of(made, RATE_HZ, block=0, seed=0, stream=0, limits=LIMITS)
    wanted = Log(live, RATE_HZ).played(blocks, 1, engine)[FADE:].astype(np.float32)
    assert np.abs(wanted).max() > 0.1
    np.testing.assert_array_equal(rendered[FADE:], wanted)
