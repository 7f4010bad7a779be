"""Small models and thresholds whose levels follow by hand."""

from __future__ import annotations

import numpy as np

from tactileq.modeling import TextureModel, Threshold


def flat_threshold(level_g: float, low_hz: float = 1.0, high_hz: float = 2000.0) -> Threshold:
    return Threshold("flat", np.array([low_hz, high_hz]), np.full(2, level_g), "made up", "none")


def texture_model(
    noise_gain: float, layers: tuple[tuple[float, float, float], ...] = ()
) -> TextureModel:
    """The same noise gain and layers (f, B, G) at every condition."""
    grid = np.array(layers).reshape(1, 1, len(layers), 3).repeat(2, 0).repeat(2, 1)
    return TextureModel(
        texture="made up",
        rate_hz=5000.0,
        speeds_mm_s=np.array([50.0, 350.0]),
        forces_n=np.array([0.5, 3.5]),
        noise_gains=np.full((2, 2), noise_gain),
        frequencies_hz=grid[..., 0],
        bandwidths_hz=grid[..., 1],
        gains=grid[..., 2],
        level_sd_db=np.zeros(grid.shape[:3]),
        estimator="planted",
    )
