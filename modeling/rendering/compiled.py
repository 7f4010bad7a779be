"""The compiled renderer: `kernel.h` by way of cffi, called through `call.c`."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.engines import prefers_python
from tactileq.modeling.rendering.plan import LayeredModel, RenderCounters, RenderPlan

try:
    import tactileq.modeling.rendering._kernel as _kernel
    import tactileq.modeling.rendering._kernel_single as _kernel_single
    from tactileq.modeling.rendering._call import Call
except ImportError:  # no compiler at installation
    _kernel = _kernel_single = Call = None


def is_compiled() -> bool:
    """Whether the compiled kernel renders; where there is none, a warning says so once."""
    if Call is None:
        warnings.warn(
            "expected the compiled rendering kernel, got none; rendering continues in Python with "
            "the same numbers, more than a hundred times slower: install a C compiler, "
            "then tactileq.",
            RuntimeWarning,
            stacklevel=1,  # from one place, so that Python shows it once
        )
    return Call is not None and not prefers_python()


def filled_texture(ffi: Any, fields: dict[str, Any], real: type) -> tuple[Any, list[Any]]:
    """A `tq_texture` of these fields, and the arrays that it only points at."""
    return filled(ffi, "tq_texture", fields, real=real)


def filled(
    ffi: Any, structure: str, fields: dict[str, Any], *, real: type
) -> tuple[Any, list[Any]]:
    """A structure of these fields, and the arrays that it only points at."""
    made = ffi.new(f"{structure} *")
    arrays: list[Any] = []
    for name, value in fields.items():
        field = value
        if isinstance(value, np.ndarray):
            arrays.append(np.ascontiguousarray(value, dtype=real))
            field = ffi.from_buffer("tq_real[]", arrays[-1])
        setattr(made, name, field)
    return made, arrays


def render_counters(counters: Any) -> RenderCounters:
    """A `tq_counters`."""
    return RenderCounters(
        lift_offs=counters.lift_offs,
        above_grid=counters.above_grid,
        below_grid=counters.below_grid,
        clamped=counters.clamped,
        limited_peak=counters.peak,
        limited_rms=counters.rms,
        limited_duration=counters.duration,
    )


def memory_reals(lib: Any, texture: Any) -> int:
    """TQ_MEMORY of a texture."""
    rows: int = lib.TQ_ROWS * (-(-texture.layers // lib.TQ_LANES) * lib.TQ_LANES)
    return rows + (lib.TQ_KEPT + lib.TQ_KEPT_DOUBLED if texture.up else 0)


class CompiledEngine:
    """Renders layered models; in double precision bit for bit the same as the `PythonEngine`."""

    # What renders: (speed, force, samples, out), None for what is not given. Each of speed and
    # force is a contiguous array of float64 or a float, or both are None: the hand as last read.
    # None for an answer: it takes none of these.
    call: Callable[..., Any]

    def __init__(self, model: LayeredModel, plan: RenderPlan, *, key: np.uint64) -> None:
        module = _kernel_single if plan.single else _kernel
        self._ffi, self._real = module.ffi, plan.precision
        ffi, lib = module.ffi, module.lib
        self._texture, arrays = filled_texture(ffi, plan.texture(model), self._real)
        self._row = -(-self._texture.layers // lib.TQ_LANES) * lib.TQ_LANES
        self._memory = ffi.new("tq_real[]", memory_reals(lib, self._texture))
        self._state = ffi.new("tq_state *")
        lib.tq_start(self._texture, self._state, self._memory, int(key))
        self._read = lib.tq_read
        functions = (
            ffi.addressof(lib, name) for name in ("tq_render", "tq_render_held", "tq_render_on")
        )
        addresses = [
            int(ffi.cast("uintptr_t", at)) for at in (*functions, self._texture, self._state)
        ]
        owner = (self._texture, self._state, self._memory, arrays)
        self._call = Call(owner, *addresses, plan.single)
        self.call = self._call.render

    @property
    def counters(self) -> RenderCounters:
        """What had to be corrected so far."""
        return render_counters(self._state.counters)

    @property
    def states(self) -> Floats:
        """The filters' states now, (m, 2)."""
        memory = np.frombuffer(self._ffi.buffer(self._memory), dtype=self._real)
        rows = memory[: 2 * self._row].reshape(2, -1)
        return rows[:, : self._texture.layers].T.copy()

    def render(self, speed_mm_s: Floats, force_n: Floats) -> Floats:
        """The next samples for (n,) speeds and forces."""
        rendered: Floats = self.call(speed_mm_s, force_n, None, None)
        return rendered

    def read(self, ago: float, speed_mm_s: float, force_n: float) -> None:
        """A reading that was made so many samples before the next one."""
        if self._call.busy:
            raise RuntimeError(
                "expected a reading between two calls of a renderer, got one while another thread "
                "renders; make a renderer for each thread."
            )
        self._read(self._texture, self._state, ago, speed_mm_s, force_n)

    def render_on(self, samples: int) -> Floats:
        """The next samples for the hand as it was last read."""
        rendered: Floats = self.call(None, None, samples, None)
        return rendered
