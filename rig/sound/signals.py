"""Signals that are played at a resting hand: tone bursts, files of a stimulus set.

docs/method/live.md#signals
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from modeling.arrays import Floats
from modeling.errors import InputError, shown
from modeling.files.reading import read_bytes
from modeling.files.tables import number, read_table
from modeling.files.wav import read_wav

RAMP_S = 0.02
_MANIFEST = "manifest.tsv"
_COLUMNS = ("file", "unit", "format", "full_scale_g", "sha256", "vibrator_sha256", "simulated")


@dataclass(frozen=True, eq=False, kw_only=True)
class PreparedSignal:
    """A signal and what is to be known of it.

    Parameters
    ----------
    samples_g : (n,) ndarray
    rate_hz : float
    vibrator_sha256 : str, optional
        SHA-256 of the vibrator's file for which it is compensated; None for the vibration itself.
    simulated : bool
        Whether what it was made from was simulated.
    """

    samples_g: Floats
    rate_hz: float
    vibrator_sha256: str | None
    simulated: bool


def tone_burst(
    frequency_hz: float, amplitude_g: float, *, duration_s: float, rate_hz: float
) -> PreparedSignal:
    """A sinusoid with raised-cosine ramps of 20 ms (shorter bursts: of half their length).

    Parameters
    ----------
    frequency_hz : float
        Above 0, below half the rate.
    amplitude_g : float
        Of the sinusoid, ≥ 0; its RMS is 0.707 of it.
    duration_s : float
        Ramps included; at least two samples, at most 60.
    rate_hz : float

    Raises
    ------
    InputError
        For values out of range.
    """
    if not 0 < frequency_hz < rate_hz / 2:
        raise InputError(
            f"expected a frequency between 0 and half the rate of {rate_hz:g} Hz, got "
            f"{frequency_hz}; choose another."
        )
    if not 0 <= amplitude_g < np.inf:
        raise InputError(f"expected an amplitude of 0 g or more, got {amplitude_g}; correct it.")
    if not 2 / rate_hz <= duration_s <= 60:
        raise InputError(f"expected a burst of up to 60 s, got {duration_s} s; choose another.")
    count = round(duration_s * rate_hz)
    samples = amplitude_g * np.sin(2 * np.pi * frequency_hz / rate_hz * np.arange(count))
    ramp = min(round(RAMP_S * rate_hz), count // 2)
    rise = 0.5 - 0.5 * np.cos(np.pi * np.arange(ramp) / ramp)
    samples[:ramp] *= rise
    samples[count - ramp :] *= rise[::-1]
    return PreparedSignal(samples_g=samples, rate_hz=rate_hz, vibrator_sha256=None, simulated=False)


def stimulus(folder: Path, which: str) -> PreparedSignal:
    """A file of a stimulus set, whose bytes are those that its manifest states.

    Parameters
    ----------
    folder : path
        Of tactileq stimuli.
    which : str
        Name of the file, or its SHA-256 (at least eight of its digits).

    Raises
    ------
    InputError
        For no such file, one that has changed, or one without a calibrated unit.
    """
    rows = read_table(folder / _MANIFEST, _COLUMNS)
    fitting = [
        row
        for row in rows
        if row["file"] == which or (len(which) >= 8 and row["sha256"].startswith(which))
    ]
    if len(fitting) != 1:
        raise InputError(
            f"expected the name or SHA-256 of one file of the set {folder}, got {shown(which)}, "
            f"which fits {len(fitting)} of {len(rows)}; see its {_MANIFEST}."
        )
    return _prepared(folder, fitting[0])


def _prepared(folder: Path, row: dict[str, str]) -> PreparedSignal:
    path = folder / row["file"]
    found = hashlib.sha256(read_bytes(path, "the stimulus")).hexdigest()
    if found != row["sha256"]:
        raise InputError(
            f"expected {path} with the SHA-256 {row['sha256'][:8]}… of its manifest, got "
            f"{found[:8]}…; make the set anew."
        )
    if row["unit"] != "g":
        raise InputError(
            f"expected a stimulus in g, got {path} in the unit {shown(row['unit'])}; make the set "
            "from calibrated recordings."
        )
    samples, rate_hz = read_wav(path)
    if row["format"] == "pcm24":
        samples = samples * number(row["full_scale_g"], "full_scale_g")
    compensated = row["vibrator_sha256"]
    return PreparedSignal(
        samples_g=samples,
        rate_hz=rate_hz,
        vibrator_sha256=None if compensated == "n/a" else compensated,
        simulated=row["simulated"] == "true",
    )
