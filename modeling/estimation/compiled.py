"""The compiled slopes and responses: `slopes.h` by way of cffi."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from tactileq.modeling.arrays import Floats, Integers
from tactileq.modeling.engines import prefers_python

try:
    from tactileq.modeling.estimation._slopes import ffi, lib
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
        of = self._of = ffi.new("tq_spectra *")
        of.rows, of.bins = self.rows, self.bins
        of.power, of.weight, of.tangent, of.cotangent, of.line_hz = map(_pointer, self._arrays)
        of.per_hz, of.highest_hz = np.pi / rate_hz, highest_hz
        of.least_power, of.cancelling = costs.least_power, costs.cancelling
        of.log_share = float(np.log(costs.largest_share))

    def slopes(self, theta: Floats, signs: Floats | None) -> tuple[Floats, Floats, Floats, Floats]:
        """Misfit and objective (K,), information (K, p, p) and score (K, p)."""
        rows, p = theta.shape
        misfit, objective = np.empty(rows), np.empty(rows)
        information, score = np.empty((rows, p, p)), np.empty((rows, p))
        self._call(lib.tq_slopes, theta, signs, misfit, objective, information, score)
        return misfit, objective, information, score

    def responses(self, theta: Floats, signs: Floats | None) -> tuple[Floats, Floats, Floats]:
        """Expected power (K, n), its relative derivatives (K, p, n), and by the tangents (K, n)."""
        rows, p = theta.shape
        power, beside = np.empty((2, rows, self.bins))
        derivative = np.empty((rows, p, self.bins))
        self._call(lib.tq_responses, theta, signs, power, derivative, beside)
        return power, derivative, beside

    def _call(self, function: Any, theta: Floats, signs: Floats | None, *out: Floats) -> None:
        rows, p = theta.shape
        layers = (p - 1) // 3
        theta = np.ascontiguousarray(theta, dtype=np.float64)
        up = ffi.NULL
        if signs is not None:
            each = signs if signs.ndim == 2 else np.broadcast_to(signs, (rows, layers))
            up = _pointer(np.ascontiguousarray(each, dtype=np.float64))
        of = ffi.new("tq_spectra *", self._of[0])  # a copy: other threads may ask for other layers
        of.layers = layers
        memory = np.empty(lib.tq_slopes_memory(layers, self.bins))
        function(of, _pointer(theta), up, _pointer(memory), *map(_pointer, out))


class CompiledLines:
    """A periodogram as the compiled part reads it.

    Parameters
    ----------
    tables : sequence of (lines,) ndarray
        Frequency (Hz), power and weight.
    members : float
        The other members of `tq_lines`.
    """

    def __init__(self, *tables: Floats, **members: float) -> None:
        self._arrays = [np.ascontiguousarray(table, dtype=np.float64) for table in tables]
        of = self._of = ffi.new("tq_lines *", {**members, "lines": tables[0].size})
        of.frequency_hz, of.power, of.weight = map(_pointer, self._arrays)

    def bins(self, centres_hz: Floats, widths_hz: Floats) -> Floats:
        """Power, weight, count, tangent and cotangent of the bins near peaks, (5, n)."""
        of = ffi.new("tq_lines *", self._of[0])
        peaks = [np.ascontiguousarray(peak, dtype=np.float64) for peak in (centres_hz, widths_hz)]
        of.peaks = len(peaks[0])
        of.centres_hz, of.widths_hz = map(_pointer, peaks)
        out = np.empty((6, self._arrays[0].size))
        found: Floats = out[:5, : lib.tq_bins(of, _pointer(out))]
        return found


def held_by_cells(
    slope: Floats,
    off: Floats,
    lowest: Integers,
    *,
    corners: Integers,
    shares: Floats,
    steps: Integers,
    held: float,
) -> tuple[Floats, Floats]:
    """Information (steps, N, p, p) and score (N, p) of what is off in the middles of cells.

    Parameters
    ----------
    slope : (M + N, p, n) ndarray
        Relative derivatives of power: in the middles, then at the nodes.
    off : (M, n) ndarray
        Log amplitude of the middle less what it is held to; 0 where nothing is held.
    lowest : (M, n) ndarray of int
        The corner it is held to; where it is negative, the mean of all.
    corners : (M, 4) ndarray of int
    shares : (4,) ndarray
        Of each corner in the middle.
    steps : (4, 4) ndarray of int
        Which array of blocks couples two corners, the earlier one first.
    held : float
        Weight of a square.
    """
    count, p, places = slope.shape
    nodes = count - len(off)
    blocks, score = np.zeros((int(steps.max()) + 1, nodes, p, p)), np.zeros((nodes, p))
    tables = [np.ascontiguousarray(table, dtype=np.float64) for table in (slope, off, shares)]
    whole = [np.ascontiguousarray(table, dtype=np.intp) for table in (corners, steps, lowest)]
    of = ffi.new("tq_cells *")
    of.slope, of.off, of.shares = map(_pointer, tables)
    of.corners, of.steps, of.lowest = (ffi.from_buffer("ptrdiff_t[]", table) for table in whole)
    of.cells, of.nodes, of.places, of.p, of.held = len(off), nodes, places, p, held
    memory = np.empty(lib.tq_held_memory(p, places))
    lib.tq_held(of, *map(_pointer, (memory, blocks, score)))
    return blocks, score


def _pointer(array: Floats) -> Any:
    return ffi.from_buffer("double[]", array)
