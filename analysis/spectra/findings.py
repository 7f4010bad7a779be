"""Findings from the recordings of one texture, and the files that contain them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from tactileq.analysis.columns import table_bytes
from tactileq.analysis.textures.between import (
    distances_to_recordings,
    field_fit,
    fit_like,
    left_out_table,
)
from tactileq.analysis.textures.recordings import (
    RecordingLayers,
    layers_of_recordings,
    layers_table,
    model_layers_table,
    spectra_table,
)
from tactileq.modeling import GridError, Recording, RecordingSet, Spectrum, TextureModel
from tactileq.modeling.fitting.conditions import only_unit, recording_spectra
from tactileq.modeling.fitting.texture import fit_spectra

# Endings of the files with the findings from one texture's recordings.
FILE_ENDINGS = (
    ".json",
    "_layers.tsv",
    "_spectra.tsv",
    "_alone.tsv",
    "_check.tsv",
    "_spectra.png",
    "_layers.png",
)


@dataclass(frozen=True, eq=False)
class Findings:
    """Layers and spectra of one texture's recordings, and its model if they span a grid.

    Parameters
    ----------
    measured : sequence of (Recording, Spectrum)
        Each recording with contact and its spectrum.
    alone : tuple of RecordingLayers
        The layers found in each recording alone, where requested or where there is no model.
    model : TextureModel, optional
        Fitted where the recordings span a grid.
    why_not : str
        One sentence, where they do not.
    quality : DataFrame
        Level error and distance of the model to its recordings (`textures.between`); empty
        without a model.
    left_out : DataFrame, optional
        The same for conditions that were left out and predicted, where requested.
    left_out_without_layers : DataFrame, optional
        The same by a field of spectra: what the recordings support without layers.
    """

    texture: str
    estimator: str
    measured: Sequence[tuple[Recording, Spectrum]]
    alone: tuple[RecordingLayers, ...]
    model: TextureModel | None
    why_not: str
    quality: pd.DataFrame
    left_out: pd.DataFrame | None
    left_out_without_layers: pd.DataFrame | None


def find_in(
    records: RecordingSet,
    *,
    estimator: str,
    layers: int | None = None,
    keep_hum: bool = False,
    check: bool = False,
    alone: bool = False,
) -> Findings:
    """Fit the texture's model where the recordings span a grid, else find each one's layers.

    Parameters
    ----------
    records : RecordingSet
        Of one texture.
    estimator, layers
        As in `tactileq.fit_texture`.
    keep_hum : bool
        As in `tactileq.modeling.fitting.conditions.recording_spectra`.
    check : bool
        Also leave conditions out and predict them.
    alone : bool
        Also find the layers of each recording by itself.

    Raises
    ------
    InputError
        For records that cannot be used, as in `tactileq.fit_texture`.
    """
    only_unit(records)
    measured = recording_spectra(records, keep_hum=keep_hum)
    model, why_not, quality, left_out, without = None, "", pd.DataFrame(), None, None
    try:
        model = fit_spectra(measured, estimator=estimator, layers=layers)
        quality = distances_to_recordings(model.peq, measured)
        if check:
            left_out = left_out_table(measured, fit_like(model))
            without = left_out_table(measured, field_fit)
    except GridError as error:
        why_not = str(error)
    each = () if model and not alone else layers_of_recordings(measured, estimator=estimator)
    return Findings(
        records.texture, estimator, measured, each, model, why_not, quality, left_out, without
    )


def findings_files(found: Findings, *, plot: bool) -> dict[str, bytes]:
    """The tables and the model, if there is one, as files; pictures on request.

    Parameters
    ----------
    plot : bool
        Also draw spectra of conditions in all parts of the grid, and the layers over the grid.

    Returns
    -------
    dict of str to bytes
        By the ending of the file's name, of `FILE_ENDINGS`.
    """
    tables = {"spectra": spectra_table(found.measured)}
    if found.model is not None:
        tables["layers"] = model_layers_table(found.model)
    if found.alone:
        tables["alone"] = layers_table(found.alone)
    if found.left_out is not None:
        simulated = any(recording.simulated for recording, _ in found.measured)
        tables["check"] = found.left_out.assign(texture=found.texture, simulated=simulated)
    files = {f"_{name}.tsv": table_bytes(table) for name, table in tables.items()}
    if found.model is not None:
        files[".json"] = found.model.to_json().encode()
    return files | (_pictures(found) if plot else {})


def _pictures(found: Findings) -> dict[str, bytes]:
    # Late: without pictures there is nothing to load Matplotlib for.
    from tactileq.analysis.page.saving import picture_bytes
    from tactileq.analysis.spectra.comparison import spectrum_panels
    from tactileq.analysis.spectra.figures.layers_over_grid import figure_layers_over_grid
    from tactileq.analysis.spectra.figures.spectra import figure_spectra
    from tactileq.analysis.spectra.layers_over_grid import layers_over_grid

    panels = spectrum_panels(found.measured, estimator=found.estimator, model=found.model)
    pictures = {"_spectra.png": picture_bytes(figure_spectra(panels))}
    if found.model is not None:
        figure = figure_layers_over_grid(layers_over_grid(found.model))
        pictures["_layers.png"] = picture_bytes(figure)
    return pictures
