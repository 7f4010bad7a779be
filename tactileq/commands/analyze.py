"""tactileq analyze: tests of the answers, and the report."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tactileq.keeping import check_own_results
from tactileq.options import Criterion, HoldAbove, Margin, Out, Seed, ThresholdName
from tactileq.telling import share_of, usable_recordings

if TYPE_CHECKING:
    from analysis.answers.loading import Responses
    from analysis.textures.results import TextureResult
    from modeling import Simplification, TextureModel, Threshold
    from modeling.perception.simplification import CriterionName

REPORT_CONTENTS = {"report.html", "tables", "figures", "provenance.json"}


def analyze(
    data: Annotated[Path, typer.Argument(help="Folder of the study's answers.")],
    out: Out = Path("analysis-results"),
    recordings: Annotated[
        Path | None, typer.Option(help="Folder of recording sets, one folder per texture.")
    ] = None,
    models: Annotated[Path | None, typer.Option(help="Folder of full models.")] = None,
    simplified: Annotated[Path | None, typer.Option(help="Folder of simplified models.")] = None,
    threshold: ThresholdName = "codec",
    criterion: Criterion = "energy",
    margin_db: Margin = 0.0,
    hold_above: HoldAbove = True,
    seed: Seed = 0,
) -> None:
    """Test the answers and write report.html with its tables and figures.

    With --recordings, --models and --simplified the report also tells how good and how small the
    models are; the threshold's options must be those of tactileq simplify.

    Example: tactileq analyze data --recordings recordings --models models --simplified simplified
    """
    from analysis.answers.loading import load_responses
    from analysis.report.report import write_report
    from modeling import Threshold
    from modeling.files.folders import replace_folder
    from modeling.files.provenance import write_provenance
    from modeling.models.loading import load_models

    check_own_results(out, "analyze", contents=REPORT_CONTENTS)
    responses = load_responses(data)
    folders = (recordings, models, simplified)
    results = []
    if recordings is not None and models is not None and simplified is not None:
        results = results_of_study(
            responses,
            recordings=recordings,
            full=load_models(models),
            shown=load_models(simplified),
            verdict=partial(
                simplification_shown,
                threshold=Threshold.named(threshold),
                criterion=criterion,
                margin_db=margin_db,
                hold_above=hold_above,
            ),
        )
    elif folders != (None, None, None):
        raise ValueError(
            "expected --recordings, --models and --simplified together, got only some of them; "
            "give all three or none."
        )
    settings = {
        "threshold": threshold,
        "criterion": criterion,
        "margin_db": margin_db,
        "hold_above": hold_above,
    }
    inputs = [path for path in (data, *folders) if path is not None]
    with replace_folder(out) as fresh, share_of("Reporting") as tell:
        provenance = write_provenance(
            fresh / "provenance.json", "analyze", settings, seed=seed, inputs=inputs
        )
        write_report(
            fresh / "report.html",
            responses=responses,
            textures=results,
            provenance=provenance,
            seed=seed,
            progress=tell,
        )
    for warning in responses.warnings:
        print(f"warning: {warning}", file=sys.stderr)
    print((out / "report.html").resolve())


def results_of_study(
    responses: Responses,
    *,
    recordings: Path,
    full: Mapping[str, TextureModel],
    shown: Mapping[str, TextureModel],
    verdict: Callable[[TextureModel, TextureModel | None], Simplification],
) -> list[TextureResult]:
    """Recordings, models and verdicts of every texture that was asked about."""
    from analysis.textures.between import left_out_by_model
    from analysis.textures.results import TextureResult
    from modeling.files.writing import file_stem
    from modeling.fitting.conditions import recording_spectra

    asked = responses.textures
    missing = [texture for texture in asked if texture not in full]
    if missing:
        raise ValueError(
            f"expected a model of each texture in the answers, got none of {', '.join(missing)}; "
            "give the folder of the models that were presented."
        )
    results = []
    for texture in asked:
        records = usable_recordings(recordings / file_stem(texture), texture)
        model = full[texture]
        left_out = left_out_by_model(recording_spectra(records), model)
        simplified = verdict(model, shown.get(texture))
        results.append(TextureResult(records, model, simplified, left_out=left_out))
    return results


def simplification_shown(
    full: TextureModel,
    shown: TextureModel | None,
    *,
    threshold: Threshold,
    criterion: CriterionName,
    margin_db: float,
    hold_above: bool,
) -> Simplification:
    """The verdicts behind the simplified model that people felt; refused where they differ."""
    from modeling import simplify

    verdicts = simplify(
        full, threshold, criterion=criterion, margin_db=margin_db, hold_above=hold_above
    )
    if verdicts.model != shown:
        raise ValueError(
            f"expected the simplified model of {full.texture} to be the one that {threshold.name}, "
            f"{criterion} and {margin_db:g} dB give, got "
            f"{'another' if shown else 'none'}; give the --threshold, --criterion, "
            "--margin-db and --known-only that it was made with."
        )
    return verdicts
