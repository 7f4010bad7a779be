"""A model on fewer nodes, cut off at the ends of a scene."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.hand import Hand
from tactileq.modeling.models.grid import Cells
from tactileq.modeling.models.parameter_table import NEXT
from tactileq.modeling.models.texture_model import TextureModel
from tactileq.modeling.scenes.hands import Range
from tactileq.modeling.scenes.places import Places, nodes_of
from tactileq.modeling.scenes.thinning import Nodes


def played(model: TextureModel) -> TextureModel:
    """The model as a renderer plays it: blended linearly between the nodes of its table."""
    return _on_axes(model, *nodes_of(model))


def cut(model: TextureModel, places: Places) -> TextureModel:
    """The model from the scene's lowest to its highest speed and force, blended as it was."""
    speeds = _within(model.speeds_mm_s, places.speed_range)
    forces = _within(model.forces_n, places.force_range)
    return replace(_on_axes(model, speeds, forces), blending=model.blending)


def thinned(model: TextureModel, places: Places, rows: Nodes, columns: Nodes) -> TextureModel:
    """The model on some nodes of its table alone, blended linearly, as far as the scene reaches."""
    chosen = [
        axis[list(nodes)] for axis, nodes in zip(nodes_of(model), (rows, columns), strict=True)
    ]
    at_nodes = _on_axes(model, *chosen)
    speeds = _within(chosen[0], places.speed_range)
    forces = _within(chosen[1], places.force_range)
    return _on_axes(at_nodes, speeds, forces)


def _on_axes(model: TextureModel, speeds_mm_s: Floats, forces_n: Floats) -> TextureModel:
    """A model's parameters at other speeds and forces within its own, blended linearly between."""
    shape = speeds_mm_s.size, forces_n.size
    speed, force = (x.ravel() for x in np.meshgrid(speeds_mm_s, forces_n, indexing="ij"))
    at = model.parameters(speed, force)
    cells = Cells(model.speeds_mm_s, model.forces_n, hand=Hand(speed, force))
    known = np.isin(speed, model.speeds_mm_s) & np.isin(force, model.forces_n)
    filled = cells.blend(model.interpolated.astype(float)) > 0
    marks: dict[str, Any] = {
        name: (cells.blend(getattr(model, name).astype(float)) >= 0.5).reshape(*shape, -1)
        for name in ("inherited", "unresolved")
    }
    return replace(
        model,
        speeds_mm_s=speeds_mm_s,
        forces_n=forces_n,
        noise_gains=at.noise_gain.reshape(shape),
        frequencies_hz=at.frequencies_hz.reshape(*shape, -1),
        bandwidths_hz=at.bandwidths_hz.reshape(*shape, -1),
        gains=at.gains.reshape(*shape, -1),
        level_sd_db=cells.blend(model.level_sd_db).reshape(*shape, -1),
        interpolated=(filled | ~known).reshape(shape),
        blending="linear",
        fit=None,
        **marks,
    )


def _within(axis: Floats, ends: Range) -> Floats:
    """The values of an axis strictly within a range, and the range's ends.

    Values that single precision may not tell apart count once.
    """
    low, high = ends
    if high < NEXT * low:
        return np.array([low])
    inside = axis[(axis > NEXT * low) & (NEXT * axis < high)]
    return np.concatenate([[low], inside, [high]])
