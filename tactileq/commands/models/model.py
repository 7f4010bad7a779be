"""tactileq model: models of textures over their grids."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

import typer

from tactileq.commands.models.many_textures import HowToModel, TextureOutcome, model_textures
from tactileq.modeling.errors import counted
from tactileq.options import Out


def model(
    folders: Annotated[
        list[Path],
        typer.Argument(
            metavar="FOLDER…", help="Folders of recordings, or a folder of such folders."
        ),
    ],
    out: Out = Path("models"),
    estimator: Annotated[
        Literal["joint", "paper", "paper-consistent"], typer.Option(help="How layers are found.")
    ] = "joint",
    layers: Annotated[
        int | None,
        typer.Option(min=1, help="Number of layers; by default chosen from the data (joint)."),
    ] = None,
    check: Annotated[
        bool, typer.Option("--check", help="Cross-validate: leave conditions out and predict them.")
    ] = False,
    alone: Annotated[
        bool, typer.Option("--alone", help="Also find the layers of each recording separately.")
    ] = False,
    keep_hum: Annotated[
        bool, typer.Option("--keep-hum", help="Leave mains hum in the recordings.")
    ] = False,
    plot: Annotated[
        bool, typer.Option("--plot", help="Plot some spectra, and the layers over the grid.")
    ] = False,
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Textures at a time; by default one per core.")
    ] = None,
) -> None:
    """Fit a model of each texture over its grid of speeds and forces.

    Writes TEXTURE.json, TEXTURE_layers.tsv and TEXTURE_spectra.tsv, with --check TEXTURE_check.tsv,
    with --alone TEXTURE_alone.tsv, with --plot TEXTURE_spectra.png and TEXTURE_layers.png. A
    recording that cannot be used is left out, and a texture that cannot be modelled does not stop
    the others.

    Example: tactileq model recordings/* --out models --check
    """
    how = HowToModel(
        estimator, layers=layers, keep_hum=keep_hum, check=check, alone=alone, plot=plot
    )
    _require_all(model_textures(folders, out, how=how, jobs=jobs))


def _require_all(outcomes: Sequence[TextureOutcome]) -> None:
    """Report each texture in order; at the end name those that could not be modelled."""
    failed = [outcome for outcome in outcomes if outcome.error]
    if len(outcomes) == len(failed) == 1:
        raise ValueError(failed[0].error)
    for outcome in outcomes:
        _print(outcome)
    if failed:
        raise ValueError(
            f"expected {counted(len(outcomes), 'texture')} that can be modelled, got {len(failed)} "
            f"that cannot ({'; '.join(outcome.what for outcome in failed)}); correct them and "
            "model them again."
        )


def _print(outcome: TextureOutcome) -> None:
    for warning in outcome.warnings:
        print(warning, file=sys.stderr)
    for note in outcome.notes:
        print(note)
    if outcome.error:
        print(f"error: {outcome.what}: {outcome.error}", file=sys.stderr)
