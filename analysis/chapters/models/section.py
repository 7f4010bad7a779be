"""The section on models: spectral similarity, verdicts and pictures of each texture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import pandas as pd

from tactileq.analysis.chapters.chapter import LEAD, NOBODY_ASKED, Modelled
from tactileq.analysis.labels import IDENTICAL, MODELS, names_or_none, signed
from tactileq.analysis.page.outcomes import Outcome, Weight, described
from tactileq.analysis.page.page import Fold, Item, Picture, Table
from tactileq.analysis.page.sections import Headline, Section
from tactileq.analysis.spectra.comparison import compare_spectra
from tactileq.analysis.spectra.figures.layers_over_speed import figure_layers_over_speed
from tactileq.analysis.spectra.figures.spectra import figure_spectra_and_threshold
from tactileq.analysis.spectra.layers_over_grid import layers_over_speed
from tactileq.analysis.textures.between import LEFT_OUT_COLUMNS, left_out_summary
from tactileq.analysis.textures.likeness import GFC_COLUMNS
from tactileq.analysis.textures.results import (
    LAYER_VERDICT_COLUMNS,
    MODEL_FIT_COLUMNS,
    TextureResult,
    fit_table,
    reference_condition,
    simplification_table,
)
from tactileq.modeling.errors import counted
from tactileq.modeling.files.columns import chosen, without
from tactileq.modeling.files.writing import file_stem

GFC_SHOWN = without(GFC_COLUMNS, "conditions", "gfc30_deficit")
GFC_CAUTION = (
    "GFC measures the shape of a spectrum, not its level, and even white noise scores "
    "high: interpret it together with its floor, its expected value and the distances in "
    "dB."
)
VERDICTS_SHOWN = chosen(
    LAYER_VERDICT_COLUMNS,
    *("layer", "verdict", "reason", "distance_db", "worst_speed_mm_s", "worst_force_n"),
    *("worst_frequency_hz", "flip_probability"),
)


def sections(modelled: Modelled) -> list[Section]:
    """The section on all textures; its answer is that of a report without answers of people."""
    section = model_section(modelled.textures, modelled.gfc)
    headline = Headline(NOBODY_ASKED, lead=LEAD)
    caution = described([GFC_CAUTION])
    return [replace(section, headline=headline, outcomes=(*section.outcomes, *caution))]


def model_section(textures: Sequence[TextureResult], gfc: pd.DataFrame) -> Section:
    """Models, what was dropped, and how similar the spectra remain (PAPER V).

    Parameters
    ----------
    textures : sequence of TextureResult
        At least one.
    gfc : DataFrame
        `tactileq.analysis.textures.likeness.gfc_table` of all of them.
    """
    example = _example(textures)
    folds = [
        _texture_fold(result, number=number, drawn=number == example)
        for number, result in enumerate(textures)
    ]
    spectra = _threshold_picture(textures[example], _stem(textures[example], example))
    table = Table(
        "gfc",
        "Simplification rate and quality",
        "Means over the recorded conditions. GFC30, GFC5: similarity of the model's response and "
        "the recording's spectrum, both smoothed with σ = 30 or 5 Hz; floor: white noise of equal "
        "RMS; expected: mean score of the true spectrum, which a model fitted to the same "
        "recordings may exceed. RMS error and band energy error: means of absolute values. Compare "
        "table 3 of the paper.",
        gfc,
        GFC_SHOWN,
        any(result.simulated for result in textures),
    )
    left_out = left_out_summary(textures)
    predicted = _left_out_items(left_out, simulated=any(r.simulated for r in textures))
    return Section(
        "models",
        "Models and their simplification",
        (spectra, table, *_fit_items(textures), *predicted, *folds),
        outcomes=(
            *simplification_outcomes(gfc),
            *described(left_out_outcomes(left_out)),
        ),
        done=_models_done(textures),
        tiles=_model_tiles(gfc),
    )


def _example(textures: Sequence[TextureResult]) -> int:
    """The number of the first texture that lost a layer, else of the first."""
    lost = (n for n, result in enumerate(textures) if not result.simplification.identical)
    return next(lost, 0)


def _stem(result: TextureResult, number: int) -> str:
    """Of the names of a texture's files."""
    return f"{number + 1}_{file_stem(result.texture)}"


