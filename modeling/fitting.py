"""From the recordings of one texture to its model over the grid (METHOD 2, 4 and 5)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import griddata
from scipy.spatial import QhullError

from modeling.errors import GridError, InputError
from modeling.estimators import (
    EstimatorName,
    Layers,
    check_estimator,
    find_peak_frequencies,
    fit_layers,
)
from modeling.model import TextureModel
from modeling.recording import Recording, RecordingSet
from modeling.spectra import MODEL_RATE_HZ, Spectrum, mean_spectrum, spectrum, subtract_floor
from modeling.tracking import Condition, assign_peaks, reference_of, visiting_order


@dataclass(frozen=True, eq=False)
class _Tracked:
    """Layers of one condition under their names, and which of them had no peak of their own."""

    layers: Layers
    inherited: NDArray[np.bool_]


def fit_texture(
    recordings: RecordingSet | Iterable[Recording], *, estimator: str = "paper-consistent"
) -> TextureModel:
    """Model one texture over its grid of speeds and forces.

    Repeats of a condition are averaged. Conditions of the rectangular grid without a recording are
    interpolated from their neighbours and marked in `interpolated`. Recordings at force 0 are
    taken as the sensor's floor and subtracted in power.

    Parameters
    ----------
    recordings : RecordingSet or iterable of Recording
        One texture, at least 2 speeds × 2 forces, one unit; any rates.
    estimator : {"paper-consistent", "paper"}

    Returns
    -------
    TextureModel
        At 5 kHz, or at the lowest rate among the recordings where that is lower.

    Raises
    ------
    GridError
        Where the recordings do not span such a grid.
    InputError
        Where they mix textures or units, or have contact without speed.
    """
    chosen = check_estimator(estimator)
    records = recordings if isinstance(recordings, RecordingSet) else RecordingSet(recordings)
    texture, unit = records.texture, _only_unit(records)
    spectra = condition_spectra(records)
    speeds = sorted({speed for speed, _ in spectra})
    forces = sorted({force for _, force in spectra})
    if len(speeds) < 2 or len(forces) < 2:
        raise GridError(
            f"{texture}: expected recordings at 2 or more speeds and 2 or more forces for a full "
            f"model, got {_count(speeds, 'speed')} and {_count(forces, 'force')}; "
            f"record more {'force' if len(forces) < 2 else 'speed'} levels."
        )
    tracked = _track(spectra, chosen)
    return TextureModel(
        texture=texture,
        rate_hz=next(iter(spectra.values())).rate_hz,
        speeds_mm_s=np.array(speeds),
        forces_n=np.array(forces),
        estimator=chosen,
        unit=unit,
        simulated=any(r.simulated for r in records.recordings),
        **_grids(tracked, speeds, forces, texture),
    )


def missing_conditions(model: TextureModel) -> list[Condition]:
    """(speed, force) of the conditions that were interpolated for want of a recording."""
    return [
        (float(model.speeds_mm_s[i]), float(model.forces_n[j]))
        for i, j in np.argwhere(model.interpolated)
    ]


def condition_spectra(records: RecordingSet) -> dict[Condition, Spectrum]:
    """One spectrum per condition of one texture, at one rate, floor subtracted, repeats averaged.

    Raises
    ------
    InputError
        If a record has contact but no speed, or none has contact.
    """
    by_condition: dict[Condition, list[Spectrum]] = {}
    for record, measured in recording_spectra(records):
        by_condition.setdefault(record.condition, []).append(measured)
    return {condition: mean_spectrum(found) for condition, found in by_condition.items()}


def recording_spectra(
    records: RecordingSet, *, rate_hz: float = MODEL_RATE_HZ
) -> list[tuple[Recording, Spectrum]]:
    """Each recording with contact and its spectrum, at one rate, the sensor's floor subtracted.

    This is what models are fitted to and held against (METHOD 2).

    Parameters
    ----------
    records : RecordingSet
        One texture; recordings at force 0 are the floor.
    rate_hz : float
        Of the spectra, unless a recording with contact has a lower rate: then that one.

    Raises
    ------
    InputError
        If a record has contact but no speed, or none has contact.
    """
    contact = [r for r in records.recordings if r.force_n > 0]
    still = [r for r in contact if r.speed_mm_s == 0]
    if still or not contact:
        got = still[0].describe() if still else "only recordings without contact"
        raise InputError(
            f"expected recordings with a speed and a force above 0, got {got}; correct the labels."
        )
    rate_hz = min(rate_hz, *(r.rate_hz for r in contact))
    spectra = [spectrum(r, rate_hz=rate_hz) for r in contact]
    floors = [spectrum(r, rate_hz=rate_hz) for r in records.recordings if r.force_n == 0]
    if floors:
        floor = mean_spectrum(floors)
        spectra = [subtract_floor(measured, floor) for measured in spectra]
    return list(zip(contact, spectra, strict=True))


def _only_unit(records: RecordingSet) -> str:
    units = sorted({r.unit for r in records.recordings})
    if len(units) > 1:
        raise InputError(
            f"{records.texture}: expected one unit in all recordings, got {' and '.join(units)}; "
            "calibrate all of them or none."
        )
    return units[0]


def _count(levels: list[float], name: str) -> str:
    return f"{len(levels)} {name}{'' if len(levels) == 1 else 's'}"


def _track(
    spectra: dict[Condition, Spectrum], estimator: EstimatorName
) -> dict[Condition, _Tracked]:
    """Layers of all conditions under common names, in the order of METHOD 5."""
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


def _grids(
    tracked: dict[Condition, _Tracked], speeds: list[float], forces: list[float], texture: str
) -> dict[str, Any]:
    """The model's arrays; holes of the grid are filled from their neighbours and marked."""
    conditions = [(speed, force) for speed in speeds for force in forces]
    known = np.array([condition in tracked for condition in conditions])
    present = [tracked[c] for c, there in zip(conditions, known, strict=True) if there]
    m = present[0].inherited.size
    shape = (len(speeds), len(forces))
    points = np.array(conditions)

    def grid(rows: list[NDArray[np.float64]]) -> NDArray[np.float64]:
        full = np.empty((len(conditions), rows[0].size))
        full[known] = rows
        if not known.all() and rows[0].size:
            full[~known] = _fill(points[known], np.array(rows), points[~known], texture)
        return full.reshape(*shape, -1)

    def marks(rows: list[NDArray[np.bool_]]) -> NDArray[np.bool_]:
        full = np.zeros((len(conditions), m), dtype=bool)
        full[known] = rows
        return full.reshape(*shape, m)

    return {
        "noise_gains": grid([np.array([t.layers.noise_gain]) for t in present])[:, :, 0],
        "frequencies_hz": grid([t.layers.frequencies_hz for t in present]),
        "bandwidths_hz": grid([t.layers.bandwidths_hz for t in present]),
        "gains": grid([t.layers.gains for t in present]),
        "level_sd_db": grid([t.layers.level_sd_db for t in present]),
        "inherited": marks([t.inherited for t in present]),
        "unresolved": marks([t.layers.unresolved for t in present]),
        "interpolated": ~known.reshape(shape),
    }


def _fill(
    points: NDArray[np.float64],
    values: NDArray[np.float64],
    holes: NDArray[np.float64],
    texture: str,
) -> NDArray[np.float64]:
    """Linear interpolation over (speed, force); beyond the outermost neighbours the nearest one."""
    try:
        linear = griddata(points, values, holes, method="linear", rescale=True)
    except (QhullError, ValueError):
        raise GridError(
            f"{texture}: expected recordings that span the grid, got {len(points)} of "
            f"{len(points) + len(holes)} conditions on one line; record more of them."
        ) from None
    nearest = griddata(points, values, holes, method="nearest", rescale=True)
    filled = np.where(np.isnan(linear), nearest, linear)
    # Rounding must not carry a value beyond its neighbours, and so out of the legal range.
    bounded: NDArray[np.float64] = np.clip(filled, values.min(axis=0), values.max(axis=0))
    return bounded
