"""Tables of recordings taken one by one, where no grid is needed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from modeling import Layers, Recording, Spectrum, find_layers

SPECTRUM_STEP_HZ = 5.0


@dataclass(frozen=True, eq=False)
class RecordingLayers:
    """One recording, its spectrum (sensor's floor subtracted), and the layers found in it alone."""

    recording: Recording
    spectrum: Spectrum
    layers: Layers


def layers_of_recordings(
    measured: Sequence[tuple[Recording, Spectrum]], *, estimator: str
) -> tuple[RecordingLayers, ...]:
    """Find the layers of each recording; no grid is needed.

    Parameters
    ----------
    measured : sequence of (Recording, Spectrum)
        From `modeling.fitting.recording_spectra`.
    estimator : str
        As in `modeling.fit_texture`.
    """
    return tuple(
        RecordingLayers(recording, found, find_layers(found, estimator=estimator))
        for recording, found in measured
    )


def layers_table(found: Sequence[RecordingLayers]) -> pd.DataFrame:
    """The layers of each recording: one row per layer, or one with `layer` 0 where none is.

    Parameters
    ----------
    found : sequence of RecordingLayers

    Returns
    -------
    DataFrame
        texture, speed_mm_s, force_n, repeat, unit, simulated, noise_gain (unit per unit noise),
        layer (1-based, by rising frequency), frequency_hz, bandwidth_hz, gain, level_sd_db,
        unresolved.
    """
    rows: list[dict[str, Any]] = []
    for each in found:
        recording, layers = each.recording, each.layers
        labels = {
            "texture": recording.texture,
            "speed_mm_s": recording.speed_mm_s,
            "force_n": recording.force_n,
            "repeat": recording.repeat,
            "unit": recording.unit,
            "simulated": recording.simulated,
            "noise_gain": layers.noise_gain,
        }
        columns = {
            "layer": np.arange(1, layers.gains.size + 1),
            "frequency_hz": layers.frequencies_hz,
            "bandwidth_hz": layers.bandwidths_hz,
            "gain": layers.gains,
            "level_sd_db": layers.level_sd_db,
            "unresolved": layers.unresolved,
        }
        if not layers.gains.size:
            rows.append({**labels, "layer": 0})
        rows += [
            {**labels, **dict(zip(columns, layer, strict=True))}
            for layer in zip(*columns.values(), strict=True)
        ]
    return pd.DataFrame(rows)


def spectra_table(found: Sequence[RecordingLayers]) -> pd.DataFrame:
    """The smoothed spectrum (σ = 30 Hz) of each recording every 5 Hz, in long form.

    Parameters
    ----------
    found : sequence of RecordingLayers

    Returns
    -------
    DataFrame
        texture, speed_mm_s, force_n, repeat, simulated, frequency_hz, magnitude (unit per unit
        noise).
    """
    parts = []
    for each in found:
        recording, measured = each.recording, each.spectrum
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
