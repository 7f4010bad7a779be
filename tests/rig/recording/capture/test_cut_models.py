"""A model of strokes cut into pieces has the peaks and levels of the surface, as one of records
at constant speed and force has; both are judged by the planted truth."""

from __future__ import annotations

import numpy as np
import pytest

from tactileq.modeling import Recording, RecordingSet, Renderer, TextureModel, fit_texture
from tactileq.rig.recording.capture.cutting import cut_strokes
from tactileq.rig.recording.capture.grid import StrokeGrid
from tactileq.rig.recording.capture.joining import joined
from tactileq.stimuli.planted.textures import planted_texture, record_texture, sensed

RATE_HZ = 6000.0
FULL_SCALE_G = 50.0
SPEEDS, FORCES = np.array([80.0, 160.0, 240.0]), np.array([0.6, 1.2])
GRID = StrokeGrid(SPEEDS, FORCES)
FREQUENCIES_HZ = np.geomspace(20, 2400, 400)


def errors_db(model: TextureModel, truth: TextureModel) -> np.ndarray:
    """Of the response at each condition, (conditions, frequencies)."""
    ratios = [
        model.peq(*c).response(FREQUENCIES_HZ) / truth.peq(*c).response(FREQUENCIES_HZ)
        for c in GRID.conditions
    ]
    return 20 * np.log10(ratios)


def at_peaks_db(model: TextureModel, truth: TextureModel) -> np.ndarray:
    """The same at the truth's own peaks, (conditions, layers)."""
    found = []
    for place, condition in enumerate(GRID.conditions):
        peaks_hz = truth.frequencies_hz.reshape(-1, truth.n_layers)[place]
        ratio = model.peq(*condition).response(peaks_hz) / truth.peq(*condition).response(peaks_hz)
        found.append(20 * np.log10(ratio))
    return np.array(found)


@pytest.mark.parametrize("texture", ["canvas", "PVC"])
def test_peaks_and_levels_of_cut_strokes_are_those_of_steady_records(
    texture: str, readings_of, stroking
) -> None:
    truth = planted_texture(texture, speeds_mm_s=SPEEDS, forces_n=FORCES)
    hand = stroking(90.0, SPEEDS, FORCES, seed=1)
    rows = readings_of(*hand)
    time_s = np.arange(round(90 * RATE_HZ)) / RATE_HZ
    felt = [np.interp(time_s, rows["time_s"], values) for values in hand]
    measured = sensed(Renderer(truth, rate_hz=RATE_HZ, seed=5).render(*felt))
    found = cut_strokes(
        measured / FULL_SCALE_G,
        time_s,
        rows,
        grid=GRID,
        rate_hz=RATE_HZ,
        g_per_fullscale=FULL_SCALE_G,
    )
    records = []
    for condition in GRID.conditions:
        pieces = [piece.samples_g for piece in found[condition]]
        assert len(pieces) > 3
        samples = joined(pieces, RATE_HZ)[: round(RATE_HZ)]
        assert samples.size == RATE_HZ
        records.append(Recording(samples, RATE_HZ, *condition, texture, simulated=True))
    cut = fit_texture(RecordingSet(records))
    steady = fit_texture(record_texture(truth.at_rate(RATE_HZ), seed=1))
    for model in (cut, steady):
        errors = errors_db(model, truth)
        assert abs(errors.mean()) < 0.6
        assert np.sqrt(np.mean(errors**2)) < 1.0
        peaks = at_peaks_db(model, truth)
        assert np.abs(peaks.mean(axis=0)).max() < 1.2
        assert np.abs(peaks).max() < 2.5
