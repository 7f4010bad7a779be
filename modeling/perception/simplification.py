"""Dropping the layers that nobody can feel (PAPER V, docs/method/perception.md#simplification)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tactileq.modeling.arrays import Bools, Floats
from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.models.own_peaks import own_peaks
from tactileq.modeling.models.texture_model import TextureModel
from tactileq.modeling.perception.by_amplitude import amplitude_distances, decided_by_amplitude
from tactileq.modeling.perception.by_power import decided_by_power, distances_alone, judge_of
from tactileq.modeling.perception.decisions import Decision
from tactileq.modeling.perception.signs_of_rest import with_signs_chosen_again
from tactileq.modeling.perception.thresholds import Threshold
from tactileq.modeling.perception.verdicts import (
    CRITERIA,
    CriterionName,
    LayerVerdict,
    Simplification,
)


def distances_db(
    model: TextureModel,
    threshold: Threshold,
    *,
    criterion: CriterionName = "energy",
    hold_above: bool = False,
) -> Floats:
    """Distance of every layer alone to the threshold, (S, F, m), in dB; NaN where none is known.

    By `energy` that of the change of the response's power by dropping it
    (docs/method/perception.md#change-of-power), else that of its amplitude.
    """
    if criterion == "energy":
        judge = judge_of(model, threshold, margin_db=0.0, hold_above=hold_above)
        return distances_alone(judge).reshape(model.gains.shape)
    distances, _ = amplitude_distances(
        model, threshold, criterion=criterion, margin_db=0.0, hold_above=hold_above
    )
    return distances.reshape(model.gains.shape)


def simplify(
    model: TextureModel,
    threshold: Threshold,
    *,
    criterion: CriterionName = "energy",
    margin_db: float = 0.0,
    hold_above: bool = True,
) -> Simplification:
    """Drop the layers that are reliably not felt in any condition, alone and together.

    By `energy` layers are dropped if that changes the power of the response, as rendered without
    them, by less than the threshold, `margin_db` included, in each condition of the grid: of all
    sets of layers of which this is so the largest one, and of several the one that changes least.
    P(flip) has to be below 5 % for each layer alone, or, where one alone would be felt, for the
    fewest with which it goes (docs/method/perception.md#change-of-power).

    By the paper's two criteria a layer is dropped if its amplitude is below the threshold, by
    the margin, in each condition, if P(flip) is below 5 %, and if all dropped layers together
    (powers weighted by the threshold) stay below it too; otherwise the loudest are kept.

    Where no threshold is known a layer is kept; but above the table's end its last level is held
    as a lower bound, below which a layer may be dropped. A layer that only fills another's shape
    (`tactileq.modeling.models.own_peaks`) is dropped with that one or not at all. The noise and at
    least one layer are always kept (PAPER V).

    Parameters
    ----------
    model : TextureModel
        In g.
    criterion : {"energy", "paper-fft", "paper-gain"}
    margin_db : float
        ≥ 0; how far below the threshold a change or an amplitude has to be.
    hold_above : bool
        False: above the table's end the threshold is unknown, so that every layer there is kept.

    Raises
    ------
    InputError
        For a model in arbitrary units, an unknown criterion or a negative margin.
    """
    _check_input(model, criterion, margin_db)
    peaks = own_peaks(model)
    if criterion == "energy":
        decided = decided_by_power(
            model, threshold, groups=peaks.groups, margin_db=margin_db, hold_above=hold_above
        )
    else:
        decided = decided_by_amplitude(
            model,
            threshold,
            criterion=criterion,
            fills=peaks.fills,
            margin_db=margin_db,
            hold_above=hold_above,
        )
    unresolved = model.unresolved.reshape(model.noise_gains.size, model.n_layers)
    verdicts = tuple(
        _verdict(model, layer, decision, unresolved[:, layer], fills=int(peaks.fills[layer]))
        for layer, decision in enumerate(decided)
    )
    keep = [layer for layer, decision in enumerate(decided) if decision.kept]
    simplified = with_signs_chosen_again(model, keep)
    if len(keep) < model.n_layers:
        simplified = replace(simplified, simplified_from=model.sha256)
    return Simplification(
        model=simplified,
        layers=verdicts,
        criterion=criterion,
        threshold=threshold,
        margin_db=margin_db,
        hold_above=hold_above,
        full_sha256=model.sha256,
    )


def _check_input(model: TextureModel, criterion: str, margin_db: float) -> None:
    if model.unit != "g":
        raise InputError(
            f"{model.texture}: expected a model in g, got the unit {shown(model.unit)}; "
            "thresholds are in g, so calibrate the recordings (g per full scale) first."
        )
    if criterion not in CRITERIA:
        raise InputError(
            f"expected a criterion among {', '.join(CRITERIA)}, got {shown(criterion)}; choose one."
        )
    if not (np.isfinite(margin_db) and margin_db >= 0):
        raise InputError(f"expected a margin of at least 0 dB, got {margin_db}; correct it.")


def _doubts(decision: Decision, unresolved: Bools) -> str:
    """Of a dropped layer: where its level is a bound, and where the threshold is assumed."""
    counts = {"not resolved": int(unresolved.sum()), "assumed": int(decision.assumed.sum())}
    doubts = [f"{what} in {count} of {unresolved.size}" for what, count in counts.items() if count]
    return f" ({', '.join(doubts)})" if doubts and not decision.kept else ""


def _verdict(
    model: TextureModel, layer: int, decision: Decision, unresolved: Bools, *, fills: int
) -> LayerVerdict:
    distances = decision.distances_db
    known = np.where(np.isnan(distances), -np.inf, distances)
    nothing_known = bool(np.isnan(distances).all())
    speed, force = np.unravel_index(int(np.argmax(known)), model.noise_gains.shape)
    return LayerVerdict(
        layer=layer + 1,
        verdict="kept" if decision.kept else "dropped",
        reason=decision.reason + _doubts(decision, unresolved),
        worst_speed_mm_s=float(model.speeds_mm_s[speed]),
        worst_force_n=float(model.forces_n[force]),
        worst_frequency_hz=float(model.frequencies_hz[speed, force, layer]),
        distance_db=float("nan") if nothing_known else float(known.max()),
        flip_probability=decision.flip_probability,
        assumed=int(decision.assumed.sum()),
        fills=fills + 1,
    )
