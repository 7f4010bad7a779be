"""tactileq analyze: tests of the answers, and the report."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tactileq.keeping import check_own_results
from tactileq.options import Out, Seed
from tactileq.telling import share_of, usable_recordings

if TYPE_CHECKING:
    from analysis.answers.loading import Responses
    from analysis.textures.results import TextureResult
    from modeling import Simplification, TextureModel


def analyze(
    data: Annotated[
        list[Path] | None,
        typer.Argument(help="Folder of the study's answers; with --table: further tables."),
    ] = None,
    table: Annotated[
        list[Path] | None,
        typer.Option(help="Instead of the folder: tables of any experiment, CSV or TSV."),
    ] = None,
    columns: Annotated[
        str | None,
        typer.Option("--map", help="What columns mean: correct=TYPE_ANS,factor=TYPE,…"),
    ] = None,
    out: Out = Path("analysis-results"),
    recordings: Annotated[
        Path | None, typer.Option(help="Folder of recording sets, one folder per texture.")
    ] = None,
    models: Annotated[Path | None, typer.Option(help="Folder of full models.")] = None,
    simplified: Annotated[Path | None, typer.Option(help="Folder of simplified models.")] = None,
    seed: Seed = 0,
) -> None:
    """Test the answers and write report.html with its tables and figures.

    With --recordings, --models and --simplified the report also tells how good and how small the
    models are; why layers went stands in the folder that tactileq simplify wrote.

    With --table answers come from tables of any experiment. The map names columns: participant
    (else the file's name), factor (any number), count, and one of correct (0 or 1), share (0 to
    1), value, or presented with answered. Without these each file is a confusion matrix called
    PARTICIPANT_LEVEL, with a level for each factor.

    Example: tactileq analyze --table P*.csv --map correct=RIGHT,factor=SIZE

    Example: tactileq analyze data --recordings recordings --models models --simplified simplified
    """
    from analysis.answers.loading import load_responses
    from analysis.report.report import write_report
    from experiments.sessions.bids import export_all
    from modeling.files.folders import replace_folder
    from modeling.files.provenance import provenance_of, seal_folder
    from modeling.models.loading import load_models
    from modeling.perception.verdicts import load_simplifications

    folders = (recordings, models, simplified)
    if table is not None or columns is not None:
        if folders != (None, None, None):
            raise ValueError(
                "expected --table without --recordings, --models and --simplified, got both; "
                "leave those out."
            )
        return analyze_tables([*(table or []), *(data or [])], columns, out=out, seed=seed)
    if data is None or len(data) != 1:
        raise ValueError(
            f"expected one folder of answers or --table with files, got {len(data or [])} "
            "folders; give one of the two."
        )
    answers = data[0]
    check_own_results(out, "analyze")
    export_all(answers)  # of sessions that were killed
    responses = load_responses(answers)
    results = []
    if recordings is not None and models is not None and simplified is not None:
        results = results_of_study(
            responses,
            recordings=recordings,
            full=load_models(models),
            shown=load_models(simplified),
            simplifications=load_simplifications(simplified),
        )
    elif folders != (None, None, None):
        raise ValueError(
            "expected --recordings, --models and --simplified together, got only some of them; "
            "give all three or none."
        )
    inputs = [path for path in (answers, *folders) if path is not None]
    with replace_folder(out) as fresh, share_of("Reporting") as tell:
        settings = settings_of(responses, results)
        provenance = provenance_of("analyze", settings, seed=seed, inputs=inputs)
        write_report(
            fresh / "report.html",
            responses=responses,
            textures=results,
            provenance=provenance,
            seed=seed,
            progress=tell,
        )
        seal_folder(fresh, provenance)
    for warning in responses.warnings:
        print(f"warning: {warning}", file=sys.stderr)
    print((out / "report.html").resolve())


def analyze_tables(files: Sequence[Path], columns: str | None, *, out: Path, seed: int) -> None:
    """Write the report on tables of any experiment."""
    import numpy as np

    from analysis.answers.imported import load_imported, parse_map
    from analysis.report.report import write_report
    from analysis.report.section_table import table_sections
    from modeling.files.folders import replace_folder
    from modeling.files.provenance import provenance_of, seal_folder

    folders = [path for path in files if path.is_dir()]
    if not files or folders:
        got = f"the folder {folders[0]}" if folders else "none"
        raise ValueError(f"expected files of answers with --table, got {got}; give files only.")
    check_own_results(out, "analyze")
    imported = load_imported(files, parse_map(columns or ""))
    sections = table_sections(imported, rng=np.random.default_rng(seed))
    with replace_folder(out) as fresh, share_of("Reporting") as tell:
        provenance = provenance_of("analyze", {"map": columns or ""}, seed=seed, inputs=files)
        write_report(
            fresh / "report.html",
            benches=sections,
            provenance=provenance,
            title="What the tables show",
            seed=seed,
            progress=tell,
        )
        seal_folder(fresh, provenance)
    print((out / "report.html").resolve())


def settings_of(responses: Responses, results: Sequence[TextureResult]) -> dict[str, object]:
    """What a report rests on: study, models, and how layers were dropped."""
    reasons = {
        result.texture: {
            "full_sha256": result.simplification.full_sha256,
            "simplified_sha256": result.simplification.model.sha256,
            "threshold": result.simplification.threshold.name,
            "threshold_sha256": result.simplification.threshold.sha256,
            "criterion": result.simplification.criterion,
            "margin_db": result.simplification.margin_db,
            "hold_above": result.simplification.hold_above,
        }
        for result in results
    }
    return {
        "study_sha256": responses.study_sha256,
        "models_sha256": responses.models,
        "simplifications": reasons,
    }


def results_of_study(
    responses: Responses,
    *,
    recordings: Path,
    full: Mapping[str, TextureModel],
    shown: Mapping[str, TextureModel],
    simplifications: Mapping[str, Simplification],
) -> list[TextureResult]:
    """Recordings, models and verdicts of every texture that was asked about."""
    from analysis.textures.between import left_out_by_model
    from analysis.textures.results import TextureResult
    from modeling.files.writing import file_stem
    from modeling.fitting.conditions import recording_spectra

    results = []
    for texture in responses.textures:
        _require_models(texture, responses, full=full, shown=shown, why=simplifications)
        records = usable_recordings(recordings / file_stem(texture), texture)
        left_out = left_out_by_model(recording_spectra(records), full[texture])
        results.append(
            TextureResult(records, full[texture], simplifications[texture], left_out=left_out)
        )
    return results


def _require_models(
    texture: str,
    responses: Responses,
    *,
    full: Mapping[str, TextureModel],
    shown: Mapping[str, TextureModel],
    why: Mapping[str, Simplification],
) -> None:
    """Refuse models that are not there, do not belong together, or were not the ones presented."""
    for kind, models in (("full", full), ("simplified", shown)):
        if texture not in models:
            raise ValueError(
                f"expected a {kind} model of each texture in the answers, got none of {texture}; "
                "give the folders of the models that were presented."
            )
    if texture not in why:
        raise ValueError(
            f"expected the file that tells why layers of {texture} were dropped beside its "
            "simplified model, got none; simplify it again with tactileq simplify."
        )
    simplification = why[texture]
    if simplification.full_sha256 != full[texture].sha256 or simplification.model != shown[texture]:
        raise ValueError(
            f"expected the simplified model of {texture} to come from the full one in --models, "
            "got one of another model or a changed file; simplify it again."
        )
    given = {"full": full[texture].sha256, "simplified": shown[texture].sha256}
    for kind, presented in responses.models.get(texture, {}).items():
        if given[kind] != presented:
            raise ValueError(
                f"expected the {kind} model of {texture} that was presented (SHA-256 "
                f"{presented[:12]}…), got another one ({given[kind][:12]}…); give the folders of "
                "the models that were presented."
            )
