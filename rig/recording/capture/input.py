"""An input of a sound card: acceleration with the time of every block, and what goes wrong.

docs/method/strokes.md#clocks
"""

from __future__ import annotations

import atexit
import sys
import threading
from collections import deque
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactileq.modeling.arrays import Floats
from tactileq.modeling.checks import check_rate, check_whole, is_positive
from tactileq.modeling.errors import InputError, shortened, shown
from tactileq.rig.devices.sound.devices import check_rate as check_device_rate
from tactileq.rig.devices.sound.devices import find_device, portaudio
from tactileq.rig.shared.live.clock import called, now_s

BLOCK_S = 0.02
MOST_CHANNELS = 64
# If even the most punctual of the last blocks is so much later than before, samples are missing.
LOST_FROM_S = 0.01
# Without a call for this long, the stream has ended; the first one may take so much longer.
SILENT_S = 2.0
BEGIN_S = 5.0
END_S = 2.0
# So long a callback waits for other Python threads. With Python's 5 ms blocks of a few ms were lost
# two to five times as often (two shared cores, audio server at 48 kHz and blocks of 256).
SWITCH_S = 0.0005
_COMPARED = 25


@dataclass(frozen=True)
class InputSettings:
    """Which input of which device, and what its samples mean.

    Parameters
    ----------
    g_per_fullscale : float
        Acceleration of a sample of 1, > 0.
    device : str, optional
        Its name, or a part that no other has; the system's usual one without it.
    channel : int
        From 1, to 64.
    rate_hz : float, optional
        That of the device without it.
    """

    g_per_fullscale: float
    device: str | None = None
    channel: int = 1
    rate_hz: float | None = None

    def __post_init__(self) -> None:
        if not is_positive(self.g_per_fullscale):
            raise InputError(
                "expected the acceleration of a full-scale sample above 0 g, got "
                f"{shown(self.g_per_fullscale)}; correct it."
            )
        check_whole("the channel", self.channel, low=1, high=MOST_CHANNELS)
        if self.rate_hz is not None:
            check_rate(self.rate_hz)


@dataclass(frozen=True, eq=False)
class InputBlock:
    """What one call of the audio system brought.

    Parameters
    ----------
    position : int
        Of the first sample, from the stream's start; lost samples are not counted.
    samples : (n,) ndarray
        Shares of full scale.
    time_s : float
        When the first sample was measured, by `tactileq.rig.shared.live.clock.now_s`; the input
        latency is taken off.
    lost : bool
        Whether samples are missing between the block before and this one.
    """

    position: int
    samples: Floats
    time_s: float
    lost: bool


