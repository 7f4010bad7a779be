"""tactileq stability: where methods hold and where they start to fail."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tactileq.options import Out
from tactileq.printing import progress
from tactileq.results import FolderResults
from tactileq.workers import working

if TYPE_CHECKING:
    import pandas as pd

    from tactileq.benches.atlas.case import Case
    from tactileq.benches.atlas.edges import Examined


def stability(
    out: Out = Path("stability"),
    reduced: Annotated[
        bool,
        typer.Option(
            "--reduced", help="One column of each case, edges to within 1/8 of their axis."
        ),
    ] = False,
    only: Annotated[
        list[str] | None,
        typer.Option(metavar="FAMILY", help="Only these cases, such as filters; repeatable."),
    ] = None,
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Processes at once; by default one per core.")
    ] = None,
) -> None:
    """Measure where methods hold, degrade and fail, and how far the defaults are from failure.

    Everything is simulated. Writes cells.tsv, edges.tsv, margins.tsv, atlas.png, atlas.svg and
    atlas.html, which contains all of them.

    Example: tactileq stability --only filters
    """
    from tactileq.benches.atlas.cases import CASES
    from tactileq.benches.atlas.edges import columns_of

    results = FolderResults(out, "stability")
    chosen = cases_of(CASES, only)
    with progress("Examining", len(columns_of(chosen, full=not reduced))) as advance:
        found = examined(chosen, full=not reduced, jobs=jobs, advance=advance)
    settings = {"reduced": reduced, "only": sorted({case.family for case in chosen})}
    _write(found, results, settings)


def cases_of(cases: Sequence[Case], families: Sequence[str] | None) -> list[Case]:
    """The cases of these families, or all of them.

    Raises
    ------
    ValueError
        For a family that there is not.
    """
    known = list(dict.fromkeys(case.family for case in cases))
    for family in families or ():
        if family not in known:
            raise ValueError(
                f"expected a family of cases among {', '.join(known)}, got {family!r}; name one "
                "of these with --only, or leave it out for all."
            )
    return [case for case in cases if not families or case.family in families]


def examined(
    cases: Sequence[Case],
    *,
    full: bool = False,
    jobs: int | None = None,
    advance: Callable[[str], None] = lambda item: None,
) -> list[Examined]:
    """The columns of every case, in their order, in several processes.

    Parameters
    ----------
    full : bool
        With all runs, or with the few of the reduced atlas.
    jobs : int, optional
        Processes; as many as cores without it.
    advance : callable, optional
        Called with the name of each column that is done.
    """
    from tactileq.benches.atlas.edges import columns_of, examine_column

    found: dict[int, Examined] = {}
    columns = columns_of(cases, full=full)
    with working(partial(examine_column, cases, full=full), columns, jobs=jobs) as done:
        for number, one in done:
            found[number] = one
            advance(" · ".join(filter(None, (one.case.family, one.case.method, one.column))))
    return [found[number] for number in sorted(found)]


def _write(found: Sequence[Examined], results: FolderResults, settings: dict[str, object]) -> None:
    from tactileq.benches.atlas.section import atlas_files
    from tactileq.benches.atlas.tables import margin_table

    provenance = results.provenance(settings)
    with results.folder(provenance) as fresh:
        for name, data in atlas_files(found, provenance).items():
            (fresh / name).write_bytes(data)
    _print(margin_table(found))
    print(f"simulated: {results.out / 'atlas.html'}")


def _print(margins: pd.DataFrame) -> None:
    """How far each default is from the nearest edge."""
    for row in margins.to_dict("records"):
        most = "at least " if row["at_least"] else ""
        near = "" if row["enough"] else f" ({row['exception'] or 'reason unknown'})"
        unit = f" {row['unit']}" if row["unit"] else ""
        print(
            f"{row['family']}: {row['method']}, {row['measured']}: {row['verdict']} at "
            f"{row['default']:.5g}{unit} ({row['axis']}), nearest edge {most}{row['margin']:.3g} × "
            f"more severe{near}"
        )
