"""What the report holds: for every part of the study its figures, tables and sentences."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from analysis import figures, outcomes, statistics
from analysis.between import left_out_summary, planted_between_table
from analysis.comparison import compare_spectra, layer_course
from analysis.load import MODELS, Responses
from analysis.page import Fold, Item, Picture, Table
from analysis.planted import ALL_LAYERS, planted_layers_table, planted_truth_table
from analysis.tables import TextureResult, gfc_table, simplification_table
from modeling.files import file_stem
from stimuli.planted import TEXTURES

Progress = Callable[[float, str], None]

GFC_COLUMNS = (
    *("texture", "model", "layers", "parameters", "gfc30_mean", "gfc30_min", "gfc30_floor"),
    *("gfc30_ceiling", "gfc5_mean", "gfc5_floor", "gfc5_ceiling", "log_spectral_distance_db"),
    *("rms_error_db", "band_energy_error_db"),
)
TEST_COLUMNS = (
    *("texture", "n", "mean_full", "mean_simplified", "mean_difference", "ci_low", "ci_high", "t"),
    *("df", "p", "p_holm", "d_z", "d_z_low", "d_z_high", "wilcoxon_p", "note", "excluded"),
)
RATE_COLUMNS = (
    *("texture", "model", "participants", "trials", "mean", "se", "ci_low", "ci_high", "t", "df"),
    *("p", "p_holm", "note"),
)
VERDICT_COLUMNS = (
    *("layer", "verdict", "reason", "distance_db", "worst_speed_mm_s", "worst_force_n"),
    *("worst_frequency_hz", "flip_probability"),
)


@dataclass(frozen=True, eq=False)
class Section:
    """One part of the report.

    Parameters
    ----------
    anchor, heading : str
    items : tuple of Table, Picture or Fold
        In the order of the page.
    outcomes : tuple of str
        What came out, one sentence each, computed from the numbers.
    done : tuple of str
        What was done.
    tiles : tuple of (str, str)
        Key figures: value, and what it is.
    tests : DataFrame, optional
        The paired tests shown here.
    """

    anchor: str
    heading: str
    items: tuple[Item, ...]
    outcomes: tuple[str, ...] = ()
    done: tuple[str, ...] = ()
    tiles: tuple[tuple[str, str], ...] = ()
    tests: pd.DataFrame | None = None


def model_section(
    textures: Sequence[TextureResult], *, rng: np.random.Generator, progress: Progress
) -> Section:
    """Models, what was dropped, and how alike the spectra stay (PAPER V).

    Parameters
    ----------
    textures : sequence of TextureResult
        At least one.
    rng : Generator
        Draws behind the GFC ceilings.
    progress : callable
        Called with a share (0–1) and what comes next.
    """
    rows, folds = [], []
    for number, result in enumerate(textures):
        progress(number / len(textures), f"comparing models of {result.texture}")
        simplified = result.simplification.model
        rows.append(gfc_table(result.recordings, result.model, simplified, rng=rng))
        folds.append(_texture_fold(result, number=number))
    gfc = pd.concat(rows, ignore_index=True)
    table = Table(
        "gfc",
        "Simplification rate and quality",
        "Means over the recorded conditions. GFC30, GFC5: likeness of the model's response and the "
        "recording's spectrum, both smoothed with σ = 30 or 5 Hz; floor: white noise of equal RMS; "
        "ceiling: draws of the recording's own smoothed spectrum. "
        "RMS error and band energy error: means of absolute values. Cf. the paper's table 3.",
        gfc,
        any(result.simulated for result in textures),
        GFC_COLUMNS,
    )
    left_out = left_out_summary(textures)
    foretold = _left_out_items(left_out, simulated=any(r.simulated for r in textures))
    return Section(
        "models",
        "Models and their simplification",
        (table, *foretold, *folds),
        outcomes=(
            *outcomes.simplification_outcomes(gfc),
            *outcomes.left_out_outcomes(left_out),
        ),
        done=_models_done(textures),
        tiles=_model_tiles(gfc),
    )


def _left_out_items(summary: pd.DataFrame, *, simulated: bool) -> tuple[Item, ...]:
    if not len(summary):
        return ()
    table = Table(
        "left_out",
        "Conditions foretold that the model was not shown",
        "A hand is hardly ever at a recorded condition. Every second condition was left out and "
        "foretold from its neighbours, by the model and by an autoregressive one. Level error "
        "(absolute median) and log-spectral distance (both smoothed with σ = 30 Hz) to the "
        "recording that was left out, whose own scatter is in them.",
        summary,
        simulated,
    )
    return (table,)


def _models_done(textures: Sequence[TextureResult]) -> tuple[str, ...]:
    simplification = textures[0].simplification
    threshold = simplification.threshold
    contact = [r for result in textures for r in result.recordings.recordings if r.force_n > 0]
    simulated = sum(r.simulated for r in contact)
    estimators = ", ".join(sorted({result.model.estimator for result in textures}))
    whose = "simulated " if simulated == len(contact) else ""
    part = f", {simulated} of them simulated" if simulated and not whose else ""
    return (
        f"Models of {len(textures)} texture{'s' * (len(textures) != 1)} were fitted to "
        f"{len(contact)} {whose}recordings{part} (estimator {estimators}). A layer was "
        f"dropped only where it lies below the threshold “{threshold.name}” in every condition "
        f"(criterion “{simplification.criterion}”, margin {simplification.margin_db:g} dB).",
        f"Source of the threshold “{threshold.name}”: {threshold.source.rstrip('.')}. Caveat: "
        f"{threshold.caveat.rstrip('.')}.",
    )


def _model_tiles(gfc: pd.DataFrame) -> tuple[tuple[str, str], ...]:
    full, simple = (gfc[gfc["model"] == model] for model in MODELS)
    floor, ceiling = full["gfc30_floor"].mean(), full["gfc30_ceiling"].mean()
    return (
        (f"{full['layers'].sum()} → {simple['layers'].sum()}", "layers, full → simplified"),
        (
            f"{full['gfc30_mean'].mean():.3f} → {simple['gfc30_mean'].mean():.3f}",
            f"mean GFC30, full → simplified (floor {floor:.3f}, ceiling {ceiling:.3f})",
        ),
    )


def _texture_fold(result: TextureResult, *, number: int) -> Fold:
    stem = f"{number + 1}_{file_stem(result.texture)}"
    verdicts = Table(
        f"verdicts_{stem}",
        f"{result.texture}: verdict on each layer",
        "Distance to the threshold in the condition where the layer stands highest against it "
        "(+ above); flip probability: chance that the level's sampling error, which the records' "
        "length leaves, would turn the verdict in other records; whether the estimator would find "
        f"the layer again, and its bias, are not in it.{_unresolved_note(result)}",
        simplification_table(result.simplification),
        result.simulated,
        VERDICT_COLUMNS,
    )
    kept, all_layers = result.simplification.model.n_layers, result.model.n_layers
    return Fold(
        f"{result.texture}: {kept} of {all_layers} layers kept",
        (verdicts, _threshold_picture(result, stem), _course_picture(result, stem)),
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
        "Above: smoothed spectrum of the recording and of each model; thin lines: each layer "
        "alone, and in black the gain at which it would be just felt. Below: each layer's "
        "amplitude by the criterion against the threshold; open crosses mark dropped layers. A "
        "layer may lie below the threshold here and yet be kept, because another condition, its "
        "uncertainty or the sum of the dropped layers decides. Cf. the paper's figure 6.",
        figures.figure_spectra_and_threshold(comparison),
        result.simulated,
    )


def _course_picture(result: TextureResult, stem: str) -> Picture:
    force_n = reference_condition(result)[1]
    courses = [layer_course(result.model, force_n=force_n)]
    note = "Frequency and amplitude of each layer."
    if result.truth is not None and force_n in result.truth.forces_n:
        courses.append(layer_course(result.truth, force_n=force_n))
        note += " Dashed: what was planted."
    return Picture(
        f"layers_{stem}",
        f"{result.texture}: layers over speed at {force_n:g} N",
        note,
        figures.figure_layer_courses(courses),
        result.simulated,
    )


def planted_section(textures: Sequence[TextureResult]) -> Section:
    """How well the estimators find what was planted; every texture has a truth."""
    scores, layers = [], []
    for result in textures:
        assert result.truth is not None
        estimates = (result.model, *result.other_estimates)
        scores.append(planted_truth_table(result.truth, estimates))
        speed_mm_s, force_n = reference_condition(result)
        layers += [
            planted_layers_table(result.truth, model, speed_mm_s=speed_mm_s, force_n=force_n)
            for model in estimates
        ]
    score = pd.concat(scores, ignore_index=True)
    tables = _planted_tables(score, pd.concat(layers, ignore_index=True))
    between = _planted_between(textures)
    return Section(
        "planted",
        "Planted truth",
        (tables[0], *between, *tables[1:]),
        outcomes=tuple(outcomes.planted_outcomes(score)),
    )


def _planted_between(textures: Sequence[TextureResult]) -> tuple[Item, ...]:
    known = [result for result in textures if result.texture in TEXTURES]
    if not known:
        return ()
    table = Table(
        "planted_between",
        "Distance to the planted spectrum at the conditions and between them",
        "RMS of the log ratio of the two responses over all conditions (15 Hz to 0.96 of the "
        "Nyquist frequency, unsmoothed), at the recorded conditions and half-way between four of "
        "them, where the truth is known by its formula; level errors are those half-way between.",
        planted_between_table(known),
        simulated=True,
    )
    return (table,)


def _planted_tables(score: pd.DataFrame, layers: pd.DataFrame) -> tuple[Item, ...]:
    found = Table(
        "planted_truth",
        "Planted layers found",
        "Planted and estimated layers are paired one to one within max(B/2, 10 Hz) in every "
        "condition. Precision: share of the estimated layers nearest to this planted layer that "
        "have a partner; recall: share of the conditions in which it was found; median errors over "
        "the pairs. Levels compare |G| at one rate.",
        score,
        simulated=True,
    )
    overall = Table(
        "planted_overall",
        "Planted layers found, by texture",
        "The rows for all layers of the table below; its caption explains the columns.",
        score[score["layer"] == ALL_LAYERS].drop(columns="layer"),
        simulated=True,
    )
    detail = Table(
        "planted_layers",
        "Planted and estimated parameters, layer by layer",
        "At the strongest force and highest speed of each texture; gains are |G| at the planted "
        "model's rate; surplus: estimated where nothing was planted.",
        layers,
        simulated=True,
    )
    return (
        overall,
        Fold("Layer by layer", (detail,), opened=True),
        Fold("Scores by estimator and layer", (found,)),
    )


def rating_section(responses: Responses) -> Section:
    """Absolute evaluation (PAPER VIII-A)."""
    tests = statistics.rating_tests(responses.absolute)
    done, tile = _participants(responses, responses.absolute, where="absolute evaluation")
    picture = Picture(
        "ratings",
        "Rated similarity of virtual and real surface",
        "Means over participants ± standard error. Cf. the paper's figure 9.",
        figures.figure_ratings(tests, simulated=responses.simulated),
        responses.simulated,
    )
    table = Table(
        "rating_tests",
        "Paired tests of the ratings",
        "Differences are simplified − full, in points of the scale. Holm over the textures of one "
        "scale. d_z: mean difference over the standard deviation of the differences. Intervals: "
        "95%.",
        tests,
        responses.simulated,
        ("scale", *TEST_COLUMNS),
    )
    return Section(
        "ratings",
        "Absolute evaluation: ratings",
        (picture, table),
        outcomes=tuple(outcomes.rating_outcomes(tests)),
        done=(done,),
        tiles=(tile,),
        tests=tests,
    )


def choice_section(responses: Responses, *, rng: np.random.Generator) -> Section:
    """Relative evaluation (PAPER VIII-B); `rng` draws the bootstrap."""
    relative, simulated = responses.relative, responses.simulated
    matrices = statistics.confusion_matrices(relative)
    chance = 1 / len(matrices["full"].textures)
    rates = statistics.correct_rates(relative, rng=rng, chance=chance)
    tests = statistics.rate_tests(relative)
    done, tile = _participants(responses, relative, where="forced choice")
    overall = rates[rates["texture"] == statistics.ALL_TEXTURES].set_index("model")["mean"]
    shown = " → ".join(f"{overall[model]:.0%}" for model in MODELS if model in overall)
    rate_tile = (shown, f"right answers, full → simplified (chance {chance:.0%})")
    counts = Fold(
        "Confusion matrices as tables",
        tuple(_confusion_table(matrix, simulated=simulated) for matrix in matrices.values()),
    )
    return Section(
        "choices",
        "Relative evaluation: forced choice",
        (
            *_choice_pictures(tests, matrices, simulated=simulated),
            *_rate_tables(rates, tests, simulated=simulated),
            counts,
        ),
        outcomes=tuple(outcomes.rate_outcomes(rates, tests, matrices=matrices)),
        done=(done,),
        tiles=(tile, rate_tile),
        tests=tests,
    )


def _choice_pictures(
    tests: pd.DataFrame, matrices: dict[str, statistics.ConfusionMatrix], *, simulated: bool
) -> tuple[Picture, Picture]:
    chance = 1 / len(matrices["full"].textures)
    rates_picture = Picture(
        "correct_rates",
        "Correct rates of the forced choice",
        "Means over participants ± standard error; dashed: chance. Cf. the paper's figure 11.",
        figures.figure_correct_rates(tests, simulated=simulated, chance=chance),
        simulated,
    )
    confusion_picture = Picture(
        "confusion",
        "Who was taken for whom",
        "Rows: real surface presented; columns: virtual surface answered. Per cent of the row, in "
        f"brackets the number of answers; chance is {chance:.1%}. Cf. the paper's figure 10.",
        figures.figure_confusion(matrices, simulated=simulated),
        simulated,
    )
    return rates_picture, confusion_picture


def _rate_tables(
    rates: pd.DataFrame, tests: pd.DataFrame, *, simulated: bool
) -> tuple[Table, Table]:
    against_chance = Table(
        "correct_rates",
        "Correct rates against chance",
        "Participants are the units: mean of their rates with a 95% interval (bias-corrected and "
        "accelerated bootstrap over participants), and a one-sample t-test against chance with "
        "Holm over the textures of one model.",
        rates,
        simulated,
        RATE_COLUMNS,
    )
    paired = Table(
        "rate_tests",
        "Paired tests of the correct rates",
        "Differences are simplified − full, as shares. Holm over the textures; the row over all "
        "textures stands outside the family. Intervals: 95%.",
        tests,
        simulated,
        TEST_COLUMNS,
    )
    return against_chance, paired


def _participants(
    responses: Responses, trials: pd.DataFrame, *, where: str
) -> tuple[str, tuple[str, str]]:
    """The sentence and the tile that say how many took part."""
    people = trials["participant_id"].nunique()
    who = "simulated participants" if responses.simulated_participants else "participants"
    who += " at the simulated rig" if responses.simulated_rig else ""
    sentence = f"{where.capitalize()}: {people} {who}, {len(trials)} trials (training left out)."
    return sentence, (str(people), f"{who}, {where}")


def _confusion_table(matrix: statistics.ConfusionMatrix, *, simulated: bool) -> Table:
    shares = matrix.row_shares
    rows = [
        {
            "presented": real,
            "answered": virtual,
            "count": int(matrix.counts[i, j]),
            "row_share": shares[i, j],
        }
        for i, real in enumerate(matrix.textures)
        for j, virtual in enumerate(matrix.textures)
    ]
    title = f"Confusion matrix, {matrix.model} model"
    note = "Counts and shares of the row (0–1)."
    return Table(f"confusion_{matrix.model}", title, note, pd.DataFrame(rows), simulated)


def reference_condition(result: TextureResult) -> tuple[float, float]:
    """(speed, force): the strongest force and the highest speed recorded at it."""
    conditions = [recording.condition for recording in result.recordings.recordings]
    return max(conditions, key=lambda condition: (condition[1], condition[0]))
