"""Tables of recordings taken one by one, where no grid is needed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from modeling import Recording, RecordingSet, Spectrum, find_layers
from modeling.fitting import recording_spectra

SPECTRUM_STEP_HZ = 5.0


def layers_table(recordings: RecordingSet, *, estimator: str = "paper-consistent") -> pd.DataFrame:
    """The layers of each recording alone: one row per layer, or one with `layer` 0 where none is.

    The sensor's floor (recordings at force 0) is subtracted and not listed.

    Parameters
    ----------
    recordings : RecordingSet
    estimator : str
        As in `modeling.fit_texture`.

    Returns
    -------
    DataFrame
        texture, speed_mm_s, force_n, repeat, unit, simulated, noise_gain (unit per unit noise),
        layer (1-based, by rising frequency), frequency_hz, bandwidth_hz, gain, level_sd_db,
        unresolved.
    """
    rows: list[dict[str, Any]] = []
    for recording, measured in _spectra(recordings):
        found = find_layers(measured, estimator=estimator)
        labels = {
            "texture": recording.texture,
            "speed_mm_s": recording.speed_mm_s,
            "force_n": recording.force_n,
            "repeat": recording.repeat,
            "unit": recording.unit,
            "simulated": recording.simulated,
            "noise_gain": found.noise_gain,
        }
        layers = {
            "layer": np.arange(1, found.gains.size + 1),
            "frequency_hz": found.frequencies_hz,
            "bandwidth_hz": found.bandwidths_hz,
            "gain": found.gains,
            "level_sd_db": found.level_sd_db,
            "unresolved": found.unresolved,
        }
        if not found.gains.size:
            rows.append({**labels, "layer": 0})
        rows += [
            {**labels, **dict(zip(layers, layer, strict=True))}
            for layer in zip(*layers.values(), strict=True)
        ]
    return pd.DataFrame(rows)


def spectra_table(recordings: RecordingSet) -> pd.DataFrame:
    """The smoothed spectrum (σ = 30 Hz) of each recording every 5 Hz, in long form.

    The sensor's floor (recordings at force 0) is subtracted and not listed.

    Returns
    -------
    DataFrame
        texture, speed_mm_s, force_n, repeat, simulated, frequency_hz, magnitude (unit per unit
        noise).
    """
    parts = []
    for recording, measured in _spectra(recordings):
        frequency = np.arange(0.0, measured.rate_hz / 2, SPECTRUM_STEP_HZ)
        parts.append(
            pd.DataFrame(
                {
                    "texture": recording.texture,
                    "speed_mm_s": recording.speed_mm_s,
                    "force_n": recording.force_n,
                    "repeat": recording.repeat,
                    "simulated": recording.simulated,
                    "frequency_hz": frequency,
                    "magnitude": np.interp(frequency, measured.frequency_hz, measured.smoothed()),
                }
            )
        )
    return pd.concat(parts, ignore_index=True)


def _spectra(recordings: RecordingSet) -> list[tuple[Recording, Spectrum]]:
    """All recordings with contact; each texture has its own floor and rate."""
    return [
        pair
        for texture in recordings.textures
        for pair in recording_spectra(recordings.of_texture(texture))
    ]
