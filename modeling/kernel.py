"""The compiled renderer: `kernel.h` by way of cffi."""

from __future__ import annotations

import os
import warnings
from typing import Any

import numpy as np

from modeling.peq import Floats
from modeling.plan import LayeredModel, RenderCounters, RenderPlan, noise_lowpass

try:
    from modeling._kernel import ffi, lib
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
            stacklevel=4,
        )
    return lib is not None and not os.environ.get(SWITCH)


class CompiledEngine:
    """Renders layered models; bit for bit the same as `modeling.filters.PythonEngine`."""

    def __init__(self, model: LayeredModel, plan: RenderPlan, *, key: np.uint64) -> None:
        table, lowpass = model.table, noise_lowpass(model.rate_hz, plan.rate_hz)
        self._arrays = {
            "speed_mm_s": table.speeds_mm_s,
            "force_n": table.forces_n,
            "values": table.values,
            "signs": table.signs,
            "slews": plan.slews(table),
            "lowpass": lowpass,
        }
        self._texture = ffi.new("tq_texture *", self._numbers(model, plan, lowpass.size))
        for name, array in self._arrays.items():
            self._arrays[name] = np.ascontiguousarray(array, dtype=np.float64)
            setattr(self._texture, name, ffi.from_buffer("double[]", self._arrays[name]))
        reals = lib.TQ_ROWS * table.n_layers + lowpass.size - 1 + lib.TQ_CHUNK
        self._memory = ffi.new("double[]", reals)
        self._state = ffi.new("tq_state *")
        lib.tq_start(self._texture, self._state, self._memory, int(key))

    def _numbers(self, model: LayeredModel, plan: RenderPlan, taps: int) -> dict[str, Any]:
        table, limits = model.table, plan.limits
        numbers: dict[str, Any] = {
            "speeds": table.speeds_mm_s.size,
            "forces": table.forces_n.size,
            "layers": table.n_layers,
            "rate_hz": plan.rate_hz,
            "noise_scale": float(np.sqrt(plan.rate_hz / model.rate_hz)),
            "update_samples": plan.update_samples,
            "taps": taps,
            "speed_change": plan.hand_changes[0],
            "force_change": plan.hand_changes[1],
            "peak": limits.peak if np.isfinite(limits.peak) else 0.0,
            "mean_square": limits.mean_square if np.isfinite(limits.rms) else 0.0,
            "mean_share": plan.mean_share,
            "longest": plan.samples(limits.duration_s),
            "pause": plan.samples(limits.pause_s),
        }
        if plan.compensation is not None:
            numbers["notch_hz"] = plan.compensation.frequency_hz
            numbers["notch_width_hz"] = plan.compensation.bandwidth_hz
            numbers["notch_share"] = plan.compensation.band_share
        return numbers

    @property
    def counters(self) -> RenderCounters:
        """What had to be corrected so far."""
        counters = self._state.counters
        return RenderCounters(
            lift_offs=counters.lift_offs,
            clamped=counters.clamped,
            limited_peak=counters.peak,
            limited_rms=counters.rms,
            limited_duration=counters.duration,
        )

    @property
    def states(self) -> Floats:
        """The filters' states now, (m, 2)."""
        memory = np.frombuffer(ffi.buffer(self._memory))
        return memory[: 2 * self._texture.layers].reshape(2, -1).T.copy()

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
