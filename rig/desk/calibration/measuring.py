"""Plays on the vibrator and records the accelerometer, in g, with times."""

from __future__ import annotations

import time
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError
from tactileq.rig.devices.sound.vibration import Presented
from tactileq.rig.recording.capture.input import AudioInput, InputBlock

AROUND_S = 0.3
LOST = "lost samples"
LOST_FROM_S = 1.5e-3  # less than any block of a card that records
NEAR_BLOCKS, LEAST_BLOCKS = 25, 10
# Over so long the blocks' times say better how fast a card runs than its own statement does.
LEAST_FOR_RATE_S = 5.0


class PlaysSignals(Protocol):
    """What a measurement needs of `tactileq.rig.devices.sound.output.SoundOutput`."""

    def play_signal(
        self, samples_g: ArrayLike, *, compensated: bool = False, wait: bool = False
    ) -> Presented:
        """Play samples in g, and wait until they are over."""


@dataclass(frozen=True, eq=False)
class Record:
    """What the accelerometer gave.

    Parameters
    ----------
    samples_g : (n,) ndarray
    time_s : float
        Of the first sample, by `now_s`.
    """

    samples_g: Floats
    time_s: float
    rate_hz: float

    def between(self, start_s: float, end_s: float) -> Floats:
        """The samples from one moment to another, by `now_s`."""
        first, end = (
            max(0, round((moment - self.time_s) * self.rate_hz)) for moment in (start_s, end_s)
        )
        return self.samples_g[first:end]


class Accelerometer:
    """An open input of a sound card, read in stretches; 0 is its own zero.

    Parameters
    ----------
    source : AudioInput
        Open.
    """

    def __init__(self, source: AudioInput) -> None:
        self._source = source

    def forget(self) -> None:
        """Discard what was recorded until now."""
        self._source.read()

    def take(self) -> Record:
        """All since the last call.

        Raises
        ------
        InputError
            If the device gives nothing, is gone, or samples were lost.
        """
        stretches = self.stretches()
        if len(stretches) > 1:
            raise InputError(
                f"expected a record of the accelerometer without gaps, got one with {LOST}; close "
                "other programs, and try again."
            )
        return stretches[0]

    def stretches(self) -> list[Record]:
        """All since the last call, cut where samples were lost.

        Raises
        ------
        InputError
            If the device gives nothing, or is gone.
        """
        blocks = self._source.read()
        if not blocks or not self._source.running:
            raise InputError(
                "expected samples of the accelerometer, got none; check that it is plugged in, and "
                "its device under [accelerometer]."
            )
        times = np.array([block.time_s for block in blocks])
        positions = np.array([block.position for block in blocks], dtype=np.float64)
        starts = [0, *gaps(times - positions / self._source.rate_hz), len(blocks)]
        return [self._joined(blocks[start:end]) for start, end in pairwise(starts)]

    def _joined(self, blocks: list[InputBlock]) -> Record:
        samples = np.concatenate([block.samples for block in blocks])
        positions = np.array([block.position - blocks[0].position for block in blocks], np.float64)
        times = np.array([block.time_s for block in blocks])
        rate_hz = self._source.rate_hz
        if positions[-1] > LEAST_FOR_RATE_S * rate_hz:
            rate_hz = float(1 / np.polyfit(positions, times - times[0], 1)[0])
        scale_g = self._source.settings.g_per_fullscale
        return Record(samples * scale_g, float(np.median(times - positions / rate_hz)), rate_hz)

    def record(self, duration_s: float) -> Record:
        """Record for this long; what is left without a gap, where samples were lost."""
        self.forget()
        time.sleep(duration_s + AROUND_S)
        record = max(self.stretches(), key=lambda stretch: stretch.samples_g.size)
        count = round(duration_s * record.rate_hz)
        return Record(record.samples_g[:count], record.time_s, record.rate_hz)

    def record_played(
        self, sound: PlaysSignals, signal_g: Floats, *, raw: bool = False
    ) -> tuple[Record, Presented]:
        """Record what is played, with some silence before and after it.

        Raw signals reach the vibrator without its compensation.
        """
        self.forget()
        time.sleep(AROUND_S)
        presented = sound.play_signal(signal_g, compensated=raw, wait=True)
        time.sleep(AROUND_S)
        return self.take(), presented


def gaps(late_s: Floats) -> list[int]:
    """Before which blocks samples were lost.

    A busy system reports the time of single blocks too late, but of some soon after in time. If
    samples are missing, all following blocks are late. The last ten blocks cannot be judged.

    Parameters
    ----------
    late_s : (n,) ndarray
        Time of each block less that at which its position is due.
    """
    found = []
    start = 0
    for block in range(1, late_s.size - LEAST_BLOCKS):
        before = late_s[max(start, block - NEAR_BLOCKS) : block].min()
        after = late_s[block : block + NEAR_BLOCKS].min()
        if after - before > LOST_FROM_S and late_s[block - 1] < before + LOST_FROM_S:
            found.append(block)
            start = block
    return found
