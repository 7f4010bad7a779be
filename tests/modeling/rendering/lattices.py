"""All-pole models that everybody can see, `lattice.h` as a renderer, and the same in Python."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tactileq.modeling import Renderer
from tactileq.modeling.arrays import Floats
from tactileq.modeling.models.ar_model import ARModel
from tactileq.modeling.models.line_spectral import line_spectral_frequencies
from tactileq.modeling.rendering.compiled import filled, render_counters
from tactileq.modeling.rendering.lattice import lattice_fields
from tactileq.modeling.rendering.noise import stream_key
from tactileq.modeling.rendering.plan import RenderCounters, plan_for
from tactileq.rig.shared.live.compiled import compiled


def ar_model(
    *conditions: tuple[ArrayLike, float], shape: tuple[int, int] = (2, 2), rate_hz: float = 5000.0
) -> ARModel:
    """Filters a₁ … a_p with their gains, one for each condition of a grid of speeds × forces."""
    frequencies = np.array([line_spectral_frequencies(a) for a, _ in conditions])
    return ARModel(
        texture="planted",
        rate_hz=rate_hz,
        speeds_mm_s=np.linspace(50.0, 350.0, shape[0]),
        forces_n=np.linspace(0.5, 3.5, shape[1]),
        line_spectral_frequencies=frequencies.reshape(*shape, -1),
        gains=np.reshape([gain for _, gain in conditions], shape),
        level_sd_db=np.zeros(shape),
        simulated=True,
    )


def poles(*of: tuple[float, float]) -> Floats:
    """a₁ … a_p with a pair of poles at each (radius, angle in radians)."""
    a = np.ones(1)
    for radius, angle in of:
        a = np.convolve(a, [1.0, -2 * radius * np.cos(angle), radius**2])
    return a[1:]


def planted_ar(gain: float = 0.05, *, rate_hz: float = 5000.0) -> ARModel:
    """Two speeds, two forces, order 4."""
    places = [(0.97, 0.1), (0.95, 0.2), (0.9, 0.4), (0.98, 0.3)]
    conditions = [(poles(place, (0.8, 2.0)), gain * (1 + n / 4)) for n, place in enumerate(places)]
    return ar_model(*conditions, rate_hz=rate_hz)


class CompiledLattice:
    """`lattice.h` at a rate, in silence at the start of a stream."""

    def __init__(
        self, model: ARModel, *, rate_hz: float, seed: int = 0, stream: int = 0, **plan: Any
    ) -> None:
        module = compiled()
        self._ffi, self._lib = module.ffi, module.lib
        fields = lattice_fields(model, plan_for(model.rate_hz, rate_hz=rate_hz, **plan))
        self._texture, arrays = filled(self._ffi, "tq_texture", fields.texture, real=np.float64)
        self._lattice, more = filled(self._ffi, "tq_lattice", fields.lattice, real=np.float64)
        memory = self._ffi.new(
            "tq_real[]", self._lib.tq_lattice_memory(self._texture, self._lattice)
        )
        self._state, self._filter = self._ffi.new("tq_state *"), self._ffi.new("tq_lattice_state *")
        self._kept = (arrays, more, memory)
        self._order = model.order
        states = self._texture, self._lattice, self._state, self._filter
        self._lib.tq_lattice_start(*states, memory, int(stream_key(seed, stream)))

    def held(self, speed_mm_s: float, force_n: float, *, samples: int) -> Floats:
        """The next samples for a hand that is held."""
        out = np.full(samples, np.nan)
        into = self._ffi.from_buffer("tq_real[]", out)
        states = self._texture, self._lattice, self._state, self._filter
        self._lib.tq_lattice_render_held(*states, speed_mm_s, force_n, into, samples)
        return out

    def read(self, speed_mm_s: float, force_n: float, *, ago: float) -> None:
        """A reading that was made so many samples before the next one."""
        self._lib.tq_read(self._texture, self._state, ago, speed_mm_s, force_n)

    def on(self, samples: int) -> Floats:
        """The next samples for the hand as last read."""
        out = np.full(samples, np.nan)
        into = self._ffi.from_buffer("tq_real[]", out)
        states = self._texture, self._lattice, self._state, self._filter
        self._lib.tq_lattice_render_on(*states, into, samples)
        return out

    def blocks(self, speeds: Floats, forces: Floats, *, block: int) -> Floats:
        """The next samples for hands that are held for a block each."""
        pairs = zip(speeds.tolist(), forces.tolist(), strict=True)
        return np.concatenate([self.held(*pair, samples=block) for pair in pairs])

    @property
    def counters(self) -> RenderCounters:
        return render_counters(self._state.counters)

    @property
    def states(self) -> Floats:
        """What the stages hold, (p,)."""
        return np.array(self._ffi.unpack(self._filter.held, self._order))


def in_python(
    model: ARModel, speeds: Floats, forces: Floats, *, rate_hz: float, **renderer: Any
) -> Floats:
    """The same at this rate, for hands given at each of its samples."""
    return Renderer(model, rate_hz=rate_hz, **renderer).render(speeds, forces)
