"""From the recordings of one texture to its model over the grid (METHOD 2, 4 and 5)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from modeling.errors import InputError
from modeling.estimators import (
    EstimatorName,
    check_estimator,
    find_peak_frequencies,
    fit_layers,
)
from modeling.grid import Condition, check_spanned, fill_grid, grid_axes
from modeling.layer_search import MOST_LAYERS
from modeling.layers import Layers
from modeling.likelihood import is_silent
from modeling.model import TextureModel
from modeling.peq import Floats
from modeling.recording import Recording, RecordingSet
from modeling.sinusoids import common_hum, without_hum
from modeling.spectra import (
    MODEL_RATE_HZ,
    Spectrum,
    mean_spectrum,
    prepare,
    prepared_spectrum,
    subtract_floor,
)
from modeling.stationarity import Drift, drift_of, straightened
from modeling.tracking import assign_peaks, reference_of, visiting_order
from modeling.whole_grid import fit_grid_jointly


@dataclass(frozen=True, eq=False)
class _Tracked:
    """Layers of one condition under their names, and which of them had no peak of their own."""

    layers: Layers
    inherited: NDArray[np.bool_]


def fit_texture(
    recordings: RecordingSet | Iterable[Recording],
    *,
    estimator: str = "joint",
    layers: int | None = None,
) -> TextureModel:
    """Model one texture over its grid of speeds and forces.

    Repeats of a condition are averaged; silent recordings count as not made. Conditions of the
    rectangular grid without a recording are interpolated from their neighbours and marked in
    `interpolated`.
    Recordings at force 0 are taken as the sensor's floor and subtracted in power.

    Parameters
    ----------
    recordings : RecordingSet or iterable of Recording
        One texture, one unit; any rates. One speed or one force will do: then nothing is known of
        others.
    estimator : {"joint", "paper", "paper-consistent"}
    layers : int, optional
        Number of layers, 1 … 12, with `joint` only, which chooses it otherwise.

    Returns
    -------
    TextureModel
        At 5 kHz, or at the lowest rate among the recordings where that is lower.

    Raises
    ------
    GridError
        Where the recordings lie on a line across the grid.
    InputError
        Where they mix textures or units, or have contact without speed; for a number of layers out
        of range or with another estimator.
    """
    records = recordings if isinstance(recordings, RecordingSet) else RecordingSet(recordings)
    check_estimator(estimator)
    only_unit(records)
    return fit_spectra(recording_spectra(records), estimator=estimator, layers=layers)


def fit_spectra(
    measured: Sequence[tuple[Recording, Spectrum]],
    *,
    estimator: str = "joint",
    layers: int | None = None,
) -> TextureModel:
    """Model one texture from spectra that `recording_spectra` has prepared; see `fit_texture`.

    Parameters
    ----------
    measured : sequence of (Recording, Spectrum)
        With contact; the same texture, unit and rate in all.
    estimator : {"joint", "paper", "paper-consistent"}
    """
    chosen = check_estimator(estimator)
    _check_layers(layers, chosen)
    first, spectrum_of_first = measured[0]
    repeats = spectra_by_condition(measured)
    heard = {c: [s for s in found if not is_silent(s)] for c, found in repeats.items()}
    spectra = {condition: mean_spectrum(found) for condition, found in heard.items() if found}
    if not spectra:
        raise InputError(
            f"{first.texture}: expected a recording with vibration, got silence in all of "
            f"{len(repeats)} conditions; check the sensor, or leave its floor out."
        )
    check_spanned(spectra, first.texture)
    speeds, forces = grid_axes(spectra)
    if chosen == "joint":
        arrays = _joint_arrays(spectra, layers)
    else:
        arrays = _grids(_track(spectra, chosen), first.texture)
    return TextureModel(
        texture=first.texture,
        rate_hz=spectrum_of_first.rate_hz,
        speeds_mm_s=np.array(speeds),
        forces_n=np.array(forces),
        estimator=chosen,
        unit=first.unit,
        simulated=any(r.simulated for r, _ in measured),
        **arrays,
    )


def _check_layers(layers: object, estimator: EstimatorName) -> None:
    if layers is None:
        return
    whole = isinstance(layers, int) and not isinstance(layers, bool)
    if estimator != "joint" or not (whole and 1 <= int(layers) <= MOST_LAYERS):  # type: ignore[call-overload]
        raise InputError(
            f"expected 1 to {MOST_LAYERS} layers with the estimator joint, got {layers!r} with "
            f"{estimator}; leave the number out, or give another."
        )


def _joint_arrays(spectra: Mapping[Condition, Spectrum], count: int | None) -> dict[str, Any]:
    """The model's arrays by `joint`; holes are what their neighbours foretell."""
    found = fit_grid_jointly(spectra, count=count)
    speeds, forces = grid_axes(spectra)
    grid = [(speed, force) for speed in speeds for force in forces]
    shape = (len(speeds), len(forces))

    def table(name: str) -> NDArray[Any]:
        return np.array([getattr(found.layers[c], name) for c in grid]).reshape(*shape, -1)

    recorded = np.array([found.recorded[c] for c in grid]).reshape(shape)
    inherited = np.array([found.inherited[c] for c in grid]).reshape(*shape, -1)
    names = ("frequencies_hz", "bandwidths_hz", "gains", "level_sd_db", "unresolved")
    return {
        "noise_gains": table("noise_gain")[:, :, 0],
        **{name: table(name) for name in names},
        "inherited": inherited & recorded[:, :, None],
        "interpolated": ~recorded,
        "blending": "logarithmic",
    }


