"""How well an estimated model recovers the planted one: layers matched one to one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment, minimize_scalar

from tactileq.analysis.columns import ESTIMATOR, LAYER, TEXTURE
from tactileq.analysis.labels import ALL_LAYERS
from tactileq.modeling import InputError, TextureModel, similarity
from tactileq.modeling.arrays import Bools, Floats, Integers
from tactileq.modeling.equalizer.peq import PEQ
from tactileq.modeling.errors import shown
from tactileq.modeling.files.columns import Column, names

GRID_STEP_HZ = 5.0  # where a truth and its form at a lower rate are compared
LEAST_TOLERANCE_HZ = 10.0
NO_PARTNER = -1
_PARAMETERS = {"frequency_hz": "frequencies_hz", "bandwidth_hz": "bandwidths_hz", "gain": "gains"}


def match_layers(
    true_frequency_hz: Floats, true_bandwidth_hz: Floats, *, estimated_frequency_hz: Floats
) -> Integers:
    """Pair true and estimated layers of one condition, one to one.

    A pair may lie at most max(B/2, 10 Hz) apart, B being the true layer's bandwidth. Among all
    assignments with the most pairs, the one with the smallest summed distance is taken.

    Parameters
    ----------
    true_frequency_hz, true_bandwidth_hz : (m,) ndarray
        Frequencies and −3 dB widths in Hz.
    estimated_frequency_hz : (k,) ndarray
        Frequencies in Hz.

    Returns
    -------
    (m,) ndarray of int
        For each true layer the index of its estimated layer, −1 where there is none.
    """
    partner = np.full(true_frequency_hz.size, NO_PARTNER, dtype=np.int64)
    if not estimated_frequency_hz.size:
        return partner
    distance = np.abs(true_frequency_hz[:, None] - estimated_frequency_hz[None, :])
    allowed = distance <= np.maximum(true_bandwidth_hz / 2, LEAST_TOLERANCE_HZ)[:, None]
    # A forbidden pair costs more than all allowed ones together, so it never displaces one.
    forbidden_cost = 1.0 + distance.sum()
    rows, columns = linear_sum_assignment(np.where(allowed, distance, forbidden_cost))
    valid = allowed[rows, columns]
    partner[rows[valid]] = columns[valid]
    return partner


def truth_at_rate(truth: TextureModel, rate_hz: float) -> TextureModel:
    """The planted model as one of a lower rate can express it (docs/method/similarity.md#planted).

    Frequencies, −3 dB widths and peak gains mean the same at both rates. Skirts do not: they fall
    to 0 at the lower Nyquist frequency, so the noise gain has to stand for them there, too. It is
    the one that brings the response nearest to the truth's (least Itakura–Saito divergence from
    10 Hz to 0.98 of the Nyquist frequency), which is what an estimator finds in a long record.

    Parameters
    ----------
    truth : TextureModel
        At the rate at which it was recorded.
    rate_hz : float
        Of the models that are compared with it.

    Raises
    ------
    InputError
        For a layer that lies above the lower rate's legal range.
    """
    scaled = truth.at_rate(rate_hz)
    if rate_hz == truth.rate_hz:
        return scaled
    noise_gains = scaled.noise_gains.copy()
    for i, j in np.argwhere(noise_gains > 0):
        condition = float(truth.speeds_mm_s[i]), float(truth.forces_n[j])
        noise_gains[i, j] = _nearest_noise_gain(scaled.peq(*condition), truth.peq(*condition))
    return replace(scaled, noise_gains=noise_gains)


def _nearest_noise_gain(scaled: PEQ, truth: PEQ) -> float:
    """The noise gain with which `scaled` comes nearest to `truth`, another rate's equalizer."""
    end_hz = similarity.HIGHEST_SHARE * min(scaled.rate_hz, truth.rate_hz) / 2
    frequency_hz = np.arange(similarity.LOWEST_HZ, end_hz, GRID_STEP_HZ)
    layers = scaled.complex_response(frequency_hz) - scaled.noise_gain
    power = truth.response(frequency_hz) ** 2 * (scaled.rate_hz / truth.rate_hz)

    def divergence(log_factor: float) -> float:
        ratio = power / np.abs(scaled.noise_gain * np.exp(log_factor) + layers) ** 2
        return float(np.sum(ratio - np.log(ratio) - 1))

    return scaled.noise_gain * float(np.exp(minimize_scalar(divergence, bracket=(0.0, 0.1)).x))


