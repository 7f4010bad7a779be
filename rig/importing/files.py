"""Recordings that other equipment made: WAV and CSV files."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np

from modeling import InputError, Recording, RecordingSet
from modeling.arrays import Floats
from modeling.checks import check_number
from modeling.errors import counted, shortened, shown
from modeling.files.columns import number_in
from modeling.files.reading import read_bytes
from modeling.files.tables import csv_cells
from modeling.files.wav import full_scale, read_wav
from modeling.recordings.appending import WavSource
from modeling.recordings.recording import clipped_samples
from modeling.recordings.spectrum import dft321
from rig.importing.labels import Label
from rig.importing.plausible import G_PER_UNIT, doubts_about
from rig.importing.times import TimeColumn, since_first

Axis = Literal["x", "y", "z", "dft321"]
AXES: tuple[Axis, ...] = ("x", "y", "z", "dft321")
# Below it layers are missed: docs/method/recordings.md#shortest-records
SHORTEST_MODELLED_S = 0.2
ROLES = ("time", "x", "y", "z")
VOLTS_PER_UNIT = {"V": 1.0, "mV": 1e-3}
SENSITIVITIES_MV_PER_G = (0.01, 1e5)  # from shock sensors to seismic ones
_TIME_NAMES = {"time", "t", "timestamp"}
_UNIT_ALONE = re.compile(r"\s*[\[(][^\])]*[\])]\s*")  # a line below the header: (ms),(V)
_ELAPSED = re.compile(r"(?:elapsed_)?(milli|micro|nano)?seconds(?:_elapsed)?")  # seconds_elapsed
_SECONDS = {None: "s", "milli": "ms", "micro": "us", "nano": "ns"}
_AXIS_NAME = re.compile(r"(?:(?:a|.*acc.*?)_?)?([xyz])")  # x, ax, acc_x, linear_acceleration_x


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
    paths : sequence of Path
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
    samples, rate_hz = read_wav(path, channel=channel)
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
    warnings = [*_beyond_full_scale(path, samples, scale), *_too_short(path, recording)]
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
    paths : sequence of Path
    labels : sequence of Label
        One per path.
    axis : {"x", "y", "z", "dft321"}, optional
        Needed where a file has more than one column beside time, unless `named` names one axis.
    unit : {"g", "mg", "m/s2", "V", "mV", "arbitrary"}, optional
        Unit of the axes, where the header names none (`x (g)`, `x_g`). With neither the unit is
        `arbitrary`.
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
    """The recording; refused where something about it is implausible."""
    if one.doubts:
        raise InputError(one.doubts[0])
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
    _check_unit(unit, "--unit")
    columns, warnings = _read_columns(path, named or {})
    time = _time_column(path, columns)
    axes, found_unit = _chosen_axes(path, columns, axis or _only_axis_of(named or {}))
    # Combined axes no longer show their limits, nor do resampled ones: they are looked for here.
    clipped_share = float(np.any([clipped_samples(one) for one in axes], axis=0).mean())
    rate_hz, axes, uneven, contradiction = _even(path, time, axes, columns, given_hz=rate_hz)
    if unit and found_unit and unit != found_unit:
        raise InputError(
            f"expected one unit for {path.name}, got {shown(found_unit)} in its header and "
            f"{shown(unit)} from --unit; leave --unit out or correct the header."
        )
    final_unit = unit or found_unit or "arbitrary"
    _check_unit(final_unit, f"the header of {path.name}")
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
        (*warnings, *uneven, *_too_short(path, recording)),
        doubts=(*contradiction, *doubts_about(recording, path.name, unit=taken_as)),
    )


def parse_columns(text: str) -> dict[str, str]:
    """Which column is which: `time=Zeit,z=Beschl_Z`.

    Raises
    ------
    InputError
        For anything else than time, x, y and z, each with a column of its own.
    """
    found: dict[str, str] = {}
    for part in text.split(","):
        role, equals, column = (piece.strip() for piece in part.partition("="))
        if role not in ROLES or not (equals and column) or role in found:
            raise InputError(
                f"expected {', '.join(ROLES)}, each once, with = and a column, got {shown(part)}; "
                "write --map time=Zeit,z=Beschl_Z."
            )
        found[role] = column
    return found


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
    columns: Mapping[str, Floats],
    *,
    given_hz: float | None,
) -> tuple[float, Floats, Sequence[str], Sequence[str]]:
    """Rate and evenly spaced samples; warnings about them; contradictions to the rate.

    A rate that is given says that the samples are even, whatever their times.
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
        if uneven is None:
            return rate_hz, axes, (), ()
        note = (
            f"{path.name}: {uneven}; they were resampled at even times by a spline through their "
            "own ones; if only the times are uneven, give --rate."
        )
        return rate_hz, time.resampled(axes, rate_hz), (note,), ()
    contradiction = time.contradiction(given_hz)
    uneven = None if contradiction else time.unevenness(given_hz)
    if uneven is None:
        return given_hz, axes, (), (contradiction,) if contradiction else ()
    note = (
        f"{path.name}: {uneven}, but are taken as evenly spaced, as --rate says; if they are not, "
        f"that turns {uneven.share:.0%} of the power of a vibration at {uneven.highest_hz:.4g} Hz "
        "into noise, and less at lower frequencies."
    )
    return given_hz, axes, (note,), ()


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
    if unit is not None and unit not in (*G_PER_UNIT, *VOLTS_PER_UNIT):
        raise InputError(
            f"expected a unit among {', '.join((*G_PER_UNIT, *VOLTS_PER_UNIT))} in {where}, got "
            f"{shown(unit)}; convert the data or name the unit with --unit."
        )


