"""Starts and watches the process that reads the hand (docs/method/hand.md#process)."""

from __future__ import annotations

import json
import queue
import signal
import subprocess
import tempfile
import threading
from collections import deque
from contextlib import suppress
from typing import IO, Any

from modeling.errors import InputError
from rig.hand.following import Follower
from rig.hand.settings import HandSettings
from rig.hand.tracking import REST_S
from rig.hand.window import WindowHand
from rig.live.child import last_complaint, started
from rig.live.memory import Live, now_s

START_S = 30.0
END_S = 2.0
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

    def __init__(self, live: Live, settings: HandSettings) -> None:
        self._live = live
        self._settings = settings
        self._window = WindowHand(live, settings) if settings.kind == "window" else None
        self._process: subprocess.Popen[str] | None = None
        self._lock = threading.Lock()  # of the process and the faults
        self._faults: deque[str] = deque(maxlen=_MOST_FAULTS)
        self._counts: dict[str, int] = {}
        self._closing = threading.Event()
        self._threads: list[threading.Thread] = []
        self._first: queue.Queue[dict[str, str]] = queue.Queue()
        self._was_ready = False
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
        self._first, self._was_ready = queue.Queue(), False
        self._firmware = ""
        self._has_firmware.clear()
        self._threads = [
            threading.Thread(target=target, daemon=True) for target in (self._keep, self._watch)
        ]
        for thread in self._threads:
            thread.start()
        message = self._wait_for_first()
        if "ready" not in message:
            self.close()
            raise InputError(message["error"])
        self.device_name = message["ready"]
        self._ready_s = now_s()

    def close(self) -> None:
        """End reading; the last reading says that the device is gone."""
        if self._window is not None:
            self._window.close()
        self._closing.set()
        with self._lock:
            process = self._process
        if process is not None:
            _end(process)
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
        with self._lock:
            return dict(self._counts)

    def firmware(self) -> str:
        """The version that the device states; empty where it states none.

        A serial sensor is given a second to do so after it was opened.
        """
        if self._settings.kind == "serial":
            self._has_firmware.wait(max(0.0, self._ready_s + FIRMWARE_S - now_s()))
        with self._lock:
            return self._firmware

    def push(self, x: float, y: float, *, down: bool = True, button: bool = False) -> None:
        """Where the window's pointer is now; for kind "window" only.

        Parameters
        ----------
        x, y : float
            Pixels; `counts_per_mm` of them are 1 mm.
        down : bool
            Whether it touches.
        button : bool
        """
        if self._window is None:
            raise InputError(
                f'expected a hand of kind "window" to push positions, got "{self._settings.kind}"; '
                "its own device gives them."
            )
        self._window.pointer.push(x, y, down=down, button=button)

    def unplug(self, unplugged: bool = True) -> None:
        """Have the process act as if the device were unplugged, or plugged in again; for tests."""
        with self._lock:
            process = self._process
        if process is not None and process.stdin is not None:
            process.stdin.write(json.dumps({"unplugged": unplugged}) + "\n")
            process.stdin.flush()

    @property
    def pid(self) -> int | None:
        """Number of the process that reads; None where there is none."""
        with self._lock:
            return self._process.pid if self._process is not None else None

    def __enter__(self) -> HandReader:
        self.open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _wait_for_first(self) -> dict[str, str]:
        try:
            return self._first.get(timeout=START_S)
        except queue.Empty:
            return {
                "error": f"expected the hand's process to start within {START_S:g} s, got no "
                "answer; close other programs and try again."
            }

    def _keep(self) -> None:
        """Keep a process that reads, until this is closed."""
        patient = False
        while not self._closing.is_set():
            with tempfile.TemporaryFile() as complaints:
                process = self._start(complaints, patient=patient)
                assert process.stdout is not None
                with suppress(ValueError, OSError):  # closed under our eyes
                    for line in process.stdout:
                        self._hear(json.loads(line))
                self._alive_s = float("inf")
                how = _how(process.wait()) + last_complaint(complaints)
            if not self._was_ready:  # `open` refuses
                ended = f"expected the hand's process to start, got its end {how}; try again."
                self._first.put({"error": ended})
                return
            if not self._closing.is_set():
                # The process is no more and its heir not yet there: nobody else writes.
                Follower(self._settings, rest_s=REST_S).gone(now_s()).write(self._live)
                self._add_fault(
                    f"the process that reads the hand ended {how} and is started again."
                )
                patient = True
                self._closing.wait(_PAUSE_S)

    def _start(self, complaints: IO[bytes], *, patient: bool) -> subprocess.Popen[str]:
        wanted = {
            "live": str(self._live.path),
            "settings": self._settings.to_dict(),
            "patient": patient,
        }
        process = started("rig.hand.process", wanted, complaints=complaints)
        with self._lock:
            self._process = process
        if self._closing.is_set():  # closed in between
            _end(process)
        return process

    def _hear(self, message: dict[str, Any]) -> None:
        if "fault" in message:
            self._add_fault(message["fault"])
        if "counts" in message:
            with self._lock:
                self._counts = message["counts"]
        if "firmware" in message:
            with self._lock:
                self._firmware = message["firmware"]
            self._has_firmware.set()
        self._alive_s = min(self._alive_s, now_s())
        if "ready" in message or "error" in message:
            self._was_ready = self._was_ready or "ready" in message
            self._first.put(message)

    def _watch(self) -> None:
        """Kill a process that writes no readings; `_keep` replaces it."""
        looked_s, held_up_s = now_s(), float("-inf")
        while not self._closing.wait(_WATCH_S):
            if now_s() - looked_s > SILENT_S / 2:  # the computer was held up, and the process too
                held_up_s = now_s()
            looked_s = now_s()
            latest = self._live.latest()
            last_s = max(
                self._alive_s, held_up_s, float("-inf") if latest is None else latest["time_s"]
            )
            with self._lock:
                process = self._process
            if process is not None and now_s() - last_s > SILENT_S:
                self._alive_s = float("inf")
                self._add_fault(
                    f"the process that reads the hand has not written for {SILENT_S:g} s and is "
                    "killed."
                )
                process.kill()

    def _add_fault(self, sentence: str) -> None:
        with self._lock:
            self._faults.append(sentence)


def _end(process: subprocess.Popen[str]) -> None:
    """End a process by the end of its input; kill it where it does not."""
    with suppress(OSError, ValueError):
        assert process.stdin is not None
        process.stdin.close()
    try:
        process.wait(END_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _how(code: int) -> str:
    """By which signal or with which code a process ended."""
    return f"by {signal.Signals(-code).name}" if code < 0 else f"with code {code}"
