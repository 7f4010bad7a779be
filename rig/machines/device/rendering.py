"""What a device is told to play, and the log of what it played, in the process that talks to it."""

from __future__ import annotations

import threading
from dataclasses import fields

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError
from tactileq.modeling.rendering.plan import RenderCounters
from tactileq.rig.machines.device.messages import (
    CountCorrections,
    Describe,
    DeviceAnswer,
    DeviceRequest,
    PlayModel,
    PlaySamples,
    StopPlaying,
    Wanted,
)
from tactileq.rig.machines.device.registers import DeviceSource
from tactileq.rig.machines.force.settings import Vibration
from tactileq.rig.shared.live.clock import holding, now_s
from tactileq.rig.shared.live.memory import BLOCK, HEARTBEAT_S, NO_HEARTBEAT, STALE, UNDERFLOW, Live
from tactileq.rig.shared.setup.rig_file import DEVICE_RATE_HZ
from tactileq.rig.shared.wire.conversation import DeviceRefused
from tactileq.rig.shared.wire.link import Link

SAMPLES = 25  # of one frame
AHEAD = 700  # samples that are sent before they are due; 1000 fit
FEED = 100  # at most at one look, between which the hand is read
GONE_S = 0.01  # between blocks of a device that is gone
SECTIONS = 4  # of the weighting at most
_UNIT = 1e-6  # of the sums, g² and g
_COUNTERS = [field.name for field in fields(RenderCounters)]


