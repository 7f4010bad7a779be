"""tactileq analyze: tests of the answers, and the report."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tactileq.options import PAIR, Out, Seed, as_pair
from tactileq.printing import progress, share_of, usable_recordings
from tactileq.results import FolderResults
from tactileq.workers import working

if TYPE_CHECKING:
    import pandas as pd

    from tactileq.analysis.answers.plan import AnalysisPlan
    from tactileq.analysis.answers.responses import Responses
    from tactileq.analysis.textures.results import TextureResult
    from tactileq.modeling import Simplification, TextureModel


def analyze(
    data: Annotated[
        list[str] | None,
        typer.Argument(
            help="Folder of the study's answers; for several set-ups, NAME=FOLDER each. With "
            "--table: further tables."
        ),
    ] = None,
    table: Annotated[
        list[Path] | None,
        typer.Option(help="Instead of the folder: tables of any experiment, CSV or TSV."),
    ] = None,
    columns: Annotated[
        list[str] | None,
        typer.Option(
            "--map",
            help="Meaning of the columns: correct=TYPE_ANS,factor=TYPE,…, or a TOML file with "
            "these; repeatable.",
        ),
    ] = None,
    where: Annotated[
        list[Any] | None,
        typer.Option(
            parser=as_pair,
            metavar=PAIR,
            help="Only lines of tables with this value in this column; repeatable.",
        ),
    ] = None,
    right: Annotated[
        str | None,
        typer.Option(
            metavar="CODE",
            help="What means right in the column correct; without right answers, whose share of "
            "the column answered.",
        ),
    ] = None,
    out: Out = Path("analysis-results"),
    recordings: Annotated[
        Path | None, typer.Option(help="Folder of recording sets, one folder per texture.")
    ] = None,
    models: Annotated[Path | None, typer.Option(help="Folder of full models.")] = None,
    simplified: Annotated[Path | None, typer.Option(help="Folder of simplified models.")] = None,
    plan: Annotated[
        Path | None,
        typer.Option(
            help="Study file written after the data, whose claims are tested as exploratory."
        ),
    ] = None,
    exclude: Annotated[
        list[str] | None,
        typer.Option(help="Participant to exclude, and why: sub-05='fell asleep'."),
    ] = None,
    complete: Annotated[
        bool,
        typer.Option("--complete", help="Compare complete pairs only, where some are incomplete."),
    ] = False,
    validate: Annotated[
        int | None,
        typer.Option(
            min=1,
            metavar="N",
            help="Append the results of the procedures on planted truth, with N simulations each.",
        ),
    ] = None,
    jobs: Annotated[
        int | None,
        typer.Option(min=1, help="Processes for --validate; by default one per core."),
    ] = None,
    dask: Annotated[
        str | None, typer.Option(help="Address of a Dask scheduler whose workers run --validate.")
    ] = None,
    unverified: Annotated[
        str | None,
        typer.Option(
            metavar="REASON", help="Go on where data differ from what sessions stored, and say why."
        ),
    ] = None,
    seed: Seed = 0,
) -> None:
    """Test the answers and write report.html with its tables and figures.

    DATA is only read, and verified first, as by tactileq verify. A table that is incomplete or
    differs from the log of its session is named; tactileq study status writes it again. Whatever
    else differs has to be restored, its participant excluded, or a reason given.

    The claims are those of the study that was run; those of --plan are exploratory. With
    --recordings, --models and --simplified the report also states the accuracy and size of the
    models; the reasons why layers were dropped are read from the folder that tactileq simplify
    wrote.

    With --table, answers come from tables of any experiment. The map names columns: participant
    (by default the file's name), factor (any number; session where each file is one), count, and
    one of correct (0 or 1, true or false, or --right), share (0 to 1), value, presented with
    answered, or answered alone. Without these, each file is a confusion matrix called
    PARTICIPANT_LEVEL, with a level for each factor.

    Example: tactileq analyze --table P*.csv --map correct=RIGHT,factor=SIZE

    Example: tactileq analyze --table export.csv --map roles.toml --where phase main --right 1

    Example: tactileq analyze data --recordings recordings --models models --simplified simplified
    """
    folders = (recordings, models, simplified)
    if table or columns or where or right is not None:
        if (*folders, plan, exclude, validate, unverified) != (None,) * 7 or complete:
            raise ValueError(
                "expected --table with no option but --map, --where, --right, --out and --seed, "
                "got more; leave the others out."
            )
        files = [*(table or []), *map(Path, data or [])]
        analyze_tables(
            files, columns or (), where=where or (), right=right or "", out=out, seed=seed
        )
        return
    if not data:
        raise ValueError(
            "expected a folder of answers, or --table with files, got neither; give one of the two."
        )
    from tactileq.analysis.report.report import write_report
    from tactileq.analysis.statistics.described_verdicts import check_complete
    from tactileq.benches.validation.section import validation_section
    from tactileq.modeling.models.loading import load_models
    from tactileq.modeling.perception.verdicts import load_simplifications

    written = FolderResults(out, "analyze")
    places = _places(data)
    written.reads(*places.values(), *folders, plan)
    given = {"recordings": recordings, "models": models, "simplified": simplified, "plan": plan}
    options = {
        "data": list(data),
        **{name: None if path is None else str(path) for name, path in given.items()},
        "exclude": exclude,
        "complete": complete,
        "validate": validate,
        "unverified": unverified,
        "seed": seed,
    }
    responses = read_answers(places, exclude or (), unverified=unverified)
    if plan is not None:
        responses = replace(responses, plan=_later_plan(plan, responses.plan))
    if not complete:
        check_complete(responses)
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
    appendix = []
    if validate is not None:
        appendix = [validation_section(*validated(validate, seed=seed, jobs=jobs, dask=dask))]
    settings = settings_of(responses, results)
    settings |= {"validate": validate} if validate is not None else {}
    provenance = written.provenance(settings, seed=seed)
    sealed = {**provenance, "options": options}
    with written.folder(sealed) as fresh, share_of("Reporting") as advance:
        write_report(
            fresh / "report.html",
            responses=responses,
            textures=results,
            hand=_hand(places, responses),
            benches=appendix,
            provenance=provenance,
            seed=seed,
            progress=advance,
        )
    for warning in responses.warnings:
        print(f"warning: {warning}", file=sys.stderr)
    print((out / "report.html").resolve())


def analyze_tables(
    files: Sequence[Path],
    columns: Sequence[str],
    *,
    where: Sequence[tuple[str, str]],
    right: str,
    out: Path,
    seed: int,
) -> None:
    """Write the report on tables of any experiment."""
    import numpy as np

    from tactileq.analysis.answers.imported import load_imported
    from tactileq.analysis.answers.table_map import parse_map
    from tactileq.analysis.chapters.tables.section import table_sections
    from tactileq.analysis.report.report import write_report
    from tactileq.modeling.files.others.roles import is_file_of_roles

    folders = [path for path in files if path.is_dir()]
    if not files or folders:
        got = f"the folder {folders[0]}" if folders else "none"
        raise ValueError(f"expected files of answers with --table, got {got}; give files only.")
    written = FolderResults(out, "analyze")
    written.reads(*files, *map(Path, filter(is_file_of_roles, columns)))
    mapping = parse_map(columns, where=where, right=right)
    imported = load_imported(files, mapping)
    sections = table_sections(imported, rng=np.random.default_rng(seed))
    settings = {"map": asdict(mapping), "notes": imported.notes}
    provenance = written.provenance(settings, seed=seed)
    for note in imported.notes:
        print(f"note: {note}", file=sys.stderr)
    with written.folder(provenance) as fresh, share_of("Reporting") as advance:
        write_report(
            fresh / "report.html",
            benches=sections,
            provenance=provenance,
            title="What the tables show",
            seed=seed,
            progress=advance,
        )
    print((out / "report.html").resolve())


def _places(data: Sequence[str]) -> dict[str, Path]:
    """The folder of each set-up, by its name; one alone needs none."""
    if len(data) == 1:
        return {"": Path(data[0])}
    named = [text.partition("=") for text in data]
    places = {name: Path(folder) for name, _, folder in named if name and folder}
    if len(places) < len(data):
        raise ValueError(
            f"expected a name of its own for each of several set-ups, got {', '.join(data)}; name "
            "them, as in leipzig=data nara=other/data."
        )
    return places


def read_answers(
    places: Mapping[str, Path], exclude: Sequence[str], *, unverified: str | None = None
) -> Responses:
    """The answers at all set-ups, without those who are left out; nothing is written.

    Raises
    ------
    InputError
        If something of those who are not left out differs from what sessions stored, and there is
        no reason to go on unverified; or the answers cannot be used.
    """
    from tactileq.analysis.answers.loading import load_responses
    from tactileq.analysis.answers.responses import SETUP_SEPARATOR, leave_out
    from tactileq.analysis.answers.setups import pool_setups
    from tactileq.commands.results.verification import require_verified

    reasons = dict(map(_with_reason, exclude))
    setups = {}
    for name, place in places.items():
        before = f"{name}{SETUP_SEPARATOR}" if name else ""
        without = {who.removeprefix(before) for who in reasons if who.startswith(before)}
        found = require_verified(place, without=without, unverified=unverified, named=before)
        setups[name] = replace(
            load_responses(place, leaving_out=without),
            verified=(found.summary,),
            unverified=(unverified or "") if found.differences else "",
        )
    responses = pool_setups(setups) if len(setups) > 1 else next(iter(setups.values()))
    return leave_out(responses, reasons)


def _hand(places: Mapping[str, Path], responses: Responses) -> pd.DataFrame:
    """How the hand moved at all set-ups, participants named as in the answers."""
    import pandas as pd

    from tactileq.analysis.answers.hand import load_hand
    from tactileq.analysis.answers.setups import answers_at, named_after

    tables = [
        named_after(name, load_hand(place, answers_at(name, responses.answers)))
        for name, place in places.items()
    ]
    return pd.concat(tables, ignore_index=True)


def _with_reason(text: str) -> tuple[str, str]:
    who, _, why = text.partition("=")
    return who, why


def _later_plan(path: Path, registered: AnalysisPlan) -> AnalysisPlan:
    """The plan of a study file; claims not registered with its rule of verdicts are exploratory."""
    from tactileq.analysis.answers.plan import plan_from
    from tactileq.experiments.study.study import Study

    later = plan_from(Study.load(path).to_dict()["plan"], path=path, sha256=registered.sha256)
    known = registered.claims if later.rule == registered.rule else ()
    claims = (replace(claim, planned=claim in known) for claim in later.claims)
    return replace(later, claims=tuple(claims))


def validated(
    simulations: int, *, seed: int, jobs: int | None = None, dask: str | None = None
) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """Procedures, and the rule of verdicts, on planted truth, and ranks of the model's sampler.

    The same tables on any number of workers.

    Parameters
    ----------
    simulations : int
        Of each row, ≥ 1.
    seed : int
        ≥ 0.
    jobs : int, optional
        Processes; as many as cores without it.
    dask : str, optional
        Address of a scheduler.
    """
    from tactileq.benches.validation.model import (
        model_cells,
        model_table,
        simulate_model_cell,
    )
    from tactileq.benches.validation.procedures import cells, simulate_cell, validation_table
    from tactileq.benches.validation.ranks import RANK_KINDS, rank_table, simulate_ranks

    settings: dict[str, int] = {"simulations": simulations, "seed": seed}
    listed, planted = cells(), model_cells()
    tasks = [partial(simulate_cell, cell, **settings) for cell in listed]
    of_model = [partial(simulate_model_cell, cell, **settings) for cell in planted]
    ranks = [partial(simulate_ranks, kind, **settings) for kind in RANK_KINDS]
    every = [*tasks, *of_model, *ranks]
    names = [" ".join(map(str, cell)) for cell in (*listed, *planted)] + list(RANK_KINDS)
    found: dict[int, Any] = {}
    with (
        progress("Validating", len(every)) as advance,
        working(_called, every, jobs=jobs, dask=dask) as done,
    ):
        for number, row in done:
            found[number] = row
            advance(names[number])
    rows = [found[number] for number in range(len(every))]
    split, end = len(tasks), len(tasks) + len(of_model)
    return (
        validation_table(rows[:split]),
        model_table(rows[split:end]),
        rank_table(row for of_kind in rows[end:] for row in of_kind),
    )


def _called(task: object) -> Any:
    """What a task finds, in a process of its own."""
    assert callable(task)
    return task()


def settings_of(responses: Responses, results: Sequence[TextureResult]) -> dict[str, object]:
    """What a report is based on: study, models, and how layers were dropped."""
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
    from tactileq.analysis.textures.between import left_out_by_model
    from tactileq.analysis.textures.results import TextureResult
    from tactileq.modeling.files.writing import file_stem
    from tactileq.modeling.fitting.conditions import recording_spectra

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
            f"expected the file with the reasons why layers of {texture} were dropped beside its "
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
        if given.get(kind, presented) != presented:
            raise ValueError(
                f"expected the {kind} model of {texture} that was presented (SHA-256 "
                f"{presented[:12]}…), got another one ({given[kind][:12]}…); give the folders of "
                "the models that were presented."
            )
