"""What the process of a device is asked to have it play, and what it answers."""

from __future__ import annotations

from tactileq.modeling.rendering.plan import RenderCounters
from tactileq.rig.shared.live.messages import Message


class Describe(Message, frozen=True):
    """What is the board? Answered with `real_size` and `most_g`."""


class PlayModel(Message, frozen=True, kw_only=True):
    """Play a model under the tool from now on: an upload, and its hash."""

    presentation: int
    data: bytes
    digest: int


class PlaySamples(Message, frozen=True, kw_only=True):
    """Play samples once, in g, as bytes of float32."""

    presentation: int
    samples: bytes


class StopPlaying(Message, frozen=True):
    """Fade to silence."""


class CountCorrections(Message, frozen=True):
    """What did rendering a presentation have to correct so far?"""

    presentation: int


Wanted = Describe | PlayModel | PlaySamples | StopPlaying | CountCorrections


class DeviceRequest(Message, frozen=True):
    """One of them, with a number."""

    number: int
    wanted: Wanted


class DeviceAnswer(Message, frozen=True, kw_only=True):
    """The answer to a request of this number.

    `sentence` says why not, where it was refused or the device is `lost`. `real_size`: bytes of a
    number of the kernel;
    `most_g`: what the vibrator's converter takes, in its own unit. `counters`: None of samples, or
    of what was not presented last.
    """

    number: int
    sentence: str = ""
    lost: bool = False
    real_size: int = 0
    most_g: float = 0.0
    counters: RenderCounters | None = None
