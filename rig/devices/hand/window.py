"""A hand that moves a window's pointer, where no device can be read (docs/method/hand.md#window).

The owner of the window pushes positions; a thread of the same process filters them and writes the
readings. While that process is busy nothing is written, and what is rendered falls silent.
"""

from __future__ import annotations

import threading
from collections import deque

from tactileq.rig.devices.hand.loop import HandLoop
from tactileq.rig.devices.hand.sample import Sample
from tactileq.rig.devices.hand.settings import HandSettings
from tactileq.rig.shared.live.clock import now_s, wait_for
from tactileq.rig.shared.live.memory import Live

_MOST_PUSHED = 10_000


class PointerDevice:
    """The pointer of a window as a device: what is pushed at one end is read at the other."""

    name = "pointer of the window"
    firmware = ""
    rest_s = 0.05  # two frames of a screen may be missed

    def __init__(self, pixels_per_mm: float) -> None:
        self._pixels_per_mm = pixels_per_mm
        self._pushed: deque[Sample] = deque(maxlen=_MOST_PUSHED)
        self._news = threading.Event()

    def push(self, x: float, y: float, *, down: bool, button: bool) -> None:
        """Where the pointer is now, in pixels."""
        x_mm, y_mm = x / self._pixels_per_mm, y / self._pixels_per_mm
        self._pushed.append(Sample(now_s(), x_mm, y_mm, contact=down, button=button))
        self._news.set()

    def wait(self, seconds: float) -> None:
        """Until something is pushed, at the latest after this time."""
        if wait_for(self._news.wait, seconds):
            self._news.clear()

    def read(self) -> list[Sample]:
        """What was pushed since the last call."""
        return [self._pushed.popleft() for _ in range(len(self._pushed))]

    def counts(self) -> dict[str, int]:
        """Nothing can be lost."""
        return {}

    def close(self) -> None:
        """Nothing to give back."""


class WindowHand:
    """Readings from pushed positions, written by a thread of this process.

    Parameters
    ----------
    settings : HandSettings
        Of kind "window".
    """

    def __init__(self, live: Live, settings: HandSettings) -> None:
        assert settings.counts_per_mm is not None  # which the settings make sure of
        self.pointer = PointerDevice(settings.counts_per_mm)
        self._loop = HandLoop(
            live, settings, send=lambda sentence: None, opening=lambda settings: self.pointer
        )
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None

    def open(self) -> None:
        """Start writing readings."""
        self._closing.clear()
        self._loop.open()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End writing; the last reading says that the pointer is gone."""
        self._closing.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    def _run(self) -> None:
        while not self._closing.is_set():
            self._loop.step()
        self._loop.close()
