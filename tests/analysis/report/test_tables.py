"""The report's tables: declared where they are computed, and the page knows none of them."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import tactileq.analysis.page.page
from tactileq.analysis.answers.hand import HAND_TABLE_COLUMNS
from tactileq.analysis.answers.responses import Responses
from tactileq.analysis.chapters.chapter import Stream
from tactileq.analysis.chapters.choices import section as choices_chapter
from tactileq.analysis.chapters.claims import section as claims
from tactileq.analysis.chapters.claims.people import PRIORS_COLUMNS
from tactileq.analysis.chapters.claims.section import IN_SHORT_COLUMNS, IN_WORDS_COLUMNS
from tactileq.analysis.chapters.confusions import section as confusions
from tactileq.analysis.chapters.confusions.buttons import BUTTON_COLUMNS
from tactileq.analysis.chapters.confusions.section import (
    BIAS_COLUMNS,
    CHANGE_COLUMNS,
    CHOICE_FIT_COLUMNS,
    INFORMATION_COLUMNS,
    SIMILARITY_COLUMNS,
)
from tactileq.analysis.chapters.hand.statistics import HAND_TEST_COLUMNS
from tactileq.analysis.chapters.models.section import model_section
from tactileq.analysis.chapters.oddity.section import ODDITY_COLUMNS, oddity_section
from tactileq.analysis.chapters.paper.findings import FINDING_COLUMNS, of_answers
from tactileq.analysis.chapters.paper.section import paper_section
from tactileq.analysis.chapters.parameters.section import parameter_section
from tactileq.analysis.chapters.planted.section import planted_section
from tactileq.analysis.chapters.ratings import section as ratings_chapter
from tactileq.analysis.chapters.reliability.section import CARELESS_COLUMNS, reliability_section
from tactileq.analysis.chapters.reliability.statistics import AGREEMENT_COLUMNS, RATER_COLUMNS
from tactileq.analysis.chapters.single_answers.section import (
    CLAIM_GEE_COLUMNS,
    CLAIM_MIXED_COLUMNS,
    mixed_section,
)
from tactileq.analysis.chapters.speed.comparison import RIGHT_WRONG_COLUMNS, TIME_RATIO_COLUMNS
from tactileq.analysis.chapters.speed.comparison import SPEED_COMPARISON_COLUMNS as SPEED_COLUMNS
from tactileq.analysis.chapters.speed.scores import (
    CONDITIONAL_COLUMNS,
    SCORE_COLUMNS,
    TEXTURE_TIME_COLUMNS,
)
from tactileq.analysis.chapters.speed.section import speed_accuracy_section
from tactileq.analysis.columns import TEXTURE
from tactileq.analysis.labels import ALL_TEXTURES
from tactileq.analysis.page.page import Fold, Item, Table, table_html
from tactileq.analysis.page.provenance import PROVENANCE_COLUMNS
from tactileq.analysis.page.sections import Section
from tactileq.analysis.statistics.claims import CLAIM_COLUMNS, VERDICT_COLUMNS
from tactileq.analysis.statistics.confusion import CONFUSION_COLUMNS
from tactileq.analysis.statistics.described_verdicts import PLANTED_COLUMNS, SETUP_COLUMNS
from tactileq.analysis.statistics.participants.verdict import PEOPLE_COLUMNS
from tactileq.analysis.statistics.rates import CORRECT_RATE_COLUMNS
from tactileq.analysis.statistics.verdicts import ClaimFound
from tactileq.analysis.textures.between import LEFT_OUT_COLUMNS, PLANTED_BETWEEN_COLUMNS
from tactileq.analysis.textures.compared import comparisons
from tactileq.analysis.textures.likeness import GFC_COLUMNS
from tactileq.analysis.textures.recovery import PLANTED_LAYER_COLUMNS, PLANTED_TRUTH_COLUMNS
from tactileq.analysis.textures.regressions import (
    CENTROID_AMPLITUDE_COLUMNS,
    CENTROID_COLUMNS,
    COEFFICIENT_COLUMNS,
    DRIVING_COLUMNS,
    REGRESSION_COLUMNS,
    SUPPORT_COLUMNS,
    driving_table,
)
from tactileq.analysis.textures.results import LAYER_VERDICT_COLUMNS, MODEL_FIT_COLUMNS
from tactileq.benches.atlas import hands
from tactileq.benches.atlas.edges import examine
from tactileq.benches.atlas.section import stability_section
from tactileq.benches.atlas.tables import EDGE_COLUMNS, MARGIN_COLUMNS
from tactileq.benches.chart.chart import chart_of
from tactileq.benches.chart.judging import judge
from tactileq.benches.chart.page import chart_section
from tactileq.benches.chart.summary import METHOD_COLUMNS, RIVAL_COMPARISON_COLUMNS
from tactileq.benches.chart.surfaces import Simulated, simulated_sources
from tactileq.benches.scenes.examples import SCENE_COMPARISON_COLUMNS, CompiledExample, Surface
from tactileq.benches.scenes.section import (
    SCENE_STEP_COLUMNS,
    SCENE_TEXTURE_COLUMNS,
    scene_section,
)
from tactileq.modeling import Scene, compile_scene, fit_ar
from tactileq.modeling.files.columns import Column, Columns, chosen, names, without
from tactileq.modeling.scenes.hands import HandRange
from tactileq.modeling.scenes.strokes import windows_kept
from tactileq.stimuli.planted.textures import PlantedSurface, planted_texture, record_texture
from tests.analysis.conftest import answered_of, by_model, people_summary

pytestmark = pytest.mark.usefixtures("few_draws")

PAGE = Path(tactileq.analysis.page.page.__file__)
DECLARED = {
    "paper": FINDING_COLUMNS,
    "claims": VERDICT_COLUMNS,
    "claims_in_short": IN_SHORT_COLUMNS,
    "claim_sentences": IN_WORDS_COLUMNS,
    "claim_tests": CLAIM_COLUMNS,
    "people": PEOPLE_COLUMNS,
    "people_priors": PRIORS_COLUMNS,
    "planted_effects": PLANTED_COLUMNS,
    "setups": SETUP_COLUMNS,
    "agreement": AGREEMENT_COLUMNS,
    "raters": RATER_COLUMNS,
    "careless": CARELESS_COLUMNS,
    "hand": HAND_TABLE_COLUMNS,
    "hand_tests": HAND_TEST_COLUMNS,
    "correct_rates": CORRECT_RATE_COLUMNS,
    "confusion": CONFUSION_COLUMNS,
    "confusion_change": CHANGE_COLUMNS,
    "transferred_information": INFORMATION_COLUMNS,
    "similarity_fit": CHOICE_FIT_COLUMNS,
    "similarities": SIMILARITY_COLUMNS,
    "biases": BIAS_COLUMNS,
    "buttons": BUTTON_COLUMNS,
    "mixed_effects": CLAIM_MIXED_COLUMNS,
    "gee_effects": CLAIM_GEE_COLUMNS,
    "oddity": ODDITY_COLUMNS,
    "speed_accuracy": SPEED_COLUMNS,
    "time_ratio": TIME_RATIO_COLUMNS,
    "speed_right_and_wrong": RIGHT_WRONG_COLUMNS,
    "speed_scores": SCORE_COLUMNS,
    "speed_cells": TEXTURE_TIME_COLUMNS,
    "speed_quantiles": CONDITIONAL_COLUMNS,
    "gfc": GFC_COLUMNS,
    "fits": MODEL_FIT_COLUMNS,
    "left_out": LEFT_OUT_COLUMNS,
    "verdicts": LAYER_VERDICT_COLUMNS,
    "regressions": REGRESSION_COLUMNS,
    "regression_support": SUPPORT_COLUMNS,
    "regression_coefficients": COEFFICIENT_COLUMNS,
    "centroid": CENTROID_COLUMNS,
    "centroid_amplitude": CENTROID_AMPLITUDE_COLUMNS,
    "driving": DRIVING_COLUMNS,
    "planted_truth": PLANTED_TRUTH_COLUMNS,
    "planted_overall": without(PLANTED_TRUTH_COLUMNS, "layer"),
    "planted_layers": PLANTED_LAYER_COLUMNS,
    "planted_between": PLANTED_BETWEEN_COLUMNS,
    "provenance": PROVENANCE_COLUMNS,
    "chart_comparisons": RIVAL_COMPARISON_COLUMNS,
    "chart_methods": METHOD_COLUMNS,
    "scene_comparison": SCENE_COMPARISON_COLUMNS,
    "scene_steps": SCENE_STEP_COLUMNS,
    "scene_textures": SCENE_TEXTURE_COLUMNS,
    "stability_margins": MARGIN_COLUMNS,
    "stability_edges": EDGE_COLUMNS,
}
# In no section, of several set-ups, or of hands that were measured.
ELSEWHERE = {"provenance", "setups", "hand", "hand_tests"}
EVERY_COLUMN = {column for columns in DECLARED.values() for column in columns}


def kind(table: Table) -> str:
    """The declaration that a table's name stands for: there is one per texture or per model."""
    name = re.sub(r"^(speed_.*)_relative$", r"\1", table.name)
    return re.sub(r"^(verdicts|confusion)_(?!change$).*", r"\1", name)


