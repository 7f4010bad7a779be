"""The section on where methods fail, and the files of the whole atlas."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from analysis.benches.atlas.cases import TO_COME
from analysis.benches.atlas.edges import Examined
from analysis.benches.atlas.tables import (
    CELL_COLUMNS,
    EDGE_COLUMNS,
    LEAST_MARGIN,
    MARGIN_COLUMNS,
    cell_table,
    edge_table,
    margin_table,
)
from analysis.columns import chosen, names, without
from analysis.figures.atlas import figure_atlas
from analysis.figures.saving import png_of, svg_of, warn_of_missing_fonts
from analysis.report.findings import table_bytes
from analysis.report.outcomes import Outcome
from analysis.report.page import (
    PICTURE_DPI,
    Fold,
    Item,
    Picture,
    Table,
    bullets,
    folded,
    page,
    picture_html,
    table_html,
)
from analysis.report.section_provenance import PROVENANCE_COLUMNS, unfolded
from analysis.report.sections import Section
from analysis.report.sentences import described

BANNER = "SIMULATED: every run is on signals, hands, recordings and answers that were made up."
# What matters first; sentences have their place above the tables, and in the files.
SHOWN_MARGINS = chosen(
    MARGIN_COLUMNS,
    *("family", "method", "axis", "default", "unit", "margin", "at_least", "verdict"),
    *("nearest_edge", "column", "measured"),
)
SHOWN_EDGES = chosen(
    EDGE_COLUMNS,
    *("family", "method", "axis", "column", "holds_to", "fails_from", "unit", "theory"),
    *("disagreement", "measured", "returns"),
)
SHOWN_CELLS = without(CELL_COLUMNS, "simulated")


def stability_section(examined: Sequence[Examined]) -> Section:
    """Where methods hold, degrade and fail, and how far our defaults are from there."""
    margins, edges = margin_table(examined), edge_table(examined)
    picture = Picture(
        "stability",
        "Where methods hold, degrade and fail",
        "A row per method, a mark per run. Bars change colour at the edges, which were sought by "
        "bisection from the easy end (left). Black: to where theory lets a method hold. Dashed: "
        "where the program, or a usual hand, is by default.",
        figure_atlas(examined),
        simulated=True,
    )
    near = Table(
        "stability_margins",
        "How far our defaults are from the nearest edge",
        "The factor by which the nearest edge is more severe than the default; "
        f"{LEAST_MARGIN:g} or more is asked for, or a reason. Where there was no edge, to the end "
        "of what was tried.",
        margins,
        SHOWN_MARGINS,
        simulated=True,
    )
    every = Table(
        "stability_edges",
        "Every edge",
        "To where each method holds and from where on it fails (n/a: nowhere within what was "
        "tried), beside theory, whose sources are in the file.",
        edges,
        SHOWN_EDGES,
        simulated=True,
    )
    return Section(
        "stability",
        "Where methods fail",
        (picture, near, Fold("Every edge, and what theory says", (every,))),
        outcomes=tuple(_outcomes(margins, edges)),
        done=tuple(f"Not examined yet, {name}: {why}." for name, why in TO_COME.items()),
    )


def _outcomes(margins: pd.DataFrame, edges: pd.DataFrame) -> list[Outcome]:
    enough = int(margins["enough"].sum())
    sentences = [
        f"{enough} of {len(margins)} defaults are a factor of {LEAST_MARGIN:g} or more away from "
        "where they stop to hold."
    ] * bool(len(margins))
    sentences += [
        f"Nearer is {row['method']} ({row['family']}, {row['axis']}): a factor of "
        f"{row['margin']:.2g}; {row['exception'] or 'no reason is known'}."
        for row in margins[~margins["enough"].astype(bool)].to_dict("records")
    ]
    factors = edges["disagreement"].to_numpy(dtype=np.float64)
    factors = factors[np.isfinite(factors) & (factors > 0)]
    if factors.size:
        off = np.exp(np.abs(np.log(factors)))
        sentences.append(
            f"Where theory says to where a method holds ({factors.size} edges), the measured "
            f"edge is off by a factor of {np.median(off):.2f} in the median and {off.max():.2f} at "
            "worst."
        )
    return described(sentences)


def atlas_files(examined: Sequence[Examined], provenance: Mapping[str, object]) -> dict[str, bytes]:
    """The whole atlas by file name: tables, its picture, and a page that holds all of it."""
    section = stability_section(examined)
    picture = section.items[0]
    assert isinstance(picture, Picture)
    png, lacking = png_of(picture.figure, dpi=PICTURE_DPI)
    warn_of_missing_fonts(lacking)
    tables = {
        "cells.tsv": cell_table(examined),
        "edges.tsv": edge_table(examined),
        "margins.tsv": margin_table(examined),
    }
    html = _page(section, png, cells=tables["cells.tsv"], provenance=provenance)
    return {name: table_bytes(table) for name, table in tables.items()} | {
        "atlas.png": png,
        "atlas.svg": svg_of(picture.figure)[0],
        "atlas.html": html.encode(),
    }


def _page(
    section: Section, png: bytes, *, cells: pd.DataFrame, provenance: Mapping[str, object]
) -> str:
    runs = Table("cells", "Every run", "All marks of the picture.", cells, SHOWN_CELLS, True)
    origin = Table(
        "provenance",
        "Where this page comes from",
        "Exact tables are in the TSV files beside it.",
        pd.DataFrame(unfolded(provenance), columns=names(PROVENANCE_COLUMNS)),
        PROVENANCE_COLUMNS,
        simulated=False,
    )
    told = [outcome.sentence for outcome in section.outcomes]
    items = (*section.items, Fold("Every run", (runs,)))
    return page(
        title="Where do methods fail?",
        answer=told[0] if told else "No default was examined.",
        lead="Methods of modelling, rendering and analysis, from easy cases to hard ones.",
        banner=BANNER,
        sections=[
            ("overview", "At a glance", bullets([*told[1:], *section.done])),
            (section.anchor, section.heading, "".join(_item_html(item, png) for item in items)),
            ("origin", "Provenance", table_html(origin)),
        ],
    )


def _item_html(item: Item, png: bytes) -> str:
    if isinstance(item, Fold):
        return folded(item, "".join(_item_html(each, png) for each in item.items))
    return table_html(item) if isinstance(item, Table) else picture_html(item, png)
