"""Detection thresholds: the weakest sinusoid that is felt, by frequency (eq. 5, METHOD 7)."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import resources
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from modeling.errors import InputError
from modeling.files import read_table
from modeling.peq import Floats
from modeling.recording import number

STANDARD_GRAVITY_M_S2 = 9.80665
SHIPPED = ("codec", "pen-hold")


def displacement_to_acceleration_g(frequency_hz: ArrayLike, displacement_um: ArrayLike) -> Floats:
    """Peak acceleration (g) of a sinusoid of peak displacement x (µm): (2πf)²·x (eq. 5)."""
    omega = 2 * np.pi * np.asarray(frequency_hz, dtype=np.float64)
    acceleration: Floats = omega**2 * np.asarray(displacement_um) * 1e-6 / STANDARD_GRAVITY_M_S2
    return acceleration


@dataclass(frozen=True, eq=False)
class Threshold:
    """A detection threshold, valid from its first to its last frequency.

    Parameters
    ----------
    name : str
    frequency_hz : (n,) ndarray
        Rising, > 0, n ≥ 2.
    acceleration_g : (n,) ndarray
        Peak acceleration at threshold, > 0.
    source, caveat : str
        Where the numbers come from and what speaks against them.
    """

    name: str
    frequency_hz: Floats
    acceleration_g: Floats
    source: str
    caveat: str

    def __post_init__(self) -> None:
        frequency, level = self.frequency_hz, self.acceleration_g
        good = frequency.size >= 2 and frequency.shape == level.shape
        good = good and bool((np.diff(frequency) > 0).all() and (frequency > 0).all())
        good = good and bool(np.isfinite(frequency).all())
        if not (good and np.isfinite(level).all() and (level > 0).all()):
            raise InputError(
                f"expected at least two rising frequencies with levels above 0 in the threshold "
                f"{self.name!r}, got frequencies {frequency.tolist()}; correct the table."
            )

    def at(self, frequency_hz: ArrayLike) -> Floats:
        """Threshold in g (peak) at any frequencies, log–log interpolated; NaN outside the range."""
        frequency = np.asarray(frequency_hz, dtype=np.float64)
        with np.errstate(divide="ignore", invalid="ignore"):
            level = np.exp(
                np.interp(np.log(frequency), np.log(self.frequency_hz), np.log(self.acceleration_g))
            )
        known = (frequency >= self.frequency_hz[0]) & (frequency <= self.frequency_hz[-1])
        return np.where(known, level, np.nan)

    @staticmethod
    def load(path: str | Path) -> Threshold:
        """Read a TSV with frequency_hz and displacement_um or acceleration_g (both peak).

        Lines `# source: …` and `# caveat: …` above the header are kept with the table.

        Raises
        ------
        InputError
            For a missing file, missing columns or values that are no thresholds.
        """
        source = Path(path)
        rows = read_table(source, ("frequency_hz",))
        column = next(
            (c for c in ("acceleration_g", "displacement_um") if c in (rows or [{}])[0]), ""
        )
        if not column:
            raise InputError(
                f"expected a column acceleration_g or displacement_um with values in {source}, got "
                "neither; a threshold needs levels."
            )
        cells = [
            [number(row[name], f"{name} in {source.name}") for row in rows]
            for name in ("frequency_hz", column)
        ]
        frequency, level = (np.array(values) for values in cells)
        if column == "displacement_um":
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
    def shipped(name: str) -> Threshold:
        """One of the thresholds that come along: "codec" or "pen-hold" (METHOD 7)."""
        if name not in SHIPPED:
            raise InputError(
                f"expected a threshold among {', '.join(SHIPPED)} or a TSV file, got {name!r}; "
                "give one of them."
            )
        with resources.as_file(resources.files("modeling") / "thresholds" / f"{name}.tsv") as path:
            return Threshold.load(path)


def _notes(path: Path) -> dict[str, str]:
    notes = {}
    for line in path.read_text(encoding="utf-8-sig").splitlines():
        if line.startswith("#") and ":" in line:
            key, value = line[1:].split(":", 1)
            notes[key.strip().lower()] = value.strip()
    return notes