@dataclass(frozen=True, eq=False)
class _Pairing:
    """Matches of a whole grid: partner (C, m) and nearest true layer (C, k) per condition."""

    truth: TextureModel
    estimated: TextureModel
    conditions: Bools
    partner: Integers
    nearest: Integers


PLANTED_TRUTH_COLUMNS = (
    TEXTURE,
    ESTIMATOR,
    LAYER,
    Column("precision"),
    Column("recall"),
    Column("median_frequency_error_hz", "frequency error, median", "Hz"),
    Column("worst_frequency_error_hz", "worst", "Hz"),
    Column("worst_frequency_error_at", "at"),
    Column("median_bandwidth_ratio", "bandwidth ratio, median"),
    Column("worst_bandwidth_ratio", "worst"),
    Column("worst_bandwidth_ratio_at", "at"),
    Column("median_level_error_db", "layer level error, median", "dB"),
    Column("median_absolute_level_error_db", "layer level error, absolute median", "dB"),
    Column("worst_level_error_db", "worst", "dB"),
    Column("worst_level_error_at", "at"),
    Column("median_noise_gain_error_db", "noise gain error, median", "dB"),
    Column("worst_noise_gain_error_db", "worst", "dB"),
    Column("worst_noise_gain_error_at", "at"),
)


def planted_truth_table(truth: TextureModel, estimates: Sequence[TextureModel]) -> pd.DataFrame:
    """Precision, recall and parameter errors of estimated models against the planted one.

    Parameters
    ----------
    truth : TextureModel
        The planted model at the rate at which it was recorded, at least one layer.
    estimates : sequence of TextureModel
        Models of the same texture and grid; the truth is expressed at their rate
        (`truth_at_rate`). Interpolated conditions, which no recording stands behind, are left out.

    Returns
    -------
    DataFrame
        Per estimator one row per true layer and one for all: texture, estimator, layer, precision
        (share of the estimated layers nearest to this true layer that have a partner), recall
        (share of conditions where the true layer has a partner), median_frequency_error_hz
        (|Δf|), median_bandwidth_ratio (estimated/true), median_level_error_db and
        median_absolute_level_error_db (20·log10 |G|/|G|, estimated over true), and, in the row
        for all layers, median_noise_gain_error_db. Beside each median stands the worst one, with
        its sign, and where it is: worst_frequency_error_hz, worst_bandwidth_ratio (farthest from
        1 on a logarithmic scale), worst_level_error_db and worst_noise_gain_error_db, each with
        a column ending in _at (`layer 2, 350 mm/s, 1 N`; empty where there is none).

    Raises
    ------
    InputError
        Where grids differ or nothing was planted.
    """
    rows = []
    at_rates = {rate: truth_at_rate(truth, rate) for rate in {e.rate_hz for e in estimates}}
    for estimated in estimates:
        pairing = _pair(at_rates[estimated.rate_hz], estimated)
        layers = [(str(i + 1), np.array([i])) for i in range(truth.n_layers)]
        layers.append((ALL_LAYERS, np.arange(truth.n_layers)))
        for name, chosen in layers:
            scores = _scores(pairing, chosen)
            if name == ALL_LAYERS:
                scores |= _noise_gain_scores(pairing)
            labels = {
                "texture": truth.texture,
                "estimator": estimated.estimator,
                "layer": name,
            }
            rows.append(labels | scores)
    table = pd.DataFrame(rows, columns=names(PLANTED_TRUTH_COLUMNS))
    return table.fillna({"worst_noise_gain_error_at": ""})