def _read_lines(path: Path) -> tuple[list[str], bool]:
    """Lines that are neither empty nor comments, and whether the last one has its end."""
    text = _decoded(path)
    if text.startswith("LabVIEW Measurement"):
        raise InputError(
            f"expected a CSV file with a header line, got a LabVIEW measurement file (LVM) at "
            f"{path}; save it as CSV, or remove all lines above the one that begins with X_Value "
            "and give --map time=X_Value,x= and the column of the axis."
        )
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    if len(lines) < 2:
        raise InputError(
            f"expected a header and rows of numbers in {path.name}, got "
            f"{counted(len(lines), 'line')}; "
            "export or record it again."
        )
    return lines, text.endswith(("\n", "\r"))


def _check_last_row(path: Path, row: Sequence[str], header: Sequence[str]) -> str:
    """Refuse a row without a line end that is not whole; else a warning that it may not be."""
    if len(row) != len(header) or number_in(row[-1].replace(",", ".")) is None:
        raise InputError(
            f"expected {path.name} to end with a whole row, got {shown(','.join(row))} without a "
            "line end; the file is truncated, export or record it again."
        )
    return (
        f"{path.name}: has no line end after its last row, so its last number, "
        f"{shortened(row[-1])}, may be cut short; if so, export or record it again."
    )


def _decoded(path: Path) -> str:
    """The text of a file in UTF-8, UTF-16 with its mark, or the Western code page."""
    data = read_bytes(path, "a CSV file")
    marked = data.startswith((b"\xff\xfe", b"\xfe\xff"))
    for encoding in ("utf-16",) if marked else ("utf-8-sig", "cp1252"):
        try:
            text = data.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" not in text:
            return text
    raise InputError(f"expected a text file, got other bytes in {path}; export CSV.")


def _read_columns(
    path: Path, named: Mapping[str, str]
) -> tuple[dict[str, Floats], tuple[str, ...]]:
    """Columns of numbers by their header, and what to be warned of.

    Those that are named have the header of their role, and no other one has it. Times since 1970
    have the unit that they are in.
    """
    lines, ended = _read_lines(path)
    delimiter = max(",;\t", key=lines[0].count)
    rows = [
        csv_cells(line, f"line {number} of {path.name}", delimiter=delimiter)
        for number, line in enumerate(lines, start=1)
    ]
    header = [cell.strip() for cell in rows[0]]
    if len(rows) > 2 and all(_UNIT_ALONE.fullmatch(cell) for cell in rows[1]):
        header = [f"{name} {unit.strip()}" for name, unit in zip(header, rows.pop(1), strict=False)]
    if all(number_in(cell) is not None for cell in header):
        raise InputError(
            f"expected a header line in {path.name} (time,x,y,z), got numbers; add one."
        )
    if len(set(header)) < len(header):
        raise InputError(
            f"expected each column name once in {path.name}, got "
            f"{shortened(', '.join(header))}; rename."
        )
    warnings = () if ended else (_check_last_row(path, rows[-1], header),)
    for line, row in enumerate(rows[1:], start=2):
        if len(row) != len(header):
            raise InputError(
                f"expected {len(header)} values in line {line} of {path.name}, got {len(row)}; "
                "the file is truncated or damaged, export or record it again."
            )
    if delimiter == ";":
        rows = [[c if "." in c else c.replace(",", ".") for c in row] for row in rows]
    try:
        values = np.array(rows[1:], dtype=np.float64)
    except ValueError:
        other = next((cell for row in rows[1:] for cell in row if number_in(cell) is None), "text")
        raise InputError(
            f"expected numbers below the header of {path.name}, got {shown(other)}; correct the "
            "file."
        ) from None
    columns = {}
    for place, name in enumerate(_roles(path, header, named)):
        if name is not None:
            note, column = name, values[:, place]
            kind, unit = _name_and_unit(name)
            if kind in _TIME_NAMES:
                column, since_1970 = since_first(column, [row[place] for row in rows[1:]])
                note = f"{name} ({since_1970})" if since_1970 and not unit else name
            columns[note] = column
    return columns, warnings


