"""The verdicts of the model of the participants on planted truth: rows, aims, ranks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from statsmodels.stats.multitest import multipletests

from tactileq.analysis.statistics.participants import posterior
from tactileq.analysis.statistics.participants.posterior import Effort
from tactileq.benches.validation import model as validation_model
from tactileq.benches.validation import ranks as validation_ranks
from tactileq.benches.validation.model import (
    MODEL_COLUMNS,
    WORLDS,
    aims,
    model_cells,
    model_table,
    simulate_model_cell,
)
from tactileq.benches.validation.people.drawn import DrawnStudies
from tactileq.benches.validation.ranks import simulate_ranks
from tactileq.modeling import InputError
from tactileq.modeling.seeds import generator, number_of
from tests.refusals import refused

SHARES = ("coverage", "equal", "different", "texture_different", "texture_equal", "withheld")


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """A few steps instead of hundreds, which suffice; enough for what does not rest on them."""
    few = Effort(chains=2, warm_up=2, steps=8, every=1)
    monkeypatch.setattr(posterior, "Effort", lambda: few)
    monkeypatch.setattr(posterior, "LONGER", few)
    monkeypatch.setattr(posterior, "LONGEST", few)
    monkeypatch.setattr(posterior, "HIGHEST_R_HAT", 10.0)
    monkeypatch.setattr(posterior, "FEWEST_EFFECTIVE", 1.0)


# --- Rows -------------------------------------------------------------------------------------


def test_every_world_is_a_row_at_each_size_but_unequal_groups_at_their_own():
    cells = model_cells()
    assert len(set(cells)) == len(cells)
    for name in WORLDS:
        sizes = [n for one, n in cells if one == name]
        assert sizes == ([20] if "13 and 7" in name else [20, 36])
    assert model_cells(sizes=[8]) == [(name, 8) for name in WORLDS if "13 and 7" not in name]


def test_a_row_follows_from_its_seed_and_shares_are_of_all_studies(short: None):
    cell = ("20 % random people", 8)
    first, again, other = (
        simulate_model_cell(cell, simulations=6, seed=seed) for seed in (1, 1, 2)
    )
    assert list(model_table([first]).columns) == [column.name for column in MODEL_COLUMNS]
    assert set(first) == {column.name for column in MODEL_COLUMNS}
    assert model_table([first]).equals(model_table([again]))
    assert not model_table([first]).equals(model_table([other]))
    for row in (first, other):
        counts = [6 * row[name] for name in SHARES if not np.isnan(row[name])]
        assert counts == pytest.approx(np.round(counts))
        assert row["planted"] == 7.5


def test_the_model_decides_on_ratings_that_days_do_not_unbalance(short: None):
    rules = {
        cell: simulate_model_cell(cell, simulations=1, seed=1)["rule"]
        for cell in [
            *(("none, SD 2", 4), ("by day, none", 4), ("by day, 13 and 7", 20)),
            *(("choices, days .25", 4), ("choices, 13 and 7", 20)),
        ]
    }
    assert list(rules.values()) == ["hierarchical", "hierarchical", "tests", "tests", "tests"]


def test_held_out_worlds_say_the_rule_they_were_written_after(short: None):
    held_out = {name: one.held_out for name, one in WORLDS.items() if one.held_out}
    assert len(held_out) >= 2
    for name, commit in list(held_out.items())[:1]:
        assert simulate_model_cell((name, 4), simulations=1, seed=1)["held_out"] == commit
    assert not simulate_model_cell(("none, SD 2", 4), simulations=1, seed=1)["held_out"]


# --- Words ------------------------------------------------------------------------------------


def by_scipy(drawn: DrawnStudies, bounds: tuple[float, float]) -> list[tuple[float, float, bool]]:
    """p of t and of TOST of each study, and whether the 95 % interval holds what is planted."""
    means = drawn.values.mean(axis=(2, 4))
    days = drawn.days[:, 0, :, 0]
    last = days[:, 1] > days[:, 0]
    found = []
    for d in means[..., 1] - means[..., 0]:

        def against(bound: float, way: str, d: np.ndarray = d) -> object:
            if not days.any():
                return stats.ttest_1samp(d, bound, alternative=way)
            return stats.ttest_ind(d[last] - bound, bound - d[~last], alternative=way)

        test = against(0.0, "two-sided")
        low, high = np.array(test.confidence_interval(0.95)) / (2 if days.any() else 1)
        tost = max(against(bounds[0], "greater").pvalue, against(bounds[1], "less").pvalue)
        found.append((test.pvalue, tost, low <= drawn.planted.mean() <= high))
    return found


@pytest.mark.parametrize(
    ("name", "n"),
    [
        ("choices, at the bound", 20),
        ("choices, 13 and 7", 20),
        ("by day, 13 and 7", 20),
        ("none, SD 6", 10),
    ],
)
def test_words_by_tests_are_those_of_scipy(name: str, n: int, short: None):
    row = simulate_model_cell((name, n), simulations=20, seed=4)
    drawn = WORLDS[name](generator(4, number_of(name), n, 0), (20, n))
    known = by_scipy(drawn, WORLDS[name].bounds)
    equal, different = ([one[place] < 0.05 for one in known] for place in (1, 0))
    assert row["tests_equal"] == pytest.approx(np.mean(equal))
    assert row["tests_different"] == pytest.approx(np.mean(different))
    assert row["tests_equal"] + row["tests_different"] > 0
    if row["rule"] == "tests":
        assert row["coverage"] == pytest.approx(np.mean([one[2] for one in known]))
        for column in ("equal", "different", "texture_different", "texture_equal"):
            assert row[column] == pytest.approx(row[f"tests_{column}"], nan_ok=True)


def test_textures_are_a_family_corrected_after_holm(short: None):
    """Of the six textures without an effect, whether any is called different."""
    name, n = "one texture", 8
    row = simulate_model_cell((name, n), simulations=25, seed=1)
    values = WORLDS[name](generator(1, number_of(name), n, 0), (25, n)).values.mean(axis=-1)
    p = stats.ttest_1samp(values[..., 1] - values[..., 0], 0.0, axis=1).pvalue
    wrong = [multipletests(one, method="holm")[0][[0, 1, 2, 4, 5, 6]].any() for one in p]
    assert row["tests_texture_different"] == pytest.approx(np.mean(wrong))
    assert 0 < sum(wrong) < 12
    assert np.isnan(row["texture_equal"])  # nothing is planted at a bound


def test_the_model_says_of_clear_worlds_what_was_planted(
    short: None, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(posterior, "Effort", lambda: Effort(chains=2, warm_up=80, steps=100))
    felt = simulate_model_cell(("twice the bound", 20), simulations=8, seed=1)
    assert felt["different"] == 1
    assert felt["equal"] == 0
    none = simulate_model_cell(("none, SD 2", 20), simulations=8, seed=1)
    assert none["equal"] > 0.7
    assert none["different"] < 0.4
    for row in (felt, none):
        assert row["coverage"] >= 0.6
        assert row["withheld"] == 0
        assert 0.5 <= row["sd_coverage"] <= 1


def test_of_draws_that_do_not_suffice_no_word_is_counted(
    short: None, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(posterior, "FEWEST_EFFECTIVE", 1e9)
    row = simulate_model_cell(("twice the bound", 8), simulations=3, seed=1)
    assert row["withheld"] == 1
    assert row["equal"] == row["different"] == 0
    assert row["tests_different"] == 1
    assert np.isnan(row["coverage"])
    assert "withheld" in row["missed"]


# --- Aims -------------------------------------------------------------------------------------

ROW = {
    "world": "none, SD 2",
    "planted": 0.0,
    "simulations": 1000,
    "coverage": 0.95,
    "sd_coverage": 0.95,
    "equal": 0.8,
    "tests_equal": 0.8,
    "different": 0.05,
    "tests_different": 0.05,
    "texture_different": 0.05,
    "texture_equal": np.nan,
    "withheld": 0.0,
}
AT_BOUND = {**ROW, "world": "base 95", "planted": -7.5, "equal": 0.05, "different": 0.9}
TWICE = {**AT_BOUND, "world": "twice the bound", "planted": 15.0, "tests_different": 0.9}


@pytest.mark.parametrize(
    ("row", "asked"),
    [
        (ROW, {"equal": (0.95 * 0.8, 1.0), "different": (0.0, 0.06)}),
        (AT_BOUND, {"equal": (0.0, 0.06)}),
        ({**AT_BOUND, "world": "choices, at the bound", "planted": -0.1}, {"equal": (0.0, 0.06)}),
        (TWICE, {"different": (0.95 * 0.9, 1.0)}),
        ({**ROW, "world": "one texture", "planted": 15 / 7}, {}),
    ],
    ids=["none", "at the bound", "choices at the bound", "twice the bound", "amid"],
)
def test_aims_are_those_of_what_is_planted(row: dict, asked: dict):
    found = {quantity: (low, high) for quantity, low, high in aims(row)}
    assert {name: found[name] for name in ("equal", "different") if name in found} == asked
    assert found["coverage"] == (0.93, 0.97)
    assert "texture_equal" not in found  # NaN: there is no such texture
    assert "coverage" not in {one for one, *_ in aims({**row, "coverage": np.nan})}


@settings(max_examples=20)
@given(st.integers(0, 1000), st.integers(0, 1000), st.sampled_from([ROW, AT_BOUND, TWICE]))
def test_an_aim_is_missed_where_the_99_percent_interval_of_the_count_lies_beside_it(
    first: int, second: int, row: dict
):
    changed = {**row, "coverage": first / 1000, "equal": second / 1000}
    expected = []
    for quantity, lowest, highest in aims(changed):
        count = round(changed[quantity] * 1000)
        low, high = stats.binomtest(count, 1000).proportion_ci(0.99)
        if low > highest or high < lowest:
            expected.append(quantity)
    assert [said.split()[0] for said in validation_model._missed(changed)] == expected


def test_rows_with_all_aims_reached_miss_none():
    assert [validation_model._missed(row) for row in (ROW, AT_BOUND, TWICE)] == [[], [], []]


# --- Ranks ------------------------------------------------------------------------------------


def ranks_of(kind: str, monkeypatch: pytest.MonkeyPatch, *, steps: int) -> dict[str, dict]:
    monkeypatch.setattr(validation_ranks, "STEPS", steps)
    monkeypatch.setattr(validation_ranks, "WARM_UP", 60)
    return {row["quantity"]: row for row in simulate_ranks(kind, simulations=100, seed=3)}


def test_ranks_of_drawn_values_are_spread_over_all_tenths(monkeypatch: pytest.MonkeyPatch):
    rows = ranks_of("two repeats", monkeypatch, steps=300)
    assert rows.keys() >= {"mean effect", "SD between people", "SD of deviations on textures"}
    for row in rows.values():
        counts = list(map(int, row["ranks"].split()))
        assert sum(counts) == 100
        assert row["p"] > 1e-4  # of a hundred studies; a wrong sampler piles up at one end


def test_ranks_show_a_sampler_with_another_prior(monkeypatch: pytest.MonkeyPatch):
    """A sampler that believes in ten times as many lapses is found out; deviations are not told."""
    own = validation_ranks.RatingSampler

    def biased(studies, priors, *, rng):
        return own(studies, replace(priors, lapses=(60.0, 60.0)), rng=rng)

    monkeypatch.setattr(validation_ranks, "RatingSampler", biased)
    rows = ranks_of("single ratings", monkeypatch, steps=100)
    assert rows["lapsed trials"]["p"] < 1e-6
    assert "SD of deviations on textures" not in rows


def test_no_simulation_is_refused():
    for simulate in (
        lambda: simulate_model_cell(model_cells()[0], simulations=0, seed=1),
        lambda: simulate_ranks("single ratings", simulations=0, seed=1),
    ):
        with refused(InputError, expected=["simulations", 1, 1000000], got=0):
            simulate()
