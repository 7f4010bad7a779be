"""The verdicts of the model of the participants on planted truth: rows, aims, ranks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tactileq.analysis.statistics.participants.posterior import Effort
from tactileq.benches.validation import model as validation_model
from tactileq.benches.validation import ranks as validation_ranks
from tactileq.benches.validation.model import (
    MODEL_COLUMNS,
    aims,
    all_situations,
    model_cells,
    model_table,
    simulate_model_cell,
)
from tactileq.benches.validation.people.held_out import HELD_OUT
from tactileq.benches.validation.ranks import simulate_ranks


@pytest.fixture(autouse=True)
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """A few steps instead of hundreds."""
    few = Effort(chains=1, warm_up=80, steps=120, every=3)
    monkeypatch.setattr(validation_model, "EFFORT", few)
    monkeypatch.setattr(validation_ranks, "STEPS", 300)
    monkeypatch.setattr(validation_ranks, "WARM_UP", 100)


def test_every_situation_is_a_row_at_each_size_and_the_held_out_ones_say_so():
    cells = model_cells()
    assert len(cells) == 2 * len(all_situations())
    assert len(HELD_OUT) >= 2
    row = simulate_model_cell(("oddity: strategies", 10), simulations=4, seed=1)
    assert row["held_out"] == "yes"
    assert list(model_table([row]).columns) == [column.name for column in MODEL_COLUMNS]


def test_a_row_follows_from_its_seed_and_shares_are_of_all_studies():
    cell = ("oddity: 1 person in 4", 12)
    first, again, other = (
        simulate_model_cell(cell, simulations=12, seed=seed) for seed in (1, 1, 2)
    )
    assert first == again
    assert first != other
    words = ("equality", "different", "inconclusive")
    for row in (first, other):
        assert all(round(row[name] * 12) == pytest.approx(row[name] * 12) for name in words)
        assert row["equivalent"] <= row["equality"]


def test_split_opinions_are_seen_and_equality_needs_proof_of_sensitivity():
    split = simulate_model_cell(("ratings: split ± 10", 24), simulations=12, seed=1)
    assert split["equivalent"] == 0
    assert split["felt"] > 0.7
    assert split["tests_inside"] > 0.7  # what a mean alone would have said
    blind = simulate_model_cell(
        ("ratings: everybody at a favourite place, no anchors", 12), simulations=8, seed=1
    )
    assert blind["equality"] == 0
    assert blind["inside"] > 0.5
    assert np.isnan(blind["coverage"])


def test_an_aim_is_missed_by_more_than_two_standard_errors_only():
    name = "ratings: base 90"
    row = {"situation": name, "n": 20, "planted": 7.5, "simulations": 1000, "tests_inside": 0.8}
    asked = {quantity: (low, high) for quantity, low, high in aims(name, 20, row=row)}
    assert asked["equality"] == (0.0, 0.06)
    assert asked["coverage"] == (0.93, 0.97)
    just = {**row, "equality": 0.074, "coverage": 0.915, "inside": 0.05}
    assert validation_model._missed(just) == []  # 2 SE of .06 are .015, of .93 .016
    (missed,) = validation_model._missed({**just, "coverage": 0.91})
    assert missed.startswith("coverage")
    assert len(validation_model._missed({**just, "equality": 0.2, "inside": 0.2})) == 2


def test_ranks_of_drawn_values_are_spread_over_all_tenths():
    rows = simulate_ranks("odd one out", simulations=100, seed=3)
    assert {row["quantity"] for row in rows} >= {"mean effect", "participants outside"}
    for row in rows:
        counts = list(map(int, row["ranks"].split()))
        assert sum(counts) == 100
        assert row["p"] > 1e-4  # of a hundred studies; a wrong sampler piles up at one end


def test_ranks_show_a_sampler_with_another_prior(monkeypatch: pytest.MonkeyPatch):
    """A sampler that believes in ten times as many lapses is found out."""
    own = validation_ranks.ChoiceSampler

    def biased(studies, model, priors, *, rng):
        return own(studies, model, replace(priors, lapses=(60.0, 60.0)), rng=rng)

    monkeypatch.setattr(validation_ranks, "ChoiceSampler", biased)
    rows = {row["quantity"]: row for row in simulate_ranks("odd one out", simulations=100, seed=3)}
    assert rows["lapsed trials"]["p"] < 1e-6
