"""Models and recordings with known contents, shared by the tests of this room."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from tactileq.modeling import Recording, RegressedModel, TextureModel


def make_model(
    noise_gain: float,
    layers: list[tuple[float, float, float]],
    *,
    speeds_mm_s: tuple[float, ...] = (100.0, 300.0),
    forces_n: tuple[float, ...] = (1.0, 3.0),
    rate_hz: float = 5000.0,
    level_sd_db: float = 0.0,
    unit: str = "g",
) -> TextureModel:
    """A model with the same (frequency, bandwidth, gain) layers in every condition."""
    shape = (len(speeds_mm_s), len(forces_n), len(layers))
    table = np.array(layers, dtype=float).reshape(-1, 3)
    return TextureModel(
        texture="planted",
        rate_hz=rate_hz,
        speeds_mm_s=np.array(speeds_mm_s),
        forces_n=np.array(forces_n),
        noise_gains=np.full(shape[:2], noise_gain),
        frequencies_hz=np.broadcast_to(table[:, 0], shape),
        bandwidths_hz=np.broadcast_to(table[:, 1], shape),
        gains=np.broadcast_to(table[:, 2], shape),
        level_sd_db=np.full(shape, level_sd_db),
        estimator="planted",
        unit=unit,
        simulated=True,
    )


def make_recording(
    samples: np.ndarray | None = None, *, rate_hz: float = 5000.0, seed: int = 0, **labels: object
) -> Recording:
    """Gaussian noise (or the samples given) under default labels."""
    if samples is None:
        samples = np.random.default_rng(seed).standard_normal(1000)
    named = {"speed_mm_s": 100.0, "force_n": 1.0, "texture": "planted", **labels}
    return Recording(samples, rate_hz, **named)  # type: ignore[arg-type]


def make_falling(**changes: object) -> RegressedModel:
    """Noise gain and amplitude reach 0 at 200 mm/s; the layer is negative."""
    values: dict[str, object] = {
        "texture": "falling",
        "rate_hz": 5000.0,
        "driven_by": "conditions",
        "speeds_mm_s": [50.0, 350.0],
        "forces_n": [0.5, 3.5],
        "noise_gain": [0.2, -1e-3, 0, 0],
        "frequencies_hz": [[100.0], [0], [0], [0]],
        "bandwidths_hz": [[20.0], [0], [0], [0]],
        "amplitudes": [[2.0], [-1e-2], [0], [0]],
        "signs": [-1],
        "centroid_hz": [],
        "estimator": "planted",
    }
    return RegressedModel(**(values | changes))


@pytest.fixture(name="make_falling", scope="session")
def _make_falling() -> Callable[..., RegressedModel]:
    return make_falling


@pytest.fixture(name="make_model", scope="session")
def _make_model() -> Callable[..., TextureModel]:
    return make_model


@pytest.fixture(name="make_recording", scope="session")
def _make_recording() -> Callable[..., Recording]:
    return make_recording
