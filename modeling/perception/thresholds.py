"""Detection thresholds: the weakest sinusoid that is felt, by frequency (eq. 5).

docs/method/perception.md#thresholds
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import resources
from math import inf
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.files.columns import ABOVE_0, Column, chosen
from tactileq.modeling.files.described import FileSection, key
from tactileq.modeling.files.hashes import sha256_of_values
from tactileq.modeling.files.others.declared import read_user_cells
from tactileq.modeling.files.others.splitting import read_other_text
from tactileq.modeling.files.tables import typed
from tactileq.modeling.reprs import one_line

STANDARD_GRAVITY_M_S2 = 9.80665
SHIPPED = ("codec", "pen-hold", "mobile")
# Beyond anybody's threshold on both sides; within, levels in decibels and pictures stay finite.
FREQUENCIES_HZ = (1e-6, 1e6)
LEVELS_G = (1e-9, 1e6)
THRESHOLD_COLUMNS = (
    Column(
        "frequency_hz",
        unit="Hz",
        description="Frequency of the sinusoid, rising",
        limits=FREQUENCIES_HZ,
        required=True,
    ),
    Column(
        "acceleration_g",
        unit="g",
        description="Peak acceleration at threshold; without displacement_um",
        limits=LEVELS_G,
        required=True,
        optional=True,
    ),
    Column(
        "displacement_um",
        unit="µm",
        description="Peak displacement at threshold; without acceleration_g",
        limits=(ABOVE_0, inf),
        required=True,
        optional=True,
    ),
)
LEVEL_COLUMNS = ("acceleration_g", "displacement_um")


def displacement_to_acceleration_g(frequency_hz: ArrayLike, displacement_um: ArrayLike) -> Floats:
    """Peak acceleration (g) of a sinusoid of peak displacement x (µm): (2πf)²·x (eq. 5)."""
    omega = 2 * np.pi * np.asarray(frequency_hz, dtype=np.float64)
    acceleration: Floats = omega**2 * np.asarray(displacement_um) * 1e-6 / STANDARD_GRAVITY_M_S2
    return acceleration


@dataclass(frozen=True, eq=False)
class Threshold(FileSection):
    """A detection threshold, valid from its first to its last frequency.

    Raises
    ------
    InputError
        Naming the first value that cannot be part of a threshold.
    """

    WHERE = "threshold"
    ADVICE = "correct the table"

    name: Annotated[str, key("of a shipped table, or the file's")]
    frequency_hz: Annotated[
        Floats, key("rising, 1e-6 … 1e6", unit="Hz", shape="frequencies", finite=False)
    ]
    acceleration_g: Annotated[
        Floats,
        key("peak at threshold, 1e-9 … 1e6", unit="g", shape="frequencies", finite=False),
    ]
    source: Annotated[str, key("where the numbers come from")]
    caveat: Annotated[str, key("what speaks against them")]

    __repr__ = one_line

    def __post_init__(self) -> None:
        super().__post_init__()
        wrong = _what_is_wrong(self.frequency_hz, self.acceleration_g)
        if wrong:
            raise InputError(
                "expected at least two rising frequencies with levels above 0 "
                f"({LEVELS_G[0]:g} to {LEVELS_G[1]:g} g) in the threshold {shown(self.name)}, got "
                f"{wrong}; correct the table."
            )

    @property
    def valid_range_hz(self) -> tuple[float, float]:
        """Lowest and highest frequency of the table; outside, the threshold is unknown."""
        return float(self.frequency_hz[0]), float(self.frequency_hz[-1])

    def at(self, frequency_hz: ArrayLike) -> Floats:
        """Threshold in g (peak) at any frequencies, log–log interpolated; NaN outside the range."""
        frequency = np.asarray(frequency_hz, dtype=np.float64)
        with np.errstate(divide="ignore", invalid="ignore"):
            level = np.exp(
                np.interp(np.log(frequency), np.log(self.frequency_hz), np.log(self.acceleration_g))
            )
        known = (frequency >= self.frequency_hz[0]) & (frequency <= self.frequency_hz[-1])
        return np.where(known, level, np.nan)

    def held(self, frequency_hz: ArrayLike) -> Floats:
        """As `at`, but above the range its last level (g): a lower bound, which is assumed.

        Thresholds rise there: the P channel is the most sensitive at 250 to 300 Hz
        (docs/method/perception.md#above-the-table).
        """
        above = np.asarray(frequency_hz, dtype=np.float64) > self.frequency_hz[-1]
        finite = above & np.isfinite(frequency_hz)
        return np.where(finite, self.acceleration_g[-1], self.at(frequency_hz))

    @property
    def sha256(self) -> str:
        """SHA-256 of its values, by which files name the threshold that they are based on."""
        return sha256_of_values(self.to_dict())

    @staticmethod
    def load(path: str | Path) -> Threshold:
        """Read a TSV with frequency_hz and displacement_um or acceleration_g (both peak).

        Lines `# source: …` and `# caveat: …` above the header are kept with the table.

        Raises
        ------
        InputError
            For a missing file, missing or doubled columns or values that are no thresholds.
        """
        source = Path(path)
        rows = read_user_cells(source, THRESHOLD_COLUMNS, "a table of thresholds")
        columns = [name for name in LEVEL_COLUMNS if rows and name in rows[0][1]]
        if len(columns) != 1:
            got = "both" if columns else ("neither" if rows else "no rows")
            raise InputError(
                f"expected one column, {' or '.join(LEVEL_COLUMNS)}, with values in {source}, got "
                f"{got}; a threshold needs one level (peak) for each frequency."
            )
        used = chosen(THRESHOLD_COLUMNS, "frequency_hz", *columns)
        values = [typed(cells, used, where) for where, cells in rows]
        frequency, level = (
            np.array([row[column.name] for row in values], dtype=np.float64) for column in used
        )
        if columns == ["displacement_um"]:
            level = displacement_to_acceleration_g(frequency, level)
        notes = _notes(source)
        return Threshold(
            source.stem,
            frequency,
            level,
            notes.get("source", "not stated in the file"),
            notes.get("caveat", "not stated in the file"),
        )

    @staticmethod
    def named(name: str | Path) -> Threshold:
        """An included threshold, by name, or a user's own, by the path of its TSV."""
        file = Threshold.file_of(name)
        return Threshold.load(file) if file else Threshold.shipped(str(name))

    @staticmethod
    def file_of(name: str | Path) -> Path | None:
        """The file of a user's own threshold; None for the name of an included one."""
        return Path(name) if Path(name).suffix else None

    @staticmethod
    def shipped(name: str) -> Threshold:
        """One of `SHIPPED`, which are included (docs/method/perception.md#shipped-thresholds)."""
        if name not in SHIPPED:
            raise InputError(
                f"expected a threshold among {', '.join(SHIPPED)} or a TSV file, got "
                f"{shown(name)}; "
                "give one of them."
            )
        with resources.as_file(
            resources.files("tactileq.modeling.perception") / "shipped" / f"{name}.tsv"
        ) as path:
            return Threshold.load(path)


def _what_is_wrong(frequency_hz: Floats, acceleration_g: Floats) -> str:
    """The first reason why these numbers are no threshold; empty where they are one."""
    if frequency_hz.ndim != 1 or frequency_hz.shape != acceleration_g.shape:
        return f"arrays of shapes {frequency_hz.shape} and {acceleration_g.shape}"
    if frequency_hz.size < 2:
        return f"{frequency_hz.size} of them"
    wrong = ~((frequency_hz >= FREQUENCIES_HZ[0]) & (frequency_hz <= FREQUENCIES_HZ[1]))
    if wrong.any():
        return f"a frequency of {frequency_hz[wrong][0]:g} Hz"
    falls = np.diff(frequency_hz) <= 0
    if falls.any():
        at = int(np.argmax(falls))
        return f"{frequency_hz[at + 1]:g} Hz after {frequency_hz[at]:g} Hz"
    wrong = ~((acceleration_g >= LEVELS_G[0]) & (acceleration_g <= LEVELS_G[1]))
    if wrong.any():
        return f"the level {acceleration_g[wrong][0]:g} at {frequency_hz[wrong][0]:g} Hz"
    return ""


def _notes(path: Path) -> dict[str, str]:
    notes = {}
    for written in read_other_text(path, "a table").content.splitlines():
        is_quoted = written.startswith('"') and written.endswith('"')  # by a spreadsheet
        line = written[1:-1].replace('""', '"') if is_quoted else written
        if line.startswith("#") and ":" in line:
            key, value = line[1:].split(":", 1)
            notes[key.strip().lower()] = value.strip()
    return notes
