"""The compiled slopes and responses: `slopes.h` by way of cffi."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from modeling.arrays import Floats
from modeling.engines import prefers_python

try:
    from modeling.estimation._slopes import ffi, lib
except ImportError:  # no compiler at installation
    ffi = lib = None


def is_compiled() -> bool:
    """Whether the compiled part computes; NumPy does the same, some five times slower."""
    return lib is not None and not prefers_python()


class Costs(NamedTuple):
    """Constants of the objective, see `coherent`."""

    least_power: float
    cancelling: float
    largest_share: float


class CompiledSpectra:
    """Spectra as the compiled part reads them.

    Parameters
    ----------
    tables : sequence of (K, n) ndarray
        Power, weight, tangent and cotangent.
    line_hz : (K,) ndarray
    rate_hz, highest_hz : float
        Layers above `highest_hz` are looked at there.
    costs : Costs
    """

    def __init__(
        self,
        *tables: Floats,
        line_hz: Floats,
        rate_hz: float,
        highest_hz: float,
        costs: Costs,
    ) -> None:
        # C reads these arrays wherever they lie; they have to live as long.
        self._arrays = [np.ascontiguousarray(t, dtype=np.float64) for t in (*tables, line_hz)]
        self.rows, self.bins = self._arrays[0].shape
        power, weight, tangent, cotangent, line = map(_pointer, self._arrays)
        self._fields = {
            "rows": self.rows,
            "bins": self.bins,
            "per_hz": np.pi / rate_hz,
            "highest_hz": highest_hz,
            "least_power": costs.least_power,
            "cancelling": costs.cancelling,
            "log_share": float(np.log(costs.largest_share)),
            "power": power,
            "weight": weight,
            "tangent": tangent,
            "cotangent": cotangent,
            "line_hz": line,
        }

    def slopes(self, theta: Floats, signs: Floats | None) -> tuple[Floats, Floats, Floats, Floats]:
        """Misfit and objective (K,), information (K, p, p) and score (K, p)."""
        rows, p = theta.shape
        misfit, objective = np.empty(rows), np.empty(rows)
        information, score = np.empty((rows, p, p)), np.empty((rows, p))
        self._call(lib.tq_slopes, theta, signs, misfit, objective, information, score)
        return misfit, objective, information, score

    def responses(self, theta: Floats, signs: Floats | None) -> tuple[Floats, Floats]:
        """Expected power (K, n) and its relative derivatives (K, p, n)."""
        rows, p = theta.shape
        power, derivative = np.empty((rows, self.bins)), np.empty((rows, p, self.bins))
        self._call(lib.tq_responses, theta, signs, power, derivative)
        return power, derivative

    def _call(self, function: Any, theta: Floats, signs: Floats | None, *out: Floats) -> None:
        rows, p = theta.shape
        layers = (p - 1) // 3
        theta = np.ascontiguousarray(theta, dtype=np.float64)
        up = ffi.NULL
        if signs is not None:
            each = np.ascontiguousarray(np.broadcast_to(signs, (rows, layers)), dtype=np.float64)
            up = _pointer(each)
        of = ffi.new("tq_spectra *", {**self._fields, "layers": layers})
        memory = np.empty(lib.tq_slopes_memory(layers, self.bins))
        function(of, _pointer(theta), up, _pointer(memory), *map(_pointer, out))


def _pointer(array: Floats) -> Any:
    return ffi.from_buffer("double[]", array)
