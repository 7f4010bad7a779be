"""One self-contained report of a study, with its tables and figures beside it."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from analysis.answers.responses import Responses
from analysis.columns import tsv_text
from analysis.labels import MODELS
from analysis.page.outcomes import by_weight
from analysis.page.page import (
    PICTURE_DPI,
    Fold,
    Item,
    Picture,
    Table,
    bullets,
    folded,
    grouped,
    page,
    paragraph,
    picture_html,
    table_html,
    tiles,
)
from analysis.page.provenance import provenance_table
from analysis.page.saving import missing_fonts, png_of, svg_of
from analysis.page.sections import Progress, Section, of_pairs
from analysis.report.answer import answer, unfinished_tasks
from analysis.report.people_sentences import FEEL_IT
from analysis.report.plan_sentences import deviations, methods_paragraph
from analysis.report.section_answers import choice_section, rating_section, verdict_section
from analysis.report.section_confusions import confusion_section
from analysis.report.section_hand import hand_section
from analysis.report.section_mixed import mixed_section
from analysis.report.section_models import model_section
from analysis.report.section_oddity import oddity_section
from analysis.report.section_parameters import parameter_section
from analysis.report.section_planted import planted_section
from analysis.report.section_reliability import reliability_section
from analysis.report.section_speed_accuracy import speed_accuracy_section
from analysis.report.section_task import task_section, tasks_without_chapter
from analysis.report.sentences import cautions
from analysis.statistics.draws import generators
from analysis.statistics.equivalence import INCONCLUSIVE
from analysis.statistics.verdicts import ClaimFound, chance_of, claims_found, models_of
from analysis.textures.compared import Comparison, Mapped, comparisons
from analysis.textures.regressions import driving_table
from analysis.textures.results import TextureResult
from modeling import InputError
from modeling.files.answer_tables import ANSWER_TABLES
from modeling.files.writing import write_text

LEAD = "Surfaces recorded, modelled, simplified by detection thresholds, and judged."
MODELS_SHARE = 0.4  # of the time that a report of a whole study takes
PICTURES_SHARE = 0.4


def write_report(
    path: str | Path,
    *,
    responses: Responses | None = None,
    textures: Sequence[TextureResult] = (),
    benches: Sequence[Section] = (),
    provenance: Mapping[str, object] | None = None,
    title: str = "Can anybody feel the difference?",
    answered: str = "",
    hand: pd.DataFrame | None = None,
    planted: Mapping[str, Mapping[str, float]] | None = None,
    seed: int = 0,
    progress: Progress | None = None,
    mapped: Mapped = map,
) -> Path:
    """Write report.html, and tables/*.tsv, figures/*.png and figures/*.svg beside it.

    Parameters
    ----------
    path : str or Path
        The report's file, which is self-contained; folders are created as needed.
    responses : Responses, optional
        Answers of the study; without them the report covers the models alone.
    textures : sequence of TextureResult, optional
        Models, their simplification and, where known, the planted truth.
    benches : sequence of Section
        Results on methods rather than this study: speed against accuracy, where methods fail.
    provenance : mapping of str to object, optional
        Versions, configuration, hashes of inputs; nested values are flattened.
    title : str
    answered : str
        The sentence at the top where `benches` contain the answers; otherwise computed from
        `responses`.
    hand : DataFrame, optional
        How the hand moved with either model (`analysis.answers.hand.load_hand`).
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
    # Begun first: other processes compare models while this one analyses answers.
    compared = comparisons(textures, rng=rng, mapped=mapped) if textures else ()
    report_progress(0.0, "analysing answers")
    found = [] if responses is None else claims_found(responses, rng=rng)
    people = []
    if responses is not None:
        people = _answer_sections(responses, found, hand=hand, planted=planted, rng=rng)
    models = _model_sections(textures, compared, people=people, progress=report_progress)
    sections = [*models, *benches]
    if not sections:
        raise InputError(
            "expected answers or models to report on, got neither; run a session or fit a model."
        )
    pictures = _pictures([item for section in sections for item in section.items])
    drawn = mapped(_drawn, pictures)
    facts = {**(provenance or {}), "seed of this report": seed}
    files = _Files(target.parent)
    for number, (picture, (formats, lacking)) in enumerate(zip(pictures, drawn, strict=True)):
        share = 1 - PICTURES_SHARE * (1 - number / len(pictures))
        report_progress(share, f"drawing {picture.title}")
        files.add_picture(picture, formats, lacking=lacking)
    shown = [(s.anchor, s.heading, files.html(s.items)) for s in sections]
    undrawn = missing_fonts("".join(sorted(files.lacking)))
    overview = _overview(sections, responses, found=found, models=bool(textures), undrawn=undrawn)
    methods = ""
    judged = [one for one in found if not one.standing.unfinished]
    if responses is not None and judged:
        text = methods_paragraph(responses, judged)
        methods = paragraph("Statistical methods, for a paper", text)
    html = page(
        title=title,
        answer=answered or answer(found, responses),
        lead="" if answered else _lead(found),
        banner=_banner(responses, textures),
        sections=[
            ("overview", "At a glance", overview),
            *shown,
            ("origin", "Methods and provenance", methods + files.html([provenance_table(facts)])),
        ],
    )
    write_text(target, html)
    if undrawn:
        warnings.warn(undrawn, stacklevel=2)
    report_progress(1.0, "done")
    return target


def _lead(found: Sequence[ClaimFound]) -> str:
    """What stands below the answer: what its words mean, where it is about people."""
    return f"{FEEL_IT} {LEAD}" if any(one.people is not None for one in found) else LEAD


def _model_sections(
    textures: Sequence[TextureResult],
    compared: Iterable[Comparison],
    *,
    people: Sequence[Section],
    progress: Progress,
) -> list[Section]:
    """The sections on models, where there are some, around those on the answers."""
    if not textures:
        return list(people)
    gfc, driven = [], []
    before = 1 - PICTURES_SHARE - MODELS_SHARE
    for number, (result, comparison) in enumerate(zip(textures, compared, strict=True)):
        share = before + MODELS_SHARE * number / len(textures)
        progress(share, f"comparing models of {result.texture}")
        gfc.append(comparison.gfc)
        driven.append(comparison.driven)
    progress(1 - PICTURES_SHARE, "regressing parameters on speed and force")
    models = model_section(textures, pd.concat(gfc, ignore_index=True))
    parameters = parameter_section(textures, driving_table(driven))
    truths = [result for result in textures if result.truth is not None]
    return [models, parameters, *people, *([planted_section(truths)] if truths else [])]


def _with_identical(responses: Responses, textures: Sequence[TextureResult]) -> Responses:
    """The answers, with what the models themselves say of being identical."""
    equal = {texture: list(groups) for texture, groups in responses.equal.items()}
    for result in textures:
        if result.simplification.identical:
            equal.setdefault(result.texture, []).append(MODELS)
    return replace(responses, equal=equal)


def _answer_sections(
    responses: Responses,
    found: Sequence[ClaimFound],
    *,
    hand: pd.DataFrame | None,
    planted: Mapping[str, Mapping[str, float]] | None,
    rng: np.random.Generator,
) -> list[Section]:
    """The answers, and how reliable they are.

    Models are not compared by answers of an unfinished task.
    """
    shown = [one for one in found if len(one.tests)]
    others = tasks_without_chapter(responses)
    if not shown and not others:
        return []
    simulated = responses.simulated
    sections: list[Section | None] = []
    if shown:
        sections.append(verdict_section(responses, shown, planted=planted))
    judged = [one for one in shown if not one.standing.unfinished]
    finished = {t: own for t, own in responses.answers.items() if t not in responses.unfinished}
    by_task = {task: [one for one in judged if one.claim.task == task] for task in finished}
    if by_task.get("absolute"):
        sections.append(rating_section(responses, by_task["absolute"]))
    if by_task.get("relative"):
        sections.append(choice_section(responses, by_task["relative"], rng=rng))
        models = models_of(responses, "relative")
        confused = confusion_section(responses.relative, models, simulated=simulated, rng=rng)
        sections.append(confused)
    sections.append(oddity_section(judged, simulated=simulated))
    draws = generators(rng)
    for task in others:
        sections.append(task_section(responses, task, by_task.get(task, ()), rng=draws[task]))
    sections.append(mixed_section(responses, judged, rng=rng))
    # Task by task, so that a further task does not change the results of earlier ones.
    pairs = list(dict.fromkeys(one.claim.models for own in by_task.values() for one in own))
    speeds, hands = {}, {}
    for pair in pairs:
        same = list(responses.identical(pair))
        different = {task: t[~t["texture"].isin(same)] for task, t in finished.items()}
        speeds[pair] = speed_accuracy_section(different, models=pair, simulated=simulated, rng=rng)
        if hand is not None:
            moved = hand[~hand["texture"].isin(same) & hand["task"].isin(list(finished))]
            hands[pair] = hand_section(moved, models=pair, simulated=simulated, rng=rng)
    sections.append(of_pairs(speeds))
    asked = {*(one.claim.task for one in shown), *others}
    tasks = {task: answers for task, answers in responses.answers.items() if task in asked}
    sections.append(
        # Whether somebody answers at chance is tested on the share of right answers: an effect.
        reliability_section(
            tasks,
            chances=_chances({task: t for task, t in tasks.items() if task in finished}),
            simulated=simulated,
            rng=rng,
        )
    )
    sections.append(of_pairs(hands))
    return [section for section in sections if section is not None]


def _chances(tasks: Mapping[str, pd.DataFrame]) -> dict[str, float]:
    """Rates of guessing participants in the tasks with right answers."""
    chances = {
        task: chance_of(task, answers)
        for task, answers in tasks.items()
        if "correct" in ANSWER_TABLES[task].measures and len(answers)
    }
    return {task: chance for task, chance in chances.items() if not np.isnan(chance)}


def _overview(
    sections: Sequence[Section],
    responses: Responses | None,
    *,
    found: Sequence[ClaimFound],
    models: bool,
    undrawn: str,
) -> str:
    verdicts = pd.concat([one.tests["verdict"] for one in found]) if found else pd.Series()
    warned = cautions(
        simulated_participants=responses is not None and responses.simulated_participants,
        simulated_rig=responses is not None and responses.simulated_rig,
        models=models,
        inconclusive=bool((verdicts == INCONCLUSIVE).any()),
        unfinished=[] if responses is None else unfinished_tasks(responses),
    )
    outcomes = [outcome for section in sections for outcome in section.outcomes]
    # An unfinished task is reported in its own section and in the one on the verdicts.
    tiles_once = list(dict.fromkeys(tile for section in sections for tile in section.tiles))
    done = list(dict.fromkeys(sentence for section in sections for sentence in section.done))
    done += [f"While drawing the figures: {undrawn}"] * bool(undrawn)
    otherwise = [] if responses is None else deviations(responses, found)
    planned = "<h3>Exclusions, and deviations from the plan</h3>" + bullets(otherwise)
    return (
        tiles(tiles_once)
        + "<h3>Findings</h3>"
        + grouped(by_weight(outcomes))
        + '<div class="caution"><h3>What must not be concluded</h3>'
        + bullets(warned)
        + "</div>"
        + planned * bool(otherwise)
        + "<h3>What was done</h3>"
        + bullets(done)
    )


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
    return f"SIMULATED: {'; '.join(reasons)}." if reasons else ""


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
