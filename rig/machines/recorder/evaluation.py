"""Files of the accelerometer's evaluation tool, read strictly (docs/recorder.md#files)."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Literal

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError, shortened, shown
from tactileq.modeling.files.reading import read_text

Axis = Literal["x", "y", "z"]
HEADER = "Time(s),ax(g),ay(g),az(g)"
RATES_HZ = (22704.0, 220704.0)  # the paper's, and what the tool streams: 6897 frames of 32 samples
LIMIT_G = 50.0
STEP_G = 0.001907349
RATE_SHARE = 1e-3  # by which times may contradict the rate
_TIME_STEP_S = 1e-6  # six decimals
_COMMA = re.compile(r"-?\d+,\d+(;-?\d+,\d+){3}")


def read_evaluation(path: Path, *, rate_hz: float, axis: Axis = "z") -> Floats:
    """One axis of a file: acceleration (n,) in g, at `rate_hz`.

    Parameters
    ----------
    rate_hz : float
        That the sensor was set to, above 0; the times have to agree within 0.1 %.
    axis : {"x", "y", "z"}

    Raises
    ------
    InputError
        For another header, rows that are not four numbers, decimal commas, NaN, times that do not
        rise evenly at the rate, and samples at the sensor's limit (±50 g).
    """
    lines = read_text(path, "a file of the evaluation tool").split("\n")
    if lines.pop() != "":
        raise InputError(
            f"expected {path.name} to end with a whole line, got none; it is truncated, record "
            "again."
        )
    lines = [line.removesuffix("\r") for line in lines]
    if not lines or lines[0] != HEADER:
        raise InputError(
            f"expected the header {HEADER} in {path.name}, got "
            f"{shown(lines[0] if lines else '')}; save it with the evaluation tool, or import it "
            "with tactileq import csv."
        )
    columns = _columns(path, lines[1:])
    _check_times(path, columns[0], rate_hz)
    samples: Floats = columns[1 + "xyz".index(axis)]
    clipped = int(np.count_nonzero(np.abs(columns[1:]) >= LIMIT_G - STEP_G))
    if clipped:
        raise InputError(
            f"expected samples within ±{LIMIT_G:g} g in {path.name}, got {clipped} at the sensor's "
            "limit; press less hard, or take a softer lever."
        )
    return samples


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
    if _COMMA.fullmatch(row) or row.count(",") == 7:
        return InputError(
            f"expected points as decimal marks in {path.name}, got commas in line {number}, "
            f"{shortened(row)}; set the computer's number format to points, and record again."
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


def _check_times(path: Path, time_s: Floats, rate_hz: float) -> None:
    mean_s = (time_s[-1] - time_s[0]) / (time_s.size - 1)
    if mean_s <= 0 or abs(mean_s * rate_hz - 1) > RATE_SHARE + _TIME_STEP_S * rate_hz / time_s.size:
        got = 1 / mean_s if mean_s > 0 else np.inf
        hint = "".join(
            f" (sensor.rate_hz = {usual:g})" for usual in RATES_HZ if abs(got / usual - 1) < 0.01
        )
        raise InputError(
            f"expected times at {rate_hz:g} Hz in {path.name}, got {got:.6g} Hz; the clocks of "
            f"sensor and recorder file disagree, correct the one that is wrong{hint}."
        )
    even = time_s[0] + np.arange(time_s.size) * mean_s
    worst = int(np.argmax(np.abs(time_s - even)))
    if abs(time_s[worst] - even[worst]) > max(1 / rate_hz, 2 * _TIME_STEP_S):
        raise InputError(
            f"expected even times in {path.name}, got {time_s[worst]:.6f} s for sample {worst}; "
            "samples are missing, record again."
        )