PLANTED_LAYER_COLUMNS = (
    TEXTURE,
    ESTIMATOR,
    LAYER,
    Column("true_frequency_hz", "true frequency", "Hz"),
    Column("estimated_frequency_hz", "estimated frequency", "Hz"),
    Column("true_bandwidth_hz", "true bandwidth", "Hz"),
    Column("estimated_bandwidth_hz", "estimated bandwidth", "Hz"),
    Column("true_gain"),
    Column("estimated_gain"),
)


def planted_layers_table(
    truth: TextureModel, estimated: TextureModel, *, speed_mm_s: float, force_n: float
) -> pd.DataFrame:
    """True and estimated frequency, bandwidth and gain of each layer in one condition.

    Parameters
    ----------
    truth, estimated : TextureModel
        Gains are given for noise of unit variance at the estimated model's rate.
    speed_mm_s, force_n : float
        The condition; between grid points both models are interpolated.

    Returns
    -------
    DataFrame
        One row per true layer (partner's columns NaN where it was missed), then one per surplus
        estimated layer (true columns NaN). Gains are amplitudes |G|.
    """
    true = truth.at_rate(estimated.rate_hz).peq(speed_mm_s, force_n)
    found = estimated.peq(speed_mm_s, force_n)
    partner = match_layers(
        true.frequencies_hz, true.bandwidths_hz, estimated_frequency_hz=found.frequencies_hz
    )
    surplus = sorted(set(range(found.gains.size)) - set(partner.tolist()))
    pairs: list[tuple[int | None, int | None]] = [
        (i, None if j == NO_PARTNER else int(j)) for i, j in enumerate(partner)
    ]
    rows = []
    for i, j in pairs + [(None, j) for j in surplus]:
        row: dict[str, object] = {
            "texture": truth.texture,
            "estimator": estimated.estimator,
            "layer": "surplus" if i is None else str(i + 1),
        }
        for label, name in _PARAMETERS.items():
            row[f"true_{label}"] = np.nan if i is None else abs(getattr(true, name)[i])
            row[f"estimated_{label}"] = np.nan if j is None else abs(getattr(found, name)[j])
        rows.append(row)
    return pd.DataFrame(rows)


def _pair(truth: TextureModel, estimated: TextureModel) -> _Pairing:
    if not (
        np.array_equal(truth.speeds_mm_s, estimated.speeds_mm_s)
        and np.array_equal(truth.forces_n, estimated.forces_n)
    ):
        raise InputError(
            f"expected a model of {shown(truth.texture)} on the planted grid, got speeds "
            f"{estimated.speeds_mm_s.tolist()} mm/s and forces {estimated.forces_n.tolist()} N; "
            "record the planted texture on its own grid."
        )
    if not truth.n_layers:
        raise InputError(
            f"expected planted layers in {shown(truth.texture)}, got none; plant at least one."
        )
    conditions = ~np.asarray(estimated.interpolated, dtype=bool)
    true_f, true_b = truth.frequencies_hz[conditions], truth.bandwidths_hz[conditions]
    found_f = estimated.frequencies_hz[conditions]
    partner = [
        match_layers(f, b, estimated_frequency_hz=g)
        for f, b, g in zip(true_f, true_b, found_f, strict=True)
    ]
    nearest = np.abs(found_f[:, :, None] - true_f[:, None, :]).argmin(axis=2)
    return _Pairing(truth, estimated, conditions, np.array(partner), nearest)


