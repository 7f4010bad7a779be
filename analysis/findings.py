"""What the recordings of one texture say, and the files that hold it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from analysis.comparison import layers_over_grid, spectrum_panels
from analysis.figures import figure_spectra
from analysis.figures_layers import figure_layers_over_grid
from analysis.recordings import (
    RecordingLayers,
    layers_of_recordings,
    layers_table,
    spectra_table,
)
from modeling import GridError, RecordingSet, TextureModel
from modeling.files import file_stem, write_text
from modeling.fitting import fit_spectra, only_unit, recording_spectra

DOTS_PER_INCH = 110


@dataclass(frozen=True, eq=False)
class Findings:
    """Layers and spectra of one texture's recordings, and its model if they span a grid.

    Parameters
    ----------
    texture, estimator : str
    recordings : tuple of RecordingLayers
        Each recording with contact, its spectrum and the layers found in it alone.
    model : TextureModel, optional
        Fitted where the recordings span a grid.
    why_not : str
        One sentence, where they do not.
    """

    texture: str
    estimator: str
    recordings: tuple[RecordingLayers, ...]
    model: TextureModel | None
    why_not: str = ""


def find_in(records: RecordingSet, *, estimator: str) -> Findings:
    """Find the layers of each recording and, where they span a grid, fit the texture's model.

    Parameters
    ----------
    records : RecordingSet
        Of one texture.
    estimator : str
        As in `modeling.fit_texture`.

    Raises
    ------
    InputError
        For records that cannot be used, as in `modeling.fit_texture`.
    """
    only_unit(records)
    measured = recording_spectra(records)
    model, why_not = None, ""
    try:
        model = fit_spectra(measured, estimator=estimator)
    except GridError as error:
        why_not = str(error)
    found = layers_of_recordings(measured, estimator=estimator)
    return Findings(records.texture, estimator, found, model, why_not)


def save_findings(found: Findings, out: Path, *, plot: bool) -> Path:
    """Write the tables, the picture of the spectra and the model, if there is one, into `out`.

    Parameters
    ----------
    found : Findings
    out : Path
        Made if it is not there.
    plot : bool
        Also draw the model's layers over its grid.

    Returns
    -------
    Path
        What all files begin with: TEXTURE.json, TEXTURE_layers.tsv, TEXTURE_spectra.tsv,
        TEXTURE_spectra.png and TEXTURE_layers.png.
    """
    start = out / file_stem(found.texture)
    tables = {"layers": layers_table(found.recordings), "spectra": spectra_table(found.recordings)}
    panels = spectrum_panels(found.recordings, estimator=found.estimator, model=found.model)
    for name, table in tables.items():
        write_text(f"{start}_{name}.tsv", table.to_csv(sep="\t", index=False, na_rep="n/a"))
    figure_spectra(panels).savefig(f"{start}_spectra.png", dpi=DOTS_PER_INCH)
    if found.model is not None:
        found.model.save(f"{start}.json")
        if plot:
            figure = figure_layers_over_grid(layers_over_grid(found.model))
            figure.savefig(f"{start}_layers.png", dpi=DOTS_PER_INCH)
    return start
