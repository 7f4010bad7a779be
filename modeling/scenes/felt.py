"""Which layers cannot be felt in a scene (docs/method/scenes.md#what-is-felt)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.models.parameter_table import Parameters
from tactileq.modeling.models.texture_model import TextureModel
from tactileq.modeling.perception.dropping import Judge, Recorded, SetsOfLayers
from tactileq.modeling.perception.power_changes import PowerChanges
from tactileq.modeling.perception.signs_of_rest import SignsOfRest
from tactileq.modeling.scenes.places import Places, enclosing
from tactileq.modeling.scenes.scene import Scene


def kept_layers(
    model: TextureModel,
    scene: Scene,
    places: Places,
    *,
    groups: Sequence[Sequence[int]],
    signs: SignsOfRest,
) -> list[tuple[int, ...]]:
    """Every choice of layers to keep that drops nothing that is felt, smallest first.

    As `tactileq.simplify` decides by `energy`, at the places of the scene instead of the
    whole grid, and of what the actuator plays. Of several choices of one size the one that changes
    least comes first.

    Parameters
    ----------
    groups : sequence of sequences of int
        Layers that go together or not at all (`own_peaks(model).groups`).
    signs : SignsOfRest
        Of the model.

    Returns
    -------
    list of tuple of int
        Indices of layers, 0-based; the last is all of them.

    Raises
    ------
    InputError
        For a model in arbitrary units.
    """
    if model.unit != "g":
        raise InputError(
            f"{model.texture}: expected a model in g, got the unit {shown(model.unit)}; "
            "thresholds are in g, so calibrate the recordings (g per full scale) first."
        )
    at = at_places(model, places)
    judge = Judge(
        at,
        _changes(model, scene, at),
        recorded=_recorded(model, scene, places),
        signs=signs,
        margin_db=scene.margin_db,
    )
    every = tuple(range(model.n_layers))
    dropped = [set(dropping.layers) for dropping in SetsOfLayers(judge, groups).allowed]
    return [tuple(layer for layer in every if layer not in gone) for gone in [*dropped, set()]]


def at_places(model: TextureModel, places: Places) -> Parameters:
    """The model's parameters at the places that count, in C order."""
    rows, columns = np.nonzero(places.counts)
    return model.parameters(places.speeds_mm_s[rows], places.forces_n[columns])


def _changes(model: TextureModel, scene: Scene, at: Parameters) -> PowerChanges:
    return PowerChanges(
        at,
        rate_hz=model.rate_hz,
        threshold=scene.threshold,
        hold_above=True,
        band_hz=scene.actuator.band_hz,
    )


def _recorded(model: TextureModel, scene: Scene, places: Places) -> Recorded:
    """The recorded conditions that enclose the places."""
    rows, columns = np.nonzero(places.counts)
    axes = (
        (model.speeds_mm_s, places.speeds_mm_s[rows]),
        (model.forces_n, places.forces_n[columns]),
    )
    inside = [
        np.flatnonzero(enclosing(axis, (float(at.min()), float(at.max())))) for axis, at in axes
    ]
    row, column = (index.ravel() for index in np.meshgrid(*inside, indexing="ij"))
    at = model.parameters(model.speeds_mm_s[row], model.forces_n[column])
    return Recorded(at, _changes(model, scene, at), model.level_sd_db[row, column], beyond=True)
