"""Consistent names of layers over the whole grid (docs/method/fitting.md#tracking; PAPER III)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tactileq.modeling.arrays import Bools, Floats, Integers
from tactileq.modeling.estimation.layers import EstimatorName, Layers
from tactileq.modeling.estimation.paper import find_peak_frequencies, fit_layers
from tactileq.modeling.models.grid import Condition, fill_grid, grid_axes
from tactileq.modeling.recordings.spectrum import Spectrum


def paper_arrays(
    spectra: dict[Condition, Spectrum], estimator: EstimatorName, *, texture: str
) -> dict[str, Any]:
    """The arrays of a model by the paper's recipe, one name per layer over the whole grid.

    Parameters
    ----------
    spectra : dict of (speed, force) to Spectrum
        One condition at least.
    estimator : {"paper", "paper-consistent"}
    texture : str
        For messages.
    """
    return _grids(_track(spectra, estimator), texture)


@dataclass(frozen=True, eq=False)
class _Tracked:
    """Layers of one condition under their names, and which of them had no peak of their own."""

    layers: Layers
    inherited: Bools


def _track(
    spectra: dict[Condition, Spectrum], estimator: EstimatorName
) -> dict[Condition, _Tracked]:
    """Layers of all conditions under common names, in order (docs/method/fitting.md#tracking)."""
    peaks = {condition: find_peak_frequencies(s) for condition, s in spectra.items()}
    order = visiting_order(list(spectra))
    lead = next((c for c in order if peaks[c].size), order[0])
    unknown = np.full(peaks[lead].shape, np.nan)
    first = fit_layers(
        spectra[lead], peaks[lead], fallback_bandwidths_hz=unknown, estimator=estimator
    )
    tracked = {lead: _Tracked(first, np.zeros(peaks[lead].shape, dtype=bool))}
    for condition in order:
        if condition == lead:
            continue
        reference = tracked[reference_of(condition, list(tracked))].layers
        chosen = assign_peaks(peaks[condition], reference.frequencies_hz)
        inherited = chosen < 0
        frequencies = reference.frequencies_hz.copy()
        frequencies[~inherited] = peaks[condition][chosen[~inherited]]
        layers = fit_layers(
            spectra[condition],
            frequencies,
            fallback_bandwidths_hz=reference.bandwidths_hz,
            estimator=estimator,
        )
        tracked[condition] = _Tracked(layers, inherited)
    return tracked


def _grids(tracked: Mapping[Condition, _Tracked], texture: str) -> dict[str, Any]:
    """The model's arrays; holes of the grid are filled from their neighbours and marked."""

    def grid(name: str) -> Floats:
        return fill_grid({c: getattr(t.layers, name) for c, t in tracked.items()}, texture)[0]

    def marks(rows: Mapping[Condition, Bools]) -> Bools:
        known = {c: row.astype(np.float64) for c, row in rows.items()}
        # A condition that was filled in has no marks of its own.
        marked: Bools = fill_grid(known, texture)[0] == 1
        return marked & ~interpolated[:, :, None]

    noise = {c: np.array([t.layers.noise_gain]) for c, t in tracked.items()}
    noise_gains, interpolated = fill_grid(noise, texture)
    speeds, forces = grid_axes(tracked)
    return {
        "speeds_mm_s": np.array(speeds),
        "forces_n": np.array(forces),
        "noise_gains": noise_gains[:, :, 0],
        **{
            name: grid(name) for name in ("frequencies_hz", "bandwidths_hz", "gains", "level_sd_db")
        },
        "inherited": marks({c: t.inherited for c, t in tracked.items()}),
        "unresolved": marks({c: t.layers.unresolved for c, t in tracked.items()}),
        "interpolated": interpolated,
    }


def visiting_order(conditions: Sequence[Condition]) -> list[Condition]:
    """(speed, force) pairs force by force downwards, and within a force by falling speed."""
    return sorted(conditions, key=lambda c: (-c[1], -c[0]))


def reference_of(condition: Condition, visited: Sequence[Condition]) -> Condition:
    """The condition whose layers name the peaks of this one.

    The next-faster one at the same force, else the next-stronger one at the same speed. Where that
    speed was not recorded at all yet, the one at the nearest force whose speed is nearest.
    """
    speed, force = condition
    faster = [c for c in visited if c[1] == force and c[0] > speed]
    if faster:
        return min(faster)
    stronger = [c for c in visited if c[0] == speed and c[1] > force]
    if stronger:
        return min(stronger, key=lambda c: c[1])
    return min(visited, key=lambda c: (abs(c[1] - force), abs(c[0] - speed)))


def assign_peaks(peaks_hz: Floats, layers_hz: Floats) -> Integers:
    """Which peak belongs to which layer.

    A peak takes the name of the nearest layer, within half the gap to that layer's neighbours
    (outermost layers use their inner gap on both sides; a single layer f/2). In a conflict the
    nearest peak wins.

    Parameters
    ----------
    peaks_hz : (k,) ndarray
        Peaks found in this condition, any order.
    layers_hz : (m,) ndarray
        The layers' frequencies in the reference condition, any order.

    Returns
    -------
    (m,) ndarray of int
        Index of each layer's peak, −1 where it has none. No peak is used twice.
    """
    chosen = np.full(layers_hz.size, -1, dtype=np.intp)
    if not (peaks_hz.size and layers_hz.size):
        return chosen
    below, above = _reaches(layers_hz)
    offset = peaks_hz[None, :] - layers_hz[:, None]
    distance = np.abs(offset)
    nearest = np.argmin(distance, axis=0)
    for layer in range(layers_hz.size):
        reach = np.where(offset[layer] < 0, below[layer], above[layer])
        mine = (nearest == layer) & (distance[layer] <= reach)
        if mine.any():
            chosen[layer] = np.argmin(np.where(mine, distance[layer], np.inf))
    return chosen


def _reaches(layers_hz: Floats) -> tuple[Floats, Floats]:
    """How far below and above each layer a peak may lie (Hz)."""
    if layers_hz.size == 1:
        return layers_hz / 2, layers_hz / 2
    order = np.argsort(layers_hz, kind="stable")
    half_gaps = np.diff(layers_hz[order]) / 2
    below, above = np.empty(layers_hz.size), np.empty(layers_hz.size)
    below[order] = np.concatenate((half_gaps[:1], half_gaps))
    above[order] = np.concatenate((half_gaps, half_gaps[-1:]))
    return below, above
