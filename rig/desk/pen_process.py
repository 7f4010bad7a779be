"""The process that follows an accelerometer at the pen, and keeps what is asked for.

Its settings are the argument, as JSON; it answers each line by one, and ends with its input. It is
a process of its own since PortAudio may end, or stop indefinitely, a process whose sound server
dies.
"""

from __future__ import annotations

import json
import shutil
import sys
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from modeling import InputError
from rig.capture.input import AudioInput, InputBlock, InputSettings
from rig.live.driven import settings_from_parent, tell

LOOK_S = 0.25  # from one look at the input to the next
RECENT_S = 2.0  # what is not asked for is forgotten after this time


class PenLog:
    """Keeps the blocks of an input between `begin` and `end`.

    Parameters
    ----------
    source : AudioInput
        Open.
    """

    def __init__(self, source: AudioInput) -> None:
        self._source = source
        self._recent: list[InputBlock] = []
        self._kept: list[InputBlock] = []
        self._keeping = False
        self._lock = threading.Lock()

    def look(self) -> None:
        """Read what is new."""
        with self._lock:
            blocks = self._source.read()
            if self._keeping:
                self._kept += blocks
                return
            self._recent += blocks
            if self._recent:
                oldest_s = self._recent[-1].time_s - RECENT_S
                self._recent = [block for block in self._recent if block.time_s > oldest_s]

    def begin(self, start_s: float) -> None:
        """Keep all from the block on in which this moment lies (by `now_s`)."""
        self.look()
        with self._lock:
            self._kept += [block for block in self._recent if self._end_s(block) > start_s]
            self._recent, self._keeping = [], True

    def end(self) -> None:
        """Keep what has come until now, and nothing that comes later."""
        self.look()
        with self._lock:
            self._keeping = False

    def take(self) -> list[list[InputBlock]]:
        """What was kept since the last call, in pieces within which no sample is missing."""
        self.look()
        with self._lock:
            blocks, self._kept = self._kept, []
        pieces: list[list[InputBlock]] = []
        end = -1
        for block in blocks:
            if block.lost or block.position != end:
                pieces.append([])
            pieces[-1].append(block)
            end = block.position + block.samples.size
        return pieces

    def _end_s(self, block: InputBlock) -> float:
        return block.time_s + block.samples.size / self._source.rate_hz


def main() -> None:
    """Follow the input until standard input ends."""
    settings = settings_from_parent()
    source = AudioInput(InputSettings(**settings["input"]))
    try:
        source.open()
    except InputError as error:
        tell({"error": str(error)})
        return
    log, closing, folder = PenLog(source), threading.Event(), Path(settings["folder"])
    thread = threading.Thread(target=_follow, args=(log, closing), daemon=True)
    thread.start()
    tell({"rate_hz": source.rate_hz})
    for line in sys.stdin:
        tell(_answer(log, source, json.loads(line), folder=folder))
    shutil.rmtree(folder, ignore_errors=True)  # the parent may have been killed
    closing.set()
    source.close()


def _follow(log: PenLog, closing: threading.Event) -> None:
    while not closing.wait(LOOK_S):
        log.look()


def _answer(
    log: PenLog, source: AudioInput, wanted: Mapping[str, Any], *, folder: Path
) -> dict[str, Any]:
    match wanted["do"]:
        case "begin":
            log.begin(wanted["start_s"])
        case "end":
            log.end()
        case "take":
            return {"runs": source.running, "pieces": _saved(log.take(), source, folder)}
    return {}


def _saved(pieces: list[list[InputBlock]], source: AudioInput, folder: Path) -> list[Any]:
    """Each piece as a file of numbers in g, and when it begins."""
    written = []
    for number, piece in enumerate(pieces):
        samples = np.concatenate([block.samples for block in piece])
        path = folder / f"{number}.npy"
        np.save(path, (samples * source.settings.g_per_fullscale).astype(np.float32))
        written.append({"file": str(path), "start_s": piece[0].time_s})
    return written


if __name__ == "__main__":
    main()
