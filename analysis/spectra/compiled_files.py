"""What a compiled scene leaves beside its models: tables, a figure, a header in C."""

from __future__ import annotations

from tactileq.analysis.columns import table_bytes
from tactileq.analysis.page.saving import picture_bytes
from tactileq.analysis.spectra.figures.scenes import figure_tradeoff
from tactileq.analysis.textures.scenes import before_after_table, steps_table
from tactileq.modeling import CompiledScene
from tactileq.modeling.files.writing import file_stem
from tactileq.stimuli.exports.scene_header import compiled_header


def compiled_files(compiled: CompiledScene, *, seed: int) -> dict[str, bytes]:
    """By their names; without a header where the models have different rates.

    Parameters
    ----------
    seed : int
        Of the header's noise.
    """
    files = {
        "before_after.tsv": table_bytes(before_after_table(compiled)),
        "steps.tsv": table_bytes(steps_table(compiled)),
        "tradeoff.png": picture_bytes(figure_tradeoff(compiled)),
    }
    if len({texture.plan.rate_hz for texture in compiled.textures}) == 1:
        name = f"{file_stem(compiled.scene.name)}.h"
        files[name] = compiled_header(compiled, name, seed=seed).encode()
    return files