def _fit_items(textures: Sequence[TextureResult]) -> tuple[Item, ...]:
    fits = fit_table(textures)
    if not len(fits):
        return ()
    table = Table(
        "fits",
        "Expected distance of the models, and their blends",
        "Expected log-spectral distance from the true spectra, estimated from the fit itself: at "
        "the recorded conditions, and at and between them. Blend defect: the largest distance of "
        "a response half-way between conditions from the mean of the logarithms at its "
        "conditions; above 4 dB a model must not be used between its conditions.",
        fits,
        without(MODEL_FIT_COLUMNS, "simulated"),
        any(result.simulated for result in textures),
    )
    return (table,)


def _left_out_items(summary: pd.DataFrame, *, simulated: bool) -> tuple[Item, ...]:
    if not len(summary):
        return ()
    table = Table(
        "left_out",
        "Prediction of left-out conditions (cross-validation)",
        "A hand is rarely exactly at a recorded condition. Every second condition was left out and "
        "predicted from its neighbours, by the model, by an autoregressive model and by a smooth "
        "field of spectra, which shows what the recordings support without layers. Level error "
        "(absolute median) and log-spectral distance (both smoothed with σ = 30 Hz) are relative "
        "to the left-out recording, whose own scatter they include.",
        summary,
        LEFT_OUT_COLUMNS,
        simulated,
    )
    return (table,)


def _models_done(textures: Sequence[TextureResult]) -> tuple[str, ...]:
    contact = [r for result in textures for r in result.recordings.recordings if r.force_n > 0]
    simulated = sum(r.simulated for r in contact)
    estimators = ", ".join(sorted({result.model.estimator for result in textures}))
    whose = "simulated " if simulated == len(contact) else ""
    part = f", {simulated} of them simulated" if simulated and not whose else ""
    fitted = (
        f"Models of {counted(len(textures), 'texture')} were fitted to "
        f"{counted(len(contact), whose + 'recording')}{part} (estimator {estimators})."
    )
    return fitted, *_rules(textures), *_sources_of_thresholds(textures)


def _rules(textures: Sequence[TextureResult]) -> list[str]:
    """A sentence for each threshold, criterion and margin by which layers were dropped."""
    by_rule: dict[str, list[str]] = {}
    for result in textures:
        made = result.simplification
        above = "" if made.hold_above else ", without assuming thresholds above its table"
        rule = (
            f"below the threshold “{made.threshold.name}”{above} in every condition (criterion "
            f"“{made.criterion}”, margin {made.margin_db:g} dB)."
        )
        by_rule.setdefault(rule, []).append(result.texture)
    if len(by_rule) == 1:
        return [f"A layer was dropped only where it lies {rule}" for rule in by_rule]
    return [
        f"A layer of {', '.join(names)} was dropped only where it lies {rule}"
        for rule, names in by_rule.items()
    ]


def _sources_of_thresholds(textures: Sequence[TextureResult]) -> list[str]:
    thresholds = {made.sha256: made for made in (r.simplification.threshold for r in textures)}
    return [
        f"Source of the threshold “{threshold.name}”: {threshold.source.rstrip('.')}. Caveat: "
        f"{threshold.caveat.rstrip('.')}."
        for threshold in thresholds.values()
    ]


def _model_tiles(gfc: pd.DataFrame) -> tuple[tuple[str, str], ...]:
    full, simple = (gfc[gfc["model"] == model] for model in MODELS)
    floor, expected = full["gfc30_floor"].mean(), full["gfc30_expected"].mean()
    return (
        (f"{full['layers'].sum()} → {simple['layers'].sum()}", "layers, full → simplified"),
        (
            f"{full['gfc30_mean'].mean():.3f} → {simple['gfc30_mean'].mean():.3f}",
            f"mean GFC30, full → simplified (floor {floor:.3f}, expected for the true "
            f"spectrum {expected:.3f})",
        ),
    )


