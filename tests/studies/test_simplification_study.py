"""The study behind docs/studies/simplification.md, on a tiny setting."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import numpy as np
import pandas as pd
import pytest

from modeling import CRITERIA

SCRIPT = Path(__file__).parents[2] / "docs" / "studies" / "simplification_study.py"
FAR_DB = (-60.0, 60.0)


@pytest.fixture(scope="module")
def study() -> ModuleType:
    spec = importlib.util.spec_from_file_location("simplification_study", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def results(study: ModuleType) -> np.ndarray:
    return np.stack([study.record_twice(seed, 1.0, distances_db=FAR_DB) for seed in range(8)])


@pytest.fixture(scope="module")
def table(study: ModuleType, results: np.ndarray) -> pd.DataFrame:
    return pd.DataFrame(study.summary(results, 1.0, FAR_DB))


def test_planted_layers_have_the_distance_they_are_given(study: ModuleType) -> None:
    truth = study.planted(np.random.default_rng(3))
    assert truth.simulated
    assert truth.noise_gains.shape == (2, 2)
    top = np.abs(truth.gains[-1, -1])
    assert (np.abs(truth.gains) <= top).all()
    assert 20 * np.log10(top[1] / top[0]) == pytest.approx(study.LOUDER_DB)
    assert 6 <= 20 * np.log10(top[0] / study.NOISE_GAIN) <= 20


def test_far_from_threshold_no_verdict_is_wrong_or_flips(table: pd.DataFrame) -> None:
    assert list(table["criterion"].unique()) == list(CRITERIA)
    assert (table["not_found"] < 1).all()
    far_below = table["true_distance_db"] < 0
    assert (table.loc[~far_below, ["dropped_plain", "dropped"]] == 0).all(axis=None)
    # Below by 60 dB is everything, the louder layer, too: the sum stays far below, one layer stays.
    assert (table.loc[far_below, "dropped_plain"] == 1).all()
    # But what only fills the shape of the one that stays, stays with it: here in one of eight.
    assert (table.loc[far_below, "dropped"] >= 7 / 8).all()
    assert (table[["flipped_plain", "flipped", "contradicted"]] == 0).all(axis=None)
    assert (table["mean_flip_probability"] < 1e-6).all()


def test_a_layer_that_is_not_found_is_an_outcome_of_its_own(
    study: ModuleType, results: np.ndarray
) -> None:
    lost = results.copy()
    lost[:4] = np.nan
    before, after = (
        pd.DataFrame(study.summary(r, 1.0, FAR_DB))["not_found"].iloc[0] for r in (results, lost)
    )
    found_in_rest = (~np.isnan(results[4:, :, 0, 0, 0])).sum()
    assert after == pytest.approx(1 - found_in_rest / 16)
    assert after >= before


def test_shares_count_pairs_of_recordings(study: ModuleType) -> None:
    """Four pairs: dropped twice, dropped once, kept twice, found once only."""
    gone, stays, lost = (1.0, 1.0, 0.01), (0.0, 0.0, 0.3), (np.nan,) * 3
    pairs = [(gone, gone), (gone, stays), (stays, stays), (gone, lost)]
    results = np.broadcast_to(
        np.array(pairs)[:, :, None, None, :], (4, 2, len(CRITERIA), 1, 3)
    ).copy()
    row = study.summary(results, 1.0, (0.0,))[0]
    assert row["not_found"] == pytest.approx(1 / 8)
    assert row["dropped"] == row["dropped_plain"] == pytest.approx(4 / 7)
    assert row["flipped"] == pytest.approx(1 / 3)
    assert row["contradicted"] == pytest.approx(1 / 6)
    assert row["mean_flip_probability"] == pytest.approx((4 * 0.01 + 3 * 0.3) / 7)


def test_figure_says_that_it_is_simulated(study: ModuleType, table: pd.DataFrame) -> None:
    figure = study.figure_of(table, estimator="joint")
    assert figure.get_suptitle().startswith("Simulated")
    assert len(figure.axes) == 2 * len(study.PANELS)
    lines = figure.axes[0].get_lines()
    energy = table[table["criterion"] == "energy"]
    assert lines[0].get_ydata() == pytest.approx(100 * energy["dropped_plain"].to_numpy())
