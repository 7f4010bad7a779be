"""One self-contained report of a study, with its tables and figures beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from analysis.answers.loading import Responses
from analysis.columns import Column, names
from analysis.report.page import (
    Fold,
    Item,
    Table,
    bullets,
    folded,
    page,
    picture_html,
    picture_png,
    table_html,
    tiles,
)
from analysis.report.section_answers import choice_section, rating_section
from analysis.report.section_models import model_section
from analysis.report.section_parameters import parameter_section
from analysis.report.section_planted import planted_section
from analysis.report.sections import Progress, Section
from analysis.report.sentences import cautions
from analysis.textures.results import TextureResult
from modeling import InputError
from modeling.files.writing import write_text

MODELS_SHARE = 0.35  # of the time that a report of a whole study takes
PARAMETERS_SHARE = 0.3
PROVENANCE_COLUMNS = (Column("what"), Column("value"))


def write_report(
    path: str | Path,
    *,
    responses: Responses | None = None,
    textures: Sequence[TextureResult] = (),
    provenance: Mapping[str, str] | None = None,
    title: str = "Can anybody feel the difference?",
    seed: int = 0,
    progress: Progress | None = None,
) -> Path:
    """Write report.html, and tables/*.tsv and figures/*.png beside it.

    Parameters
    ----------
    path : str or Path
        The report's file; folders are made as needed. The file needs nothing but itself.
    responses : Responses, optional
        Answers of the study; without them the report is on the models alone.
    textures : sequence of TextureResult, optional
        Models, their simplification and, where known, the planted truth.
    provenance : mapping of str to str, optional
        Versions, configuration, hashes of inputs; shown as they are.
    title : str
    seed : int
        Of the bootstrap and of the draws behind the expected GFCs; shown with the provenance.
    progress : callable, optional
        Called with the share done (0–1) and what comes next.

    Returns
    -------
    Path
        The report's file.

    Raises
    ------
    InputError
        Where there is nothing to report.
    """
    target = Path(path)
    tell = progress or (lambda share, what: None)
    rng = np.random.default_rng(seed)
    sections = _sections(responses, textures, rng=rng, tell=tell)
    if not sections:
        raise InputError(
            "expected answers or models to report on, got neither; run a session or fit a model."
        )
    tell(0.8, "writing the report")
    facts = {**(provenance or {}), "seed of this report": str(seed)}
    parts = [
        ("overview", "At a glance", _overview(sections, responses, models=bool(textures))),
        *((s.anchor, s.heading, _section_html(s, folder=target.parent)) for s in sections),
        ("origin", "Provenance", _item_html(_provenance(facts), folder=target.parent)),
    ]
    html = page(
        title=title,
        lead="Surfaces recorded, modelled, simplified by what can be felt, and judged.",
        banner=_banner(responses, textures),
        sections=parts,
    )
    write_text(target, html)
    tell(1.0, "done")
    return target


def _sections(
    responses: Responses | None,
    textures: Sequence[TextureResult],
    *,
    rng: np.random.Generator,
    tell: Progress,
) -> list[Section]:
    sections = []
    if textures:

        def tell_models(share: float, what: str) -> None:
            tell(MODELS_SHARE * share, what)

        def tell_parameters(share: float, what: str) -> None:
            tell(MODELS_SHARE + PARAMETERS_SHARE * share, what)

        sections.append(model_section(textures, rng=rng, progress=tell_models))
        sections.append(parameter_section(textures, rng=rng, progress=tell_parameters))
    if responses is not None:
        tell(MODELS_SHARE + PARAMETERS_SHARE, "analysing answers")
        if not responses.absolute.empty:
            sections.append(rating_section(responses))
        if not responses.relative.empty:
            sections.append(choice_section(responses, rng=rng))
    planted = [result for result in textures if result.truth is not None]
    if planted:
        sections.append(planted_section(planted))
    return sections


def _overview(sections: Sequence[Section], responses: Responses | None, *, models: bool) -> str:
    warned = cautions(
        [section.tests for section in sections if section.tests is not None],
        simulated_participants=responses is not None and responses.simulated_participants,
        simulated_rig=responses is not None and responses.simulated_rig,
        models=models,
    )
    warnings = responses.warnings if responses is not None else ()
    done = [sentence for section in sections for sentence in section.done]
    done += [f"On reading the answers: {warning}" for warning in warnings]
    return (
        tiles([tile for section in sections for tile in section.tiles])
        + "<h3>What came out</h3>"
        + bullets([sentence for section in sections for sentence in section.outcomes])
        + '<div class="caution"><h3>What may not be concluded</h3>'
        + bullets(warned)
        + "</div><h3>What was done</h3>"
        + bullets(done)
    )


def _banner(responses: Responses | None, textures: Sequence[TextureResult]) -> str:
    reasons = []
    simulated = [result.simulated for result in textures]
    if any(simulated):
        whose = "" if all(simulated) else f" of {sum(simulated)} of {len(simulated)} textures"
        reasons.append(f"the recordings{whose} come from no real surface")
    if responses is not None and responses.simulated_participants:
        reasons.append("no person took part")
    elif responses is not None and responses.simulated_rig:
        reasons.append("people took part, but at a simulated rig, where nobody felt a real surface")
    return f"SIMULATED: {'; '.join(reasons)}." if reasons else ""


def _provenance(facts: Mapping[str, str]) -> Table:
    return Table(
        "provenance",
        "Where this report comes from",
        "Exact tables are in tables/*.tsv, pictures in figures/*.png beside this file.",
        pd.DataFrame([*facts.items()], columns=names(PROVENANCE_COLUMNS)),
        PROVENANCE_COLUMNS,
        simulated=False,
    )


def _section_html(section: Section, *, folder: Path) -> str:
    return "".join(_item_html(item, folder=folder) for item in section.items)


def _item_html(item: Item, *, folder: Path) -> str:
    """The item as HTML; its table or picture is written to the folder as well."""
    if isinstance(item, Fold):
        content = "".join(_item_html(inner, folder=folder) for inner in item.items)
        return folded(item, content)
    if isinstance(item, Table):
        _save_table(item, folder / "tables")
        return table_html(item)
    png = picture_png(item.figure)
    target = folder / "figures" / f"{item.name}.png"
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_bytes(png)
    return picture_html(item, png)


def _save_table(table: Table, folder: Path) -> None:
    marked = table.frame.assign(simulated=str(table.simulated).lower())
    text = marked.to_csv(sep="\t", index=False, na_rep="n/a", lineterminator="\n")
    write_text(folder / f"{table.name}.tsv", text)
