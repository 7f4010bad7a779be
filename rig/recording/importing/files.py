"""Recordings that other equipment made: WAV and CSV files."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from warnings import warn

import numpy as np

from tactileq.modeling import InputError, Recording, RecordingSet
from tactileq.modeling.arrays import Floats
from tactileq.modeling.checks import check_number
from tactileq.modeling.errors import shortened, shown
from tactileq.modeling.files.wav import full_scale, read_wav
from tactileq.modeling.recordings.appending import WavSource
from tactileq.modeling.recordings.recording import clipped_samples
from tactileq.modeling.recordings.spectrum import dft321
from tactileq.rig.recording.importing.csv_columns import (
    AXES,
    Axis,
    only_axis_of,
    read_log,
)
from tactileq.rig.recording.importing.headers import OVERLOAD, known_unit
from tactileq.rig.recording.importing.labels import Label
from tactileq.rig.recording.importing.plausible import G_PER_UNIT, doubts_about
from tactileq.rig.recording.importing.times import TimeColumn

# Below it layers are missed: docs/method/recordings.md#shortest-records
SHORTEST_MODELLED_S = 0.2
VOLTS_PER_UNIT = {"V": 1.0, "mV": 1e-3}
_UNITS = (*G_PER_UNIT, *VOLTS_PER_UNIT)
SENSITIVITIES_MV_PER_G = (0.01, 1e5)  # from shock sensors to seismic ones


@dataclass(frozen=True)
class Imported:
    """A recording from a file, what to be warned of, and the WAV file that holds its samples.

    `doubts` says what of it cannot be meant.
    """

    recording: Recording
    warnings: tuple[str, ...] = ()
    source: WavSource | None = None
    doubts: tuple[str, ...] = ()


def import_wav(
    paths: Sequence[Path],
    labels: Sequence[Label],
    *,
    g_per_fullscale: float | None = None,
    channel: int | None = None,
) -> RecordingSet:
    """WAV files as recordings, one channel of each.

    Parameters
    ----------
    labels : sequence of Label
        One per path; their own `g_per_fullscale` and `channel` win.
    g_per_fullscale : float, optional
        Acceleration (g) of a full-scale sample, > 0. Without it the unit is `arbitrary`.
    channel : int, optional
        From 1; needed where a file has several.

    Raises
    ------
    InputError
        Naming the file that cannot be used, or whose labels or scale cannot be meant.
    """
    read = partial(import_wav_file, g_per_fullscale=g_per_fullscale, channel=channel)
    return RecordingSet(_meant(read(*one)) for one in zip(paths, labels, strict=True))


def import_wav_file(
    path: Path,
    label: Label,
    *,
    g_per_fullscale: float | None = None,
    channel: int | None = None,
) -> Imported:
    """One WAV file, with warnings and doubts; otherwise as `import_wav`."""
    channel = channel if label.channel is None else label.channel
    told: list[str] = []
    samples, rate_hz = read_wav(path, channel=channel, tell=told.append)
    scale = g_per_fullscale if label.g_per_fullscale is None else label.g_per_fullscale
    if scale is not None:
        full_scale(scale, path.name)
    recording = _recording(
        path,
        samples if scale is None else samples * scale,
        rate_hz,
        label,
        unit="arbitrary" if scale is None else "g",
    )
    warnings = [*told, *_beyond_full_scale(path, samples, scale), *_too_short(path, recording)]
    doubts = doubts_about(recording, path.name, g_per_fullscale=scale)
    return Imported(recording, tuple(warnings), WavSource(path, channel or 1, scale), doubts)


def import_csv(
    paths: Sequence[Path],
    labels: Sequence[Label],
    *,
    axis: Axis | None = None,
    unit: str | None = None,
    rate_hz: float | None = None,
    mv_per_g: float | None = None,
    named: Mapping[str, str] | None = None,
) -> RecordingSet:
    """CSV files with a header line, a time column (or a rate) and one or three axes.

    Samples at uneven times are resampled at even ones, unless a rate is given.

    Parameters
    ----------
    labels : sequence of Label
        One per path.
    axis : {"x", "y", "z", "dft321"}, optional
        Needed where a file has more than one column beside time, unless `named` names one axis.
    unit : {"g", "mg", "m/s2", "V", "mV", "arbitrary"}, optional
        Unit of the axes, where the header names none (`x (g)`, `x_g`), or none that is known. With
        neither the unit is `arbitrary`.
    rate_hz : float, optional
        If there is no time column, or one that gives no rate; must not contradict one that does.
    mv_per_g : float, optional
        Sensitivity of the accelerometer, 0.01 … 100,000 mV/g; needed for samples in volts.
    named : mapping of "time", "x", "y" or "z" to str, optional
        Headers of columns of other names.

    Raises
    ------
    InputError
        Naming the file and what is wrong with it, or cannot be meant.
    """
    read = partial(
        import_csv_file, axis=axis, unit=unit, rate_hz=rate_hz, mv_per_g=mv_per_g, named=named
    )
    return RecordingSet(_meant(read(*one)) for one in zip(paths, labels, strict=True))


def _meant(one: Imported) -> Recording:
    """The recording, with its warnings; refused where something about it is implausible."""
    if one.doubts:
        raise InputError(one.doubts[0])
    for sentence in one.warnings:
        warn(sentence, stacklevel=5)
    return one.recording


def import_csv_file(
    path: Path,
    label: Label,
    *,
    axis: Axis | None = None,
    unit: str | None = None,
    rate_hz: float | None = None,
    mv_per_g: float | None = None,
    named: Mapping[str, str] | None = None,
) -> Imported:
    """One CSV file, with warnings and doubts; otherwise as `import_csv`."""
    if axis is not None and axis not in AXES:
        raise InputError(
            f"expected an axis among {', '.join(AXES)}, got {shown(axis)}; choose one."
        )
    unit = unit and (known_unit(unit) or unit)
    _check_unit(unit, "--unit")
    log = read_log(path, named or {}, axis or only_axis_of(named or {}))
    time, axes = log.time, log.axes
    rows, gap = time.without_gaps(rate_hz) if time else (slice(None), "")
    _check_overload(path, axes, rows)
    axes, time = axes[:, rows], time and replace(time, values=time.values[rows])
    # Combined axes no longer show their limits, nor do resampled ones: they are looked for here.
    clipped_share = float(np.any([clipped_samples(one) for one in axes], axis=0).mean())
    rate_hz, axes, uneven, contradiction = _even(path, time, axes, log.names, given_hz=rate_hz)
    final_unit, other_unit = _unit(path, log.unit, given=unit)
    recording = _recording(
        path,
        (dft321(axes) if len(axes) == 3 else axes[0]) * _g_per(final_unit, mv_per_g, path.name),
        rate_hz,
        label,
        unit="arbitrary" if final_unit == "arbitrary" else "g",
        clipped_share=clipped_share,
    )
    taken_as = "g" if final_unit in VOLTS_PER_UNIT else final_unit
    return Imported(
        recording,
        (*log.warnings, *filter(None, (gap, other_unit)), *uneven, *_too_short(path, recording)),
        doubts=(*contradiction, *doubts_about(recording, path.name, unit=taken_as)),
    )


def usable(
    read: Callable[[Path, Label], Imported],
    paths: Sequence[Path],
    labels: Sequence[Label],
) -> tuple[list[Imported], tuple[str, ...]]:
    """What can be read of some files, and a sentence for each that is left out.

    Parameters
    ----------
    read : callable
        `import_wav_file` or `import_csv_file` with its options.
    paths, labels
        One label per path.

    Raises
    ------
    InputError
        If no file can be read: what is wrong with the first.
    """
    records: list[Imported] = []
    refusals: list[InputError] = []
    for path, label in zip(paths, labels, strict=True):
        try:
            records.append(read(path, label))
        except InputError as error:
            refusals.append(error)
    if refusals and not records:
        raise refusals[0]
    return records, tuple(map(str, refusals))


def _even(
    path: Path,
    time: TimeColumn | None,
    axes: Floats,
    columns: Sequence[str],
    *,
    given_hz: float | None,
) -> tuple[float, Floats, Sequence[str], Sequence[str]]:
    """Rate and evenly spaced samples; warnings about them; contradictions to the rate.

    A rate that is given says that the samples between gaps are even, whatever their times.
    """
    if time is None:
        if given_hz is None:
            raise InputError(
                f"expected a time column or --rate for {path.name}, got the columns "
                f"{shortened(', '.join(columns), longest=120)}; name it with --time-column, or "
                "give the sampling rate in Hz."
            )
        return given_hz, axes, (), ()
    if given_hz is None:
        rate_hz = time.rate_hz()
        uneven = time.unevenness(rate_hz)
        doubt, either = time.unit_doubt(SHORTEST_MODELLED_S)
        doubts, notes = ((doubt,), ()) if either else ((), (doubt,) if doubt else ())
        if uneven is None:
            return rate_hz, axes, notes, doubts
        note = (
            f"{path.name}: {uneven}; they were resampled at even times by a spline through their "
            "own ones; if only the times are uneven, give --rate."
        )
        return rate_hz, time.resampled(axes, rate_hz), (*notes, note), doubts
    time, other_unit = time.by_rate(given_hz)
    told = (other_unit,) if other_unit else ()
    contradiction = time.contradiction(given_hz)
    uneven = None if contradiction else time.unevenness(given_hz)
    if uneven is None:
        return given_hz, axes, told, (contradiction,) if contradiction else ()
    note = (
        f"{path.name}: {uneven}, but are taken as evenly spaced, as --rate says; if they are not, "
        f"that turns {uneven.share:.0%} of the power of a vibration at {uneven.highest_hz:.4g} Hz "
        "into noise, and less at lower frequencies."
    )
    return given_hz, axes, (*told, note), ()


def _check_overload(path: Path, axes: Floats, rows: slice) -> None:
    """Refuse what instruments send for a value beyond their range."""
    over = np.flatnonzero((np.abs(axes[:, rows]) >= OVERLOAD).any(axis=0))
    if over.size:
        row = int(over[0]) + (rows.start or 0)
        raise InputError(
            f"expected samples within the range of the instrument in {path.name}, got its sign for "
            f"an overload, {np.abs(axes[:, row]).max():.3g}, in row {row + 1} of the numbers; "
            "record again with a wider range."
        )


def _unit(path: Path, found: str, *, given: str | None) -> tuple[str, str]:
    """The unit of the samples, and a warning where the header names one that is not known."""
    if not given:
        _check_unit(found or None, f"the header of {path.name}")
        return found or "arbitrary", ""
    if found in _UNITS and found != given:
        raise InputError(
            f"expected one unit for {path.name}, got {shown(found)} in its header and "
            f"{shown(given)} from --unit; leave --unit out or correct the header."
        )
    if found in ("", given):
        return given, ""
    return given, (
        f"{path.name}: its header names the unit {shown(found)}, which is not known; its numbers "
        f"are taken in {given}, as --unit says."
    )


def _g_per(unit: str, mv_per_g: float | None, file: str) -> float:
    """How many g one of this unit is."""
    if unit not in VOLTS_PER_UNIT:
        if mv_per_g is not None:
            raise InputError(
                f"expected {file} in volts for --mv-per-g, got the unit {shown(unit)}; leave "
                "--mv-per-g out, or give --unit V."
            )
        return G_PER_UNIT[unit]
    if mv_per_g is None:
        raise InputError(
            f"expected the sensitivity of the accelerometer for {file}, whose samples are "
            f"{unit}, got none; give --mv-per-g, as its data sheet says."
        )
    low, high = SENSITIVITIES_MV_PER_G
    check_number("--mv-per-g", mv_per_g, low=low, high=high)
    return 1e3 * VOLTS_PER_UNIT[unit] / mv_per_g


def _beyond_full_scale(path: Path, samples: Floats, scale: float | None) -> list[str]:
    """A warning of samples beyond ±1, which floats hold, unless the scale is 1: then they are g."""
    peak = float(np.abs(samples).max())
    if peak <= 1 or scale == 1:
        return []
    taken = "in arbitrary units" if scale is None else f"as {peak * scale:.4g} g"
    return [
        f"{path.name}: holds samples up to {peak:.4g}, beyond the full scale of 1, and they are "
        f"taken {taken}; if they are g already, as in files of tactileq export wav, give "
        "--g-per-fullscale 1."
    ]


def _too_short(path: Path, recording: Recording) -> list[str]:
    if recording.duration_s >= SHORTEST_MODELLED_S:
        return []
    return [
        f"{path.name}: lasts {recording.duration_s:.3g} s; models need {SHORTEST_MODELLED_S:g} s "
        "or more, in a shorter recording layers are missed or misplaced, so record longer."
    ]


def _recording(
    path: Path,
    samples: Floats,
    rate_hz: float,
    label: Label,
    *,
    unit: str,
    clipped_share: float = np.nan,
) -> Recording:
    try:
        return Recording(
            samples,
            rate_hz,
            label.speed_mm_s,
            label.force_n,
            label.texture,
            unit=unit,
            repeat=label.repeat,
            clipped_share=clipped_share,
        )
    except InputError as error:
        raise InputError(f"{path.name}: {error}") from None


def _check_unit(unit: str | None, where: str) -> None:
    if unit is not None and unit not in _UNITS:
        raise InputError(
            f"expected a unit among {', '.join(_UNITS)} in {where}, got "
            f"{shown(unit)}; convert the data or name the unit with --unit."
        )
