"""Which models a study compares."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from experiments.study.models import ModelSets
from modeling import InputError, regressed
from modeling.models.compiled_for import CompiledFor
from stimuli.planted.textures import planted_texture

SMALL = {"speeds_mm_s": np.array([100.0, 300.0]), "forces_n": np.array([1.0, 3.0])}
FULL = {name: planted_texture(name, **SMALL) for name in ("canvas", "MDF")}
NOTE = CompiledFor(
    scene="light touch",
    scene_sha256="a",
    full_sha256="b",
    bound={"gfc30": 0.95},
    update_s=0.008,
    single=True,
)


def test_models_of_a_scene_stand_where_simplified_ones_stand() -> None:
    least = {name: replace(regressed(model), compiled_for=NOTE) for name, model in FULL.items()}
    sets = ModelSets(sets={"full": FULL, "simplified": least})
    sets.require(("canvas", "MDF"))
    assert sets.scene == NOTE
    assert sets.identical(("canvas", "MDF")) == ()
    assert sets.of("MDF", "simplified") == least["MDF"]
    assert sets.sha256(["MDF"])["MDF"]["simplified"] == least["MDF"].sha256


def test_a_scene_without_a_texture_of_the_study_is_named() -> None:
    sets = ModelSets(
        sets={"full": FULL, "simplified": {"MDF": replace(FULL["MDF"], compiled_for=NOTE)}}
    )
    told = "each texture of the study in the scene light touch, got none of canvas; add what"
    with pytest.raises(InputError, match=told):
        sets.require(("canvas", "MDF"))


def test_simplified_models_are_of_no_scene() -> None:
    sets = ModelSets(sets={"full": FULL, "simplified": {"MDF": FULL["MDF"]}})
    assert sets.scene is None
    assert sets.identical(["MDF"]) == ("MDF",)
    with pytest.raises(InputError, match="a simplified model of each texture of the study, got no"):
        sets.require(("canvas", "MDF"))
