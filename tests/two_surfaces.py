"""The smallest study of two planted surfaces, on disk."""

from __future__ import annotations

from pathlib import Path

from tactileq.stimuli.planted.textures import planted_texture

STUDY = """
name = "Two surfaces"
seed = 3
textures = ["MDF", "PVC"]
{more}
[trays]
MDF = "A"
PVC = "B"
[absolute]
participants = 2
schedule = "interleaved"
training_trials = 1
"""


def save_two_surfaces(folder: Path, more: str = "") -> None:
    """Full models, simplified ones of one layer, and study.toml, with these lines more."""
    for name in ("MDF", "PVC"):
        model = planted_texture(name)
        for place, kept in (("models", model), ("simplified", model.with_layers([0]))):
            (folder / place).mkdir(exist_ok=True)
            kept.save(folder / place / f"{name}.json")
    (folder / "study.toml").write_text(STUDY.format(more=more))