def tables_in(items: Iterable[Item]) -> list[Table]:
    found = []
    for item in items:
        if isinstance(item, Fold):
            found += tables_in(item.items)
        elif isinstance(item, Table):
            found.append(item)
    return found


def compiled_example() -> tuple[CompiledExample, dict[str, Surface]]:
    """A scene of one planted texture in a corner of its grid."""
    planted = planted_texture("MDF")
    hand = HandRange(speed_mm_s=(100.0, 150.0), force_n=(1.0, 1.5))
    compiled = compile_scene(Scene(name="corner", hand=hand), {"MDF": planted})
    rival = fit_ar(record_texture(planted, duration_s=0.2), order=4)
    windows = windows_kept(compiled.textures[0], compiled.scene, count=2)
    surface = Surface(PlantedSurface("MDF"), rival)
    return CompiledExample(compiled, (windows,)), {"MDF": surface}


def reliability(ratings: pd.DataFrame, choices: pd.DataFrame) -> Section:
    section = reliability_section(
        {"absolute": ratings, "relative": choices},
        chances={"relative": 1 / 7},
        simulated=True,
        rng=np.random.default_rng(1),
    )
    assert section is not None
    return section


def _about_the_odd_one(found: ClaimFound) -> ClaimFound:
    return replace(found, claim=replace(found.claim, task="oddity"))


