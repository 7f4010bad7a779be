"""The sentence on the worst of several textures, from a table with a known worst."""

from __future__ import annotations

from typing import Any

import pandas as pd

from tactileq.analysis.chapters.planted.section import planted_outcomes
from tactileq.analysis.textures.recovery import ALL_LAYERS


def recovered(texture: str, *, error_hz: float, ratio: float, error_db: float) -> dict[str, Any]:
    """A row of `planted_truth_table` for all layers of a texture, of these worst errors."""
    medians = {"recall": 1.0, "precision": 1.0, "median_bandwidth_ratio": 1.0}
    medians |= dict.fromkeys(
        ("median_frequency_error_hz", "median_level_error_db", "median_noise_gain_error_db"), 0.0
    )
    worst = {
        "worst_frequency_error_hz": error_hz,
        "worst_bandwidth_ratio": ratio,
        "worst_level_error_db": error_db,
    }
    places = ("worst_frequency_error_at", "worst_bandwidth_ratio_at", "worst_level_error_at")
    named = {"texture": texture, "estimator": "joint", "layer": ALL_LAYERS}
    return {**named, **medians, **worst, **dict.fromkeys(places, f"the edge of {texture}")}


def test_the_worst_recovered_layer_is_the_furthest_off_to_either_side() -> None:
    table = pd.DataFrame(
        [
            recovered("oak", error_hz=2.0, ratio=1.5, error_db=-6.0),
            recovered("elm", error_hz=-30.0, ratio=0.5, error_db=1.0),
            recovered("ash", error_hz=3.0, ratio=1.9, error_db=2.0),
        ]
    )
    (sentence,) = planted_outcomes(table)
    assert "−30.0 Hz (elm, the edge of elm)" in sentence
    assert "a factor of 0.50 (elm, the edge of elm)" in sentence  # 1/2 is further off than 1.9
    assert "−6.0 dB (oak, the edge of oak)" in sentence
