"""Models on disk, and recipes of them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tactileq.modeling import TextureModel, Vibrator
from tactileq.stimuli.planted.textures import planted_texture
from tactileq.stimuli.planted.vibrators import planted_vibrator
from tactileq.stimuli.sets.recipe import ModelEntry, Recipe, TrajectoryEntry

SMALL = {"speeds_mm_s": np.array([100.0, 300.0]), "forces_n": np.array([1.0, 3.0])}

MakeRecipe = Callable[..., Recipe]


@pytest.fixture
def truth() -> TextureModel:
    """Three layers on a grid of 2 × 2."""
    return planted_texture("wall paper", **SMALL)


@pytest.fixture
def vibrator() -> Vibrator:
    """One layer: 80 Hz, four times as strong as the flat part, which gives 0.3."""
    return planted_vibrator()


@pytest.fixture
def recipe(tmp_path: Path, truth: TextureModel) -> MakeRecipe:
    """`recipe(level=…)`: a full and a simplified model on two strokes, short and at 8 kHz."""
    models = (("full", truth), ("simplified", truth.with_layers([0])))
    for label, model in models:
        model.save(tmp_path / label / "paper.json")

    def make(**changes: Any) -> Recipe:
        return Recipe(
            **{
                "name": "test",
                "models": tuple(ModelEntry(tmp_path / label, label) for label, _ in models),
                "trajectories": (
                    TrajectoryEntry.constant(100.0, 1.0),
                    TrajectoryEntry.constant(250.0, 2.5),
                ),
                "rates_hz": (8000,),
                "seeds": (4,),
                "duration_s": 0.25,
                **changes,
            }
        )

    return make
