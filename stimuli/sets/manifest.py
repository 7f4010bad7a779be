"""The manifest of a stimulus set: one row per WAV file, and what its columns mean."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from modeling.arrays import Floats
from modeling.files.tables import write_table
from modeling.files.writing import write_text
from stimuli.sets.rendering import steady_part

MANIFEST = "manifest.tsv"
COLUMNS_FILE = "manifest.json"
COMPENSATED = "compensated"

COLUMNS = {
    "file": "name of the WAV file",
    "texture": "texture of the model",
    "model": "label of the model in the recipe",
    "layers": "number of layers; n/a for an autoregressive model",
    "model_rate_hz": "rate of the model; above half of it the file has no content",
    "trajectory": "name of the trajectory in the recipe",
    "speed_mm_s": "speed where it is constant, else n/a",
    "force_n": "force where it is constant, else n/a",
    "rate_hz": "sampling rate of the file",
    "duration_s": "length of the file",
    "seed": "seed of the noise",
    "stream": "stream of the noise under that seed; equal where the noise is frozen",
    "unit": "unit of rms and peak: g, or arbitrary where the recordings were not calibrated",
    "format": "float32 (samples in the unit) or pcm24 (samples in shares of full_scale_g)",
    "bits": "bits per sample",
    "full_scale_g": "value of a full-scale sample of a pcm24 file in the unit, else n/a",
    "gain_db": "gain applied to the model's output",
    "rms": "RMS over the file without its fades (the first and last 10 ms); of a compensated file, "
    "of the vibration meant at the hand, before the compensation",
    "level_db": "the same in dB re 1 g (re 1 where the unit is arbitrary)",
    "sensation_level_db": "threshold-weighted RMS after the gain in dB above threshold, over the "
    "same part at the model's rate, before any compensation; n/a where loudness was not matched",
    "share_without_threshold": "share of the power at frequencies without a known threshold, which "
    "the sensation level leaves out; n/a where loudness was not matched",
    "peak": "largest absolute sample of the file, compensated or not",
    "crest_db": "peak over RMS; of a compensated file, of the vibration meant at the hand",
    "sha256": "SHA-256 of the file",
    "model_sha256": "SHA-256 of the model's file",
    "recipe_sha256": "SHA-256 of recipe.toml in this folder",
    "threshold_sha256": "SHA-256 of the threshold's values (`Threshold.sha256`); n/a where "
    "loudness was not matched",
    "vibrator": "compensated: the file is the drive for the vibrator of sources/vibrator.json, "
    "whose vibration is then the one meant at the hand, times the flat gain in that file; n/a: the "
    "file is the vibration itself",
    "vibrator_sha256": "SHA-256 of the vibrator's file; n/a without",
    "simulated": "true where the recordings behind the model, or the test of the vibrator, were "
    "simulated",
}


@dataclass(frozen=True)
class Stimulus:
    """One rendered file: the manifest's row; `COLUMNS` says what each field is (None: n/a)."""

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


def write_manifest(folder: Path, stimuli: Sequence[Stimulus]) -> None:
    """Write `manifest.tsv`, and `manifest.json` with what each column means."""
    columns = [field.name for field in fields(Stimulus)]
    rows = [[_cell(getattr(stimulus, column)) for column in columns] for stimulus in stimuli]
    write_table(folder / MANIFEST, columns, rows)
    write_text(folder / COLUMNS_FILE, json.dumps(COLUMNS, indent=2) + "\n")


def _cell(value: object) -> object:
    return "n/a" if value is None else value
