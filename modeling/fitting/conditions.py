"""The spectra of one texture: one per recording, hum removed and drift corrected."""

from __future__ import annotations

from collections.abc import Sequence

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError
from tactileq.modeling.models.grid import Condition
from tactileq.modeling.recordings.recording import Recording
from tactileq.modeling.recordings.recording_set import RecordingSet
from tactileq.modeling.recordings.sinusoids import common_hum, without_hum
from tactileq.modeling.recordings.spectrum import (
    MODEL_RATE_HZ,
    Spectrum,
    mean_spectrum,
    prepare,
    prepared_spectrum,
    subtract_floor,
)
from tactileq.modeling.recordings.stationarity import Drift, drift_of, without_drift


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

    This is what models are fitted to and compared with (docs/method/recordings.md). Hum is removed,
    and frequencies that drift within a record are held at those of its middle; the spectra's
    `notes` say so.

    Parameters
    ----------
    records : RecordingSet
        One texture; recordings at force 0 are the floor.
    rate_hz : float
        Of the spectra, unless a recording with contact has a lower rate: then that one.
    keep_hum : bool
        Leave mains hum where it is.

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
    """Lines of the mains in each; hum is sought in data of one rate only."""
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
    """The spectrum of one prepared record, corrected, with notes."""
    notes = []
    if hum_hz:
        samples = without_hum(samples, rate_hz, hum_hz)
        lines = ", ".join(f"{f:.0f}" for f in hum_hz)
        notes.append(f"mains hum at {lines} Hz removed")
    # Without contact there is nothing that could drift.
    drift = drift_of(samples, rate_hz) if record.force_n > 0 else Drift(0.0, 0.0)
    if drift.frequency:
        samples = without_drift(samples, drift.frequency)
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
