"""One self-contained report of a study, with its tables and figures beside it."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from analysis import figures, outcomes, page, statistics
from analysis.comparison import compare_spectra, layer_course
from analysis.load import MODELS, Responses
from analysis.page import Picture, Table
from analysis.planted import planted_layers_table, planted_truth_table
from analysis.tables import TextureResult, gfc_table, simplification_table
from modeling import InputError
from modeling.files import write_text

Progress = Callable[[float, str], None]
Section = tuple[str, str, str]


def write_report(
    path: str | Path,
    *,
    responses: Responses | None = None,
    textures: Sequence[TextureResult] = (),
    provenance: Mapping[str, str] | None = None,
    title: str = "Can anybody feel the difference?",
    seed: int = 0,
    progress: Progress | None = None,
) -> Path:
    """Write report.html, and tables/*.tsv and figures/*.png beside it.

    Parameters
    ----------
    path : str or Path
        The report's file; folders are made as needed. The file needs nothing but itself.
    responses : Responses, optional
        Answers of the study; without them the report is on the models alone.
    textures : sequence of TextureResult, optional
        Models, their simplification and, where known, the planted truth.
    provenance : mapping of str to str, optional
        Versions, configuration, hashes of inputs; shown as they are.
    title : str
    seed : int
        Of the bootstrap and of the draws behind the GFC ceilings; shown with the provenance.
    progress : callable, optional
        Called with the share done (0–1) and what comes next.

    Returns
    -------
    Path
        The report's file.

    Raises
    ------
    InputError
        Where there is nothing to report.
    """
    if responses is None and not textures:
        raise InputError(
            "expected answers or models to report on, got neither; run a session or fit a model."
        )
    tell = progress or (lambda share, what: None)
    report = _Report(Path(path), seed=seed, tell=tell)
    if textures:
        report.add_models(textures)
    if responses is not None:
        report.add_answers(responses)
    report.finish(title, provenance=provenance or {})
    tell(1.0, "done")
    return report.path


class _Report:
    """Collects sections while it writes their tables and pictures."""

    def __init__(self, path: Path, *, seed: int, tell: Progress) -> None:
        self.path = path
        self.seed = seed
        self.rng = np.random.default_rng(seed)
        self.tell = tell
        self.sections: list[Section] = []
        self.tiles: list[tuple[str, str]] = []
        self.outcomes: list[str] = []
        self.done: list[str] = []
        self.simulated: list[str] = []
        self.tests: dict[str, pd.DataFrame] = {}
        self.answers_simulated = False

    def add_models(self, textures: Sequence[TextureResult]) -> None:
        """Sections on models, simplification and planted truth."""
        simulated = any(result.simulated for result in textures)
        if simulated:
            self.simulated.append("no real surface was touched")
        self._describe_models(textures)
        gfc_rows = []
        for number, result in enumerate(textures):
            self.tell(0.3 * number / len(textures), f"comparing models of {result.texture}")
            gfc_rows.append(self._gfc(result))
        gfc = pd.concat(gfc_rows, ignore_index=True)
        self.outcomes += outcomes.simplification_outcomes(gfc)
        self._model_tiles(gfc)
        content = self._table(
            Table(
                "gfc",
                "Simplification rate and quality",
                "Means over the recorded conditions. GFC30 and GFC5: likeness of the model's "
                "response and the recording's spectrum, both smoothed with σ = 30 or 5 Hz; floor: "
                "white noise of equal RMS; ceiling: draws of the recording's own smoothed "
                "spectrum. RMS error and band energy error are means of absolute values. "
                "Cf. the paper's table 3.",
                gfc,
                simulated,
            )
        )
        for number, result in enumerate(textures):
            self.tell(0.3 + 0.4 * number / len(textures), f"drawing {result.texture}")
            content += self._texture_details(number, result)
        self.sections.append(("models", "Models and their simplification", content))
        planted = [result for result in textures if result.truth is not None]
        if planted:
            self._add_planted(planted)

    def _describe_models(self, textures: Sequence[TextureResult]) -> None:
        first = textures[0]
        recorded = sum(len(result.recordings) for result in textures)
        kinds = sorted({result.model.estimator for result in textures})
        self.done.append(
            f"{len(textures)} texture{'s' * (len(textures) != 1)}, {recorded} recordings; models "
            f"by the estimator {', '.join(kinds)}; layers held against the threshold "
            f"“{first.simplification.threshold.name}” by the criterion "
            f"“{first.simplification.criterion}” with a margin of "
            f"{first.simplification.margin_db:g} dB, and dropped only where they are below it in "
            "every condition."
        )
        threshold = first.simplification.threshold
        self.done.append(
            f"The threshold's source: {threshold.source} Its caveat: {threshold.caveat}"
        )

    def _gfc(self, result: TextureResult) -> pd.DataFrame:
        simplified = result.simplification.model
        return gfc_table(result.recordings, result.model, simplified, rng=self.rng)

    def _model_tiles(self, gfc: pd.DataFrame) -> None:
        full, simple = (gfc[gfc["model"] == model] for model in MODELS)
        self.tiles += [
            (f"{full['layers'].sum()} → {simple['layers'].sum()}", "layers, full → simplified"),
            (
                f"{full['gfc30_mean'].mean():.3f} → {simple['gfc30_mean'].mean():.3f}",
                f"mean GFC30, full → simplified (floor {full['gfc30_floor'].mean():.3f}, ceiling "
                f"{full['gfc30_ceiling'].mean():.3f})",
            ),
        ]

    def _texture_details(self, number: int, result: TextureResult) -> str:
        """Verdicts and pictures of one texture, folded."""
        stem = f"{number + 1}_{_file_name(result.texture)}"
        speed_mm_s, force_n = _reference_condition(result)
        verdicts = self._table(
            Table(
                f"verdicts_{stem}",
                f"{result.texture}: verdict on each layer",
                "Distance to the threshold in the condition where the layer stands highest "
                "against it (+ above); flip probability: chance that other records of the same "
                "length had turned the verdict.",
                simplification_table(result.simplification),
                result.simulated,
            )
        )
        comparison = compare_spectra(result, speed_mm_s=speed_mm_s, force_n=force_n)
        spectra = self._picture(
            Picture(
                f"threshold_{stem}",
                f"{result.texture}: spectra and detection threshold at {speed_mm_s:g} mm/s and "
                f"{force_n:g} N",
                "Above: smoothed spectrum of the recording and of each model. Below: each layer's "
                "amplitude by the criterion, against the threshold; open crosses mark dropped "
                "layers. A layer may lie below the threshold here and yet be kept, because another "
                "condition or the sum of the dropped layers decides. Cf. the paper's figure 6.",
                figures.figure_spectra_and_threshold(comparison),
                result.simulated,
            )
        )
        courses = [layer_course(result.model, force_n=force_n)]
        on_planted_grid = result.truth is not None and force_n in result.truth.forces_n
        if result.truth is not None and on_planted_grid:
            courses.append(layer_course(result.truth, force_n=force_n))
        course = self._picture(
            Picture(
                f"layers_{stem}",
                f"{result.texture}: layers over speed at {force_n:g} N",
                "Frequency and amplitude of each layer."
                + (" Dashed: what was planted." if len(courses) > 1 else ""),
                figures.figure_layer_courses(courses),
                result.simulated,
            )
        )
        kept, all_layers = result.simplification.model.n_layers, result.model.n_layers
        summary = f"{result.texture}: {kept} of {all_layers} layers kept"
        return page.folded(summary, verdicts + spectra + course, opened=number == 0)

    def _add_planted(self, textures: Sequence[TextureResult]) -> None:
        scores, layers = [], []
        for result in textures:
            truth = result.truth
            assert truth is not None  # the caller chose those with a truth
            estimates = (result.model, *result.other_estimates)
            scores.append(planted_truth_table(truth, estimates))
            speed_mm_s, force_n = _reference_condition(result)
            layers += [
                planted_layers_table(truth, model, speed_mm_s=speed_mm_s, force_n=force_n)
                for model in estimates
            ]
        table = pd.concat(scores, ignore_index=True)
        self.outcomes += outcomes.planted_outcomes(table)
        found = self._table(
            Table(
                "planted_truth",
                "Planted layers found",
                "Planted and estimated layers are paired one to one within max(B/2, 10 Hz) in every "
                "condition. Precision: share of the estimated layers nearest to this planted layer "
                "that have a partner; recall: share of the conditions in which it was found; "
                "median errors over the pairs. Levels compare |G| at one rate.",
                table,
                simulated=True,
            )
        )
        detail = self._table(
            Table(
                "planted_layers",
                "Planted and estimated parameters, layer by layer",
                "At the strongest force and highest speed of each texture; gains are |G| at the "
                "planted model's rate.",
                pd.concat(layers, ignore_index=True),
                simulated=True,
            )
        )
        content = page.bullets(outcomes.planted_outcomes(table)) + page.folded(
            "Scores per texture, estimator and layer", found
        )
        content += page.folded("Parameters, layer by layer", detail)
        self.sections.append(("planted", "Planted truth", content))

    def add_answers(self, responses: Responses) -> None:
        """Sections on the two evaluations, as far as they were run."""
        self.answers_simulated = responses.simulated
        if responses.simulated:
            self.simulated.append("no person took part")
        self.tell(0.75, "analysing answers")
        if not responses.absolute.empty:
            self._add_ratings(responses)
        if not responses.relative.empty:
            self._add_choices(responses)
        if responses.warnings:
            self.done += [f"On reading: {warning}" for warning in responses.warnings]

    def _add_ratings(self, responses: Responses) -> None:
        tests = statistics.rating_tests(responses.absolute)
        self.tests["absolute"] = tests
        self._count_participants(responses.absolute, "absolute evaluation")
        self.outcomes += outcomes.rating_outcomes(tests)
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
            "Differences are simplified − full, in points of the scale. Holm over the textures of "
            "one scale. d_z: mean difference over the standard deviation of the differences, with "
            "its exact interval.",
            tests,
            responses.simulated,
        )
        content = self._picture(picture) + self._table(table)
        self.sections.append(("ratings", "Absolute evaluation: ratings", content))

    def _add_choices(self, responses: Responses) -> None:
        relative, simulated = responses.relative, responses.simulated
        matrices = statistics.confusion_matrices(relative)
        chance = 1 / len(matrices["full"].textures)
        rates = statistics.correct_rates(relative, rng=self.rng, chance=chance)
        tests = statistics.rate_tests(relative)
        self.tests["relative"] = tests
        self._count_participants(relative, "forced choice")
        self._rate_tile(rates, chance)
        self.outcomes += outcomes.rate_outcomes(rates, tests, matrices)
        self.tell(0.85, "drawing answers")
        items: list[Picture | Table] = [
            Picture(
                "correct_rates",
                "Correct rates of the forced choice",
                "Means over participants ± standard error; dashed: chance. Cf. the paper's figure "
                "11.",
                figures.figure_correct_rates(tests, simulated=simulated, chance=chance),
                simulated,
            ),
            Picture(
                "confusion",
                "Who was taken for whom",
                "Rows: real surface presented; columns: virtual surface answered. Per cent of the "
                f"row, in brackets the number of answers; chance is {chance:.1%}. Cf. the paper's "
                "figure 10.",
                figures.figure_confusion(matrices, simulated=simulated),
                simulated,
            ),
            Table(
                "correct_rates",
                "Correct rates against chance",
                "Participants are the units: mean of their rates, bias-corrected bootstrap "
                "interval over participants, one-sample t against chance with Holm over the "
                "textures of one model.",
                rates,
                simulated,
            ),
            Table(
                "rate_tests",
                "Paired tests of the correct rates",
                "Differences are simplified − full, as shares. Holm over the textures; the row "
                "over all textures stands outside the family.",
                tests,
                simulated,
            ),
        ]
        parts = [
            self._picture(item) if isinstance(item, Picture) else self._table(item)
            for item in items
        ]
        for model, matrix in matrices.items():
            self._save_table(_confusion_table(matrix, simulated=simulated))
            self.tell(0.9, f"saving the confusion matrix of the {model} model")
        self.sections.append(("choices", "Relative evaluation: forced choice", "".join(parts)))

    def _count_participants(self, trials: pd.DataFrame, where: str) -> None:
        people = trials["participant_id"].nunique()
        simulated = "simulated " if self.answers_simulated else ""
        self.done.append(
            f"{where[0].upper()}{where[1:]}: {people} {simulated}participants, {len(trials)} "
            "trials (training left out)."
        )
        self.tiles.append((str(people), f"{simulated}participants, {where}"))

    def _rate_tile(self, rates: pd.DataFrame, chance: float) -> None:
        overall = rates[rates["texture"] == statistics.ALL_TEXTURES].set_index("model")["mean"]
        values = " → ".join(f"{overall[model]:.0%}" for model in MODELS if model in overall)
        self.tiles.append((values, f"right answers, full → simplified (chance {chance:.0%})"))

    def finish(self, title: str, *, provenance: Mapping[str, str]) -> None:
        """Put the page together and write it whole."""
        caution = outcomes.cautions(
            self.tests.get("absolute"),
            self.tests.get("relative"),
            simulated=self.answers_simulated,
        )
        overview = (
            page.tiles(self.tiles)
            + "<h3>What came out</h3>"
            + page.bullets(self.outcomes)
            + '<div class="caution"><h3>What may not be concluded</h3>'
            + page.bullets(caution)
            + "</div><h3>What was done</h3>"
            + page.bullets(self.done)
        )
        facts = pd.DataFrame(
            [*provenance.items(), ("seed of this report", str(self.seed))],
            columns=["what", "value"],
        )
        origin = self._table(
            Table(
                "provenance",
                "Where this report comes from",
                "Exact tables are in tables/*.tsv and pictures in figures/*.png beside it.",
                facts,
                simulated=False,
            )
        )
        sections = [
            ("overview", "At a glance", overview),
            *self.sections,
            ("provenance-section", "Provenance", origin),
        ]
        banner = f"SIMULATED: {' and '.join(self.simulated)}." if self.simulated else ""
        lead = "Surfaces recorded, modelled, simplified by what can be felt, and judged."
        write_text(self.path, page.page(title=title, lead=lead, banner=banner, sections=sections))

    def _table(self, table: Table) -> str:
        self._save_table(table)
        return page.table_html(table)

    def _save_table(self, table: Table) -> None:
        text = table.frame.assign(simulated=str(table.simulated).lower()).to_csv(
            sep="\t", index=False, na_rep="n/a", lineterminator="\n"
        )
        write_text(self.path.parent / "tables" / f"{table.name}.tsv", text)

    def _picture(self, picture: Picture) -> str:
        png = page.picture_png(picture.figure)
        target = self.path.parent / "figures" / f"{picture.name}.png"
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(png)
        return page.picture_html(picture, png)


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
    return Table(f"confusion_{matrix.model}", title, "", pd.DataFrame(rows), simulated)


def _reference_condition(result: TextureResult) -> tuple[float, float]:
    """The strongest force and, at that force, the highest speed that was recorded."""
    conditions = [recording.condition for recording in result.recordings.recordings]
    return max(conditions, key=lambda condition: (condition[1], condition[0]))


def _file_name(texture: str) -> str:
    return re.sub(r"[^a-z0-9]+", "_", texture.lower()).strip("_") or "texture"