def _scores(pairing: _Pairing, layers: Integers) -> dict[str, object]:
    """Scores of the true layers with these indices."""
    condition, chosen = np.nonzero(pairing.partner[:, layers] != NO_PARTNER)
    true_index = layers[chosen]
    found_index = pairing.partner[condition, true_index]

    def matched(name: str) -> tuple[Floats, Floats]:
        true = getattr(pairing.truth, name)[pairing.conditions][condition, true_index]
        found = getattr(pairing.estimated, name)[pairing.conditions][condition, found_index]
        return np.abs(true), np.abs(found)

    has_partner = np.zeros(pairing.nearest.shape, dtype=bool)
    rows, true_layers = np.nonzero(pairing.partner != NO_PARTNER)
    has_partner[rows, pairing.partner[rows, true_layers]] = True
    attributed = np.isin(pairing.nearest, layers)
    true_f, found_f = matched("frequencies_hz")
    true_b, found_b = matched("bandwidths_hz")
    true_g, found_g = matched("gains")
    frequency_error_hz, bandwidth_ratio = found_f - true_f, found_b / true_b
    # No ratio to a layer without a level.
    level_error_db, heard = _ratio_db(true_g, found_g), true_g > 0
    places = _places(pairing, condition, layers=true_index)
    return {
        "precision": _mean(has_partner[attributed].astype(float)),
        "recall": _mean((pairing.partner[:, layers] != NO_PARTNER).astype(float)),
        "median_frequency_error_hz": _median(np.abs(frequency_error_hz)),
        **_worst("frequency_error", frequency_error_hz, places=places, unit="_hz"),
        "median_bandwidth_ratio": _median(bandwidth_ratio),
        **_worst("bandwidth_ratio", bandwidth_ratio, places=places, size=np.log(bandwidth_ratio)),
        "median_level_error_db": _median(level_error_db),
        "median_absolute_level_error_db": _median(np.abs(level_error_db)),
        **_worst("level_error", level_error_db, places=places[heard], unit="_db"),
    }


def _noise_gain_scores(pairing: _Pairing) -> dict[str, object]:
    true = pairing.truth.noise_gains[pairing.conditions]
    error_db = _ratio_db(true, pairing.estimated.noise_gains[pairing.conditions])
    places = _places(pairing, np.flatnonzero(true > 0))
    return {
        "median_noise_gain_error_db": _median(error_db),
        **_worst("noise_gain_error", error_db, places=places, unit="_db"),
    }


def _places(
    pairing: _Pairing, conditions: Integers, *, layers: Integers | None = None
) -> NDArray[np.str_]:
    """Names of these conditions, with a layer each where layers are given."""
    row, column = np.nonzero(pairing.conditions)
    speeds = pairing.truth.speeds_mm_s[row[conditions]]
    forces = pairing.truth.forces_n[column[conditions]]
    places = [f"{speed:g} mm/s, {force:g} N" for speed, force in zip(speeds, forces, strict=True)]
    if layers is not None:
        places = [f"layer {n + 1}, {place}" for n, place in zip(layers, places, strict=True)]
    return np.array(places, dtype=np.str_)


def _worst(
    name: str,
    values: Floats,
    *,
    places: NDArray[np.str_],
    size: Floats | None = None,
    unit: str = "",
) -> dict[str, object]:
    """The value whose size (by default itself) is farthest from 0, and where it is."""
    if not values.size:
        return {f"worst_{name}{unit}": float("nan"), f"worst_{name}_at": ""}
    worst = int(np.abs(values if size is None else size).argmax())
    return {f"worst_{name}{unit}": float(values[worst]), f"worst_{name}_at": str(places[worst])}


def _ratio_db(true: Floats, found: Floats) -> Floats:
    """20·log10(found/true); infinite where only one is 0, left out where the truth is 0."""
    positive = true > 0
    with np.errstate(divide="ignore"):
        ratio: Floats = 20 * np.log10(found[positive] / true[positive])
    return ratio


def _median(values: Floats) -> float:
    return float(np.median(values)) if values.size else float("nan")


def _mean(values: Floats) -> float:
    return float(values.mean()) if values.size else float("nan")
