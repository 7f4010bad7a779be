"""One self-contained report of a study, with its supplement, tables and figures beside it."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import cast

import numpy as np
import pandas as pd

from tactileq.analysis.answers.responses import Responses
from tactileq.analysis.chapters.chapter import (
    AnswerChapter,
    Answered,
    ModelChapter,
    Modelled,
    StudyChapter,
)
from tactileq.analysis.columns import tsv_text
from tactileq.analysis.labels import MODELS
from tactileq.analysis.page.page import (
    PICTURE_DPI,
    Fold,
    Item,
    Picture,
    Table,
    bullets,
    findings_html,
    folded,
    page,
    paragraph,
    picture_html,
    supplement_html,
    table_html,
    tiles,
)
from tactileq.analysis.page.provenance import provenance_table
from tactileq.analysis.page.saving import missing_fonts, png_of, svg_of
from tactileq.analysis.page.sections import Headline, Mapped, Progress, Section
from tactileq.analysis.statistics.verdicts import ClaimsBegun
from tactileq.analysis.textures.compared import Comparison, comparisons
from tactileq.analysis.textures.regressions import driving_table
from tactileq.analysis.textures.results import TextureResult
from tactileq.modeling import InputError
from tactileq.modeling.errors import counted
from tactileq.modeling.files.writing import write_text

# The chapters in the order of the page: folders of `analysis/chapters`. The generator of a report
# is passed on from each chapter to the next, so a new one goes to the end of its list.
ANSWER_CHAPTERS = (
    "claims",
    "ratings",
    "choices",
    "confusions",
    "oddity",
    "tasks",
    "single_answers",
    "speed",
    "hand",
    "reliability",
)
MODEL_CHAPTERS = (
    "models",
    "parameters",
    "planted",
)
SUPPLEMENT_NAME = "supplement.html"
# About answers and models, either of which a report may lack.
STUDY_CHAPTERS = ("paper",)
# Of the time that a report of a whole study takes.
MODELS_SHARE, PICTURES_SHARE = 0.25, 0.25
ENOUGH_PICTURES = 3  # to have other processes begin with them


def write_report(
    path: str | Path,
    *,
    responses: Responses | None = None,
    textures: Sequence[TextureResult] = (),
    benches: Sequence[Section] = (),
    provenance: Mapping[str, object] | None = None,
    title: str = "Can anybody feel the difference?",
    hand: pd.DataFrame | None = None,
    planted: Mapping[str, Mapping[str, float]] | None = None,
    seed: int = 0,
    progress: Progress | None = None,
    mapped: Mapped = map,
) -> Path:
    """Write report.html, and supplement.html, tables/ and figures/ (PNG and SVG) beside it.

    The report has a first page and a chapter for each section. What is behind them is folded in the
    report, and in the supplement, which is printed on its own.

    Parameters
    ----------
    path : str or Path
        The report's file, which is self-contained as its supplement is; folders are created as
        needed.
    responses : Responses, optional
        Answers of the study; without them the report covers the models alone.
    textures : sequence of TextureResult, optional
        Models, their simplification and, where known, the planted truth.
    benches : sequence of Section
        What was made elsewhere: results on methods rather than this study, chapters on a table.
    provenance : mapping of str to object, optional
        Versions, configuration, hashes of inputs; nested values are flattened.
    hand : DataFrame, optional
        How the hand moved with either model (`tactileq.analysis.answers.hand.load_hand`).
    planted : mapping of texture to mapping of measure to points, optional
        Differences that simulated participants were given (`verdicts.planted_verdicts`).
    seed : int
        Seeds the bootstrap and the draws behind the expected GFCs; shown with the provenance.
    progress : callable, optional
        Called with the share done (0–1) and what comes next.
    mapped : callable
        How textures and pictures are gone through: `map`, or one that uses several processes. It
        changes no result.

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
    report_progress = progress or (lambda share, what: None)
    rng = np.random.default_rng(seed)
    if responses is not None:
        responses = _with_identical(responses, textures)
    # Begun first: other processes compare models, sample and draw while this one goes on, with the
    # chapters on models, as the samplers take longest.
    streams = rng.spawn(len(textures))
    compared = comparisons(textures, streams, mapped=mapped)
    claims = None if responses is None else ClaimsBegun.of(responses, rng=rng, mapped=mapped)
    drawing = _Drawing(mapped)
    drawing.begin(benches)
    on_models: list[Section] = []
    sections: list[Section] = []
    answered, modelled = None, None
    if textures:
        modelled = _modelled(textures, compared, progress=report_progress)
        for name in MODEL_CHAPTERS:
            report_progress(MODELS_SHARE, f"chapter on {name}")
            on_models += drawing.begin(cast(ModelChapter, _sections_of(name))(modelled))
    if responses is not None and claims is not None:
        report_progress(MODELS_SHARE, "testing the claims")
        answered = Answered(
            responses=responses,
            found=claims.found(),
            rng=rng,
            seed=seed,
            hand=hand,
            planted=planted,
        )
        for number, name in enumerate(ANSWER_CHAPTERS):
            done = 0.5 + 0.5 * number / len(ANSWER_CHAPTERS)  # half of it for the claims
            share = MODELS_SHARE + (1 - PICTURES_SHARE - MODELS_SHARE) * done
            report_progress(share, f"chapter on {name.replace('_', ' ')}")
            sections += drawing.begin(cast(AnswerChapter, _sections_of(name))(answered))
    sections += on_models
    for name in STUDY_CHAPTERS:
        sections += drawing.begin(cast(StudyChapter, _sections_of(name))(answered, modelled))
    sections += benches
    if not any(section.items for section in sections):
        raise InputError(
            "expected answers or models to report on, got neither; run a session or fit a model."
        )
    _write_pages(
        target,
        sections,
        drawing,
        title=title,
        banner=_banner(responses, textures),
        real=_real(responses, textures),
        verified=() if responses is None else responses.verified,
        facts={**(provenance or {}), "seed of this report": seed},
        progress=report_progress,
    )
    report_progress(1.0, "done")
    return target