@pytest.fixture(scope="module")
def tables(results, ratings, choices, found) -> list[Table]:
    """All tables of a report but its provenance."""
    responses = Responses(
        {"absolute": ratings, "relative": choices},
        simulated_participants=True,
        simulated_rig=True,
    )
    predicted = pd.DataFrame(
        [(200.0, 1.0, -0.5, 1.5)],
        columns=["speed_mm_s", "force_n", "level_error_db", "log_spectral_distance_db"],
    )
    case = hands.CASES[0]
    [surface] = simulated_sources(Simulated(1, ()))
    textures = [replace(results[0], left_out={"joint": predicted}), *results[1:]]
    compared = list(comparisons(textures, np.random.default_rng(1).spawn(len(textures))))
    judged = [by_model(found[0], people_summary()), *found[1:]]
    planted = {"PVC": {"magnitude_similarity": -30.0}}
    answered = answered_of(responses, found=judged, planted=planted)
    odd = replace(responses, answers={"oddity": choices})
    sections = (
        model_section(textures, pd.concat([each.gfc for each in compared])),
        parameter_section(textures, driving_table([each.driven for each in compared])),
        *claims.sections(answered),
        *ratings_chapter.sections(answered),
        *choices_chapter.sections(answered),
        *confusions.sections(answered),
        mixed_section(responses, found, rng=np.random.default_rng(1)),
        oddity_section([_about_the_odd_one(found[2])], odd),
        speed_accuracy_section(
            [(Stream("relative", "", np.random.default_rng(1)), choices)],
            models=("full", "simplified"),
            simulated=True,
        ),
        reliability(ratings, choices),
        paper_section(of_answers(judged, responses.answers), simulated=True),
        planted_section(textures),
        chart_section(chart_of([judge(surface, methods=("joint, 1 layer", "truth"))], turns=1)),
        scene_section([compiled_example()]),
        stability_section([examine(case, next(iter(case.columns)), full=False)]),
    )
    return [table for section in sections for table in tables_in(section.items)]


def test_no_table_is_without_a_declaration(tables: list[Table]) -> None:
    assert {kind(table) for table in tables} | ELSEWHERE == set(DECLARED)


