"""Files of the accelerometer's evaluation tool, read strictly (docs/recorder.md#files)."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Literal

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError, shortened, shown
from tactileq.modeling.files.reading import read_text

Axis = Literal["x", "y", "z"]
HEADER = "Time(s),ax(g),ay(g),az(g)"
RATES_HZ = (100.0, 1e6)  # that a sensor may have
LIMIT_G = 50.0
STEP_G = 0.001907349
RATE_SHARE = 1e-3  # by which times may contradict the rate
STANDS_STILL_S = 0.1
# The header says s, but the only published file counts ms (docs/recorder.md#files).
_SECONDS = {"s": 1.0, "ms": 1e-3}
_TIME_STEP = 1e-6  # six decimals


def read_evaluation(
    path: Path,
    *,
    rate_hz: float,
    axis: Axis = "z",
    tell: Callable[[str], None] = lambda sentence: None,
) -> Floats:
    """One axis of a file: acceleration (n,) in g, at `rate_hz`.

    Parameters
    ----------
    rate_hz : float
        That the sensor was set to, above 0; the times have to agree within 0.1 %, in s or in ms.
    axis : {"x", "y", "z"}
    tell : callable
        Is told of times in ms, and of times that would not show lost samples.

    Raises
    ------
    InputError
        For another header, rows that are not four numbers, decimal commas, NaN, times that do not
        rise evenly at the rate, samples at the sensor's limit (±50 g), and an axis that stands
        still.
    """
    lines = read_text(path, "a file of the evaluation tool").split("\n")
    if lines.pop() != "":
        raise InputError(
            f"expected {path.name} to end with a whole line, got none; it is truncated, record "
            "again."
        )
    lines = [line.removesuffix("\r") for line in lines]
    if not lines or lines[0].replace(";", ",") != HEADER:
        raise InputError(
            f"expected the header {HEADER} in {path.name}, got "
            f"{shown(lines[0] if lines else '')}; save it with the evaluation tool."
        )
    columns = _columns(path, lines[1:])
    _check_times(path, columns[0], rate_hz, tell)
    samples: Floats = columns[1 + "xyz".index(axis)]
    clipped = int(np.count_nonzero(np.abs(columns[1:]) >= LIMIT_G - STEP_G))
    if clipped:
        raise InputError(
            f"expected samples within ±{LIMIT_G:g} g in {path.name}, got {clipped} at the sensor's "
            "limit; record lower forces or speeds (--grid)."
        )
    check_alive(samples, rate_hz=rate_hz, where=path.name)
    return samples


def check_alive(samples: Floats, *, rate_hz: float, where: str) -> None:
    """Refuse samples (n,) of which 0.1 s are the same: no sensor that is pressed is so quiet.

    Raises
    ------
    InputError
        With how long they are the same, and what they are.
    """
    ends = np.flatnonzero(np.append(np.diff(samples) != 0, True))
    lasting = np.diff(ends, prepend=-1)
    longest = int(np.argmax(lasting))
    if lasting[longest] >= min(STANDS_STILL_S * rate_hz, samples.size):
        raise InputError(
            f"expected samples that change in {where}, got {samples[ends[longest]]:g} for "
            f"{lasting[longest] / rate_hz:.3g} s; check the sensor and its cable, then record "
            "again."
        )


def _columns(path: Path, rows: list[str]) -> Floats:
    """(4, n) ndarray."""
    if len(rows) < 2:
        raise InputError(f"expected samples in {path.name}, got {len(rows)}; record again.")
    try:
        columns = np.loadtxt(rows, delimiter=",", comments=None, ndmin=2).T
    except ValueError:
        columns = np.empty((0, 0))
    if columns.shape != (4, len(rows)) or not np.isfinite(columns).all():
        raise _first_wrong(path, rows)
    return columns


def _first_wrong(path: Path, rows: list[str]) -> InputError:
    """What is wrong with the first row that is not four finite numbers."""
    wrong = ((number, row) for number, row in enumerate(rows, start=2) if not _is_whole(row))
    number, row = next(wrong, (len(rows) + 1, rows[-1]))
    if ";" in row or row.count(",") == 7:
        return InputError(
            f"expected points as decimal marks, and commas between columns, in {path.name}, got "
            f"other ones in line {number}, {shortened(row)}; set the computer's number format to "
            "points and its list separator to a comma, and record again."
        )
    return InputError(
        f"expected four finite numbers in line {number} of {path.name}, got {shown(row)}; record "
        "again."
    )


def _is_whole(row: str) -> bool:
    try:
        values = [float(cell) for cell in row.split(",")]
    except ValueError:
        return False
    return len(values) == 4 and bool(np.isfinite(values).all())


def _check_times(path: Path, times: Floats, rate_hz: float, tell: Callable[[str], None]) -> None:
    mean = float(times[-1] - times[0]) / (times.size - 1)
    off = np.abs(times - (times[0] + np.arange(times.size) * mean))
    worst = int(np.argmax(off))
    if mean <= 0 or off[worst] > max(mean, 2 * _TIME_STEP):
        raise InputError(
            f"expected times that rise evenly in {path.name}, got {times[worst]:.6f} for sample "
            f"{worst}; samples are missing, record again."
        )
    found = {unit: 1 / (mean * second) for unit, second in _SECONDS.items()}
    share = RATE_SHARE + _TIME_STEP / (mean * times.size)
    unit = next((unit for unit, hz in found.items() if abs(rate_hz / hz - 1) <= share), None)
    if unit is None:
        possible = {unit: hz for unit, hz in found.items() if RATES_HZ[0] <= hz <= RATES_HZ[1]}
        got = " or ".join(f"{hz:.6g} Hz (in {unit})" for unit, hz in possible.items())
        raise InputError(
            f"expected times at {rate_hz:g} Hz in {path.name}, as sensor.rate_hz says, got "
            f"{got or f'a step of {mean:.4g}'}; write the rate that the sensor is set to into "
            "sensor.rate_hz, or set the sensor to it."
        )
    if unit != "s":
        tell(f"its times are in {unit}, although its header says s: so they have sensor.rate_hz")
    # The first time of the published file is not even with the others.
    if np.abs(np.diff(times[1:]) - mean).max(initial=0) <= 2 * _TIME_STEP < mean / 2:
        tell(
            "its times are even to the last digit, as if counted, so samples that were lost may "
            "show in their number only; have the tool record no longer than --duration"
        )
