"""The manifest of a stimulus set: one row per WAV file, and what its columns mean."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.files.stimulus_table import MANIFEST, STIMULUS_COLUMNS
from tactileq.modeling.files.tables import write_table
from tactileq.modeling.files.writing import write_text
from tactileq.stimuli.sets.rendering import steady_part

COLUMNS_FILE = "manifest.json"
COMPENSATED = "compensated"


@dataclass(frozen=True)
class StimulusRow:
    """One rendered file: the row of the manifest, with a field for each of `STIMULUS_COLUMNS`."""

    file: str
    texture: str
    model: str
    layers: int | None
    model_rate_hz: float
    trajectory: str
    speed_mm_s: float | None
    force_n: float | None
    rate_hz: int
    duration_s: float
    seed: int
    stream: int
    unit: str
    format: str
    bits: int
    full_scale_g: float | None
    gain_db: float
    rms: float
    level_db: float
    sensation_level_db: float | None
    share_without_threshold: float | None
    peak: float
    crest_db: float | None
    sha256: str
    model_sha256: str
    recipe_sha256: str
    threshold_sha256: str | None
    vibrator: str | None
    vibrator_sha256: str | None
    simulated: str


def level_db(rms: float) -> float:
    """RMS in dB re 1; −inf for silence."""
    return 20 * float(np.log10(rms)) if rms > 0 else -np.inf


def measured(vibration: Floats, rate_hz: float, *, written: Floats) -> dict[str, Any]:
    """The columns rms, level_db and crest_db of a vibration, and peak of what is written for it."""
    rms = float(np.sqrt(np.mean(steady_part(vibration, rate_hz) ** 2)))
    highest = float(np.abs(vibration).max())
    return {
        "rms": rms,
        "level_db": level_db(rms),
        "peak": float(np.abs(written).max()),
        "crest_db": level_db(highest) - level_db(rms) if rms > 0 else None,
    }


def write_manifest(folder: Path, rows: Iterable[Mapping[str, object]]) -> tuple[Path, Path]:
    """Write `manifest.tsv`, and `manifest.json` with what each column means."""
    table, described = folder / MANIFEST, folder / COLUMNS_FILE
    write_table(table, STIMULUS_COLUMNS, rows)
    meanings = {column.name: column.description for column in STIMULUS_COLUMNS}
    write_text(described, json.dumps(meanings, indent=2) + "\n")
    return table, described
