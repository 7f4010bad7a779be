"""The tables' results in sentences."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial

import numpy as np
import pandas as pd

from analysis.labels import (
    ALL_LAYERS,
    ALL_TEXTURES,
    IDENTICAL,
    TASKS,
    sentence_case,
)
from analysis.page.outcomes import Outcome, Weight
from analysis.statistics.confusion import ConfusionMatrix
from analysis.statistics.rates import UNKNOWN_CHANCE
from modeling.errors import counted

ALPHA = 0.05


def rate_outcomes(rates: pd.DataFrame, task: str, *, chance: float) -> list[Outcome]:
    """A sentence on each model's correct rates against chance, from `rates.correct_rates`.

    If chance is not known (NaN), it says so and tests nothing against it.
    """
    compared = _described_rate if np.isnan(chance) else partial(_against_chance, chance=chance)
    return [
        Outcome(
            Weight.DESCRIPTIVE if np.isnan(chance) else Weight.SECONDARY,
            f"{sentence_case(TASKS[task])}, {model} model: {compared(of_model)}.",
        )
        for model, of_model in rates.groupby("model", sort=False)
    ]


def confusion_outcomes(matrices: Mapping[str, ConfusionMatrix]) -> list[Outcome]:
    """The most frequent confusion with each model, where there is one."""
    return [
        outcome
        for matrix in matrices.values()
        for outcome in described(_strongest_confusion(matrix))
    ]


def described(sentences: Iterable[str]) -> list[Outcome]:
    """These sentences as descriptive findings, without tests."""
    return [Outcome(Weight.DESCRIPTIVE, sentence) for sentence in sentences]


def simplification_outcomes(gfc: pd.DataFrame) -> list[Outcome]:
    """Sentences on the dropped layers and the loss, from `likeness.gfc_table` rows."""
    full = gfc[gfc["model"] == "full"].set_index("texture")
    simple = gfc[gfc["model"] == "simplified"].set_index("texture")
    dropped = full["layers"] - simple["layers"]
    loss = full["gfc30_mean"] - simple["gfc30_mean"]
    layers = counted(int(full["layers"].sum()), "layer")
    sentences = [
        f"Simplification dropped {dropped.sum()} of {layers}, in "
        f"{(dropped > 0).sum()} of {counted(len(full), 'texture')}; the models need "
        f"{simple['parameters'].sum()} instead of {full['parameters'].sum()} numbers per "
        "condition.",
        f"GFC30 (mean over conditions and textures) is {full['gfc30_mean'].mean():.4f} with the "
        f"full and {simple['gfc30_mean'].mean():.4f} with the simplified models; white noise of "
        f"equal RMS scores {full['gfc30_floor'].mean():.4f}, and the true spectra would score "
        f"{full['gfc30_expected'].mean():.4f} on average.",
    ]
    if (dropped == 0).any():
        same = _names([str(texture) for texture in dropped.index[dropped == 0]])
        sentences.append(f"No layer was dropped from {same}: {IDENTICAL}.")
    if (dropped > 0).any():
        change = -loss[dropped > 0].sort_values(ascending=False)
        sentences.append(
            f"Where layers were dropped, GFC30 changed by {signed(change.iloc[0], 4)} "
            f"({change.index[0]}) to {signed(change.iloc[-1], 4)} ({change.index[-1]})."
        )
    return [Outcome(Weight.SECONDARY, sentence) for sentence in sentences]


def left_out_outcomes(summary: pd.DataFrame) -> list[str]:
    """How well conditions are predicted, from `between.left_out_summary`; none without any."""
    sentences = []
    for name, rows in summary.groupby("foretold_by", sort=False) if len(summary) else ():
        worst = rows.iloc[int(rows["worst_level_error_db"].abs().to_numpy().argmax())]
        sentences.append(
            f"Left-out conditions are predicted by {name} with a level error of "
            f"{rows['median_level_error_db'].median():.2f} dB (median over textures; at worst "
            f"{signed(float(worst['worst_level_error_db']), 1)} dB, {worst['texture']} at "
            f"{worst['worst_level_error_at']}) and a log-spectral distance of "
            f"{rows['median_distance_db'].median():.2f} dB."
        )
    return sentences


def regression_outcomes(support: pd.DataFrame) -> list[str]:
    """How well speed and force explain the parameters, from `regressions.support_table`."""
    explained = "; ".join(
        f"{row['parameter']} {row['adjusted_r_squared']:.2f} "
        f"({row['published_adjusted_r_squared']:.2f})"
        for row in support.to_dict("records")
        if np.isfinite(row["adjusted_r_squared"])
    )
    if not explained:
        return []
    return [
        "Regressions on speed, force and their product: mean adjusted R² (published values in "
        f"brackets) {explained}."
    ]


def driving_outcomes(driving: pd.DataFrame) -> list[str]:
    """Accuracy by way of driving, from `regressions.driving_table`; means over the textures."""
    overall = driving[driving["texture"] == ALL_TEXTURES]
    ways = {"grid": "the grid", "conditions": "regressions", "centroid": "the centroid alone"}
    shown = [
        f"{ways[row['driven_by']]}: {row['numbers']:.0f} numbers, GFC30 {row['gfc30_mean']:.4f}, "
        f"log-spectral distance {row['log_spectral_distance_db']:.2f} dB"
        for row in overall.to_dict("records")
    ]
    return [f"Full models (means over the textures) driven by {'; by '.join(shown)}."] * bool(shown)


def planted_outcomes(planted: pd.DataFrame) -> list[str]:
    """One sentence per estimator, from rows of `recovery.planted_truth_table`: means."""
    overall = planted[planted["layer"] == ALL_LAYERS]
    return [
        _planted_outcome(str(estimator), rows)
        for estimator, rows in overall.groupby("estimator", sort=False)
    ]


def _planted_outcome(estimator: str, rows: pd.DataFrame) -> str:
    if not rows["recall"].any():
        return f"The estimator {estimator} found 0% of the planted layers."
    return (
        f"The estimator {estimator} found {rows['recall'].mean():.0%} of the planted layers, and "
        f"{rows['precision'].mean():.0%} of the layers it reports were planted; median errors: "
        f"{rows['median_frequency_error_hz'].mean():.1f} Hz in frequency, a factor of "
        f"{rows['median_bandwidth_ratio'].mean():.2f} in bandwidth, "
        f"{signed(rows['median_level_error_db'].mean(), 1)} dB in level, "
        f"{signed(rows['median_noise_gain_error_db'].mean(), 1)} dB in noise gain (medians over "
        f"the conditions, averaged over {counted(len(rows), 'texture')}); at worst "
        f"{_worst_of(rows, 'frequency_error', digits=1, unit='_hz')}, a factor of "
        f"{_worst_of(rows, 'bandwidth_ratio', digits=2)} and "
        f"{_worst_of(rows, 'level_error', digits=1, unit='_db')}."
    )


def _worst_of(rows: pd.DataFrame, name: str, *, digits: int, unit: str = "") -> str:
    """The worst of all textures, with its place."""
    values = rows[f"worst_{name}{unit}"]
    far = values.abs() if unit else np.log(values).abs()
    worst = rows.iloc[int(far.fillna(0.0).to_numpy().argmax())]
    value = float(worst[f"worst_{name}{unit}"])
    units = {"_hz": " Hz", "_db": " dB", "": ""}
    shown = signed(value, digits) if unit else f"{value:.{digits}f}"
    return f"{shown}{units[unit]} ({worst['texture']}, {worst[f'worst_{name}_at']})"


def cautions(
    *,
    simulated_participants: bool,
    simulated_rig: bool,
    models: bool,
    inconclusive: bool,
    unfinished: Sequence[str] = (),
) -> list[str]:
    """What must not be concluded.

    Parameters
    ----------
    simulated_participants, simulated_rig : bool
        Whether there are answers that are simulated, and whether the rig was.
    models : bool
        Whether the report shows likeness of spectra.
    inconclusive : bool
        Whether some test shows neither a difference nor equivalence.
    unfinished : sequence of str
        For each incomplete task: how much of it has been done.
    """
    sentences = []
    if unfinished:
        sentences.append(
            f"The study is not complete ({'; '.join(unfinished)}): neither effects nor tests of "
            "its claims are shown before it is complete, because seeing them could influence "
            "whether it is stopped or continued."
        )
    if simulated_participants:
        sentences.append(
            "Simulated participants follow a model that was specified beforehand: their answers "
            "test the procedure and say nothing about what people feel."
        )
    elif simulated_rig:
        sentences.append(
            "The participants are people, but the rig was simulated and nobody felt a real "
            "surface: their answers test the procedure and say nothing about what people feel."
        )
    if inconclusive:
        sentences.append(
            "Inconclusive means neither different nor equivalent: a test of a difference that is "
            "not significant does not show that two models are equivalent; only a verdict of "
            "equivalence by bounds fixed before data collection can show that."
        )
    if models:
        sentences.append(
            "GFC measures the shape of a spectrum, not its level, and even white noise scores "
            "high: interpret it together with its floor, its expected value and the distances in "
            "dB."
        )
    return sentences


def _described_rate(rates: pd.DataFrame) -> str:
    return f"{_overall_rate(rates)}; {UNKNOWN_CHANCE}, nothing is tested against it)"


def _overall_rate(rates: pd.DataFrame) -> str:
    """The share of right answers over all textures; the closing bracket is left out."""
    overall = rates[rates["texture"] == ALL_TEXTURES].iloc[0]
    if not overall["participants"]:
        return "no participant has answered all textures (no overall share"
    interval = "no interval, because participants do not vary"
    if np.isfinite(overall["ci_low"]):
        interval = f"95% bootstrap CI {overall['ci_low']:.1%} to {overall['ci_high']:.1%}"
    return (
        f"{overall['mean']:.1%} of the answers were right ({interval}; participants: "
        f"{overall['participants']}"
    )


def _against_chance(rates: pd.DataFrame, *, chance: float) -> str:
    family = rates[rates["texture"] != ALL_TEXTURES]
    significant = family["p_holm"] < ALPHA
    above = family[significant & (family["mean"] > chance)]
    below = family[significant & (family["mean"] < chance)]
    text = (
        f"{_overall_rate(rates)}; chance {chance:.1%}); above chance (Holm): "
        f"{_names(above['texture'])}"
    )
    if not below.empty:
        text += f"; below chance: {_names(below['texture'])}"
    unclear = family[~significant & family["p_holm"].notna()]
    if not unclear.empty:
        text += f"; not distinguished from chance: {_names(unclear['texture'])}"
    undefined = family[family["p_holm"].isna()]
    if not undefined.empty:
        text += f"; test undefined (see the notes): {_names(undefined['texture'])}"
    return text


def _strongest_confusion(matrix: ConfusionMatrix) -> list[str]:
    wrong = matrix.counts.copy()
    np.fill_diagonal(wrong, 0)
    if not wrong.any():
        return []
    shares = np.where(wrong > 0, matrix.row_shares, 0.0)
    row, column = np.unravel_index(int(np.argmax(shares)), shares.shape)
    return [
        f"Most frequent confusion with the {matrix.model} model: {matrix.textures[row]} was taken "
        f"for {matrix.textures[column]} in {shares[row, column]:.0%} of its trials "
        f"({wrong[row, column]} answers)."
    ]


def _names(textures: Sequence[str] | pd.Series) -> str:
    return ", ".join(textures) or "none"


def signed(value: float, digits: int) -> str:
    """A number with its sign, with a true minus sign."""
    return f"{value:+.{digits}f}".replace("-", "−")
