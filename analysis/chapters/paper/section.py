"""The chapter on the paper: its findings beside ours.

docs/paper.md
"""

from __future__ import annotations

from math import isfinite

from tactileq.analysis.chapters.chapter import Answered, Modelled
from tactileq.analysis.chapters.paper.figure import figure_findings
from tactileq.analysis.chapters.paper.findings import (
    CONTRADICTED,
    FINDING_COLUMNS,
    PaperFinding,
    finding_table,
    in_words,
    of_answers,
    of_models,
)
from tactileq.analysis.page.outcomes import described
from tactileq.analysis.page.page import Picture, Table
from tactileq.analysis.page.sections import Section
from tactileq.analysis.textures.regressions import centroid_table

LEFT_OPEN = (
    " Last column: the smallest difference that a paired t-test with as many participants as the "
    "paper had (20 for ratings, 24 for choices) finds with a probability of 80%, given the spread "
    "of our participants: where the paper found no difference, its test leaves smaller ones open. "
    "The paper's own spread is not published."
)


def sections(answered: Answered | None, modelled: Modelled | None) -> list[Section]:
    """A section, where a texture of the paper was judged or modelled."""
    findings: list[PaperFinding] = []
    simulated = False
    if answered is not None:
        findings += of_answers(answered.judged, answered.responses.answers)
        simulated |= bool(findings) and answered.responses.simulated
    if modelled is not None:
        models = [result.model for result in modelled.textures]
        own = of_models(centroid_table(models), modelled.gfc)
        findings += own
        simulated |= bool(own) and modelled.simulated
    return [paper_section(findings, simulated=simulated)] if findings else []


def paper_section(findings: list[PaperFinding], *, simulated: bool) -> Section:
    """The findings of the paper, replicated, contradicted or open."""
    picture = Picture(
        "paper",
        "The paper beside ours",
        "Each mark is what our result says of a finding of the paper; below it, what the paper "
        "says of that texture. Replicated: our 95% interval lies wholly on the paper's side, or "
        "equality was shown where the paper found no difference. Contradicted: it lies wholly on "
        "the other side, or equality was shown where the paper found a difference. Open: neither.",
        figure_findings(findings, simulated=simulated),
        simulated,
    )
    frame = finding_table(findings)
    table = Table(
        "paper",
        "Findings of the paper and ours",
        "Intervals: Student's t over participants, not corrected for their number, as in the "
        f"paper; of correlations Fisher's z.{LEFT_OPEN * bool(frame['left_open'].notna().any())}",
        frame,
        FINDING_COLUMNS,
        simulated,
    )
    against = [
        f"Contradicted: {one.texture}, {one.kind} ({one.where}: {one.said}; here {_value(one)})."
        for one in findings
        if one.outcome == CONTRADICTED
    ]
    return Section(
        "paper",
        "The paper beside ours",
        (picture, table),
        answer=in_words(findings, simulated=simulated),
        outcomes=tuple(described(against)),
    )


def _value(one: PaperFinding) -> str:
    text = f"{one.ours:.3g}"
    if isfinite(one.low):
        text += f", 95% CI {one.low:.3g} to {one.high:.3g}"
    return f"{text} {one.unit}".replace("-", "−")
