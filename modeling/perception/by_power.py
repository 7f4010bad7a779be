"""What `energy` decides: the change of the response's power against the threshold.

docs/method/perception.md#change-of-power
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.equalizer.peq import PEQ
from tactileq.modeling.errors import counted
from tactileq.modeling.models.parameter_table import Parameters
from tactileq.modeling.models.texture_model import TextureModel
from tactileq.modeling.perception.decisions import Decision, no_threshold_known
from tactileq.modeling.perception.dropping import (
    HIGHEST_FLIP_PROBABILITY,
    Dropping,
    Judge,
    Layers,
    Recorded,
    SetsOfLayers,
)
from tactileq.modeling.perception.power_changes import PowerChange, PowerChanges
from tactileq.modeling.perception.signs_of_rest import SignsOfRest, at_conditions
from tactileq.modeling.perception.thresholds import Threshold


def judge_of(
    model: TextureModel, threshold: Threshold, *, margin_db: float, hold_above: bool
) -> Judge:
    """What dropping layers changes in the conditions of a model's grid."""
    at = at_conditions(model)
    changes = PowerChanges(at, rate_hz=model.rate_hz, threshold=threshold, hold_above=hold_above)
    level_sd_db = model.level_sd_db.reshape(at.gains.shape)
    return Judge(
        at,
        changes,
        recorded=Recorded(at, changes, level_sd_db, beyond=False),
        signs=SignsOfRest.of_model(model),
        margin_db=margin_db,
    )


def power_changes(peq: PEQ, threshold: Threshold, *, hold_above: bool) -> PowerChanges:
    """By how much other gains would change the power in one condition."""
    return PowerChanges(_at(peq), rate_hz=peq.rate_hz, threshold=threshold, hold_above=hold_above)


def changes_alone(peq: PEQ, threshold: Threshold, *, hold_above: bool) -> list[PowerChange]:
    """The change of power by dropping each of m layers alone in one condition, m of one place.

    Signs are chosen again for this condition.
    """
    signs = SignsOfRest(_at(peq), rate_hz=peq.rate_hz)
    changes, gains = power_changes(peq, threshold, hold_above=hold_above), peq.gains[None]
    return [changes.of(signs.without(gains, (layer,))) for layer in range(peq.gains.size)]


def _at(peq: PEQ) -> Parameters:
    layers = (peq.frequencies_hz, peq.bandwidths_hz, peq.gains)
    return Parameters(np.array([peq.noise_gain]), *(values[None] for values in layers))


def decided_by_power(
    model: TextureModel,
    threshold: Threshold,
    *,
    groups: Sequence[Sequence[int]],
    margin_db: float,
    hold_above: bool,
) -> list[Decision]:
    """What is decided on each layer: of all sets that may go, the largest one goes.

    Of several, the one that changes least. `groups` are layers that go together or not at all.
    """
    judge = judge_of(model, threshold, margin_db=margin_db, hold_above=hold_above)
    sets = SetsOfLayers(judge, groups)
    dropped = sets.allowed[0].layers if sets.allowed else ()
    decided: dict[int, Decision] = {}
    for group in map(tuple, groups):
        gone = set(group) <= set(dropped)
        deciding = sets.part(group, dropped) if gone else judge(group)
        for layer in group:
            what = _dropping(layer, deciding.layers)
            if gone:
                reason = _why_dropped(what, deciding)
            else:
                together = judge(tuple(sorted({*group, *dropped})))
                reason = _why_kept(what, deciding, threshold, together=together, judge=judge)
            decided[layer] = Decision(
                not gone,
                reason,
                deciding.distances_db,
                deciding.assumed,
                deciding.flip_probability,
            )
    return [decided[layer] for layer in range(model.n_layers)]


def _dropping(layer: int, layers: Layers) -> str:
    """What is dropped, said of one of its layers."""
    others = [str(other + 1) for other in layers if other != layer]
    if not others:
        return "dropping it"
    listed = " and ".join(filter(None, (", ".join(others[:-1]), others[-1])))
    return f"dropping it with layer{'s' if len(others) > 1 else ''} {listed}"


def _why_dropped(what: str, dropping: Dropping) -> str:
    if dropping.highest_db == -np.inf:
        return f"{what} changes nothing in any condition"
    by_db = _at_most(-dropping.highest_db)
    return f"{what} changes the power by {by_db} dB less than the threshold in every condition"


def _at_most(positive_db: float) -> str:
    """Rounded down to 0.1 dB, so that no more is said than is so."""
    return f"{np.floor(10 * positive_db) / 10:.1f}"


def _why_kept(
    what: str, dropping: Dropping, threshold: Threshold, *, together: Dropping, judge: Judge
) -> str:
    distances, margin_db = dropping.distances_db, dropping.margin_db
    if above := int((distances + margin_db >= 0).sum()):
        where = f"{above} of {counted(distances.size, 'condition')}"
        if margin_db:
            bar = f"the threshold less {margin_db:g} dB"
            return f"{what} changes the power by more than {bar} in {where}"
        return f"{what} changes the power by more than the threshold in {where}"
    if not dropping.below:
        return no_threshold_known(distances, threshold)
    below = f"{what} changes the power by less than the threshold"
    if dropping.flip_probability >= HIGHEST_FLIP_PROBABILITY:
        return f"{below}, but the records are too short to be certain"
    if len(together.layers) == judge.n_layers and together.below:
        return f"{below}, kept as the last layer"
    return f"{below}, but not together with the other dropped"


def distances_alone(judge: Judge) -> Floats:
    """Distance (n, m) in dB of the change by dropping each layer alone, NaN where not known."""
    alone = [judge((layer,)).distances_db for layer in range(judge.n_layers)]
    return np.stack(alone, axis=1) if alone else np.zeros((judge.n_places, 0))
