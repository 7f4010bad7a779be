"""What the audio callback does, called without a card and in virtual time."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from tactileq.modeling.rendering.compiled import filled, filled_texture, memory_reals
from tactileq.modeling.rendering.lattice import lattice_fields
from tactileq.modeling.rendering.limits import Limits
from tactileq.modeling.rendering.noise import stream_key
from tactileq.modeling.rendering.plan import RenderPlan, plan_for
from tactileq.modeling.vibrators.exposure import hand_arm_sections
from tactileq.rig.shared.live.compiled import compiled
from tactileq.rig.shared.live.memory import CONTACT, OLDEST_READING_S, Live, Rows
from tactileq.stimuli.planted.textures import planted_texture
from tests.modeling.rendering.lattices import planted_ar

RATE_HZ = 48000.0
FADE = 240
Array = np.ndarray[Any, np.dtype[Any]]


class Callback:
    """What the sound process prepares, with the callback called here, at `time_s`."""

    def __init__(self, live: Live, *, scale: float, masking: int = -1) -> None:
        module = compiled()
        self._ffi, self._lib, self.live = module.ffi, module.lib, live
        self._kept: list[Any] = [self._ffi.new("char[]", self._lib.tq_sound_size())]
        self._sound = self._ffi.cast("tq_sound *", self._kept[0])
        self.asked_age_s = 1e6
        self.time_s = 1000.0
        self.leaves: Array = np.zeros((1, 2), dtype=np.float32)  # what the block being rendered is
        self._lib.tq_sound_start(
            self._sound,
            live.address,
            RATE_HZ,
            FADE,
            2,
            0,
            masking,
            scale,
            OLDEST_READING_S,
            1.0,
            5,
        )
        sections = hand_arm_sections(RATE_HZ)
        self._lib.tq_sound_weigh(
            self._sound, self._ffi.from_buffer("double *", sections), len(sections)
        )

    def texture(self, number: int, limits: Limits, gain: float = 1.0, *, name: str = "MDF") -> None:
        made = planted_texture(name)
        made = replace(made, noise_gains=gain * made.noise_gains, gains=gain * made.gains)
        fields = _plan(made.rate_hz, limits).texture(made)
        texture, arrays = filled_texture(self._ffi, fields, np.float64)
        memory = self._ffi.new("tq_real[]", memory_reals(self._lib, texture))
        source = self._ffi.new("tq_surface *")
        self._kept += [texture, arrays, memory, source]
        self._lib.tq_surface_start(source, texture, memory, int(stream_key(0)), number)
        self.want(surface=source)

    def lattice(self, number: int, limits: Limits, gain: float = 1.0) -> None:
        """An all-pole model."""
        made = planted_ar(gain)
        fields = lattice_fields(made, _plan(made.rate_hz, limits))
        texture, arrays = filled(self._ffi, "tq_texture", fields.texture, real=np.float64)
        lattice, more = filled(self._ffi, "tq_lattice", fields.lattice, real=np.float64)
        memory = self._ffi.new("tq_real[]", self._lib.tq_lattice_memory(texture, lattice))
        source = self._ffi.new("tq_surface *")
        self._kept += [texture, lattice, arrays, more, memory, source]
        key = int(stream_key(0))
        self._lib.tq_surface_start_lattice(source, texture, lattice, memory, key, number)
        self.want(surface=source)

    def signal(self, number: int, samples_g: Array) -> None:
        samples = samples_g.astype(np.float32)
        held, source = self._ffi.from_buffer("float[]", samples), self._ffi.new("tq_signal *")
        self._kept += [samples, held, source]
        self._lib.tq_signal_start(source, held, samples.size, number)
        self.want(signal=source)

    def silence(self) -> None:
        self.want()

    def want(self, *, surface: Any = None, signal: Any = None) -> None:
        """Asked for so long ago, without more ado, that only heartbeats count."""
        none = self._ffi.NULL
        asked_s = self.time_s - self.asked_age_s
        self._lib.tq_sound_want(self._sound, surface or none, signal or none, asked_s)

    def mask(self, level: float) -> None:
        self._lib.tq_sound_mask(self._sound, round(1e6 * level))

    def play(self, frames: int, *, speed_mm_s: float = 150.0, force_n: float = 1.5) -> Array:
        """The next samples of the vibration, (frames,), for a hand read just before.

        Whoever drives it has just looked, too.
        """
        self.look(0.0)
        self.read(0.0, speed_mm_s, force_n)
        return self.play_on(frames)

    def read(self, age_s: float, speed_mm_s: float, force_n: float) -> None:
        """Write a reading of this age."""
        self.live.write_reading(
            self.time_s - age_s,
            0.0,
            y_mm=0.0,
            speed_mm_s=speed_mm_s,
            force_n=force_n,
            flags=CONTACT,
        )

    def play_on(self, frames: int, *, late_s: float = 0.0) -> Array:
        """The same for the hand as it was read last, called so late."""
        self.leaves = out = np.full((frames, 2), np.nan, dtype=np.float32)
        into = self._ffi.from_buffer("float[]", out)
        row = self._ffi.new("tq_block *")
        row[0] = self._lib.tq_sound_block(self._sound, self.time_s + late_s, into, frames)
        self._lib.tq_write_block(self.live.address, row)
        self.time_s += frames / RATE_HZ
        self.masked = out[:, 1]
        return out[:, 0]

    def look(self, age_s: float) -> None:
        """Write a heartbeat of this age."""
        self._lib.tq_heartbeat(self.live.address, self.time_s - age_s)

    def log(self) -> Rows:
        return self.live.blocks_since(0)[1]


def _plan(model_rate_hz: float, limits: Limits) -> RenderPlan:
    return plan_for(model_rate_hz, rate_hz=RATE_HZ, limits=limits, hold_s=OLDEST_READING_S)
