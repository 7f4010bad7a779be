"""tactileq publish: an archive of a study that stands alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from tactileq.results import FolderResults

_WITH_MODELS = ("recordings", "models", "simplified")


def publish(
    data: Annotated[Path, typer.Argument(metavar="DATA", help="Folder of the study's answers.")],
    study: Annotated[
        Path, typer.Option("--study", help="Study file with [publication]: authors, licence, …")
    ],
    out: Annotated[Path, typer.Option("--out", help="Folder of the archive.")],
    results: Annotated[
        Path | None,
        typer.Option(help="Results of tactileq analyze, whose options the report is made with."),
    ] = None,
    models: Annotated[
        list[str] | None,
        typer.Option(metavar="SET=FOLDER", help="Models, where they are not where they were."),
    ] = None,
    stimuli: Annotated[Path | None, typer.Option(help="Folder of a stimulus set.")] = None,
    without: Annotated[
        list[str] | None, typer.Option(metavar="SET", help="Set of models to leave out.")
    ] = None,
    free_text: Annotated[
        bool, typer.Option("--free-text", help="Keep what people typed, such as reasons.")
    ] = False,
) -> None:
    """Write data, plan, models, report and metadata into one folder that can be given to others.

    Data are verified first. Only what sessions, sets and the study list is written, anew. Times of
    day, pseudonyms and free text are left out; the copy's logs are sealed anew, and the seals of
    the original are stated. The report is made from the copy. BIDS errors, files that nothing
    lists, and files that would identify a participant or a machine, stop it. In the archive,
    tactileq verify . checks every file, the data and the report. Needs the extra publish.

    Example: tactileq publish data --study study.toml --out archive
    """
    from tactileq.commands.results.analyze import analyze
    from tactileq.commands.results.publishing import assemble, check_publishable, checked_models
    from tactileq.commands.results.verification import require_verified
    from tactileq.experiments.publishing.archive import COMMAND, DATA
    from tactileq.experiments.publishing.metadata import Publication
    from tactileq.experiments.sessions.bids.validator import bids_issues, said_of
    from tactileq.experiments.sessions.kept.texts import texts_file
    from tactileq.experiments.study.study import Study
    from tactileq.modeling import InputError
    from tactileq.modeling.errors import counted
    from tactileq.modeling.files.hashes import seal_over
    from tactileq.modeling.files.provenance import sha256_of_files

    written = FolderResults(out, COMMAND)
    given = {"data": data, "study": study, "results": results, "stimuli": stimuli}
    written.reads(*given.values())
    stated = Study.load(study)
    found = require_verified(data, without=(), unverified=None)
    if not found.manifests:
        raise InputError(f"expected sessions in {data}, got none; name a folder with sourcedata.")
    places, absent = checked_models(found.manifests, _places(models), without=without or ())
    check_publishable(stated, models=places)
    given |= {f"{name} models": place for name, place in places.items()}
    ran = Study.from_dict(found.manifests[0].study)
    if ran.sha256 != stated.sha256:
        raise InputError(
            f"expected the study that {data} was run with, got another one in {study}; name its "
            "own file, or change only [publication]."
        )
    options = _options_of(results, data) if results is not None else {}
    if without and options.get("models"):
        options |= dict.fromkeys(_WITH_MODELS)
        print("note: the report is made without the chapters on models, which are left out.")
    reported = (*_WITH_MODELS, "plan")
    given |= {name: Path(options[name]) for name in reported if options.get(name)}
    written.reads(*given.values())
    read = found.manifests[0].texts_sha256 or {}
    texts = {name: Path(DATA, texts_file(name, sha256)) for name, sha256 in read.items()}
    publication = Publication(
        study=replace(ran, publication=stated.publication, texts=texts),
        data=data,
        models=places,
        stimuli=stimuli,
        options=options,
        free_text=free_text,
        textures=frozenset(name for one in found.manifests for name in one.models_sha256),
        # Of all sessions: a data set holds those of people or of simulations, never both.
        simulated_participants=found.manifests[0].simulated_participant,
        simulated_rig=found.manifests[0].simulated_rig,
    )
    provenance: dict[str, Any] = {}
    with written.folder(provenance) as fresh:
        told = assemble(fresh, publication, analyze=analyze)
        if errors := [i for i in bids_issues(fresh / DATA) if i["severity"] == "error"]:
            more = f" (and {counted(len(errors) - 1, 'more error')})" if errors[1:] else ""
            raise InputError(
                f"expected data that are valid BIDS, got {said_of(errors[0])}{more}; "
                f"tactileq study validate {data} says more."
            )
        # Paths would name a machine.
        hashes = {name: written.inputs.get(str(path)) for name, path in given.items()}
        written.inputs = {name: sha256 for name, sha256 in hashes.items() if sha256}
        settings = {"free_text": free_text, "without": list(without or ())}
        seal = seal_over(sha256_of_files(fresh))
        provenance |= {**written.provenance(settings), **told, "seal": seal}
    for name in absent:
        print(f"note: the {name} models are not here, and not in the archive.")
    print(f"seal of the archive: {seal}")
    print(out.resolve())


def _places(models: list[str] | None) -> dict[str, Path]:
    places = {}
    for text in models or ():
        name, _, folder = text.partition("=")
        if not name or not folder:
            raise ValueError(f"expected --models SET=FOLDER, got {text!r}; write both.")
        places[name] = Path(folder)
    return places


def _options_of(results: Path, data: Path) -> dict[str, Any]:
    """The options of the analysis of these data."""
    from tactileq.commands.results.verified_results import require_data
    from tactileq.modeling.files.documents import read_json_object
    from tactileq.modeling.files.provenance import PROVENANCE_NAME

    note = read_json_object(results / PROVENANCE_NAME, advice="name a folder of results")
    require_data(note, data, results)
    return dict(note.get("options", {}))