class DevicePlayer:
    """What the device plays; asked by one thread, and looked after by another.

    Parameters
    ----------
    link : Link
    live : Live
        Where blocks are logged, by nobody else.
    vibration : Vibration
    """

    def __init__(self, link: Link, live: Live, vibration: Vibration) -> None:
        self._link, self._live, self._vibration = link, live, vibration
        self._lock = threading.Lock()  # of all that follows
        self._samples = np.zeros(0, dtype=np.float32)
        self._position = 0
        self._gone_s = 0.0
        self._forget()

    def _forget(self) -> None:
        """Nothing plays, and nothing was asked for."""
        self._presentation = 0
        self._asked_s = float("-inf")
        self._ends = self._halted = self._is_model = False
        self._seen = np.zeros(6)
        self._sent = self._samples.size
        self._before: list[int] = []

    # --- The thread that listens to the parent -----------------------------------------------

    def answer(self, request: DeviceRequest) -> DeviceAnswer:
        """Do what is asked for; a refusal is answered, too."""
        try:
            return self._answered(request.number, request.wanted)
        except DeviceRefused as refused:
            return DeviceAnswer(number=request.number, sentence=str(refused))
        except InputError as lost:
            return DeviceAnswer(number=request.number, sentence=str(lost), lost=True)

    def _answered(self, number: int, wanted: Wanted) -> DeviceAnswer:
        match wanted:
            case Describe():
                size, most = self._link.read("RealSize"), self._link.read("VibrationRange")
                assert isinstance(size, int)
                assert isinstance(most, float)
                return DeviceAnswer(number=number, real_size=size, most_g=most)
            case PlayModel():
                self._play_model(wanted)
            case PlaySamples():
                self._play_samples(wanted)
            case StopPlaying():
                with holding(self._lock):
                    self._stop()
            case CountCorrections(presentation):
                return DeviceAnswer(number=number, counters=self._counters(presentation))
        return DeviceAnswer(number=number)

    def _play_model(self, wanted: PlayModel) -> None:
        self._link.write("Source", DeviceSource.NOTHING)
        self._link.upload(wanted.data, wanted.digest)
        with holding(self._lock):
            self._forget()
            self._before = self._corrections()
            self._begin(wanted.presentation, DeviceSource.MODEL)

    def _play_samples(self, wanted: PlaySamples) -> None:
        with holding(self._lock):
            self._link.write("Source", DeviceSource.NOTHING)
            self._forget()
            samples = np.frombuffer(wanted.samples, dtype=np.float32)
            self._samples = np.pad(samples, (0, -samples.size % SAMPLES))
            self._sent = 0
            self._send(0, most=AHEAD)
            self._begin(wanted.presentation, DeviceSource.HOST)

    def _begin(self, presentation: int, source: DeviceSource) -> None:
        self._link.write("Source", source)
        self._presentation, self._asked_s = presentation, now_s()
        self._is_model = source == DeviceSource.MODEL

    def _stop(self) -> None:
        self._link.write("Source", DeviceSource.NOTHING)
        self._ends, self._sent = True, self._samples.size

    def _counters(self, presentation: int) -> RenderCounters | None:
        with holding(self._lock):
            if presentation != self._presentation or not self._is_model:
                return None
            since = np.subtract(self._corrections(), self._before).tolist()
            return RenderCounters(**dict(zip(_COUNTERS, since, strict=True)))

    def _corrections(self) -> list[int]:
        return [int(count) for count in self._link.read("Corrections")]  # type: ignore[union-attr]

    # --- The thread that talks to the device ---------------------------------------------------

    def prepare(self) -> None:
        """Set up a device that is here anew: nothing plays."""
        sections = np.frombuffer(self._vibration.weighting).ravel()
        weighting = np.pad(sections, (0, 5 * SECTIONS - sections.size))
        with holding(self._lock):
            self._forget()
            self._link.write("Source", DeviceSource.NOTHING)
            self._link.write("Weighting", tuple(weighting.tolist()))
            self._link.write("VibrationScale", self._vibration.scale)
            self._link.write("VibrationLimit", self._vibration.peak_g)
            self._link.write("Seed", self._vibration.seed)
            self._seen = self._read()

    def look(self, *, speed_mm_s: float, force_n: float, heartbeat_s: float) -> None:
        """Log what was played since the last look, send more, halt what nobody looks after."""
        if not self._lock.acquire(blocking=False):
            return  # the next look
        try:
            values = self._read()
            time_s = now_s()
            since = values - self._seen
            self._seen = values
            halts = self._plays and time_s - max(heartbeat_s, self._asked_s) > HEARTBEAT_S
            if halts and not self._halted:
                self._halted = True
                self._stop()
            self._log(time_s, values, since, speed_mm_s=speed_mm_s, force_n=force_n)
            if self._plays and not self._is_model:
                self._go_on(int(values[0]))
        finally:
            self._lock.release()

    def _read(self) -> Floats:
        return np.array(self._link.read("Played"), dtype=np.float64)

    @property
    def _plays(self) -> bool:
        return self._presentation > 0 and not self._ends

    def _log(
        self, time_s: float, values: Floats, since: Floats, *, speed_mm_s: float, force_n: float
    ) -> None:
        """Append a block: the time of its first sample, and what was played in it."""
        ticks = int(since[0])
        row = np.zeros(1, dtype=BLOCK)
        row["time_s"] = time_s
        row["dac_time_s"] = row["hand_s"] = time_s - ticks / DEVICE_RATE_HZ
        row["speed_mm_s"], row["force_n"] = speed_mm_s, force_n
        row["square_sum_g2"], row["weighted_square_sum_g2"] = _UNIT * since[1], _UNIT * since[2]
        row["position"], row["frames"] = self._position, ticks
        row["readings"] = self._live.readings_written
        row["presentation"] = self._presentation if ticks or self._plays else 0
        row["peak_g"] = _UNIT * values[3]
        late = since[5] > 0 and (self._is_model or values[0] < self._samples.size)
        row["flags"] = UNDERFLOW * late | NO_HEARTBEAT * self._halted
        self._position += ticks
        self._live.write_block(row[0])

    def _go_on(self, played: int) -> None:
        """The next samples; silence after the last one."""
        self._send(played, most=FEED)
        if played >= self._samples.size:
            self._stop()

    def _send(self, played: int, *, most: int) -> None:
        end = min(self._samples.size, self._sent + most, played + AHEAD)
        while self._sent < end:
            part = self._samples[self._sent : self._sent + SAMPLES]
            self._link.write("Samples", tuple(part.tolist()))
            self._sent += SAMPLES

    def gone(self) -> None:
        """Log that there is no device while something is to be played."""
        with holding(self._lock):
            time_s = now_s()
            if not self._presentation or time_s - self._gone_s < GONE_S:
                return
            self._gone_s = time_s
            row = np.zeros(1, dtype=BLOCK)
            row["time_s"] = row["dac_time_s"] = row["hand_s"] = time_s
            row["presentation"], row["flags"] = self._presentation, STALE
            self._live.write_block(row[0])