def _write_pages(
    target: Path,
    sections: Sequence[Section],
    drawing: _Drawing,
    *,
    title: str,
    banner: str,
    real: Sequence[str],
    verified: Sequence[str],
    facts: Mapping[str, object],
    progress: Progress,
) -> None:
    """The report and its supplement, once all pictures are drawn; tables and figures beside."""
    files = _Files(target.parent)
    for share, picture, (formats, lacking) in drawing.drawn():
        progress(1 - PICTURES_SHARE * (1 - share), f"drawing {picture.title}")
        files.add_picture(picture, formats, lacking=lacking)
    undrawn = missing_fonts("".join(sorted(files.lacking)))
    headline = next((s.headline for s in sections if s.headline), Headline(""))
    chapters = [_Chapter.of(section, files) for section in sections if section.items]
    chapters.append(_origin(sections, facts, files=files, undrawn=undrawn))
    overview = (
        "overview",
        "At a glance",
        _overview(sections, files, real=real),
    )
    html = page(
        title=title,
        answer=headline.subject,
        points=headline.points,
        lead=" ".join(filter(None, [headline.lead, *(f"{line}." for line in verified)])),
        banner=banner,
        sections=[overview, *(chapter.whole() for chapter in chapters)],
        kind="report",
    )
    behind = page(
        title=f"Supplement: {title}",
        answer="Tables and pictures behind the chapters of the report.",
        lead="",
        banner=banner,
        sections=[(c.anchor, c.heading, c.supplement) for c in chapters if c.supplement],
    )
    write_text(target, html)
    write_text(target.with_name(SUPPLEMENT_NAME), behind)
    if undrawn:
        warnings.warn(undrawn, stacklevel=3)


def _sections_of(name: str) -> object:
    """The function `sections` of a chapter."""
    return import_module(f"tactileq.analysis.chapters.{name}.section").sections


