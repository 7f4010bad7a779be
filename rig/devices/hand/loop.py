"""From a device to readings in shared memory: as the samples come, and every 2 ms at rest."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from contextlib import suppress

from tactileq.rig.devices.hand.devices import open_device
from tactileq.rig.devices.hand.following import Follower, Reading
from tactileq.rig.devices.hand.messages import Counts, Firmware, HandFault
from tactileq.rig.devices.hand.sample import LOST_S, Device, DeviceLost
from tactileq.rig.devices.hand.settings import HandSettings
from tactileq.rig.devices.hand.tracking import REST_S
from tactileq.rig.shared.live.clock import now_s, sleep
from tactileq.rig.shared.live.memory import Live

BEAT_S = 0.002  # readings are written so often at most, and at rest
AGAIN_S = 0.5  # between attempts to open a device that is gone
COUNTS_S = 1.0  # between reports of what was read and lost

Send = Callable[[HandFault | Counts | Firmware], None]


class HandLoop:
    """Passes a device's samples on as readings, and continues where the device is lost.

    Parameters
    ----------
    send : callable
        Takes what the parent should know.
    opening : callable
        Gives the open device; InputError where it cannot.
    """

    def __init__(
        self,
        live: Live,
        settings: HandSettings,
        *,
        send: Send,
        opening: Callable[[HandSettings], Device] = open_device,
    ) -> None:
        self._live = live
        self._settings = settings
        self._send = send
        self._opening = opening
        self._device: Device | None = None
        self._follower = Follower(settings, rest_s=REST_S)
        self._written = Reading(float("-inf"), 0.0, 0.0, 0.0, 0.0, 0)
        self._sample_s = float("-inf")  # of the last sample that was written
        self._unwritten: Reading | None = None  # of the last sample, if it was not
        self._beat_s = 0.0
        self._again_s = 0.0
        self._attempts: queue.SimpleQueue[Device | None] = queue.SimpleQueue()
        self._attempting = False
        self._told = ""  # the last fault, until a sample passes
        self._counts: dict[str, int] = {}
        self._counts_s = 0.0
        self._late = 0  # of the counts, those that were reported
        self._firmware = ""
        self.unplugged = False  # on request: as if the plug were pulled

    def open(self) -> str:
        """Open the device, whose name is returned; InputError where that cannot be done."""
        return self._take(self._opening(self._settings))

    def _take(self, device: Device) -> str:
        self._device = device
        self._late = 0
        self._sample_s = float("-inf")
        self._follower = Follower(self._settings, rest_s=device.rest_s)
        return device.name

    def step(self) -> None:
        """Wait for samples or the next beat, and write what there is."""
        if self._device is None:
            sleep(BEAT_S)
            self._open_again()
            now = now_s()
        else:
            self._device.wait(max(0.0, self._beat_s - now_s()))
            now = now_s()  # before reading: what came until then is known at the beat
            try:
                self._pass_on(self._device)
            except DeviceLost as lost:
                self._lose(str(lost))
        if now >= self._beat_s:
            self._beat_s = now + BEAT_S
            reading = self._reading_at(now)
            if reading is not None:
                self._write(reading)

    def _reading_at(self, now: float) -> Reading | None:
        if self._device is None:
            return self._follower.gone(now)
        return self._unwritten or self._follower.at(now)

    def close(self) -> None:
        """Write a last reading without contact, and release the device."""
        self._write(self._follower.gone(now_s()))
        if self._device is not None:
            self._device.close()
            self._device = None

    def _pass_on(self, device: Device) -> None:
        if self.unplugged:
            raise DeviceLost("the device of the hand was unplugged on request.")
        samples = device.read()
        for sample in samples:
            reading = self._follower.update(sample)
            self._told = ""
            # At once, whenever the last beat was; but of a fast device not every sample is kept.
            is_due = reading.time_s >= self._sample_s + 0.9 * BEAT_S
            if is_due or reading.flags != self._written.flags:
                self._sample_s = reading.time_s
                self._write(reading)
            else:
                self._unwritten = reading
        if device.firmware != self._firmware:
            self._firmware = device.firmware
            self._send(Firmware(self._firmware))
        counts = device.counts()
        if samples:
            self._report_late(device, counts.get("late", 0))
        self._report(counts)

    def _report_late(self, device: Device, late: int) -> None:
        """Once samples are in time again, report how many were late."""
        if late > self._late:
            sentence = (
                f"expected the readings of the {device.name} within {LOST_S:g} s, got "
                f"{late - self._late} that came later and were dropped; close other programs."
            )
            self._send(HandFault(sentence))
            self._late = late

    def _report(self, counts: dict[str, int]) -> None:
        if counts != self._counts and now_s() > self._counts_s + COUNTS_S:
            self._counts, self._counts_s = counts, now_s()
            self._send(Counts(counts))

    def _lose(self, why: str) -> None:
        self._write(self._follower.gone(now_s()))
        if self._device is not None:
            self._device.close()
            self._device = None
        self._again_s = now_s() + AGAIN_S
        if why != self._told:
            self._told = why
            self._send(HandFault(why))

    def _open_again(self) -> None:
        """Try to open the device in a thread: a sensor may take seconds, and the beat goes on."""
        if not self._attempting:
            if not self.unplugged and now_s() >= self._again_s:
                self._attempting = True
                threading.Thread(target=self._attempt, daemon=True).start()
            return
        with suppress(queue.Empty):
            device = self._attempts.get_nowait()
            self._attempting = False
            self._again_s = now_s() + AGAIN_S
            if device is not None:
                self._take(device)

    def _attempt(self) -> None:
        try:
            self._attempts.put(self._opening(self._settings))
        except Exception:  # whatever it is, the next attempt may do better
            self._attempts.put(None)

    def _write(self, reading: Reading) -> None:
        """Write a reading, none earlier than the one before."""
        self._unwritten = None
        self._written = reading._replace(time_s=max(reading.time_s, self._written.time_s))
        self._written.write(self._live)
        self._beat_s = now_s() + BEAT_S
