"""The findings of the paper by texture and by what came out here."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill

from matplotlib.figure import Figure

from tactileq.analysis.chapters.paper.findings import (
    CONTRADICTED,
    NOT_COMPARABLE,
    OPEN,
    PAPER_TEXTURES,
    REPLICATED,
    PaperFinding,
)
from tactileq.analysis.page.drawing import BLACK, BLUE, GREY, ORANGE, VERMILLION

# Distinguished by shape as well as by colour.
MARKS = {
    REPLICATED: ("o", BLUE),
    CONTRADICTED: ("X", VERMILLION),
    OPEN: ("^", ORANGE),
    NOT_COMPARABLE: ("_", GREY),
}
WORD_WIDTH, HEADING_WIDTH = 15, 14  # characters
COLUMN_IN, ROW_IN = 1.15, 0.62


def figure_findings(findings: Sequence[PaperFinding], *, simulated: bool) -> Figure:
    """A row per texture, a column per kind of finding; below each mark what the paper says.

    Parameters
    ----------
    findings : sequence of PaperFinding
        At least one.
    simulated : bool
        Written into the figure.
    """
    kinds = list(dict.fromkeys(one.kind for one in findings))
    present = {one.texture for one in findings}
    rows = [texture for texture in PAPER_TEXTURES if texture in present]
    size = (1.4 + COLUMN_IN * len(kinds), 1.5 + ROW_IN * len(rows))
    figure = Figure(figsize=size, layout="constrained")
    ax = figure.subplots()
    for outcome, (mark, colour) in MARKS.items():
        places = [
            (kinds.index(one.kind), rows.index(one.texture))
            for one in findings
            if one.outcome == outcome
        ]
        if places:
            ax.plot(
                *zip(*places, strict=True), mark, color=colour, ms=10, mew=2, ls="", label=outcome
            )
    for one in findings:
        place = (kinds.index(one.kind), rows.index(one.texture) + 0.24)
        ax.text(*place, fill(one.said, WORD_WIDTH), fontsize=6, ha="center", va="top", color=BLACK)
    where = {one.kind: one.where for one in findings}
    labels = [f"{fill(kind, HEADING_WIDTH)}\n({where[kind]})" for kind in kinds]
    ax.set_xticks(range(len(kinds)), labels, fontsize=8)
    ax.xaxis.tick_top()
    ax.set_yticks(range(len(rows)), rows)
    ax.set_xlim(-0.6, len(kinds) - 0.4)
    ax.set_ylim(len(rows) - 0.2, -0.5)
    ax.tick_params(length=0)
    ax.spines[:].set_visible(False)
    ax.hlines(
        [row + 0.75 for row in range(len(rows) - 1)], -0.6, len(kinds) - 0.4, color=GREY, lw=0.3
    )
    figure.legend(loc="outside lower center", ncols=len(MARKS), frameon=False, fontsize=9)
    if simulated:
        figure.text(
            0.99, 0.01, "SIMULATED", ha="right", color=VERMILLION, weight="bold", fontsize=9
        )
    return figure
