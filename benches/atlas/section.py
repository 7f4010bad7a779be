"""The section on where methods fail, and the files of the whole atlas."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from tactileq.analysis.columns import table_bytes
from tactileq.analysis.page.outcomes import Outcome, described
from tactileq.analysis.page.page import (
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
from tactileq.analysis.page.provenance import PROVENANCE_COLUMNS, unfolded
from tactileq.analysis.page.saving import png_of, svg_of, warn_of_missing_fonts
from tactileq.analysis.page.sections import Section
from tactileq.benches.atlas.cases import TO_COME
from tactileq.benches.atlas.edges import Examined
from tactileq.benches.atlas.figure import figure_atlas, figure_margins
from tactileq.benches.atlas.tables import (
    CELL_COLUMNS,
    EDGE_COLUMNS,
    LEAST_MARGIN,
    MARGIN_COLUMNS,
    cell_table,
    edge_table,
    margin_table,
)
from tactileq.modeling.errors import counted
from tactileq.modeling.files.columns import chosen, names, without

BANNER = "SIMULATED: every run uses simulated signals, hand movements, recordings and answers."
ATLAS_NOTE = (
    "A row per method, a mark per run. Bars change colour at the edges, which were located by "
    "bisection starting at the easy end (left). Black: how far theory expects a method to "
    "hold. Dashed: the default of the program, or a typical hand movement."
)
UNEXPLAINED = (
    "unexplained, unless by the limited resolution of the edges (see the caption of the table)"
)
# The most important columns first; sentences are above the tables, and in the files.
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
    """Where methods hold, degrade and fail, and how far our defaults are from the edges."""
    margins, edges = margin_table(examined), edge_table(examined)
    near = Table(
        "stability_margins",
        "How far our defaults are from the nearest edge",
        "The factor by which the nearest edge is more severe than the default; it should be "
        f"{LEAST_MARGIN:g} or more, or the exception is explained. Where no edge was found, the "
        "factor to the end of the range. Edges are located to 1/256 of their axis (1/8 in the "
        "reduced atlas) and placed on the mild side, so that factors tend to be too small.",
        margins,
        SHOWN_MARGINS,
        simulated=True,
    )
    every = Table(
        "stability_edges",
        "Every edge",
        "The value up to which each method holds and the value from which it fails (n/a: none "
        "within the range), with the edge expected by theory, whose sources are given in the "
        "file.",
        edges,
        SHOWN_EDGES,
        simulated=True,
    )
    return Section(
        "stability",
        "Where methods fail",
        (
            *_nearest(margins),
            near,
            Fold("All edges, measured and expected by theory", (every,)),
        ),
        outcomes=tuple(_outcomes(margins, edges)),
        done=tuple(f"Not in the atlas yet: {name}, {why}." for name, why in TO_COME.items()),
    )


def _nearest(margins: pd.DataFrame) -> tuple[Picture, ...]:
    if margins.empty:
        return ()
    picture = Picture(
        "stability_margins",
        "The defaults nearest to an edge",
        "The factor by which the nearest edge is more severe than the default of the program, or a "
        "typical hand movement; left of 1 the default lies beyond its edge.",
        figure_margins(margins),
        simulated=True,
    )
    return (picture,)


def _how_close(row: Mapping[Hashable, Any]) -> str:
    """How far a default is from its nearest edge, which it may be beyond."""
    if row["margin"] < 1:
        return f"is beyond its nearest edge (factor {row['margin']:.2g})"
    return f"is only a factor of {row['margin']:.3g} away from its nearest edge"


def _outcomes(margins: pd.DataFrame, edges: pd.DataFrame) -> list[Outcome]:
    enough = int(margins["enough"].sum())
    sentences = [
        f"{enough} of {len(margins)} defaults are at least a factor of {LEAST_MARGIN:g} away from "
        "the nearest edge, where a method ceases to hold."
    ] * bool(len(margins))
    sentences += [
        f"The default of {row['method']} ({row['family']}, {row['axis']}) {_how_close(row)}; "
        f"{row['exception'] or UNEXPLAINED}."
        for row in margins[~margins["enough"].astype(bool)].to_dict("records")
    ]
    factors = edges["disagreement"].to_numpy(dtype=np.float64)
    factors = factors[np.isfinite(factors) & (factors > 0)]
    if factors.size:
        off = np.exp(np.abs(np.log(factors)))
        sentences.append(
            f"Where theory predicts an edge ({counted(factors.size, 'edge')}), the measured one "
            f"deviates from it by a factor of {np.median(off):.2f} in the median and "
            f"{off.max():.2f} at worst."
        )
    return described(sentences)


def atlas_files(examined: Sequence[Examined], provenance: Mapping[str, object]) -> dict[str, bytes]:
    """The whole atlas by file name: tables, picture, and a page with all of it."""
    section = stability_section(examined)
    atlas = Picture(
        "stability",
        "Where methods hold, degrade and fail",
        ATLAS_NOTE,
        figure_atlas(examined),
        simulated=True,
    )
    png, lacking = png_of(atlas.figure, dpi=PICTURE_DPI)
    warn_of_missing_fonts(lacking)
    tables = {
        "cells.tsv": cell_table(examined),
        "edges.tsv": edge_table(examined),
        "margins.tsv": margin_table(examined),
    }
    html = _page(section, atlas, png, cells=tables["cells.tsv"], provenance=provenance)
    return {name: table_bytes(table) for name, table in tables.items()} | {
        "atlas.png": png,
        "atlas.svg": svg_of(atlas.figure)[0],
        "atlas.html": html.encode(),
    }


def _page(
    section: Section,
    atlas: Picture,
    png: bytes,
    *,
    cells: pd.DataFrame,
    provenance: Mapping[str, object],
) -> str:
    runs = Table("cells", "Every run", "All marks of the picture.", cells, SHOWN_CELLS, True)
    origin = Table(
        "provenance",
        "Provenance of this page",
        "Exact tables are in the TSV files beside it.",
        pd.DataFrame(unfolded(provenance), columns=names(PROVENANCE_COLUMNS)),
        PROVENANCE_COLUMNS,
        simulated=False,
    )
    outcomes = [outcome.sentence for outcome in section.outcomes]
    tables = (item for item in section.items if not isinstance(item, Picture))
    shown: list[Item] = [atlas, *tables, Fold("Every run", (runs,))]
    return page(
        title="Where do methods fail?",
        answer=outcomes[0] if outcomes else "No default was examined.",
        lead="Methods of modelling, rendering and analysis, from easy cases to hard ones.",
        banner=BANNER,
        sections=[
            ("overview", "At a glance", bullets([*outcomes[1:], *section.done])),
            (section.anchor, section.heading, "".join(_item_html(item, png) for item in shown)),
            ("origin", "Provenance", table_html(origin)),
        ],
    )


def _item_html(item: Item, png: bytes) -> str:
    if isinstance(item, Fold):
        return folded(item, "".join(_item_html(each, png) for each in item.items))
    return table_html(item) if isinstance(item, Table) else picture_html(item, png)
