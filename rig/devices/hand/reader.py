"""Starts and watches the process that reads the hand (docs/method/hand.md#process)."""

from __future__ import annotations

import threading
from collections import deque
from contextlib import suppress
from typing import Any, Self

from tactileq.modeling.errors import InputError
from tactileq.rig.devices.hand.following import Follower
from tactileq.rig.devices.hand.messages import (
    Counts,
    Firmware,
    HandFault,
    ReadHand,
    Ready,
    Report,
    Unplug,
)
from tactileq.rig.devices.hand.settings import HandSettings
from tactileq.rig.devices.hand.tracking import REST_S
from tactileq.rig.devices.hand.window import WindowHand
from tactileq.rig.shared.live.child import Child, ChildLost
from tactileq.rig.shared.live.clock import now_s, wait_for
from tactileq.rig.shared.live.memory import Live
from tactileq.rig.shared.live.messages import Done

START_S = 30.0
FIRMWARE_S = 1.0  # a serial sensor states its firmware twice as often
SILENT_S = 1.0  # without a reading: the process is killed and replaced
_MOST_FAULTS = 1000
_WATCH_S = 0.1
_PAUSE_S = 0.5  # before a process that has ended is replaced


class HandReader:
    """The hand's readings, written into shared memory while this is open.

    Parameters
    ----------
    live : Live
        Has to outlive this.
    settings : HandSettings
        Kind "window" has no process: the owner of the window calls `push`.
    """

    reports: Any = Report  # what its process says by itself

    def __init__(self, live: Live, settings: HandSettings) -> None:
        self._live = live
        self._settings = settings
        self._window = WindowHand(live, settings) if settings.kind == "window" else None
        self._child: Child | None = None
        self._lock = threading.Lock()  # of the faults
        self._faults: deque[str] = deque(maxlen=_MOST_FAULTS)
        self._counts: dict[str, int] = {}
        self._closing = threading.Event()
        self._threads: list[threading.Thread] = []
        self._ready_s = float("-inf")
        self._alive_s = float("inf")  # since when the process of now has to write readings
        self.device_name = ""
        self._firmware = ""
        self._has_firmware = threading.Event()

    def open(self) -> None:
        """Start reading; returns once the device is open.

        Raises
        ------
        InputError
            If the device is not there, may not be read or cannot be used.
        """
        if self._window is not None:
            self._window.open()
            self.device_name = self._window.pointer.name
            return
        self._closing.clear()
        self._firmware = ""
        self._has_firmware.clear()
        child = self._start(patient=False)
        try:
            self.device_name = child.ready(Ready, within_s=START_S).name
        except ChildLost as lost:
            raise InputError(
                f"expected the hand's process to start, got: {lost}; close other programs and try "
                "again."
            ) from None
        self._alive_s = self._ready_s = now_s()
        self._threads = [
            threading.Thread(target=self._keep, args=(child,), daemon=True),
            threading.Thread(target=self._watch, daemon=True),
        ]
        for thread in self._threads:
            thread.start()

    def close(self) -> None:
        """End reading; the last reading says that the device is gone."""
        if self._window is not None:
            self._window.close()
        self._closing.set()
        if self._child is not None:
            self._child.close()
        for thread in self._threads:
            thread.join()
        self._threads = []

    def faults(self) -> tuple[str, ...]:
        """What went wrong since the last call, one sentence each."""
        with self._lock:
            faults = tuple(self._faults)
            self._faults.clear()
        return faults

    def counts(self) -> dict[str, int]:
        """What the device sent and what of it was lost, a second old at most.

        Of a serial sensor: lines, bad (damaged), missing, late (of the lines, those that were
        dropped because they were read more than 0.1 s after they were measured). Of a tablet or
        mouse: frames, dropped (by the kernel). They restart where the device was opened again.
        """
        return dict(self._counts)

    def firmware(self) -> str:
        """The version that the device states; empty where it states none.

        A serial sensor is given a second to do so after it was opened.
        """
        if self._settings.kind == "serial":
            wait_for(self._has_firmware.wait, max(0.0, self._ready_s + FIRMWARE_S - now_s()))
        return self._firmware

    def push(self, x: float, y: float, *, down: bool = True, button: bool = False) -> None:
        """Where the window's pointer is now; for kind "window" only.

        Parameters
        ----------
        x, y : float
            Pixels; `counts_per_mm` of them are 1 mm.
        down : bool
            Whether it touches.
        """
        if self._window is None:
            raise InputError(
                f'expected a hand of kind "window" to push positions, got "{self._settings.kind}"; '
                "its own device gives them."
            )
        self._window.pointer.push(x, y, down=down, button=button)

    def unplug(self, unplugged: bool = True) -> None:
        """Have the process act as if the device were unplugged, or plugged in again; for tests."""
        if self._child is not None:
            self._child.send(Unplug(unplugged))

    @property
    def pid(self) -> int | None:
        """Number of the process that reads; None where there is none."""
        return self._child.pid if self._child is not None else None

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _start(self, *, patient: bool) -> Child:
        settings = ReadHand(live=str(self._live.path), settings=self._settings, patient=patient)
        self._child = child = Child("tactileq.rig.devices.hand.process", settings)
        if self._closing.is_set():  # closed in between
            child.close()
        return child

    def _keep(self, child: Child) -> None:
        """Listen to the process, and to others in its place where it ends, until this is closed."""
        while True:
            with suppress(ChildLost):
                self._listen(child)
            self._alive_s = float("inf")
            how = child.end()
            if self._closing.is_set():
                return
            # The process is no more and its heir not yet there: nobody else writes.
            Follower(self._settings, rest_s=REST_S).gone(now_s()).write(self._live)
            self._add_fault(f"the process that reads the hand ended {how} and is started again.")
            if wait_for(self._closing.wait, _PAUSE_S):
                return
            child = self._start(patient=True)

    def _listen(self, child: Child) -> None:
        """Note what it reports; ChildLost at its end."""
        while True:
            try:
                report = child.hear(self.reports)
            except InputError as refusal:
                report = HandFault(str(refusal))
            self._alive_s = min(self._alive_s, now_s())
            match report:
                case HandFault(sentence):
                    self._add_fault(sentence)
                case Counts(counts):
                    self._counts = counts
                case Firmware(version):
                    self._firmware = version
                    self._has_firmware.set()
                case Ready() | Done():
                    pass
                case _:
                    self._take(report)

    def _take(self, report: Any) -> None:
        """Note what only a process of this kind reports."""

    def _watch(self) -> None:
        """Kill a process that writes no readings; `_keep` replaces it."""
        looked_s, held_up_s = now_s(), float("-inf")
        while not wait_for(self._closing.wait, _WATCH_S):
            if now_s() - looked_s > SILENT_S / 2:  # the computer was held up, and the process too
                held_up_s = now_s()
            looked_s = now_s()
            latest = self._live.latest()
            last_s = max(
                self._alive_s, held_up_s, float("-inf") if latest is None else latest["time_s"]
            )
            child = self._child
            if child is not None and now_s() - last_s > SILENT_S:
                self._alive_s = float("inf")
                self._add_fault(
                    f"the process that reads the hand has not written for {SILENT_S:g} s and is "
                    "killed."
                )
                child.kill()

    def _add_fault(self, sentence: str) -> None:
        with self._lock:
            self._faults.append(sentence)
