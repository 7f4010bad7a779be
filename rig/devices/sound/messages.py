"""What the process that plays is told, and what it answers."""

from __future__ import annotations

from tactileq.modeling.rendering.plan import RenderCounters
from tactileq.rig.shared.live.messages import Message

# Members of a structure in C by name; arrays as bytes of float64.
Members = dict[str, int | float | bytes]


class SoundSettings(Message, frozen=True, kw_only=True):
    """What it is started with: the path of the shared memory, and what `SoundOutput` describes."""

    live: str
    device: str | None
    rate_hz: float
    block: int
    channels: int
    vibration_channel: int
    masking_channel: int | None
    fullscale_per_g: float
    masking_key: int
    weighting: bytes  # sections of five numbers, float64


class Playing(Message, frozen=True):
    """The stream runs, with this latency, and plays silence."""

    latency_s: float


class PlaySurface(Message, frozen=True, kw_only=True):
    """Play a texture, or an all-pole model's lattice, from now on."""

    presentation: int
    key: int  # of its noise
    texture: Members
    lattice: Members | None = None


class PlaySignal(Message, frozen=True):
    """Play a signal once: samples in g, as bytes of float32."""

    presentation: int
    samples: bytes


class Silence(Message, frozen=True):
    """Fade to silence."""


class Mask(Message, frozen=True):
    """Masking noise of this RMS, in shares of full scale, from now on."""

    level: float


class Count(Message, frozen=True):
    """What did rendering a presentation have to correct so far?"""

    presentation: int


class Corrected(Message, frozen=True):
    """The answer: None of a signal, or of what was not presented."""

    counters: RenderCounters | None


Request = PlaySurface | PlaySignal | Silence | Mask | Count
