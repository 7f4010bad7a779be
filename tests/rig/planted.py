"""A small texture whose parameters everybody can see."""

from __future__ import annotations

import numpy as np

from tactileq.modeling import TextureModel
from tactileq.modeling.arrays import Floats
from tactileq.rig.shared.interface import Stimulus


def planted_model(gain: float = 0.2, *, rate_hz: float = 5000.0) -> TextureModel:
    """Two speeds, two forces, one layer."""
    return TextureModel(
        texture="planted",
        rate_hz=rate_hz,
        speeds_mm_s=[50.0, 350.0],
        forces_n=[0.5, 3.5],
        noise_gains=[[0.01, 0.02], [0.03, 0.05]],
        frequencies_hz=np.array([60.0, 70.0, 300.0, 320.0]).reshape(2, 2, 1),
        bandwidths_hz=np.full((2, 2, 1), 30.0),
        gains=np.full((2, 2, 1), gain),
        level_sd_db=np.zeros((2, 2, 1)),
        estimator="planted",
        simulated=True,
    )


def planted_stimulus(samples_g: Floats, *, rate_hz: float) -> Stimulus:
    """A file of a stimulus set that stands for PVC; of no file."""
    return Stimulus(
        samples_g=samples_g,
        rate_hz=rate_hz,
        vibrator_sha256=None,
        simulated=True,
        texture="PVC",
        sha256="a" * 64,
        model_sha256="b" * 64,
    )
