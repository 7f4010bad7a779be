"""The compiled renderer: `kernel.h` by way of cffi."""

from __future__ import annotations

import os
import warnings

import numpy as np

from modeling.arrays import Floats
from modeling.rendering.plan import LayeredModel, RenderCounters, RenderPlan

try:
    from modeling.rendering._kernel import ffi, lib
except ImportError:  # no compiler at installation
    lib = ffi = None

# Set to anything, renders in Python although the kernel is there.
SWITCH = "TACTILEQ_NO_KERNEL"


def is_compiled() -> bool:
    """Whether the compiled kernel renders; where there is none, a warning says so once."""
    if lib is None:
        warnings.warn(
            "expected the compiled rendering kernel, got none; rendering goes on in Python with "
            "the same numbers, some hundred times slower: install a C compiler, then tactileq.",
            RuntimeWarning,
            stacklevel=1,  # from one place, so that Python tells it once
        )
    return lib is not None and not os.environ.get(SWITCH)


class CompiledEngine:
    """Renders layered models; bit for bit the same as the `PythonEngine`."""

    def __init__(self, model: LayeredModel, plan: RenderPlan, *, key: np.uint64) -> None:
        self._texture = ffi.new("tq_texture *")
        self._arrays = []  # which the structure only points at
        for name, value in plan.texture(model).items():
            field = value
            if isinstance(value, np.ndarray):
                self._arrays.append(np.ascontiguousarray(value, dtype=np.float64))
                field = ffi.from_buffer("double[]", self._arrays[-1])
            setattr(self._texture, name, field)
        layers, taps = self._texture.layers, self._texture.taps
        self._row = -(-layers // lib.TQ_LANES) * lib.TQ_LANES
        reals = lib.TQ_ROWS * self._row + taps - 1 + lib.TQ_CHUNK  # TQ_MEMORY
        self._memory = ffi.new("double[]", reals)
        self._state = ffi.new("tq_state *")
        lib.tq_start(self._texture, self._state, self._memory, int(key))

    @property
    def counters(self) -> RenderCounters:
        """What had to be corrected so far."""
        counters = self._state.counters
        return RenderCounters(
            lift_offs=counters.lift_offs,
            above_grid=counters.above_grid,
            below_grid=counters.below_grid,
            clamped=counters.clamped,
            limited_peak=counters.peak,
            limited_rms=counters.rms,
            limited_duration=counters.duration,
        )

    @property
    def states(self) -> Floats:
        """The filters' states now, (m, 2)."""
        memory = np.frombuffer(ffi.buffer(self._memory))
        rows = memory[: 2 * self._row].reshape(2, -1)
        return rows[:, : self._texture.layers].T.copy()

    def render(self, speed_mm_s: Floats, force_n: Floats) -> Floats:
        """The next samples for (n,) speeds and forces."""
        output = np.empty(speed_mm_s.size)
        lib.tq_render(
            self._texture,
            self._state,
            ffi.from_buffer("double[]", speed_mm_s),
            ffi.from_buffer("double[]", force_n),
            ffi.from_buffer("double[]", output),
            output.size,
        )
        return output