class AudioInput:
    """A stream from a sound card, through PortAudio; open it, or use it in a `with` block.

    Raises
    ------
    InputError
        When it is opened: for a device, channel or rate that there is not.
    """

    def __init__(self, settings: InputSettings) -> None:
        self.settings = settings
        self.device_name = ""
        self.rate_hz = 0.0
        self.latency_s = 0.0
        self._stream: Any = None
        self._called_s = 0.0
        self._switch_s = sys.getswitchinterval()
        self._calls: SimpleQueue[_Call] = SimpleQueue()
        self._timeline = _Timeline(1.0)

    def open(self) -> None:
        """Begin to listen."""
        channels, wanted_hz = self.settings.channel, self.settings.rate_hz
        device = find_device(self.settings.device, "input", channels=channels)
        self.device_name = device.name
        rate_hz = device.rate_hz if wanted_hz is None else wanted_hz
        check_device_rate(device, "input", rate_hz=rate_hz, channels=channels)
        library = portaudio()
        try:
            self._stream = library.InputStream(
                device=device.index,
                channels=channels,
                samplerate=rate_hz,
                blocksize=round(BLOCK_S * rate_hz),
                dtype="float32",
                latency="high",
                callback=self._take,
            )
            # Some cards run at another rate than they were asked for, and say so.
            self.rate_hz = float(self._stream.samplerate)
            self.latency_s = float(self._stream.latency)
            self._timeline = _Timeline(self.rate_hz)
            self._called_s = now_s() + BEGIN_S
            self._switch_s = sys.getswitchinterval()
            sys.setswitchinterval(SWITCH_S)
            self._stream.start()
        except library.PortAudioError as error:
            self.close()
            raise InputError(
                f"expected to record from {shown(self.device_name)}, got the refusal "
                f"{shortened(_words(error))}; close other programs that use it, or choose another "
                "device."
            ) from None

    def close(self) -> None:
        """Stop listening; closing twice does nothing."""
        stream, self._stream = self._stream, None
        if stream is not None:
            sys.setswitchinterval(self._switch_s)
            _end_stream(stream)

    def __enter__(self) -> AudioInput:
        self.open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def running(self) -> bool:
        """Whether the stream still runs; False once the device or the audio server is gone."""
        # An audio server that dies just stops calling.
        return self._stream is not None and now_s() - self._called_s < SILENT_S

    def read(self) -> list[InputBlock]:
        """The blocks since the last call, in their order; it does not wait."""
        blocks: list[InputBlock] = []
        while True:
            try:
                call = self._calls.get_nowait()
            except Empty:
                return blocks
            blocks.append(self._timeline.block(call))

    def _take(self, data: NDArray[np.float32], frames: int, time: Any, status: Any) -> None:
        """PortAudio's callback: put the block aside, with all clocks."""
        now = self._called_s = now_s()
        called(now + SILENT_S / 2)
        self._calls.put(
            _Call(
                data[:, self.settings.channel - 1].astype(np.float64),
                now,
                float(time.currentTime),
                float(time.inputBufferAdcTime) or float(time.currentTime) - self.latency_s,
                bool(status.input_overflow),
            )
        )


@dataclass(frozen=True, eq=False)
class _Call:
    """What the audio system said in one call; `now_s` by the rig's clock, the others by its own."""

    samples: Floats
    now_s: float
    current_s: float
    measured_s: float
    overflow: bool


class _Timeline:
    """Puts the calls of a stream on the rig's clock, and finds where samples are missing."""

    def __init__(self, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._position = 0
        self._expected_s: float | None = None
        self._behind_s: deque[float] = deque(maxlen=_COMPARED)

    def block(self, call: _Call) -> InputBlock:
        position, size = self._position, call.samples.size
        began_s = position / self._rate_hz
        # The stream's own clock may stop with the card, so only its latency is used.
        measured_s = call.now_s - (call.current_s - call.measured_s)
        lost = position > 0 and (call.overflow or self._jumps(call.measured_s))
        before = min(self._behind_s, default=None)
        if lost:
            self._behind_s.clear()
        self._behind_s.append(measured_s - began_s)
        # A callback can only be late to read the clock, so the least difference is the nearest.
        behind_s = min(self._behind_s)
        slipped = before is not None and behind_s > before + LOST_FROM_S
        self._position += size
        self._expected_s = call.measured_s + size / self._rate_hz
        return InputBlock(position, call.samples, began_s + behind_s, lost=lost or slipped)

    def _jumps(self, measured_s: float) -> bool:
        """Whether the stream's clock shows that a whole block is missing."""
        return self._expected_s is not None and measured_s > self._expected_s + 0.95 * BLOCK_S


def _end_stream(stream: Any) -> None:
    """Stop and close a stream; one whose server has died would hang indefinitely, and is left."""

    def end() -> None:
        stream.abort(ignore_errors=True)
        stream.close(ignore_errors=True)

    thread = threading.Thread(target=end, daemon=True)
    thread.start()
    thread.join(END_S)
    if thread.is_alive():
        # It would hang again when the interpreter ends.
        atexit.unregister(portaudio()._exit_handler)


def _words(error: Exception) -> str:
    return str(error.args[0]) if error.args else str(error)
