"""The process that follows an accelerometer at the pen, and keeps what is asked for.

It is driven by `tactileq.rig.desk.messages`, and a process of its own since PortAudio may end, or
stop indefinitely, a process whose sound server dies.
"""

from __future__ import annotations

import threading

import numpy as np

from tactileq.rig.desk.messages import Begin, End, Listening, Request, SampleBlock, Take, Taken
from tactileq.rig.recording.capture.input import AudioInput, InputBlock, InputSettings
from tactileq.rig.shared.live.driven import Parent
from tactileq.rig.shared.live.messages import Done, Message

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
    """Follow the input until the parent is gone."""
    with Parent() as parent:
        source = AudioInput(parent.settings(InputSettings))
        source.open()
        log, closing = PenLog(source), threading.Event()
        threading.Thread(target=_follow, args=(log, closing), daemon=True).start()
        parent.send(Listening(source.rate_hz))
        parent.serve(Request, lambda request: _answer(log, source, request=request))
        closing.set()
        source.close()


def _follow(log: PenLog, closing: threading.Event) -> None:
    while not closing.wait(LOOK_S):
        log.look()


def _answer(log: PenLog, source: AudioInput, *, request: Request) -> Message:
    match request:
        case Begin(start_s):
            log.begin(start_s)
        case End():
            log.end()
        case Take():
            scale = source.settings.g_per_fullscale
            return Taken(source.running, tuple(_piece(blocks, scale) for blocks in log.take()))
    return Done()


def _piece(blocks: list[InputBlock], scale: float) -> SampleBlock:
    samples_g = scale * np.concatenate([block.samples for block in blocks])
    return SampleBlock(blocks[0].time_s, samples_g.astype(np.float32).tobytes())


if __name__ == "__main__":
    main()
