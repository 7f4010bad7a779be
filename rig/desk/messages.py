"""What the process that follows an accelerometer at the pen is told, and what it answers."""

from __future__ import annotations

from tactileq.rig.shared.live.messages import Message


class Listening(Message, frozen=True):
    """The input is open, at this rate."""

    rate_hz: float


class Begin(Message, frozen=True):
    """Keep what is measured from this moment on (by `now_s`)."""

    start_s: float


class End(Message, frozen=True):
    """Keep no more."""


class Take(Message, frozen=True):
    """What was kept since the last request of this kind?"""


class SampleBlock(Message, frozen=True):
    """Samples in g, as bytes of float32, of which none is missing, and when the first was taken."""

    start_s: float
    samples_g: bytes


class Taken(Message, frozen=True):
    """The answer, and whether the input still runs."""

    runs: bool
    pieces: tuple[SampleBlock, ...]


Request = Begin | End | Take
