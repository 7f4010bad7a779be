"""Which layers cannot be felt in a scene (docs/method/scenes.md#what-is-felt)."""

from __future__ import annotations

from itertools import chain, combinations

import numpy as np

from modeling.arrays import Floats
from modeling.equalizer.bands import band_rms, clamp_bands
from modeling.errors import InputError, shown
from modeling.models.own_peaks import own_peaks
from modeling.models.parameter_table import Parameters
from modeling.models.texture_model import TextureModel
from modeling.perception.simplification import HIGHEST_FLIP_PROBABILITY, flip_probabilities
from modeling.scenes.measures import Yardstick
from modeling.scenes.places import Places, enclosing
from modeling.scenes.scene import Range, Scene

MOST_GROUPS = 10  # of layers, all subsets of which are looked at


def kept_layers(
    model: TextureModel, scene: Scene, places: Places, *, groups: list[list[int]]
) -> list[tuple[int, ...]]:
    """Every choice of layers to keep that drops nothing that is felt, smallest first.

    As `modeling.simplify` decides, at the places of the scene instead of the whole grid, and of
    what the actuator plays. Of several choices of one size the one that drops least comes first.
    `groups` are the model's `layer_groups`.

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
    every = tuple(range(model.n_layers))
    above_db = levels_above_threshold_db(model, scene, at_places(model, places)) + scene.margin_db
    flips = _flips(model, scene, places)
    droppable = (above_db < 0).all(axis=0) & (flips < HIGHEST_FLIP_PROBABILITY)
    power = 10 ** (above_db / 10)
    groups = [group for group in groups if droppable[group].all()]
    choices: list[tuple[float, tuple[int, ...]]] = []
    for dropped in _unions(groups, power):
        together = float(power[:, dropped].sum(axis=1).max(initial=0.0))
        kept = tuple(layer for layer in every if layer not in dropped)
        if kept and (len(dropped) < 2 or together < 1):
            choices.append((together, kept))
    choices.sort(key=lambda choice: (len(choice[1]), choice[0], choice[1]))
    return [kept for _, kept in choices] or [every]


def levels_above_threshold_db(model: TextureModel, scene: Scene, at: Parameters) -> Floats:
    """Level of every layer relative to the threshold at n places, (n, m), in dB.

    Of what the actuator plays of the layer, at the frequency in its band that is nearest to the
    layer's. NaN where no threshold is known.
    """
    band_hz = scene.actuator.band_hz
    if band_hz is None:
        rms = band_rms(at.gains, at.bandwidths_hz, rate_hz=model.rate_hz)
        frequency = at.frequencies_hz
    else:
        rms = np.sqrt(_power_in_band(at, band_hz, rate_hz=model.rate_hz))
        frequency = np.clip(at.frequencies_hz, *band_hz)
    with np.errstate(divide="ignore"):
        level: Floats = 20 * np.log10(np.sqrt(2) * rms / scene.threshold.held(frequency))
    return level


def at_places(model: TextureModel, places: Places) -> Parameters:
    """The model's parameters at the places that count, in C order."""
    rows, columns = np.nonzero(places.counts)
    return model.parameters(places.speeds_mm_s[rows], places.forces_n[columns])


def _power_in_band(at: Parameters, band_hz: Range, *, rate_hz: float) -> Floats:
    """Mean square of each layer within a band, (n, m)."""
    power = np.zeros_like(at.gains)
    for layer in range(at.gains.shape[1]):
        centres, widths, _ = clamp_bands(
            at.frequencies_hz[:, layer], at.bandwidths_hz[:, layer], rate_hz=rate_hz
        )
        yardstick = Yardstick(rate_hz, narrowest_hz=float(widths.min()), band_hz=band_hz)
        alone = Parameters(
            np.zeros(len(centres)), centres[:, None], widths[:, None], at.gains[:, layer, None]
        )
        power[:, layer] = yardstick.power(alone)
    return power


def _flips(model: TextureModel, scene: Scene, places: Places) -> Floats:
    """P(flip) of each layer's verdict, (m,), over the recorded conditions that enclose the places.

    Conditions beyond the scene where a layer is felt say nothing of it here.
    """
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
    above_db = levels_above_threshold_db(model, scene, at) + scene.margin_db
    below_db = np.where(above_db < 0, above_db, -np.inf)
    return flip_probabilities(below_db, model.level_sd_db[row, column])


def layer_groups(model: TextureModel) -> list[list[int]]:
    """Layers that go together or not at all: a peak and those that fill its shape."""
    fills = own_peaks(model).fills.tolist()
    groups = {layer: [layer] for layer, peak in enumerate(fills) if peak < 0}
    for layer, peak in enumerate(fills):
        if peak >= 0:
            groups[peak].append(layer)
    return [sorted(group) for group in groups.values()]


def _unions(groups: list[list[int]], power: Floats) -> list[list[int]]:
    """All unions of groups; of very many groups only those of the weakest ones."""
    if len(groups) > MOST_GROUPS:
        groups = sorted(groups, key=lambda group: float(power[:, group].sum(axis=1).max()))
        return [list(chain.from_iterable(groups[:count])) for count in range(len(groups) + 1)]
    return [
        list(chain.from_iterable(chosen))
        for count in range(len(groups) + 1)
        for chosen in combinations(groups, count)
    ]
