"""The process that plays, driven by `tactileq.rig.devices.sound.messages`.

A process of its own, so that nothing that the experiment does delays it and it can be killed when a
sound server hangs. PortAudio calls `tq_sound_callback` (`rig/shared/live/sound.h`); Python here
only prepares what shall play. When its input ends, which means that its parent is gone, it fades to
silence and ends. docs/method/live.md#processes
"""

from __future__ import annotations

import os
import threading
import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from tactileq.modeling.errors import InputError
from tactileq.modeling.rendering.compiled import filled, memory_reals, render_counters
from tactileq.modeling.rendering.plan import RenderCounters
from tactileq.rig.devices.sound.devices import check_rate, find_device, portaudio
from tactileq.rig.devices.sound.messages import (
    Corrected,
    Count,
    Mask,
    Members,
    Playing,
    PlaySignal,
    PlaySurface,
    Request,
    Silence,
    SoundSettings,
)
from tactileq.rig.shared.live.clock import is_given, now_s
from tactileq.rig.shared.live.compiled import compiled
from tactileq.rig.shared.live.driven import Parent
from tactileq.rig.shared.live.memory import HEARTBEAT_S, OLDEST_READING_S, Live
from tactileq.rig.shared.live.messages import Done, Message

FADE_S = 5e-3
LONGEST_END_S = 1.0  # PortAudio hangs where its server has died
_MILLION = 1_000_000


@dataclass
class _Source:
    """What plays, and all memory that the callback reads of it."""

    kind: str
    address: Any
    kept: tuple[Any, ...]


class Player:
    """The stream and its sources."""

    def __init__(self, settings: SoundSettings) -> None:
        module = compiled()
        self._ffi, self._lib = module.ffi, module.lib
        self._live = Live.attach(settings.live)
        self._sources: dict[int, _Source] = {}
        rate_hz, channels = settings.rate_hz, settings.channels
        device = find_device(settings.device, "output", channels=channels)
        check_rate(device, "output", rate_hz=rate_hz, channels=channels)
        self._memory = self._ffi.new("char[]", self._lib.tq_sound_size())
        self._sound = self._ffi.cast("tq_sound *", self._memory)
        masking = settings.masking_channel
        self._lib.tq_sound_start(
            self._sound,
            self._live.address,
            rate_hz,
            max(1, round(FADE_S * rate_hz)),
            channels,
            settings.vibration_channel,
            -1 if masking is None else masking,
            settings.fullscale_per_g,
            OLDEST_READING_S,
            HEARTBEAT_S,
            settings.masking_key,
        )
        sections = np.frombuffer(settings.weighting).reshape(-1, 5)
        self._lib.tq_sound_weigh(
            self._sound, self._ffi.from_buffer("double *", sections), len(sections)
        )
        if is_given():
            self._lib.tq_sound_follow(self._sound)
        self._stream = self._open(device.index, rate_hz, channels, settings.block)
        self._stream.start()

    def _open(self, device: int, rate_hz: float, channels: int, block: int) -> Any:
        library = portaudio()
        outside = library._ffi
        callback = self._ffi.addressof(self._lib, "tq_sound_callback")
        try:
            return library._StreamBase(
                kind="output",
                samplerate=rate_hz,
                blocksize=block,
                device=device,
                channels=channels,
                dtype="float32",
                latency="low",
                clip_off=True,
                dither_off=True,
                callback=outside.cast("PaStreamCallback *", self._address(callback)),
                userdata=outside.cast("void *", self._address(self._sound)),
            )
        except library.PortAudioError as error:
            raise InputError(
                f"expected a sound device that opens, got {error}; close other programs that use "
                "it, or choose another rate or block."
            ) from None

    def _address(self, pointer: Any) -> int:
        return int(self._ffi.cast("uintptr_t", pointer))

    @property
    def latency_s(self) -> float:
        """Of the output, as PortAudio states it."""
        return float(self._stream.latency)

    def answer(self, request: Request) -> Message:
        """Do what is asked for."""
        match request:
            case PlaySurface():
                self._play_surface(request)
            case PlaySignal():
                self._play_signal(request)
            case Silence():
                self._want()
            case Mask(level):
                self._mask(level)
            case Count(number):
                return Corrected(self._corrected(number))
        self._forget()
        return Done()

    def _play_surface(self, wanted: PlaySurface) -> None:
        texture, arrays = self._filled("tq_texture", wanted.texture)
        source = self._ffi.new("tq_surface *")
        number, key = wanted.presentation, wanted.key
        if wanted.lattice is not None:
            lattice, more = self._filled("tq_lattice", wanted.lattice)
            memory = self._ffi.new("tq_real[]", self._lib.tq_lattice_memory(texture, lattice))
            start = self._lib.tq_surface_start_lattice
            start(source, texture, lattice, memory, key, number)
            arrays += [lattice, *more]
        else:
            memory = self._ffi.new("tq_real[]", memory_reals(self._lib, texture))
            self._lib.tq_surface_start(source, texture, memory, key, number)
        self._sources[number] = _Source("surface", source, (texture, arrays, memory))
        self._want(surface=source)

    def _filled(self, structure: str, members: Members) -> tuple[Any, list[Any]]:
        """A structure of the kernel, and the arrays that it only points at."""
        fields = {
            name: np.frombuffer(value) if isinstance(value, bytes) else value
            for name, value in members.items()
        }
        return filled(self._ffi, structure, fields, real=np.float64)

    def _play_signal(self, wanted: PlaySignal) -> None:
        samples = np.frombuffer(wanted.samples, dtype=np.float32)
        held = self._ffi.from_buffer("float[]", samples)
        source = self._ffi.new("tq_signal *")
        self._lib.tq_signal_start(source, held, samples.size, wanted.presentation)
        self._sources[wanted.presentation] = _Source("signal", source, (samples, held))
        self._want(signal=source)

    def _want(self, *, surface: Any = None, signal: Any = None) -> None:
        """Play one of them, or none, from now on."""
        none = self._ffi.NULL
        self._lib.tq_sound_want(self._sound, surface or none, signal or none, now_s())

    def _mask(self, level: float) -> None:
        self._lib.tq_sound_mask(self._sound, round(level * _MILLION))

    def _corrected(self, number: int) -> RenderCounters | None:
        source = self._sources.get(number)
        if source is None or source.kind != "surface":
            return None
        return render_counters(source.address.voice.state.counters)

    def _forget(self) -> None:
        """Free what is not used any more, but the latest."""
        for number in sorted(self._sources)[:-1]:
            source = self._sources[number]
            uses = getattr(self._lib, f"tq_sound_uses_{source.kind}")
            if not uses(self._sound, source.address):
                del self._sources[number]

    def close(self) -> None:
        """Fade to silence and end; the process ends even where PortAudio hangs."""
        threading.Thread(target=_end_after, args=(LONGEST_END_S,), daemon=True).start()
        self._want()
        self._mask(0)
        end = time.monotonic() + LONGEST_END_S / 2
        while self._lib.tq_sound_plays(self._sound) and time.monotonic() < end:
            time.sleep(0.002)
        time.sleep(FADE_S + min(self.latency_s, LONGEST_END_S / 4))
        self._stream.stop()
        self._stream.close()
        self._live.close()


def _end_after(seconds: float) -> None:
    time.sleep(seconds)
    os._exit(1)


def main() -> None:
    """Play what the parent asks for, until it is gone."""
    with Parent() as parent:
        player = Player(parent.settings(SoundSettings))
        try:
            parent.send(Playing(player.latency_s))
            parent.serve(Request, player.answer)
        finally:
            player.close()


if __name__ == "__main__":
    main()
