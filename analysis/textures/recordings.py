"""Tables of recordings taken one by one, where no grid is needed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from tactileq.modeling import Layers, Recording, Spectrum, TextureModel, find_layers
from tactileq.modeling.models.own_peaks import own_peaks

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
        From `tactileq.modeling.fitting.conditions.recording_spectra`.
    estimator : str
        As in `tactileq.fit_texture`.
    """
    return tuple(
        RecordingLayers(recording, found, find_layers(found, estimator=estimator))
        for recording, found in measured
    )


def layers_table(found: Sequence[RecordingLayers]) -> pd.DataFrame:
    """The layers of each recording: one row per layer, or one with `layer` 0 where none is.

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


def model_layers_table(model: TextureModel) -> pd.DataFrame:
    """The layers of a model in every condition of its grid, as `layers_table` gives them.

    Returns
    -------
    DataFrame
        The columns of `layers_table` without repeat, and besides: own_peak (false of a layer
        without a maximum of the response), inherited (its frequency is given by other conditions),
        not_identifiable (its level), interpolated (there is no recording).
    """
    peaks = own_peaks(model).is_peak
    rows: list[dict[str, Any]] = []
    for i, speed in enumerate(model.speeds_mm_s.tolist()):
        for j, force in enumerate(model.forces_n.tolist()):
            labels = {
                "texture": model.texture,
                "speed_mm_s": speed,
                "force_n": force,
                "unit": model.unit,
                "simulated": model.simulated,
                "noise_gain": model.noise_gains[i, j],
                "interpolated": model.interpolated[i, j],
            }
            if not model.n_layers:
                rows.append({**labels, "layer": 0})
            rows += [
                {
                    **labels,
                    "layer": layer + 1,
                    "frequency_hz": model.frequencies_hz[i, j, layer],
                    "bandwidth_hz": model.bandwidths_hz[i, j, layer],
                    "gain": model.gains[i, j, layer],
                    "level_sd_db": model.level_sd_db[i, j, layer],
                    "own_peak": peaks[layer],
                    "inherited": model.inherited[i, j, layer],
                    "unresolved": model.unresolved[i, j, layer],
                    "not_identifiable": model.not_identifiable[i, j, layer],
                }
                for layer in range(model.n_layers)
            ]
    return pd.DataFrame(rows)


def spectra_table(measured: Sequence[tuple[Recording, Spectrum]]) -> pd.DataFrame:
    """The smoothed spectrum (σ = 30 Hz) of each recording every 5 Hz, in long form.

    Parameters
    ----------
    measured : sequence of (Recording, Spectrum)

    Returns
    -------
    DataFrame
        texture, speed_mm_s, force_n, repeat, simulated, frequency_hz, magnitude (unit per unit
        noise).
    """
    parts = []
    for recording, found in measured:
        frequency = np.arange(0.0, found.rate_hz / 2, SPECTRUM_STEP_HZ)
        parts.append(
            pd.DataFrame(
                {
                    "texture": recording.texture,
                    "speed_mm_s": recording.speed_mm_s,
                    "force_n": recording.force_n,
                    "repeat": recording.repeat,
                    "simulated": recording.simulated,
                    "frequency_hz": frequency,
                    "magnitude": np.interp(frequency, found.frequency_hz, found.smoothed()),
                }
            )
        )
    return pd.concat(parts, ignore_index=True)