@dataclass(frozen=True)
class _Chapter:
    """A chapter of the page; `opening` and `supplement` are HTML."""

    anchor: str
    heading: str
    opening: str
    supplement: str
    behind: str  # what the supplement holds

    @classmethod
    def of(cls, section: Section, files: _Files) -> _Chapter:
        """A section whose pictures were added to the files; its tables are written."""
        opening = [section.opening] if section.opening else []
        html = findings_html(section.findings) if section.findings else ""
        return cls(
            section.anchor,
            section.heading,
            opening=html + files.html(opening),
            supplement=files.html(section.supplement),
            behind=_counted(section.supplement),
        )

    def whole(self) -> tuple[str, str, str]:
        """As the report shows it, the supplement folded."""
        folded_in = supplement_html(f"Supplement: {self.behind}", self.supplement)
        return self.anchor, self.heading, self.opening + folded_in * bool(self.supplement)


def _counted(items: Sequence[Item]) -> str:
    """How many tables and pictures there are: `3 tables, 1 picture`."""
    pictures = len(_pictures(items))
    singles = [
        each for item in items for each in (item.items if isinstance(item, Fold) else [item])
    ]
    tables = len(singles) - pictures
    found = ((tables, "table"), (pictures, "picture"))
    return ", ".join(counted(number, noun) for number, noun in found if number)


def _origin(
    sections: Sequence[Section], facts: Mapping[str, object], *, files: _Files, undrawn: str
) -> _Chapter:
    """What was done, the methods for a paper, and the provenance."""
    done = list(dict.fromkeys(sentence for section in sections for sentence in section.done))
    done += [f"While drawing the figures: {undrawn}"] * bool(undrawn)
    methods = "".join(
        paragraph("Statistical methods, for a paper", section.methods)
        for section in sections
        if section.methods
    )
    provenance = provenance_table(facts)
    return _Chapter(
        "origin",
        "Methods and provenance",
        opening="<h3>What was done</h3>" + bullets(done),
        supplement=methods + files.html([provenance]),
        behind="statistical methods, for a paper; " * bool(methods) + _counted([provenance]),
    )


def _modelled(
    textures: Sequence[TextureResult], compared: Iterable[Comparison], *, progress: Progress
) -> Modelled:
    """The models, compared one by one, which takes its time."""
    gfc, driven = [], []
    for number, (result, comparison) in enumerate(zip(textures, compared, strict=True)):
        progress(MODELS_SHARE * number / len(textures), f"comparing models of {result.texture}")
        gfc.append(comparison.gfc)
        driven.append(comparison.driven)
    progress(MODELS_SHARE, "regressing parameters on speed and force")
    return Modelled(
        textures=textures, gfc=pd.concat(gfc, ignore_index=True), driving=driving_table(driven)
    )


def _with_identical(responses: Responses, textures: Sequence[TextureResult]) -> Responses:
    """The answers, with what the models themselves say of being identical."""
    equal = {texture: list(groups) for texture, groups in responses.equal.items()}
    for result in textures:
        if result.simplification.identical:
            equal.setdefault(result.texture, []).append(MODELS)
    return replace(responses, equal=equal)


def _overview(sections: Sequence[Section], files: _Files, *, real: Sequence[str]) -> str:
    """The first page below its answer: who, pictures, and what bears on the answer."""
    # An unfinished task is reported in its own section and in the one on the verdicts.
    tiles_once = list(dict.fromkeys(tile for section in sections for tile in section.tiles))
    verified = [sentence for section in sections for sentence in section.verified]
    verified += [f"Real: {', '.join(real)}."] * bool(real)
    warned = [sentence for section in sections for sentence in section.cautions]
    caution = f'<div class="caution"><h3>What must not be concluded</h3>{bullets(warned)}</div>'
    below = {
        "Exclusions, and deviations from the plan": [
            sentence for section in sections for sentence in section.deviations
        ],
        "Reliability": [sentence for section in sections for sentence in section.reliability],
        "What was verified": verified,
    }
    columns = "".join(
        f"<div><h3>{heading}</h3>{bullets(sentences)}</div>"
        for heading, sentences in below.items()
        if sentences
    )
    return (
        tiles(tiles_once)
        + files.html([picture for section in sections for picture in section.front])
        + f'<div class="front">{columns}{caution * bool(warned)}</div>'
    )


