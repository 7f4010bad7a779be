"""Names that answers, tables and figures share."""

from __future__ import annotations

MODELS = ("full", "simplified")
SCALES = {
    "magnitude_similarity": "vibration magnitude",
    "frequency_similarity": "frequency pattern",
}

ALL_TEXTURES = "all textures"

ALL_LAYERS = "all layers"

LEVELS = ((0.001, "***"), (0.01, "**"), (0.05, "*"))
