"""One stimulus as a WAV file."""

from __future__ import annotations

from pathlib import Path

from tactileq.modeling import InputError
from tactileq.modeling.files.writing import write_bytes
from tactileq.stimuli.sets.manifest import StimulusRow
from tactileq.stimuli.sets.recipe import Recipe
from tactileq.stimuli.sets.sources import Sources, load_sources
from tactileq.stimuli.sets.writing import check_clipping, rendered, stimulus_count


def write_wav(path: str | Path, recipe: Recipe, *, sources: Sources | None = None) -> StimulusRow:
    """Write the only stimulus of a recipe to a WAV file, by default 32-bit floats in g.

    Parameters
    ----------
    path : path
        The very file that the recipe's set would hold (`write_set`); there whole or not at all.
    recipe : Recipe
        Of one model, trajectory, rate and seed.
    sources : Sources, optional
        The recipe's, where they are loaded already.

    Returns
    -------
    StimulusRow
        The file's row of a manifest: unit, rms, level_db (dB re 1 g), peak and so on.

    Raises
    ------
    InputError
        For a recipe of several stimuli, or one that `write_set` refuses.
    """
    stimulus, data = only_stimulus(recipe, sources or load_sources(recipe))
    write_bytes(path, data)
    return stimulus


def only_stimulus(recipe: Recipe, sources: Sources) -> tuple[StimulusRow, bytes]:
    """The only stimulus of a recipe and its WAV file; refused as by `write_wav`."""
    count = stimulus_count(recipe, sources)
    if count != 1:
        raise InputError(
            f"expected a recipe of one stimulus, got one of {count}; choose one model, or make a "
            "stimulus set."
        )
    ((stimulus, data),) = rendered(recipe, sources)
    check_clipping([stimulus])
    return stimulus, data
