"""Whether a machine is fast enough for a session: its screen, its rig and its disk.

docs/method/protocols.md#self-test
"""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tactileq.experiments.console.screens import open_window
from tactileq.experiments.sessions.loop.surfaces import present
from tactileq.modeling import InputError
from tactileq.rig.shared.interface import Presentable, TextureRig

FLIPS = 240
PRESSES = 20
SYNCS = 200
LINE = b'{"event": "selftest"}' + b" " * 300 + b"\n"  # about as long as an answer's


@dataclass(frozen=True, kw_only=True)
class Timing:
    """How long something took, and how long it may.

    Parameters
    ----------
    milliseconds : (n,) sequence of float
        n ≥ 1 measurements.
    limit_ms : float
        What the 99th percentile may be at most.
    """

    name: str
    meaning: str
    milliseconds: Sequence[float]
    limit_ms: float

    @property
    def median_ms(self) -> float:
        """Median."""
        return float(np.median(self.milliseconds))

    @property
    def p99_ms(self) -> float:
        """99th percentile."""
        return float(np.percentile(self.milliseconds, 99))

    @property
    def within(self) -> bool:
        """Whether the 99th percentile keeps the limit."""
        return self.p99_ms <= self.limit_ms


def time_flips(*, screen: int, fullscreen: bool) -> Timing:
    """Intervals between the frames of an empty window.

    Raises
    ------
    InputError
        If there is no screen.
    """
    window = open_window(size=(1280, 800), fullscreen=fullscreen, screen=screen)
    try:
        shown = [_after(window.flip) for _ in range(FLIPS + 1)]
    finally:
        window.close()
    return Timing(
        name="frames",
        meaning="interval between frames",
        milliseconds=(1e3 * np.diff(shown)).tolist(),
        limit_ms=25.0,
    )


def time_presentations(rig: TextureRig, models: Sequence[Presentable]) -> Timing:
    """From asking for a virtual surface, as a press does, to its first sample.

    Raises
    ------
    InputError
        If the rig cannot be opened, or fails while it presents.
    """
    rig.open()
    try:
        taken = []
        for number in range(PRESSES):
            pressed_s = rig.now_s()
            taken.append(1e3 * (present(rig, models[number % len(models)]) - pressed_s))
        faults = rig.take_faults()
    finally:
        rig.close()
    if faults:
        raise InputError(f"expected presentations without a fault, got: {faults[0].sentence}")
    return Timing(
        name="presentations",
        meaning="from a press to the first sample",
        milliseconds=taken,
        limit_ms=100.0,
    )


def time_syncs(folder: Path) -> Timing:
    """How long the disk of a folder takes to keep an answer."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder, buffering=0) as file:
        handle = file.fileno()

        def keep() -> None:
            os.write(handle, LINE)
            os.fsync(handle)

        taken = [_duration_ms(keep) for _ in range(SYNCS)]
    return Timing(
        name="answers", meaning="to store an answer on the disk", milliseconds=taken, limit_ms=50.0
    )


def _after(call: Callable[[], object]) -> float:
    call()
    return time.perf_counter()


def _duration_ms(call: Callable[[], object]) -> float:
    began_s = time.perf_counter()
    call()
    return 1e3 * (time.perf_counter() - began_s)
