"""What the paper's two criteria decide: the amplitude of each layer against the threshold.

docs/method/perception.md#paper-criteria
"""

from __future__ import annotations

import numpy as np

from tactileq.modeling.arrays import Bools, Floats, Integers
from tactileq.modeling.errors import counted
from tactileq.modeling.models.texture_model import TextureModel
from tactileq.modeling.perception.amplitudes import layer_amplitudes_g
from tactileq.modeling.perception.decisions import Decision, no_threshold_known
from tactileq.modeling.perception.dropping import HIGHEST_FLIP_PROBABILITY, flip_probabilities
from tactileq.modeling.perception.thresholds import Threshold
from tactileq.modeling.perception.verdicts import CriterionName

# `level_sd_db` is that of the energy. A gain is known less well: an error of it is mostly made up
# for by one of the width. Cramér–Rao bound of a lone layer without floor: exactly twice.
DEVIATIONS_PER_LEVEL_SD = 2.0


def decided_by_amplitude(
    model: TextureModel,
    threshold: Threshold,
    *,
    criterion: CriterionName,
    fills: Integers,
    margin_db: float,
    hold_above: bool,
) -> list[Decision]:
    """What is decided on each layer by its amplitude alone and by the summed powers."""
    distances, assumed = amplitude_distances(
        model, threshold, criterion=criterion, margin_db=margin_db, hold_above=hold_above
    )
    level_sd_db = DEVIATIONS_PER_LEVEL_SD * model.level_sd_db.reshape(distances.shape)
    flips = flip_probabilities(distances + margin_db, level_sd_db)
    decided = _decide(distances + margin_db, flips, threshold, fills=fills, margin_db=margin_db)
    return [
        Decision(*verdict, distances[:, layer], assumed[:, layer], float(flips[layer]))
        for layer, verdict in enumerate(decided)
    ]


def amplitude_distances(
    model: TextureModel,
    threshold: Threshold,
    *,
    criterion: CriterionName,
    margin_db: float,
    hold_above: bool,
) -> tuple[Floats, Bools]:
    """Distances (C, m) in dB, NaN where none is known, and which of them are assumed.

    Above the table's end a layer below the bound is below the threshold; of one above it nothing is
    known.
    """
    amplitude = layer_amplitudes_g(model, criterion=criterion)
    at = threshold.held if hold_above else threshold.at
    with np.errstate(divide="ignore"):
        known = 20 * np.log10(amplitude / threshold.at(model.frequencies_hz))
        bound = 20 * np.log10(amplitude / at(model.frequencies_hz))
    assumed = np.isnan(known) & (bound + margin_db < 0)
    shape = (model.noise_gains.size, model.n_layers)
    return np.where(assumed, bound, known).reshape(shape), assumed.reshape(shape)


def _decide(
    distances: Floats,
    flips: Floats,
    threshold: Threshold,
    *,
    fills: Integers,
    margin_db: float,
) -> list[tuple[bool, str]]:
    """(kept?, reason) per layer, from (conditions, m) distances that include the margin."""
    decided = [
        _decide_alone(level, float(flip), threshold, margin_db=margin_db)
        for level, flip in zip(distances.T, flips, strict=True)
    ]
    _keep_together(decided, fills)
    _keep_summed(distances, decided)
    _keep_together(decided, fills)
    if decided and not any(kept for kept, _ in decided):
        known = np.nan_to_num(distances.max(axis=0), nan=-np.inf)
        loudest = int(np.argmax(np.where(fills < 0, known, -np.inf)))
        decided[loudest] = (True, "below threshold, kept as the last layer")
        _keep_together(decided, fills)
    return decided


def _decide_alone(
    level: Floats, flip: float, threshold: Threshold, *, margin_db: float
) -> tuple[bool, str]:
    if (level >= 0).any():
        above = int((level >= 0).sum())
        what = f"not {margin_db:g} dB below threshold" if margin_db else "above threshold"
        return True, f"{what} in {above} of {counted(level.size, 'condition')}"
    if np.isnan(level).any():
        return True, no_threshold_known(level, threshold)
    if flip >= HIGHEST_FLIP_PROBABILITY:
        return True, "below threshold, but the records are too short to be certain"
    by = f"{margin_db:g} dB " if margin_db else ""
    return False, f"{by}below threshold in every condition"


def _keep_together(decided: list[tuple[bool, str]], fills: Integers) -> None:
    """A layer that fills another's shape is kept as long as that one, and keeps it."""
    for layer, peak in enumerate(fills.tolist()):
        if peak < 0:
            continue
        if decided[layer][0] and not decided[peak][0]:
            decided[peak] = (True, f"below threshold, but layer {layer + 1} fills its shape")
        elif decided[peak][0] and not decided[layer][0]:
            decided[layer] = (True, f"below threshold, but fills the shape of layer {peak + 1}")
    if any(p >= 0 and decided[i][0] != decided[p][0] for i, p in enumerate(fills.tolist())):
        _keep_together(decided, fills)


def _keep_summed(distances: Floats, decided: list[tuple[bool, str]]) -> None:
    """Take back the loudest dropped layers until the rest stay below threshold together."""
    while True:
        dropped = [layer for layer, (kept, _) in enumerate(decided) if not kept]
        powers = 10 ** (distances[:, dropped] / 10)
        if len(dropped) < 2 or powers.sum(axis=1).max() < 1:
            return
        worst = int(np.argmax(powers.sum(axis=1)))
        loudest = dropped[int(np.argmax(powers[worst]))]
        decided[loudest] = (True, "below threshold alone, but not together with the other dropped")