def missing_conditions(model: TextureModel) -> list[Condition]:
    """(speed, force) of the conditions that were interpolated for want of a recording."""
    return [
        (float(model.speeds_mm_s[i]), float(model.forces_n[j]))
        for i, j in np.argwhere(model.interpolated)
    ]


def spectra_by_condition(
    measured: Sequence[tuple[Recording, Spectrum]],
) -> dict[Condition, list[Spectrum]]:
    """The spectra of each condition's repeats, conditions in order of their first recording."""
    by_condition: dict[Condition, list[Spectrum]] = {}
    for record, found in measured:
        by_condition.setdefault(record.condition, []).append(found)
    return by_condition


def recording_spectra(
    records: RecordingSet, *, rate_hz: float = MODEL_RATE_HZ, keep_hum: bool = False
) -> list[tuple[Recording, Spectrum]]:
    """Each recording with contact and its spectrum, at one rate, the sensor's floor subtracted.

    This is what models are fitted to and held against (METHOD 2). Hum of the mains is taken out,
    and frequencies that drift within a record are held at those of its middle; the spectra's
    `notes` say so.

    Parameters
    ----------
    records : RecordingSet
        One texture; recordings at force 0 are the floor.
    rate_hz : float
        Of the spectra, unless a recording with contact has a lower rate: then that one.
    keep_hum : bool
        Leave hum of the mains where it is.

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
    floors = [r for r in records.recordings if r.force_n == 0]
    every = [*contact, *floors]
    prepared = [prepare(r, rate_hz=rate_hz) for r in every]
    hum = [()] * len(every) if keep_hum else _hum_in(every, prepared, rate_hz)
    spectra = [
        _spectrum_of(record, samples, min(rate_hz, record.rate_hz), hum_hz=lines)
        for record, samples, lines in zip(every, prepared, hum, strict=True)
    ]
    measured = spectra[: len(contact)]
    if floors:
        floor = mean_spectrum(spectra[len(contact) :])
        measured = [subtract_floor(one, floor) for one in measured]
    return list(zip(contact, measured, strict=True))


def _hum_in(
    records: Sequence[Recording], prepared: Sequence[Floats], rate_hz: float
) -> list[tuple[float, ...]]:
    """Lines of the mains in each; hum is told by data of one rate, so slower ones have none."""
    quick = [n for n, record in enumerate(records) if record.rate_hz >= rate_hz]
    speeds = [records[n].speed_mm_s if records[n].force_n > 0 else 0.0 for n in quick]
    found = common_hum([prepared[n] for n in quick], rate_hz, speeds_mm_s=speeds)
    lines: list[tuple[float, ...]] = [()] * len(records)
    for n, here in zip(quick, found, strict=True):
        lines[n] = here
    return lines


def _spectrum_of(
    record: Recording, samples: Floats, rate_hz: float, *, hum_hz: Sequence[float]
) -> Spectrum:
    """The spectrum of one prepared record, mended and told of."""
    notes = []
    if hum_hz:
        samples = without_hum(samples, rate_hz, hum_hz)
        lines = ", ".join(f"{f:.0f}" for f in hum_hz)
        notes.append(f"hum of the mains at {lines} Hz taken out")
    # Without contact there is nothing that could drift.
    drift = drift_of(samples, rate_hz) if record.force_n > 0 else Drift(0.0, 0.0)
    if drift.frequency:
        samples = straightened(samples, drift.frequency)
        notes.append(
            f"its frequencies drift by {drift.frequency:+.0%}, so its speed does; they are held at "
            "those of its middle"
        )
    if drift.level_db:
        notes.append(f"its level changes by {drift.level_db:.1f} dB; the mean power is modelled")
    return prepared_spectrum(samples, rate_hz, record, hum_hz=hum_hz, notes=notes)


def only_unit(records: RecordingSet) -> str:
    """The unit of all recordings; InputError where there are two of them, or two textures."""
    texture, units = records.texture, sorted({r.unit for r in records.recordings})
    if len(units) > 1:
        raise InputError(
            f"{texture}: expected one unit in all recordings, got {' and '.join(units)}; "
            "calibrate all of them or none."
        )
    return units[0]


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


def _grids(tracked: Mapping[Condition, _Tracked], texture: str) -> dict[str, Any]:
    """The model's arrays; holes of the grid are filled from their neighbours and marked."""

    def grid(name: str) -> NDArray[np.float64]:
        return fill_grid({c: getattr(t.layers, name) for c, t in tracked.items()}, texture)[0]

    def marks(rows: Mapping[Condition, NDArray[np.bool_]]) -> NDArray[np.bool_]:
        known = {c: row.astype(np.float64) for c, row in rows.items()}
        # A condition that was filled in has no marks of its own.
        marked: NDArray[np.bool_] = fill_grid(known, texture)[0] == 1
        return marked & ~interpolated[:, :, None]

    noise = {c: np.array([t.layers.noise_gain]) for c, t in tracked.items()}
    noise_gains, interpolated = fill_grid(noise, texture)
    return {
        "noise_gains": noise_gains[:, :, 0],
        **{
            name: grid(name) for name in ("frequencies_hz", "bandwidths_hz", "gains", "level_sd_db")
        },
        "inherited": marks({c: t.inherited for c, t in tracked.items()}),
        "unresolved": marks({c: t.layers.unresolved for c, t in tracked.items()}),
        "interpolated": interpolated,
    }
