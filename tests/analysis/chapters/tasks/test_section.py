"""A task without a chapter: reported by what its table of answers declares, beside the others."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import nan
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from tactileq.analysis.answers.plan import AnalysisPlan, Claim
from tactileq.analysis.answers.responses import PlannedTask, Responses
from tactileq.analysis.chapters.choices import section as choices_chapter
from tactileq.analysis.chapters.choices.figure import figure_correct_rates
from tactileq.analysis.chapters.claims.answer import NOTHING_TO_CLAIM, answer
from tactileq.analysis.chapters.claims.plan_sentences import methods_paragraph
from tactileq.analysis.chapters.oddity import section as oddity_chapter
from tactileq.analysis.chapters.ratings import section as ratings_chapter
from tactileq.analysis.chapters.tasks import section as tasks_chapter
from tactileq.analysis.labels import ALL_TEXTURES, TASK_TITLES
from tactileq.analysis.page.sections import Headline, Section
from tactileq.analysis.report.report import write_report
from tactileq.analysis.statistics.compared_answers import chance_of
from tactileq.analysis.statistics.rates import UNKNOWN_CHANCE
from tactileq.analysis.statistics.verdicts import ClaimFound, claims_found
from tactileq.modeling.files.answer_tables import (
    ANSWER_TABLES,
    CORRECT,
    ENDS,
    RESPONSE_TIME,
    AnswerColumn,
    answer_table,
)
from tests.analysis.conftest import answered_of, choice_table, rating_table

pytestmark = pytest.mark.usefixtures("undrawn", "few_draws")
CLAIM = Claim(
    name="pairs are told alike",
    task="pair",
    measure="correct",
    models=("full", "simplified"),
    bounds=(-0.1, 0.1),
    test="equivalence",
)
RATED = AnswerColumn(
    name="magnitude_similarity",
    description="Rated similarity",
    limits=ENDS,
    scale="vibration magnitude",
)
Declare = Callable[..., None]


@pytest.fixture
def declare(monkeypatch: pytest.MonkeyPatch) -> Declare:
    """`declare(CORRECT, chance=1 / 7)` adds the task "pair", the pair comparison."""

    def declare(*own: AnswerColumn, **said: float | bool) -> None:
        table = answer_table(*own, title="pair comparison", texture="", model="", **said)
        monkeypatch.setitem(ANSWER_TABLES, "pair", table)
        monkeypatch.setitem(TASK_TITLES, "pair", table.title)

    return declare


@pytest.fixture
def pairs() -> pd.DataFrame:
    """Answers of eighteen people, of whom the last guesses."""
    table = choice_table(np.random.default_rng(4), people=18, rate=0.7)
    guesses = np.random.default_rng(1).random(len(table)) < 1 / 7
    last = table["participant_id"] == "sub-18"
    return table.assign(correct=np.where(last, guesses, table["correct"]).astype(float))


@pytest.fixture
def alone(pairs: pd.DataFrame) -> Responses:
    """Nothing but the answers to the added task, with a claim about them."""
    return Responses(
        {"pair": pairs},
        simulated_participants=True,
        simulated_rig=True,
        plan=AnalysisPlan(claims=(CLAIM,)),
        planned={"pair": PlannedTask(18, 18, repeats=3, trials=18 * 42)},
    )


def found_in(responses: Responses) -> list[ClaimFound]:
    return claims_found(responses, rng=np.random.default_rng(5))


def rates_of(responses: Responses) -> Section:
    (section,) = choices_chapter.sections(answered_of(responses))
    return section


def counted_in(responses: Responses) -> Section:
    (section,) = tasks_chapter.sections(answered_of(responses, found=()))
    return section


def tables_of(section: Section) -> dict[str, pd.DataFrame]:
    return {item.name: item.frame for item in section.items if hasattr(item, "frame")}


def written(folder: Path, responses: Responses) -> dict[str, pd.DataFrame]:
    """The tables beside a report, every cell as it stands there."""
    write_report(folder / "report.html", responses=responses)
    files = sorted((folder / "tables").glob("*.tsv"))
    return {path.stem: pd.read_csv(path, sep="\t", dtype=str) for path in files}


def test_shares_of_right_answers_are_those_of_the_answers(declare, alone, pairs):
    declare(CORRECT, chance=1 / 7)
    rates = tables_of(rates_of(alone))["correct_rates_pair"].set_index(["model", "texture"])
    own = pairs.groupby(["model", "participant_id"])["correct"].mean()
    for model in ("full", "simplified"):
        row = rates.loc[(model, ALL_TEXTURES)]
        assert row["mean"] == pytest.approx(own[model].mean())
        assert row["p"] == pytest.approx(stats.ttest_1samp(own[model], 1 / 7).pvalue)
        assert row["trials"] == 18 * 7 * 3
    (claim,) = found_in(alone)
    claims = claim.tests.set_index("texture")
    difference = own["simplified"].mean() - own["full"].mean()
    assert claims.loc[ALL_TEXTURES, "mean_difference"] == pytest.approx(difference)


def test_right_answers_of_one_model_are_compared_with_chance(declare, alone, pairs):
    """Nothing is claimed of them, as there is no other model."""
    declare(CORRECT, chance=1 / 7)
    one_model = pairs[pairs["model"] == "full"].assign(model="mine")
    asked = replace(alone, answers={"pair": one_model}, plan=AnalysisPlan(claims=()), planned={})
    rates = tables_of(rates_of(asked))["correct_rates_pair"].set_index("texture")
    assert set(rates["model"]) == {"mine"}
    people = one_model.groupby("participant_id")["correct"].mean()
    assert rates.loc[ALL_TEXTURES, "p"] == pytest.approx(stats.ttest_1samp(people, 1 / 7).pvalue)


def test_what_was_done_stands_beside_what_was_planned(declare, alone):
    declare(RESPONSE_TIME)
    asked = tables_of(counted_in(alone))["asked_pair"]
    assert asked["done"].tolist() == [18, 18, 18 * 42]
    assert asked["planned"].tolist() == [18, 18, 18 * 42]
    unplanned = tables_of(counted_in(replace(alone, planned={})))["asked_pair"]
    assert unplanned["planned"].isna().all()


def test_nothing_is_tested_against_a_chance_that_is_not_declared(tmp_path, declare, alone, pairs):
    declare(CORRECT)
    assert np.isnan(chance_of("pair", pairs))
    section = rates_of(alone)
    rates = tables_of(section)["correct_rates_pair"]
    assert rates[["t", "p", "p_holm"]].isna().to_numpy().all()
    assert set(rates["note"]) == {UNKNOWN_CHANCE}
    assert np.isfinite(rates["ci_low"]).all()  # the interval needs no chance
    assert len(section.outcomes) == 2
    assert all(UNKNOWN_CHANCE in outcome.sentence for outcome in section.outcomes)
    (one,) = found_in(alone)
    figure = figure_correct_rates(one, chance=nan, simulated=True)
    assert not [text for text in figure.axes[0].texts if "chance" in text.get_text()]
    assert "compared with chance" not in methods_paragraph(alone, [one])
    assert written(tmp_path, alone)["careless"].empty


def test_who_guesses_is_named_where_chance_is_declared(tmp_path, declare, alone):
    declare(CORRECT, chance=1 / 7)
    careless = written(tmp_path, alone)["careless"]
    assert careless[["task", "participant_id"]].values.tolist() == [["pair comparison", "sub-18"]]
    assert "compared with chance" in methods_paragraph(alone, found_in(alone))


def test_an_unfinished_task_shows_no_effect(tmp_path, declare, alone):
    declare(CORRECT, chance=1 / 7)
    begun = replace(alone, planned={"pair": PlannedTask(20, 20, repeats=3)})
    tables = written(tmp_path, begun)
    assert not any(name.endswith("_pair") for name in tables)
    assert tables["claims"]["mean_difference"].isna().all()
    html = (tmp_path / "report.html").read_text("utf-8")
    assert html.count("18 of 20 planned simulated participants") == 1


def test_a_task_without_ratings_or_right_answers_is_counted(tmp_path, declare, alone, pairs):
    declare(RESPONSE_TIME)
    asked = replace(
        alone, answers={"pair": pairs.drop(columns="correct")}, plan=AnalysisPlan(claims=())
    )
    assert answer(found_in(asked), asked) == Headline(NOTHING_TO_CLAIM)
    tables = written(tmp_path, asked)
    assert tables["asked_pair"]["done"].tolist() == ["18", "18", str(18 * 42)]
    assert "claims" not in tables
    assert tables["careless"].empty


@pytest.mark.parametrize("layout", [None, "texture|another", np.nan])
def test_where_trials_hold_both_models_right_answers_are_compared_with_chance(
    declare, alone, pairs, layout
):
    declare(CORRECT, both_models=True, chance=1 / 2)
    planned = {"pair": PlannedTask(18, 18, repeats=6)}
    pairs = pairs.drop(columns="layout") if layout is None else pairs.assign(layout=layout)
    held = replace(alone, answers={"pair": pairs}, planned=planned)
    assert choices_chapter.sections(answered_of(held)) == []  # of either model there is none
    assert set(tables_of(counted_in(held))) == {"asked_pair"}
    (claim,) = found_in(held)
    row = claim.tests.set_index("texture").loc[ALL_TEXTURES]
    share = pairs.groupby("participant_id")["correct"].mean()
    assert row[["n", "mean_reference"]].tolist() == [18, 0.5]
    assert row["mean_other"] == pytest.approx(share.mean())
    assert row["mean_difference"] == pytest.approx(share.mean() - 0.5)


def test_ratings_of_another_task_are_told_apart_from_those_of_the_first(tmp_path, declare, ratings):
    declare(RATED)
    noisy = rating_table(np.random.default_rng(9)).drop(columns="frequency_similarity")
    both = Responses(
        {"absolute": ratings, "pair": noisy}, simulated_participants=True, simulated_rig=True
    )
    tables = written(tmp_path, both)
    scales = ["vibration magnitude", "frequency pattern"]
    scales.append("vibration magnitude in the pair comparison")
    assert tables["agreement"]["scale"].unique().tolist() == scales
    assert tables["raters"]["scale"].unique().tolist() == scales
    claims = tables["claims"]["claim"].unique().tolist()
    assert claims[-1] == "rated similarity of vibration magnitude of the pair comparison"
    assert len(claims) == 3


def test_every_task_has_a_chapter_by_what_it_declares():
    """The paper's two, the odd one out, and a threshold, which is only counted."""
    by_chapter = {
        chapter.__name__.split(".")[3]: [
            t for t, own in ANSWER_TABLES.items() if chapter.applies(own)
        ]
        for chapter in (ratings_chapter, choices_chapter, oddity_chapter, tasks_chapter)
    }
    assert by_chapter == {
        "ratings": ["absolute"],
        "choices": ["relative"],
        "oddity": ["oddity"],
        "tasks": ["threshold"],
    }