def _texture_fold(result: TextureResult, *, number: int, drawn: bool) -> Fold:
    """Everything on a texture; without the spectra where the chapter begins with them."""
    stem = _stem(result, number)
    verdicts = Table(
        f"verdicts_{stem}",
        f"{result.texture}: verdict on each layer",
        "Distance to the threshold in the condition where the layer is highest relative to it (+ "
        "above). Flip probability: the probability that the sampling error of the level, given the "
        "length of the records, would reverse the verdict in other records; it does not include "
        "whether the estimator would find the layer again, nor its "
        f"bias.{_unresolved_note(result)}",
        simplification_table(result.simplification),
        VERDICTS_SHOWN,
        result.simulated,
    )
    kept, all_layers = result.simplification.model.n_layers, result.model.n_layers
    return Fold(
        f"{result.texture}: {kept} of {counted(all_layers, 'layer')} kept",
        (
            verdicts,
            *(() if drawn else (_threshold_picture(result, stem),)),
            _course_picture(result, stem),
        ),
        opened=number == 0,
    )


def _unresolved_note(result: TextureResult) -> str:
    unresolved = result.model.unresolved
    if not unresolved.any():
        return ""
    return (
        f" In {unresolved.sum()} of {unresolved.size} layer-conditions (a layer in a condition) "
        "the full model's width or level is not resolved by the 30 Hz smoothing."
    )


def _threshold_picture(result: TextureResult, stem: str) -> Picture:
    speed_mm_s, force_n = reference_condition(result)
    comparison = compare_spectra(result, speed_mm_s=speed_mm_s, force_n=force_n)
    return Picture(
        f"threshold_{stem}",
        f"{result.texture}: spectra and detection threshold at {speed_mm_s:g} mm/s, {force_n:g} N",
        "Top: smoothed spectrum of the recording and of each model; thin lines: each layer alone, "
        "and green dashes: the gain at which it, alone, would just be felt. Bottom: amplitude of "
        "each layer by the criterion (by energy: the sinusoid of the power that dropping it "
        "changes), and the threshold; open crosses mark dropped layers. A layer may lie below the "
        "threshold here and still be kept, because another condition, its uncertainty or all "
        "dropped layers together decide. Compare figure 6 of the paper.",
        figure_spectra_and_threshold(comparison),
        result.simulated,
    )


def _course_picture(result: TextureResult, stem: str) -> Picture:
    force_n = reference_condition(result)[1]
    courses = [layers_over_speed(result.model, force_n=force_n)]
    note = "Frequency and amplitude of each layer."
    if result.truth is not None and force_n in result.truth.forces_n:
        truth = result.truth.at_rate(result.model.rate_hz)
        courses.append(layers_over_speed(truth, force_n=force_n))
        note += " Dashed: the planted layers."
    return Picture(
        f"layers_{stem}",
        f"{result.texture}: layers over speed at {force_n:g} N",
        note,
        figure_layers_over_speed(courses),
        result.simulated,
    )


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
        same = names_or_none([str(texture) for texture in dropped.index[dropped == 0]])
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
    found = []
    for name, rows in summary.groupby("foretold_by", sort=False) if len(summary) else ():
        worst = rows.iloc[int(rows["worst_level_error_db"].abs().to_numpy().argmax())]
        found.append(
            f"{rows['median_distance_db'].median():.2f} dB by {name} (level error "
            f"{rows['median_level_error_db'].median():.2f} dB; at worst "
            f"{signed(float(worst['worst_level_error_db']), 1)} dB, {worst['texture']} at "
            f"{worst['worst_level_error_at']})"
        )
    said = (
        "Left-out conditions are predicted with a log-spectral distance (median over textures) of "
        f"{'; '.join(found)}."
    )
    return [said] * bool(found)
