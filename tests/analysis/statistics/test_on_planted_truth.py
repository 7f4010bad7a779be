"""Every procedure on planted truth: type I errors, coverage, recovery.

docs/method/statistics.md
"""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from tactileq.analysis.answers.plan import Claim
from tactileq.analysis.labels import ALL_TEXTURES
from tactileq.analysis.statistics.caveats import Caveats
from tactileq.analysis.statistics.claims import Values, claim_tests, complete_means
from tactileq.analysis.statistics.paired import holm, paired_test
from tactileq.analysis.statistics.rates import correct_rates

pytestmark = pytest.mark.long("simulations by the hundred")


def binomial_limits(probability: float, repeats: int) -> tuple[float, float]:
    """Shares between which a right procedure falls in 99.9 % of such tests."""
    low, high = stats.binom.ppf([0.0005, 0.9995], repeats, probability) / repeats
    return float(low), float(high)


@pytest.fixture
def few_flips(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sign flips stand beside the t-test: none of what is judged here is theirs."""
    monkeypatch.setattr("tactileq.analysis.statistics.paired.RESAMPLES", 99)


@pytest.mark.usefixtures("few_flips")
def test_the_paired_test_errs_in_five_per_cent_and_its_interval_covers_the_truth():
    rng = np.random.default_rng(20)
    repeats, people, shift = 600, 20, 3.0
    wrong = covered = effect_covered = 0
    for _ in range(repeats):
        person = rng.normal(60, 15, people)
        full = person + rng.normal(0, 8, people)
        wrong += paired_test(full, person + rng.normal(0, 8, people), rng=rng).p < 0.05
        result = paired_test(full, person + shift + rng.normal(0, 8, people), rng=rng)
        covered += result.ci_low <= shift <= result.ci_high
        effect_covered += result.d_z_low <= shift / (8 * np.sqrt(2)) <= result.d_z_high
    low, high = binomial_limits(0.05, repeats)
    assert low <= wrong / repeats <= high
    low, high = binomial_limits(0.95, repeats)
    assert low <= covered / repeats <= high
    assert low <= effect_covered / repeats <= high


def test_holm_keeps_the_family_of_seven_below_five_per_cent():
    rng = np.random.default_rng(21)
    repeats = 300
    p = stats.ttest_1samp(rng.normal(size=(repeats, 7, 20)), 0.0, axis=2).pvalue
    wrong = np.mean([(holm(family) < 0.05).any() for family in p])
    assert wrong <= binomial_limits(0.05, repeats)[1]
    assert np.mean((p < 0.05).any(axis=1)) > 0.2  # what it would be without


def test_the_bootstrap_interval_of_a_correct_rate_covers_the_truth(monkeypatch):
    # Fewer resamples than in use: the coverage does not hang on their number.
    monkeypatch.setattr("tactileq.analysis.statistics.rates.BOOTSTRAP_RESAMPLES", 1000)
    rng = np.random.default_rng(22)
    repeats, people, trials, truth = 250, 24, 3, 0.4
    covered = 0
    for _ in range(repeats):
        ability = rng.beta(2, 3, people)  # mean 0.4
        right = rng.random((people, trials)) < ability[:, None]
        table = pd.DataFrame(
            {
                "participant_id": np.repeat(np.arange(people), trials).astype(str),
                "texture": "canvas",
                "model": "full",
                "correct": right.ravel().astype(float),
            }
        )
        row = correct_rates(table, ["full"], rng=rng).iloc[0]
        covered += row["ci_low"] <= truth <= row["ci_high"]
    # A bootstrap over 24 people is a little short of its nominal 0.95; 0.93 is what it promises.
    assert (
        binomial_limits(0.93, repeats)[0] <= covered / repeats <= binomial_limits(0.96, repeats)[1]
    )


@pytest.mark.usefixtures("few_flips")
def test_a_planted_effect_is_found_where_it_is_and_nowhere_else():
    rng = np.random.default_rng(23)
    repeats, people = 20, 20
    found = elsewhere = 0
    for _ in range(repeats):
        rows = [
            {
                "participant_id": f"sub-{person:02d}",
                "texture": texture,
                "model": model,
                "magnitude_similarity": 60
                + rng.normal(0, 8)
                - 12 * (model + texture == "simplifiedPVC"),
                "frequency_similarity": 60 + rng.normal(0, 8),
            }
            for person in range(people)
            for texture in ("canvas", "MDF", "PVC")
            for model in ("full", "simplified")
        ]
        table = pd.DataFrame(rows)
        for scale in ("magnitude_similarity", "frequency_similarity"):
            tests = _of_textures(table, scale, rng=rng)
            hit = (tests["texture"] == "PVC") & (scale == "magnitude_similarity")
            found += int((tests[hit]["p_holm"] < 0.05).sum())
            elsewhere += int((tests[~hit]["p_holm"] < 0.05).sum())
    assert found >= 18
    assert elsewhere / (5 * repeats) <= binomial_limits(0.05, 5 * repeats)[1]


def _of_textures(table: pd.DataFrame, scale: str, *, rng: np.random.Generator) -> pd.DataFrame:
    claim = Claim(
        name=scale,
        task="absolute",
        measure=scale,
        models=("full", "simplified"),
        bounds=(-7.5, 7.5),
        test="equivalence",
    )
    means = complete_means(table, scale, models=claim.models, repeats=1)
    tests = claim_tests(claim, Values(table=means), caveats=Caveats(), rng=rng)
    return tests[tests["texture"] != ALL_TEXTURES]
