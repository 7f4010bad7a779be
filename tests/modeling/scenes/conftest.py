"""Small models whose parameters vary over the grid, and scenes in few words."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest

from tactileq.modeling import TextureModel
from tactileq.modeling.equalizer.bands import band_rms
from tactileq.modeling.perception.thresholds import Threshold
from tactileq.modeling.scenes.compiled import CompiledTexture
from tactileq.modeling.scenes.compiler import compile_scene
from tactileq.modeling.scenes.hands import HandRange
from tactileq.modeling.scenes.scene import Bound, Scene


def varied_model(
    seed: int,
    *,
    speeds_mm_s: Sequence[float] = (60.0, 150.0, 300.0),
    forces_n: Sequence[float] = (0.5, 1.5, 3.0),
    felt: int = 2,
    weak: int = 1,
    blending: str = "linear",
    rate_hz: float = 5000.0,
    **changes: Any,
) -> TextureModel:
    """Layers that move and grow with speed and force, `weak` of them far below the threshold."""
    rng = np.random.default_rng(seed)
    v = (np.array(speeds_mm_s) / 200.0)[:, None, None]
    f = (np.array(forces_n) / 2.0)[None, :, None]
    m = felt + weak
    shape = (len(speeds_mm_s), len(forces_n), m)
    centre = np.sort(rng.uniform(60, min(900, 0.35 * rate_hz), m))
    frequency = centre * v ** rng.uniform(0, 1, m) * f ** rng.uniform(0, 0.1, m)
    frequency = np.minimum(frequency, 0.45 * rate_hz)
    width = rng.uniform(15, 60, m) * v**0.1 * np.ones_like(f)
    level = rng.uniform(0.03, 0.1, m) * v ** rng.uniform(0.2, 0.8, m) * f**0.3
    weakest = rng.permutation(m) < weak
    below = 1e-3 * Threshold.shipped("codec").held(frequency) / np.sqrt(2)
    gains = np.where(weakest, below, level) / band_rms(1.0, width, rate_hz=rate_hz)
    return TextureModel(
        **{
            "texture": f"varied {seed}",
            "rate_hz": rate_hz,
            "speeds_mm_s": speeds_mm_s,
            "forces_n": forces_n,
            "noise_gains": 0.02 * (v**-0.1 * np.ones_like(f))[..., 0],
            "frequencies_hz": frequency,
            "bandwidths_hz": np.broadcast_to(width, shape),
            "gains": gains * np.where(rng.random(m) < 0.5, -1, 1),
            "level_sd_db": np.zeros(shape),
            "estimator": "planted",
            "simulated": True,
            "blending": blending,
            **changes,
        }
    )


def make_scene(
    speed_mm_s: Any = (60.0, 300.0),
    force_n: Any = (0.5, 3.0),
    *,
    stroke_hz: float = 2.0,
    **settings: Any,
) -> Scene:
    """A scene for a hand within a range; `gfc30`, `bands_db` and `level_db` are of its bound."""
    bound = {name: settings.pop(name) for name in list(settings) if name in vars(Bound())}
    given = {
        "hand": HandRange(speed_mm_s=speed_mm_s, force_n=force_n, stroke_hz=stroke_hz),
        "bound": Bound(**bound),
    }
    return Scene(**({"name": "planted"} | given | settings))


def compile_one(model: TextureModel, scene: Scene) -> CompiledTexture:
    """The least model of one texture."""
    return compile_scene(scene, {model.texture: model}).textures[0]


@pytest.fixture(name="varied_model", scope="session")
def _varied_model() -> Callable[..., TextureModel]:
    return varied_model


@pytest.fixture(name="make_scene", scope="session")
def _make_scene() -> Callable[..., Scene]:
    return make_scene


@pytest.fixture(name="compile_one", scope="session")
def _compile_one() -> Callable[..., CompiledTexture]:
    return compile_one
