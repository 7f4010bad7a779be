"""Dropping the layers that nobody can feel (PAPER V, docs/method/perception.md#simplification)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from modeling.arrays import Bools, Floats, Integers
from modeling.equalizer.bands import band_response, band_rms
from modeling.equalizer.peq import PEQ
from modeling.equalizer.signs import neighbouring_patterns
from modeling.errors import InputError, counted, shown
from modeling.models.own_peaks import own_peaks
from modeling.models.texture_model import TextureModel
from modeling.perception.thresholds import Threshold
from modeling.perception.verdicts import CRITERIA, CriterionName, LayerVerdict, Simplification
from modeling.similarity import HIGHEST_SHARE, LOWEST_HZ

HIGHEST_FLIP_PROBABILITY = 0.05
PAPER_RECORD_S = 1.0
SIGN_POINTS = 120
TINY = 1e-100
# `level_sd_db` is that of the energy. A gain is known less well: an error of it is mostly made up
# for by one of the width. Cramér–Rao bound of a lone layer without floor: exactly twice.
DEVIATIONS_PER_LEVEL_SD: dict[CriterionName, float] = {
    "energy": 1.0,
    "paper-fft": 2.0,
    "paper-gain": 2.0,
}


def layer_amplitudes_g(model: TextureModel | PEQ, *, criterion: CriterionName) -> Floats:
    """The amplitude of each layer that is compared with a threshold, in g peak.

    (S, F, m) for a model, (m,) for the PEQ of one condition.

    `energy`: the sinusoid of equal power, √2·G·√(k/(1+k)). `paper-fft`: the single-sided FFT
    amplitude of the peak in a record of 1 s, G·√(π/N). `paper-gain`: G itself
    (docs/method/perception.md#criteria).
    """
    gains = np.abs(model.gains)
    if criterion == "paper-gain":
        return gains
    if criterion == "paper-fft":
        return gains * float(np.sqrt(np.pi / (PAPER_RECORD_S * model.rate_hz)))
    rms = band_rms(gains, model.bandwidths_hz, rate_hz=model.rate_hz)
    return rms * float(np.sqrt(2))


def distances_db(
    model: TextureModel, threshold: Threshold, *, criterion: CriterionName = "energy"
) -> Floats:
    """Level of every layer relative to the threshold, (S, F, m), in dB; NaN where none is known."""
    amplitude = layer_amplitudes_g(model, criterion=criterion)
    with np.errstate(divide="ignore"):
        distance: Floats = 20 * np.log10(amplitude / threshold.at(model.frequencies_hz))
    return distance


def simplify(
    model: TextureModel,
    threshold: Threshold,
    *,
    criterion: CriterionName = "energy",
    margin_db: float = 0.0,
    hold_above: bool = True,
) -> Simplification:
    """Drop every layer that is reliably below threshold in every condition, also in sum.

    A layer is dropped only if its level plus `margin_db` is below the threshold in each condition
    of the grid, if P(flip) of this verdict is below 5 %, and if all dropped layers together (powers
    weighted by the threshold, margin included) stay below it too; otherwise the loudest of them are
    kept. If no threshold is known, the layer is kept; but above the table's end its last level is
    held as a lower bound, below which a layer may be dropped. A layer that only fills another's
    shape (`modeling.models.own_peaks`) is dropped with that one or not at all. The noise and at
    least one layer are always kept (PAPER V, docs/method/perception.md#simplification).

    Parameters
    ----------
    model : TextureModel
        In g.
    threshold : Threshold
    criterion : {"energy", "paper-fft", "paper-gain"}
    margin_db : float
        ≥ 0; how far below the threshold a layer has to be.
    hold_above : bool
        False: above the table's end the threshold is unknown, so that every layer there is kept.

    Raises
    ------
    InputError
        For a model in arbitrary units, an unknown criterion or a negative margin.
    """
    _check_input(model, criterion, margin_db)
    by_condition = (model.noise_gains.size, model.n_layers)
    distances, assumed = _distances(
        model, threshold, criterion=criterion, margin_db=margin_db, hold_above=hold_above
    )
    level_sd_db = DEVIATIONS_PER_LEVEL_SD[criterion] * model.level_sd_db.reshape(by_condition)
    flips = flip_probabilities(distances + margin_db, level_sd_db)
    fills = own_peaks(model).fills
    decided = _decide(distances + margin_db, flips, threshold, fills=fills, margin_db=margin_db)
    _name_doubts(decided, model.unresolved.reshape(by_condition), assumed)
    verdicts = tuple(
        replace(
            _verdict(model, layer, distances[:, layer], decided[layer], float(flips[layer])),
            assumed=int(assumed[:, layer].sum()),
            fills=int(fills[layer]) + 1,
        )
        for layer in range(model.n_layers)
    )
    keep = [layer for layer, (kept, _) in enumerate(decided) if kept]
    simplified = with_signs_chosen_again(model, keep)
    if len(keep) < model.n_layers:
        simplified = replace(simplified, simplified_from=model.sha256)
    return Simplification(
        simplified, verdicts, criterion, threshold, margin_db, hold_above, model.sha256
    )


def _distances(
    model: TextureModel,
    threshold: Threshold,
    *,
    criterion: CriterionName,
    margin_db: float,
    hold_above: bool,
) -> tuple[Floats, Bools]:
    """Distances (C, m) that count, NaN where none is known, and which of them are assumed.

    Above the table's end a layer below the bound is below the threshold; of one above it nothing is
    known.
    """
    known = distances_db(model, threshold, criterion=criterion)
    if hold_above:
        amplitude = layer_amplitudes_g(model, criterion=criterion)
        with np.errstate(divide="ignore"):
            bound = 20 * np.log10(amplitude / threshold.held(model.frequencies_hz))
    else:
        bound = known
    assumed = np.isnan(known) & (bound + margin_db < 0)
    shape = (model.noise_gains.size, model.n_layers)
    return np.where(assumed, bound, known).reshape(shape), assumed.reshape(shape)


def with_signs_chosen_again(model: TextureModel, keep: list[int]) -> TextureModel:
    """The model with only these layers, their signs such that its response stays nearest.

    Two neighbours left with equal signs would cut a notch between them
    (docs/method/equalizer.md#signs). Compared with the full response in all conditions, over 10 Hz
    … 0.98 of the Nyquist frequency on a logarithmic scale, by Whittle's likelihood; amplitudes
    stay. Models by the paper's recipe keep their signs, which are all positive.

    Parameters
    ----------
    model : TextureModel
    keep : list of int
        0-based.
    """
    fewer = model.with_layers(keep)
    if len(keep) in (0, model.n_layers) or model.estimator in ("paper", "paper-consistent"):
        return fewer
    frequency = np.geomspace(LOWEST_HZ, HIGHEST_SHARE * model.rate_hz / 2, SIGN_POINTS)
    conditions = list(np.ndindex(model.noise_gains.shape))
    bands = [_bands(model, at, frequency) for at in conditions]
    full = [_response(model, at, bands_at) for at, bands_at in zip(conditions, bands, strict=True)]
    amplitudes = np.abs(fewer.gains)
    # A layer's sign is one for the whole texture, but where it is silent it has none.
    signs = np.sign(fewer.gains.sum(axis=(0, 1)))
    best, least = fewer, np.inf
    for pattern in [signs, *neighbouring_patterns(np.median(fewer.frequencies_hz, axis=(0, 1)))]:
        tried = replace(fewer, gains=amplitudes * pattern)
        ratios = [
            (whole / _response(tried, at, bands_at[keep])) ** 2
            for at, whole, bands_at in zip(conditions, full, bands, strict=True)
        ]
        misfit = sum(float(np.sum(r - 1 - np.log(r))) for r in ratios)
        if misfit < least:
            best, least = tried, misfit
    return best


def _bands(
    model: TextureModel, at: tuple[int, ...], frequency_hz: Floats
) -> NDArray[np.complex128]:
    """H_i of each layer in one condition of the grid, (m, n)."""
    return band_response(
        frequency_hz,
        centres_hz=model.frequencies_hz[at],
        bandwidths_hz=model.bandwidths_hz[at],
        rate_hz=model.rate_hz,
    )


def _response(model: TextureModel, at: tuple[int, ...], bands: NDArray[np.complex128]) -> Floats:
    """Coherent response in one condition of the grid, never quite 0."""
    response: Floats = np.abs(model.noise_gains[at] + model.gains[at] @ bands)
    return np.maximum(response, TINY)


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
        outside = int(np.isnan(level).sum())
        known = "{:g} to {:g} Hz".format(*threshold.valid_range_hz)
        where = f"{outside} of {counted(level.size, 'condition')}"
        return True, f"no threshold known in {where} ({threshold.name} covers {known})"
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


def _name_doubts(decided: list[tuple[bool, str]], unresolved: Bools, assumed: Bools) -> None:
    """Say of a dropped layer where its level is a bound, and where the threshold is assumed."""
    for layer, (kept, reason) in enumerate(decided):
        counts = {"not resolved": unresolved[:, layer].sum(), "assumed": assumed[:, layer].sum()}
        doubts = [f"{what} in {count} of {len(assumed)}" for what, count in counts.items() if count]
        if doubts and not kept:
            decided[layer] = (kept, f"{reason} ({', '.join(doubts)})")


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


def flip_probabilities(distances: Floats, level_sd_db: Floats) -> Floats:
    """P(flip) per layer, (m,), from (conditions, m) distances and deviations; NaN if unknown.

    The levels' deviations enter once, as in a bootstrap of the records. That two recordings differ
    by √2 of it is made up for by selection: of several levels the one nearest to the threshold is
    there in part by its own error. Planted repeats turn about as often as said here.
    """
    from scipy.special import ndtr

    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        z = np.where(level_sd_db > 0, -distances / level_sd_db, np.copysign(np.inf, -distances))
    below = np.prod(ndtr(z), axis=0)
    dropped = (distances < 0).all(axis=0)
    flips: Floats = np.where(
        np.isnan(distances).any(axis=0), np.nan, np.where(dropped, 1 - below, below)
    )
    return flips


def _verdict(
    model: TextureModel,
    layer: int,
    distances: Floats,
    reason: tuple[bool, str],
    flip_probability: float,
) -> LayerVerdict:
    known = np.where(np.isnan(distances), -np.inf, distances)
    nothing_known = bool(np.isnan(distances).all())
    speed, force = np.unravel_index(int(np.argmax(known)), model.noise_gains.shape)
    return LayerVerdict(
        layer=layer + 1,
        verdict="kept" if reason[0] else "dropped",
        reason=reason[1],
        worst_speed_mm_s=float(model.speeds_mm_s[speed]),
        worst_force_n=float(model.forces_n[force]),
        worst_frequency_hz=float(model.frequencies_hz[speed, force, layer]),
        distance_db=float("nan") if nothing_known else float(known.max()),
        flip_probability=flip_probability,
        assumed=0,
        fills=0,
    )