def _real(responses: Responses | None, textures: Sequence[TextureResult]) -> list[str]:
    """What is not simulated."""
    found = []
    if responses is not None:
        found += ["people"] * (not responses.simulated_participants)
        found += ["rig"] * (not responses.simulated_rig)
    return found + ["recordings"] * bool(textures and not any(r.simulated for r in textures))


def _banner(responses: Responses | None, textures: Sequence[TextureResult]) -> str:
    reasons = []
    simulated = [result.simulated for result in textures]
    if any(simulated):
        whose = "" if all(simulated) else f" of {sum(simulated)} of {len(simulated)} textures"
        reasons.append(f"the recordings{whose} are not of real surfaces")
    if responses is not None and responses.simulated_participants:
        reasons.append("no person took part")
    elif responses is not None and responses.simulated_rig:
        reasons.append("people took part, but with a simulated rig, so nobody felt a real surface")
    banner = [f"SIMULATED: {'; '.join(reasons)}."] if reasons else []
    if responses is not None and responses.unverified:
        banner.append(
            f"NOT VERIFIED: answers differ from what sessions stored ({responses.unverified})."
        )
    return " ".join(banner)


def _pictures(items: Sequence[Item]) -> list[Picture]:
    """All pictures among the items, folded ones too, in order."""
    found = []
    for item in items:
        if isinstance(item, Fold):
            found += _pictures(item.items)
        elif isinstance(item, Picture):
            found.append(item)
    return found


def _drawn(picture: Picture) -> tuple[dict[str, bytes], str]:
    """The picture by the endings of its files, and the characters that no font here has."""
    png, lacking = png_of(picture.figure, dpi=PICTURE_DPI)
    return {"png": png, "svg": svg_of(picture.figure)[0]}, lacking


class _Drawing:
    """Pictures that other processes draw while this one goes on."""

    def __init__(self, mapped: Mapped) -> None:
        self._mapped = mapped
        self._waiting: list[Picture] = []
        self._begun: list[tuple[list[Picture], Iterable[tuple[dict[str, bytes], str]]]] = []

    def begin(self, sections: Sequence[Section]) -> Sequence[Section]:
        """Draw their pictures, as soon as there are enough; the same sections."""
        self._waiting += _pictures([item for s in sections for item in (*s.front, *s.items)])
        if len(self._waiting) >= ENOUGH_PICTURES:
            self._draw()
        return sections

    def drawn(self) -> Iterator[tuple[float, Picture, tuple[dict[str, bytes], str]]]:
        """The share of all that is done, each picture, and what `_drawn` says of it."""
        self._draw()
        number, count = 0, sum(len(pictures) for pictures, _ in self._begun)
        for pictures, drawn in self._begun:
            for picture, found in zip(pictures, drawn, strict=True):
                number += 1
                yield number / count, picture, found

    def _draw(self) -> None:
        pictures, self._waiting = self._waiting, []
        self._begun.append((pictures, self._mapped(_drawn, pictures)))


class _Files:
    """The folder beside the report, and what none of its pictures could draw."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.lacking: set[str] = set()
        self.pictures: dict[str, bytes] = {}

    def add_picture(self, picture: Picture, formats: Mapping[str, bytes], *, lacking: str) -> None:
        """Write a picture's files; `html` will show the PNG."""
        folder = self.folder / "figures"
        folder.mkdir(parents=True, exist_ok=True)
        for ending, data in formats.items():
            (folder / f"{picture.name}.{ending}").write_bytes(data)
        self.pictures[picture.name] = formats["png"]
        self.lacking.update(lacking)

    def html(self, items: Sequence[Item]) -> str:
        """The items as HTML, pictures as added; their tables are written to the folder as well."""
        return "".join(self._item_html(item) for item in items)

    def _item_html(self, item: Item) -> str:
        if isinstance(item, Fold):
            return folded(item, self.html(item.items))
        if isinstance(item, Table):
            _save_table(item, self.folder / "tables")
            return table_html(item)
        return picture_html(item, self.pictures[item.name])


def _save_table(table: Table, folder: Path) -> None:
    marked = table.frame.assign(simulated=str(table.simulated).lower())
    write_text(folder / f"{table.name}.tsv", tsv_text(marked))
