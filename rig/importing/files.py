"""Recordings that other equipment made: WAV and CSV files, with labels from options or a table."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from modeling import InputError, Recording, RecordingSet
from modeling.arrays import Floats
from modeling.files.tables import is_number, number, read_table, whole_number
from modeling.files.wav import full_scale, read_wav
from modeling.perception.thresholds import STANDARD_GRAVITY_M_S2
from modeling.recordings.recording import clipped_samples
from modeling.recordings.spectrum import dft321

Axis = Literal["x", "y", "z", "dft321"]
AXES: tuple[Axis, ...] = ("x", "y", "z", "dft321")
G_PER_UNIT = {"g": 1.0, "mg": 1e-3, "m/s2": 1 / STANDARD_GRAVITY_M_S2, "arbitrary": 1.0}
SECONDS_PER_UNIT = {"": 1.0, "s": 1.0, "ms": 1e-3, "us": 1e-6}
LONGEST_GAP = 2.5
# A tool's vibration needs more; a rate below this means time in another unit than supposed.
LOWEST_RATE_HZ = 20.0
LOWEST_RATE_WITHOUT_TIME_UNIT_HZ = 250.0
_TIME_NAMES = {"time", "t", "timestamp"}
_AXIS_NAME = re.compile(r"(?:(?:a|.*acc.*?)_?)?([xyz])")  # x, ax, acc_x, linear_acceleration_x


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
        scale = g_per_fullscale if label.g_per_fullscale is None else label.g_per_fullscale
        unit = "arbitrary" if scale is None else "g"
        if scale is not None:
            samples = samples * full_scale(scale, path.name)
        records.append(_recording(path, samples, rate_hz, label, unit=unit))
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
        Unit of the axes, where the header names none (`x (g)`, `x_g`). With neither the unit is
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
        axes, found_unit = _chosen_axes(path, columns, axis)
        if unit and found_unit and unit != found_unit:
            raise InputError(
                f"expected one unit for {path.name}, got {found_unit!r} in its header and {unit!r} "
                "from --unit; leave --unit out or correct the header."
            )
        final_unit = unit or found_unit or "arbitrary"
        _check_unit(final_unit, f"the header of {path.name}")
        name = "arbitrary" if final_unit == "arbitrary" else "g"
        samples = (dft321(axes) if len(axes) == 3 else axes[0]) * G_PER_UNIT[final_unit]
        # Combined axes no longer show their limits, so those are looked for here.
        clipped = float(np.any([clipped_samples(one) for one in axes], axis=0).mean())
        records.append(_recording(path, samples, rate, label, unit=name, clipped_share=clipped))
    return RecordingSet(records)


def usable(
    read: Callable[[Sequence[Path], Sequence[Label]], RecordingSet],
    paths: Sequence[Path],
    labels: Sequence[Label],
) -> tuple[RecordingSet, tuple[str, ...]]:
    """What can be read of some files, and a sentence for each that is left out.

    Parameters
    ----------
    read : callable
        `import_wav` or `import_csv` with its options.
    paths, labels
        As there.

    Raises
    ------
    InputError
        Where no file can be read: what is wrong with the first.
    """
    records: list[Recording] = []
    refusals: list[InputError] = []
    for path, label in zip(paths, labels, strict=True):
        try:
            records += read([path], [label]).recordings
        except InputError as error:
            refusals.append(error)
    if refusals and not records:
        raise refusals[0]
    return RecordingSet(records), tuple(map(str, refusals))


def labels_from_table(table: Path, paths: Sequence[Path], *, texture: str | None) -> list[Label]:
    """Labels by file name from a TSV with file, speed_mm_s, force_n (texture, repeat, …).

    Raises
    ------
    InputError
        For a file that the table names not once, and for cells that are no usable numbers.
    """
    rows: dict[str, dict[str, str]] = {}
    for row in read_table(table, ("file", "speed_mm_s", "force_n")):
        if row["file"] in rows:
            raise InputError(
                f"expected one row for {row['file']} in {table}, got several; remove the wrong one."
            )
        rows[row["file"]] = row
    labels = []
    for path in paths:
        if not (found := rows.get(path.name) or rows.get(str(path))):
            raise InputError(
                f"expected a row for {path.name} in {table}, got none; add its speed and force."
            )
        scale = found.get("g_per_fullscale")
        labels.append(
            Label(
                found.get("texture") or texture or table.parent.resolve().name,
                number(found["speed_mm_s"], f"speed_mm_s of {path.name}"),
                number(found["force_n"], f"force_n of {path.name}"),
                whole_number(found.get("repeat") or "1", f"repeat of {path.name}"),
                full_scale(number(scale, f"g_per_fullscale of {path.name}"), path.name)
                if scale
                else None,
            )
        )
    return labels


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
    if unit is not None and unit not in G_PER_UNIT:
        raise InputError(
            f"expected a unit among {', '.join(G_PER_UNIT)} in {where}, got {unit!r}; convert the "
            "data or name the unit with --unit."
        )


def _read_lines(path: Path) -> list[str]:
    if not path.is_file():
        raise InputError(f"expected a CSV file at {path}, got nothing there; give its path.")
    text = _decoded(path)
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    if len(lines) < 2:
        raise InputError(
            f"expected a header and rows of numbers in {path.name}, got {len(lines)} lines; "
            "export or record it again."
        )
    if not text.endswith("\n"):
        raise InputError(
            f"expected a line end after the last line of {path.name}, got {lines[-1]!r} without "
            "one, so it may be truncated; add a line end if the file is complete."
        )
    return lines


def _decoded(path: Path) -> str:
    """The text of a file in UTF-8, UTF-16 with its mark, or the Western code page."""
    data = path.read_bytes()
    marked = data.startswith((b"\xff\xfe", b"\xfe\xff"))
    for encoding in ("utf-16",) if marked else ("utf-8-sig", "cp1252"):
        try:
            text = data.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" not in text:
            return text
    raise InputError(f"expected a text file, got other bytes in {path}; export CSV.")


def _read_columns(path: Path) -> dict[str, Floats]:
    """Columns of numbers by their header."""
    lines = _read_lines(path)
    delimiter = max(",;\t", key=lines[0].count)
    rows = list(csv.reader(lines, delimiter=delimiter))
    header = [cell.strip() for cell in rows[0]]
    if all(is_number(cell) for cell in header):
        raise InputError(
            f"expected a header line in {path.name} (time,x,y,z), got numbers; add one."
        )
    if len(set(header)) < len(header):
        raise InputError(
            f"expected each column name once in {path.name}, got {', '.join(header)}; rename."
        )
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
    except ValueError as error:
        raise InputError(
            f"expected numbers below the header of {path.name}, got a cell that is none ({error});"
            " correct the file."
        ) from None
    return dict(zip(header, values.T, strict=True))


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


def _time_column(columns: dict[str, Floats]) -> str | None:
    return next((name for name in columns if _name_and_unit(name)[0] in _TIME_NAMES), None)


def _rate_from_time(path: Path, columns: dict[str, Floats]) -> float:
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
    mean_step = _mean_step_s(path, columns[name] * SECONDS_PER_UNIT[unit])
    lowest = LOWEST_RATE_HZ if unit else LOWEST_RATE_WITHOUT_TIME_UNIT_HZ
    if 1 / mean_step <= lowest:
        raise InputError(
            f"expected a rate above {lowest:g} Hz in {path.name}, got {1 / mean_step:.4g} Hz by "
            f"its column {name!r}: is time in ms or us? Name the unit in the header (time_s, "
            "time_ms, time_us) or give --rate."
        )
    return 1 / mean_step


def _mean_step_s(path: Path, time_s: Floats) -> float:
    """Mean distance of the samples (s), which must rise evenly."""
    steps = np.diff(time_s)
    span = float(time_s[-1] - time_s[0])
    if not (np.isfinite(time_s).all() and span > 0 and (steps >= 0).all()):
        raise InputError(
            f"expected rising times in {path.name}, got some that fall, repeat or are not finite; "
            "repair the file or give --rate."
        )
    mean_step = span / steps.size
    # Coarse time stamps repeat and jump by whole ticks; lost samples leave a longer gap.
    tick = float(steps[steps > 0].min())
    if steps.max() > LONGEST_GAP * max(mean_step, tick):
        raise InputError(
            f"expected evenly spaced samples in {path.name}, got a gap of {steps.max():.4g} s "
            f"among steps of {mean_step:.4g} s; samples are missing, record again or give --rate."
        )
    return mean_step


def _chosen_axes(path: Path, columns: dict[str, Floats], axis: Axis | None) -> tuple[Floats, str]:
    """The chosen axis (1, n), or all three (3, n), as recorded, and the unit in their header."""
    time = _time_column(columns)
    others = [name for name in columns if name != time]
    if axis is None and len(others) != 1:
        raise InputError(
            f"expected --axis x, y, z or dft321 for {path.name}, got none and the columns "
            f"{', '.join(others)}; choose an axis."
        )
    chosen = others if axis is None else _names_of_axes(path, others, axis)
    units = {_name_and_unit(name)[1] for name in chosen}
    if len(units) > 1:
        raise InputError(
            f"expected one unit for all axes of {path.name}, got {' and '.join(sorted(units))}; "
            "convert them."
        )
    samples = np.array([columns[name] for name in chosen])
    if not np.isfinite(samples).all():
        raise InputError(
            f"expected finite samples in {path.name}, got NaN or inf; repair or record again."
        )
    return samples, units.pop()


def _names_of_axes(path: Path, names: Sequence[str], axis: Axis) -> list[str]:
    """The columns of the axis, or of all three."""
    letters = {n: m[1] for n in names if (m := _AXIS_NAME.fullmatch(_name_and_unit(n)[0]))}
    wanted = "xyz" if axis == "dft321" else axis
    chosen = [name for letter in wanted for name in letters if letters[name] == letter]
    if [letters[name] for name in chosen] != list(wanted):
        raise InputError(
            f"expected columns named {', '.join(wanted)} (each once) in {path.name}, got "
            f"{', '.join(names)}; rename them, choose another axis, or leave --axis out where "
            "there is only one."
        )
    return chosen
