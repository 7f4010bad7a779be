"""Recordings that other equipment made: WAV and CSV files, with labels from options or a table."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from modeling import InputError, Recording, RecordingSet
from modeling.files import read_table
from modeling.recording import number, read_wav
from modeling.spectra import dft321
from modeling.thresholds import STANDARD_GRAVITY_M_S2

Axis = Literal["x", "y", "z", "dft321"]
AXES: tuple[Axis, ...] = ("x", "y", "z", "dft321")
G_PER_UNIT = {"g": 1.0, "mg": 1e-3, "m/s2": 1 / STANDARD_GRAVITY_M_S2, "arbitrary": 1.0}
SECONDS_PER_UNIT = {"": 1.0, "s": 1.0, "ms": 1e-3, "us": 1e-6}
LONGEST_GAP = 2.5
_TIME_NAMES = {"time", "t", "timestamp"}
_AXIS_NAME = re.compile(r"(?:a|acc|accel|acceleration)?_?([xyz])")


@dataclass(frozen=True)
class Label:
    """What a file does not say of itself: surface, speed (mm/s), force (N), which repetition."""

    texture: str
    speed_mm_s: float
    force_n: float
    repeat: int = 1
    g_per_fullscale: float | None = None


def import_wav(
    paths: Sequence[Path], labels: Sequence[Label], *, g_per_fullscale: float | None = None
) -> RecordingSet:
    """Mono WAV files as recordings.

    Parameters
    ----------
    paths : sequence of Path
    labels : sequence of Label
        One per path.
    g_per_fullscale : float, optional
        Acceleration (g) of a full-scale sample, > 0; a label's own value wins. Without it the unit
        is `arbitrary`.

    Raises
    ------
    InputError
        Naming the file that cannot be used.
    """
    records = []
    for path, label in zip(paths, labels, strict=True):
        samples, rate_hz = read_wav(path)
        full_scale = label.g_per_fullscale or g_per_fullscale
        if full_scale is not None and not (np.isfinite(full_scale) and full_scale > 0):
            raise InputError(
                f"{path.name}: expected g per full scale above 0, got {full_scale}; correct it."
            )
        unit = "arbitrary" if full_scale is None else "g"
        records.append(_recording(path, samples * (full_scale or 1.0), rate_hz, label, unit=unit))
    return RecordingSet(records)


def import_csv(
    paths: Sequence[Path],
    labels: Sequence[Label],
    *,
    axis: Axis | None = None,
    unit: str | None = None,
    rate_hz: float | None = None,
) -> RecordingSet:
    """CSV files with a header line, a time column (or a rate) and one or three axes.

    Parameters
    ----------
    paths : sequence of Path
    labels : sequence of Label
        One per path.
    axis : {"x", "y", "z", "dft321"}, optional
        Needed where a file has more than one column beside time.
    unit : {"g", "mg", "m/s2", "arbitrary"}, optional
        Unit of the axes; wins over a unit in the header (`x (g)`, `x_g`). With neither the unit is
        `arbitrary`.
    rate_hz : float, optional
        Wins over the time column.

    Raises
    ------
    InputError
        Naming the file and what is wrong with it.
    """
    if axis is not None and axis not in AXES:
        raise InputError(f"expected an axis among {', '.join(AXES)}, got {axis!r}; choose one.")
    _check_unit(unit, "--unit")
    records = []
    for path, label in zip(paths, labels, strict=True):
        columns = _read_columns(path)
        rate = rate_hz if rate_hz is not None else _rate_from_time(path, columns)
        samples, found_unit = _chosen_axis(path, columns, axis)
        final_unit = unit or found_unit or "arbitrary"
        _check_unit(final_unit, f"the header of {path.name}")
        samples = samples * G_PER_UNIT[final_unit]
        name = "arbitrary" if final_unit == "arbitrary" else "g"
        records.append(_recording(path, samples, rate, label, unit=name))
    return RecordingSet(records)


def labels_from_table(table: Path, paths: Sequence[Path], *, texture: str | None) -> list[Label]:
    """Labels by file name from a TSV with file, speed_mm_s, force_n (texture, repeat, …).

    Raises
    ------
    InputError
        For a file that the table does not name, and for cells that are no numbers.
    """
    rows = {row["file"]: row for row in read_table(table, ("file", "speed_mm_s", "force_n"))}
    labels = []
    for path in paths:
        row = rows.get(path.name) or rows.get(str(path))
        if row is None:
            raise InputError(
                f"expected a row for {path.name} in {table}, got none; add its speed and force."
            )
        full_scale = row.get("g_per_fullscale")
        labels.append(
            Label(
                row.get("texture") or texture or table.parent.resolve().name,
                number(row["speed_mm_s"], f"speed_mm_s of {path.name}"),
                number(row["force_n"], f"force_n of {path.name}"),
                int(number(row.get("repeat") or "1", f"repeat of {path.name}")),
                number(full_scale, f"g_per_fullscale of {path.name}") if full_scale else None,
            )
        )
    return labels


def _recording(
    path: Path, samples: NDArray[np.float64], rate_hz: float, label: Label, *, unit: str
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
        )
    except InputError as error:
        raise InputError(f"{path.name}: {error}") from None


def _check_unit(unit: str | None, where: str) -> None:
    if unit is not None and unit not in G_PER_UNIT:
        raise InputError(
            f"expected a unit among {', '.join(G_PER_UNIT)} in {where}, got {unit!r}; convert the "
            "data or name the unit with --unit."
        )


def _read_columns(path: Path) -> dict[str, NDArray[np.float64]]:
    """Columns of numbers by their header."""
    if not path.is_file():
        raise InputError(f"expected a CSV file at {path}, got nothing there; give its path.")
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError:
        raise InputError(f"expected a text file, got other bytes in {path}; export CSV.") from None
    if len(lines) < 2:
        raise InputError(
            f"expected a header and rows of numbers in {path.name}, got {len(lines)} lines; "
            "export or record it again."
        )
    delimiter = max(",;\t", key=lines[0].count)
    rows = list(csv.reader(lines, delimiter=delimiter))
    header = [cell.strip() for cell in rows[0]]
    for line, row in enumerate(rows[1:], start=2):
        if len(row) != len(header):
            raise InputError(
                f"expected {len(header)} values in line {line} of {path.name}, got {len(row)}; "
                "the file is truncated or damaged, export or record it again."
            )
    try:
        values = np.array(rows[1:], dtype=np.float64)
    except ValueError as error:
        raise InputError(
            f"expected numbers below the header of {path.name}, got a cell that is none ({error});"
            " correct the file."
        ) from None
    if all(_is_number(cell) for cell in header):
        raise InputError(
            f"expected a header line in {path.name} (time,x,y,z), got numbers; add one."
        )
    return dict(zip(header, values.T, strict=True))


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _name_and_unit(header: str) -> tuple[str, str]:
    """`Acc X (m/s²)` → (acc_x, m/s2); `x_g` → (x, g); `time_ms` → (time, ms)."""
    text = header.lower().replace("²", "2").replace("^2", "2").replace("µ", "u").replace("s^-2", "")
    unit = ""
    if bracket := re.search(r"[\[(](.*?)[\])]", text):
        unit = bracket.group(1).strip()
        text = text[: bracket.start()]
    elif suffix := re.fullmatch(r"(.+?)_(g|mg|m_s2|s|ms|us)", text.strip()):
        text, unit = suffix.groups()
    return re.sub(r"[\s_]+", "_", text.strip()).strip("_"), unit.replace("m_s2", "m/s2")


def _time_column(columns: dict[str, NDArray[np.float64]]) -> str | None:
    return next((name for name in columns if _name_and_unit(name)[0] in _TIME_NAMES), None)


def _rate_from_time(path: Path, columns: dict[str, NDArray[np.float64]]) -> float:
    name = _time_column(columns)
    if name is None:
        raise InputError(
            f"expected a time column or --rate for {path.name}, got the columns "
            f"{', '.join(columns)}; give the sampling rate in Hz."
        )
    unit = _name_and_unit(name)[1]
    if unit not in SECONDS_PER_UNIT:
        raise InputError(
            f"expected time in s, ms or us in {path.name}, got {unit!r}; convert it or give --rate."
        )
    time = columns[name] * SECONDS_PER_UNIT[unit]
    steps = np.diff(time)
    if not (
        np.isfinite(time).all() and time.size > 1 and (steps >= 0).all() and time[-1] > time[0]
    ):
        raise InputError(
            f"expected rising times in {path.name}, got some that fall, repeat or are not finite; "
            "repair the file or give --rate."
        )
    mean_step = float(time[-1] - time[0]) / steps.size
    # Coarse time stamps repeat and jump by whole ticks; lost samples leave a longer gap.
    tick = float(steps[steps > 0].min())
    if steps.max() > LONGEST_GAP * max(mean_step, tick):
        raise InputError(
            f"expected evenly spaced samples in {path.name}, got a gap of {steps.max():.4g} s "
            f"among steps of {mean_step:.4g} s; samples are missing, record again or give --rate."
        )
    return 1 / mean_step


def _chosen_axis(
    path: Path, columns: dict[str, NDArray[np.float64]], axis: Axis | None
) -> tuple[NDArray[np.float64], str]:
    """The samples of the chosen axis (or of all three as one), and the unit in their header."""
    time = _time_column(columns)
    others = [name for name in columns if name != time]
    if axis is None:
        if len(others) != 1:
            raise InputError(
                f"expected --axis x, y, z or dft321 for {path.name}, got none and the columns "
                f"{', '.join(others)}; choose an axis."
            )
        return columns[others[0]], _name_and_unit(others[0])[1]
    by_axis: dict[str, str] = {}
    for name in others:
        if match := _AXIS_NAME.fullmatch(_name_and_unit(name)[0]):
            by_axis.setdefault(match.group(1), name)
    wanted = "xyz" if axis == "dft321" else axis
    missing = [letter for letter in wanted if letter not in by_axis]
    if missing:
        raise InputError(
            f"expected columns named {', '.join(wanted)} in {path.name}, got {', '.join(others)}; "
            "rename them or choose another axis."
        )
    units = {_name_and_unit(by_axis[letter])[1] for letter in wanted}
    if len(units) > 1:
        raise InputError(
            f"expected one unit for all axes of {path.name}, got {' and '.join(sorted(units))}; "
            "convert them."
        )
    samples = np.array([columns[by_axis[letter]] for letter in wanted])
    if not np.isfinite(samples).all():
        raise InputError(
            f"expected finite samples in {path.name}, got NaN or inf; repair or record again."
        )
    return (dft321(samples) if axis == "dft321" else samples[0]), units.pop()