def _roles(path: Path, header: Sequence[str], named: Mapping[str, str]) -> list[str | None]:
    """The header with the roles that columns are given; None for one that a role replaces."""
    roles: list[str | None] = [None if named and _role(name) in named else name for name in header]
    for role, wanted in named.items():
        same = [name for name in header if name == wanted] or [
            name for name in header if _name_and_unit(name)[0] == _name_and_unit(wanted)[0]
        ]
        if len(same) != 1:
            raise InputError(
                f"expected a column {shown(wanted)} in {path.name}, got "
                f"{shortened(', '.join(header), longest=120)}; correct --map or --time-column."
            )
        unit = _name_and_unit(same[0])[1]
        roles[header.index(same[0])] = f"{role} ({unit})" if unit else role
    return roles


def _role(header: str) -> str | None:
    """What a column is by its header alone: "time", an axis, or neither."""
    name = _name_and_unit(header)[0]
    if name in _TIME_NAMES:
        return "time"
    axis = _AXIS_NAME.fullmatch(name)
    return axis[1] if axis else None


def _name_and_unit(header: str) -> tuple[str, str]:
    """`Acc X (m/s²)` → (acc_x, m/s2); `x_g` → (x, g); `seconds_elapsed` → (time, s)."""
    text = header.lower().replace("²", "2").replace("^2", "2").replace("µ", "u").replace("s^-2", "")
    unit = ""
    if bracket := re.search(r"[\[(](.*?)[\])]", text):
        unit = bracket.group(1).strip()
        text = text[: bracket.start()]
    elif suffix := re.fullmatch(r"(.+?)_(g|mg|m_s2|v|mv|s|ms|us|ns)", text.strip()):
        text, unit = suffix.groups()
    name = re.sub(r"[\s_]+", "_", text.strip()).strip("_")
    if not unit and (elapsed := _ELAPSED.fullmatch(name)):
        return "time", _SECONDS[elapsed[1]]
    volts = {"v": "V", "volt": "V", "volts": "V", "mv": "mV"}
    return name, volts.get(unit, unit.replace("m_s2", "m/s2"))


def _times_in(columns: Mapping[str, Floats]) -> list[str]:
    return [name for name in columns if _role(name) == "time"]


def _time_column(path: Path, columns: Mapping[str, Floats]) -> TimeColumn | None:
    """The first column of times that gives a rate, or else the first one, if there is any."""
    every = [
        TimeColumn(path.name, name, _name_and_unit(name)[1], columns[name])
        for name in _times_in(columns)
    ]
    return next((time for time in every if time.has_a_rate()), every[0] if every else None)


def _chosen_axes(path: Path, columns: dict[str, Floats], axis: Axis | None) -> tuple[Floats, str]:
    """The chosen axis (1, n), or all three (3, n), as recorded, and the unit in their header."""
    times = _times_in(columns)
    others = [name for name in columns if name not in times]
    if axis is None and len(others) != 1:
        raise InputError(
            f"expected --axis x, y, z or dft321 for {path.name}, got none and the columns "
            f"{shortened(', '.join(others), longest=120)}; choose an axis."
        )
    chosen = others if axis is None else _names_of_axes(path, others, axis)
    units = {_name_and_unit(name)[1] for name in chosen}
    if len(units) > 1:
        raise InputError(
            f"expected one unit for all axes of {path.name}, got "
            f"{shortened(' and '.join(sorted(units)))}; "
            "convert them."
        )
    samples = np.array([columns[name] for name in chosen])
    if not np.isfinite(samples).all():
        raise InputError(
            f"expected finite samples in {path.name}, got NaN or inf; repair or record again."
        )
    return samples, units.pop()


def _only_axis_of(named: Mapping[str, str]) -> Axis | None:
    """The axis whose column was named, where it is one: the others are other channels."""
    axes = [axis for axis in AXES if axis in named]
    return axes[0] if len(axes) == 1 else None


def _names_of_axes(path: Path, names: Sequence[str], axis: Axis) -> list[str]:
    """The columns of the axis, or of all three."""
    letters = {n: m[1] for n in names if (m := _AXIS_NAME.fullmatch(_name_and_unit(n)[0]))}
    wanted = "xyz" if axis == "dft321" else axis
    chosen = [name for letter in wanted for name in letters if letters[name] == letter]
    if [letters[name] for name in chosen] != list(wanted):
        raise InputError(
            f"expected columns named {', '.join(wanted)} (each once) in {path.name}, got "
            f"{shortened(', '.join(names), longest=120)}; rename them, choose another axis, or "
            "leave --axis out where "
            "there is only one."
        )
    return chosen