def test_tables_have_the_columns_that_are_declared(tables: list[Table]) -> None:
    for table in tables:
        assert list(table.frame) == names(DECLARED[kind(table)]), table.name


def test_what_is_shown_is_declared(tables: list[Table]) -> None:
    for table in tables:
        assert set(table.columns) <= set(DECLARED[kind(table)]), table.name
        assert len(set(table.columns)) == len(table.columns), table.name


def test_p_values_are_flagged() -> None:
    probabilities = {c.name for c in EVERY_COLUMN if re.search(r"^p(_|$)|_p$|probability", c.name)}
    assert {column.name for column in EVERY_COLUMN if column.is_p_value} == probabilities
    assert {"p", "p_holm", "wilcoxon_p", "p_speed_alone", "flip_probability"} <= probabilities


def test_units_are_those_that_names_end_with() -> None:
    units = {"_db": "dB", "_hz": "Hz", "_mm_s": "mm/s", "_force_n": "N"}
    for ending, unit in units.items():
        columns = [column for column in EVERY_COLUMN if column.name.endswith(ending)]
        assert columns
        for column in columns:
            assert column.unit == unit, column.name
            assert column.heading.endswith(f" ({unit})"), column.name


def test_level_errors_of_conditions_and_of_layers_have_headings_of_their_own() -> None:
    headings = [
        {column.heading for column in columns if "median_" in column.name}
        for columns in (LEFT_OUT_COLUMNS, PLANTED_TRUTH_COLUMNS, PLANTED_BETWEEN_COLUMNS)
    ]
    assert len(set.union(*headings)) == sum(len(each) for each in headings)


def shown(frame: pd.DataFrame, columns: Columns) -> str:
    return table_html(Table("t", "Title", "Note.", frame, columns, simulated=False))


def test_a_table_is_shown_as_its_columns_say() -> None:
    columns = (
        Column("p", is_p_value=True),
        TEXTURE,
        Column("distance_db", "distance", "dB"),
        Column("note"),
    )
    frame = pd.DataFrame(
        {
            "texture": ["<canvas>", ALL_TEXTURES],
            "distance_db": [-12.345, np.nan],
            "p": [0.0004, 0.04],
            "unshown": [1, 2],
            "note": ["", ""],
        }
    )
    html = shown(frame, columns)
    headings = re.findall(r"<th ([^>]*)>(.*?)</th>", html)
    assert headings == [
        ('class="number"', "p"),
        ('class="name"', "texture"),
        ('class="number"', "distance (dB)"),
    ]
    rows = re.findall(r"<tr( class=\"total\")?>(<td.*?)</tr>", html)
    cells = [(bool(total), *re.findall(r"<td [^>]*>(.*?)</td>", row)) for total, row in rows]
    assert cells == [
        (False, "&lt; .001", "&lt;canvas&gt;", "−12.3"),
        (True, ".040", ALL_TEXTURES, "n/a"),
    ]


def test_a_note_that_somebody_wrote_is_shown() -> None:
    frame = pd.DataFrame({"note": ["", "t undefined"]})
    assert "<td >t undefined</td>" in shown(frame, (Column("note"),))
    assert "<th >note</th>" in shown(frame.iloc[:0], (Column("note"),))


def test_a_column_that_is_not_in_the_table_is_refused() -> None:
    with pytest.raises(KeyError):
        shown(pd.DataFrame({"p": [0.5]}), chosen(DECLARED["gfc"], "gfc30_mean"))


def test_the_page_names_no_column() -> None:
    source = PAGE.read_text(encoding="utf-8")
    nodes = list(ast.walk(ast.parse(source)))
    texts = {node.value for node in nodes if isinstance(node, ast.Constant)}
    every = {column.name for column in EVERY_COLUMN}
    assert not every & texts
    # Words such as `note` and `value` have their own meaning on the page; these have not.
    assert not {name for name in every if "_" in name and re.search(rf"\b{name}\b", source)}


def test_the_page_knows_of_analysis_only_what_a_column_is() -> None:
    tree = ast.parse(PAGE.read_text(encoding="utf-8"))
    modules = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    assert "tactileq.modeling.files.columns" in modules
    assert not {name for name in modules if name and name.startswith("analysis")}
