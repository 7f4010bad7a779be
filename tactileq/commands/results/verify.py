"""tactileq verify: is everything as it was stored?"""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Annotated, Any

import typer


def verify(
    data: Annotated[
        Path, typer.Argument(metavar="DATA", help="Folder of the study's answers, or an archive.")
    ],
    results: Annotated[
        Path | None, typer.Argument(metavar="[RESULTS]", help="Results of tactileq analyze.")
    ] = None,
) -> None:
    """Compare a study's data, and results, with what sessions and analysis stored; reads only.

    Draws each order again from study, seed and slot, checks the seals of each log, replays it
    through its task, makes every table again, and compares roster, description and manifests with
    each other, and the models with those that were presented. Of RESULTS it checks every file,
    then analyzes again and compares; an archive of tactileq publish has all of it inside. What
    differs is named, by file and trial, and the exit code is 1.

    Example: tactileq verify data analysis-results
    """
    from tactileq.commands.results.analyze import analyze
    from tactileq.commands.results.verification import (
        print_data_differences,
        print_differences,
        print_earlier,
    )
    from tactileq.commands.results.verified_results import (
        verify_archive,
        verify_models,
        verify_results,
    )
    from tactileq.experiments.publishing.archive import DATA, REPORT, is_archive
    from tactileq.experiments.verification.verifying import verify_data

    checks = []
    if is_archive(data):
        if results is not None:
            raise ValueError("expected an archive alone, which holds its results, got others.")
        checks.append(verify_archive(data))
        place: Any = contextlib.chdir(data)
        data, results = Path(DATA), Path(REPORT)
    else:
        place = contextlib.nullcontext()
    with place:
        found = verify_data(data)
        checks.append(verify_models(found.manifests))
        if results is not None:
            checks.append(verify_results(data, results, analyze=analyze))
    print(found.summary)
    print_earlier(found, data)
    print_data_differences(found)
    for differences, said in checks:
        if said:
            print(said)
        print_differences(differences)
    if found.differences or any(differences for differences, _ in checks):
        raise typer.Exit(1)
