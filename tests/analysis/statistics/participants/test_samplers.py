"""The samplers of the model of the participants, where the answer is known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from tactileq.analysis.statistics.participants.design import (
    choice_studies,
    first_people,
    rating_studies,
)
from tactileq.analysis.statistics.participants.mixture import MixtureOfEffects, vague_mean
from tactileq.analysis.statistics.participants.posterior import (
    Draws,
    Effort,
    choice_draws,
    rating_draws,
)
from tactileq.analysis.statistics.participants.verdict import summary_of
from tactileq.modeling.participants.choices import ODDITY, ChoiceStudies, oddity_share
from tactileq.modeling.participants.effects import EffectPriors
from tactileq.modeling.participants.ratings import RatingStudies

BOUNDS = (-7.5, 7.5)
SHORT = Effort(chains=4, warm_up=150, steps=240, every=3)


def ratings(
    rng: np.random.Generator, effects: np.ndarray, *, sd: float = 8.0, base: float = 60.0
) -> RatingStudies:
    """One study of people with these effects: seven textures, two anchors rated 30 points lower."""
    n = effects.size
    person = base + rng.normal(0, 6, n)
    middle = (
        person[:, None, None, None] + np.array([0.0, 1.0])[:, None] * effects[:, None, None, None]
    )
    values = np.clip(middle + rng.normal(0, sd, (n, 7, 2, 1)), 0, 100)
    anchors = np.clip(person[:, None] - 30 + rng.normal(0, sd, (n, 2)), 0, 100)
    return RatingStudies(
        values=values[None], anchors=anchors[None], trends=np.zeros((2, 1, *values.shape))
    )


def posterior(studies: RatingStudies, seed: int = 1) -> Draws:
    (found,) = rating_draws(studies, BOUNDS, rng=np.random.default_rng(seed), effort=SHORT)
    return found


def oddity(right: np.ndarray, *, catch: np.ndarray | None = None) -> ChoiceStudies:
    """One study of people with these numbers of right answers, of six to each of seven textures."""
    caught = np.full(len(right), 6.0) if catch is None else catch
    asked = np.full((1, *right.shape, 1), 6.0)
    return ChoiceStudies(
        right=right[None, ..., None].astype(float),
        asked=asked,
        catch_right=caught[None],
        catch_asked=np.full((1, len(right)), 6.0),
        trends=np.zeros((2, *asked.shape)),
    )


def test_the_mean_with_flat_priors_is_students_t():
    """Known effects: the posterior of μ under p(μ, σ) ∝ 1 is t with n − 2 degrees of freedom."""
    rng = np.random.default_rng(3)
    effects = rng.normal(2.0, 5.0, 12)
    n = effects.size
    many = 8000
    drawn = vague_mean(
        np.tile(effects, (many, 1)),
        np.full((many, n), 1e-6),
        np.ones((many, n), dtype=bool),
        widest=60.0,
        rng=rng,
    )
    scale = np.sqrt((n - 1) / (n - 2) * effects.var(ddof=1) / n)
    known = stats.t(n - 2, loc=effects.mean(), scale=scale)
    shares = np.array([0.025, 0.25, 0.5, 0.75, 0.975])
    below = (drawn[:, None] < known.ppf(shares)).mean(axis=0)
    assert np.abs(below - shares).max() < 4 * 0.5 / np.sqrt(many)


def test_the_mixture_with_one_known_group_is_normal():
    """Everybody's effect is known and equal: the mean of the only group is a normal posterior."""
    priors = EffectPriors(mean_sd=10.0, spread=1.0, weight=1e-9)
    rng = np.random.default_rng(4)
    studies, n = 500, 9
    mixture = MixtureOfEffects(priors, studies, rng=rng)
    estimates, variances = np.full((studies, n), 6.0), np.full((studies, n), 4.0)
    for _ in range(60):
        effects = mixture.draw(estimates, variances, np.ones((studies, n), dtype=bool))
    # With spread v ≪ 2 the mean of nine estimates has variance (4 + v²)/9, the prior 100.
    own = (4.0 + mixture.spread**2) / n
    expected = np.mean(6.0 * 100 / (100 + own))
    mean = mixture.mixture.mean()
    assert mean.mean() == pytest.approx(expected, abs=5 * mean.std() / np.sqrt(studies))
    assert mean.std() == pytest.approx(np.sqrt(np.mean(own)), rel=0.1)
    assert effects.mean() == pytest.approx(expected, abs=0.1)


def test_clean_ratings_give_the_interval_of_the_paired_t_test():
    rng = np.random.default_rng(5)
    study = ratings(rng, rng.normal(3.0, 6.0, 30))
    found = summary_of(posterior(study))
    differences = np.diff(study.values[0].mean(axis=(1, 3)), axis=1).ravel()
    low, high = stats.ttest_1samp(differences, 0.0).confidence_interval(0.95)
    width = high - low
    assert found.mean == pytest.approx(differences.mean(), abs=0.15 * width)
    assert found.mean_high - found.mean_low == pytest.approx(width, rel=0.2)


def test_careless_people_are_found_and_do_not_move_the_mean():
    rng = np.random.default_rng(6)
    study = ratings(rng, np.full(24, 7.0))
    study.values[0, :5] = rng.uniform(0, 100, study.values[0, :5].shape)
    study.anchors[0, :5] = rng.uniform(0, 100, study.anchors[0, :5].shape)
    draws = posterior(study)
    careless = 1 - draws.attends.mean(axis=(0, 1))
    assert (careless[:5] > 0.5).sum() >= 4  # one of them may answer like anybody by chance
    assert (careless[5:] < 0.2).all()
    found = summary_of(draws)
    assert found.mean_low < 7.0 < found.mean_high
    assert found.mean > 5.5  # 19 of 24 times 7 is 5.5


def test_lapsed_trials_are_counted():
    rng = np.random.default_rng(7)
    study = ratings(rng, np.zeros(36))
    lapsed = rng.random(study.values.shape) < 0.12
    study.values[lapsed] = rng.uniform(0, 100, lapsed.sum())
    share = posterior(study).lapses
    # Lapses near what would have been rated anyway cannot be told from judgements.
    assert 0.06 < share.mean() < 0.16


def test_ratings_at_the_end_hide_no_difference():
    rng = np.random.default_rng(8)
    study = ratings(rng, np.full(36, 9.0), base=93.0)
    seen = np.diff(study.values[0].mean(axis=(1, 3)), axis=1).mean()
    found = summary_of(posterior(study))
    assert seen < 6.0  # the scale shows much less than 9
    assert found.mean_low < 9.0 < found.mean_high
    assert not found.inside(BOUNDS)


def test_split_opinions_are_no_equivalence():
    rng = np.random.default_rng(9)
    found = summary_of(posterior(ratings(rng, np.repeat([-12.0, 12.0], 12))))
    assert found.inside(BOUNDS)
    assert found.somebody > 0.99
    assert found.share_low > 0.4


def test_one_person_in_ten_is_seen_in_the_odd_one_out():
    rng = np.random.default_rng(10)
    right = rng.binomial(6, 1 / 3, (30, 7))
    nobody = oddity(right)
    some = oddity(np.where(np.arange(30)[:, None] < 3, rng.binomial(6, 0.95, (30, 7)), right))
    of_nobody, of_some = (
        choice_draws(one, ODDITY, (-0.1, 0.1), rng=np.random.default_rng(2), effort=SHORT)[0]
        for one in (nobody, some)
    )
    assert (of_nobody.outside > 0).mean() < 0.2
    assert summary_of(of_nobody).share_most < 0.15
    assert (of_some.outside >= 3).mean() > 0.99
    assert summary_of(of_some).share_low < 0.1 < summary_of(of_some).share_most
    effects = of_some.effects.mean(axis=(0, 1))
    assert (effects[:3] > 0.5).all()
    assert (effects[3:] < 0.1).all()


def test_who_fails_catch_trials_is_careless_and_not_somebody_who_feels_nothing():
    rng = np.random.default_rng(11)
    share = float(oddity_share(np.array(2.5)))
    right = rng.binomial(6, share, (20, 7))
    right[:4] = rng.binomial(6, 1 / 3, (4, 7))
    catch = np.full(20, 6.0)
    catch[:4] = [2.0, 1.0, 3.0, 2.0]
    (draws,) = choice_draws(oddity(right, catch=catch), ODDITY, (-0.1, 0.1), rng=rng, effort=SHORT)
    assert (1 - draws.attends.mean(axis=(0, 1))[:4] > 0.9).all()
    found = summary_of(draws)
    assert found.mean_low < share - 1 / 3 < found.mean_high


def test_missing_people_change_nothing_but_the_random_numbers():
    rng = np.random.default_rng(12)
    whole = ratings(rng, rng.normal(0, 3, 24))
    parts = first_people(whole, [12, 24])
    assert np.isnan(parts.values[0, 12:]).all()
    padded, everybody = (
        summary_of(one)
        for one in rating_draws(parts, BOUNDS, rng=np.random.default_rng(1), effort=SHORT)
    )
    alone = summary_of(
        posterior(
            RatingStudies(
                values=whole.values[:, :12],
                anchors=whole.anchors[:, :12],
                trends=whole.trends[:, :, :12],
            )
        )
    )
    spread = alone.mean_high - alone.mean_low
    assert padded.mean == pytest.approx(alone.mean, abs=0.1 * spread)
    assert padded.mean_high - padded.mean_low == pytest.approx(spread, rel=0.2)
    assert everybody.mean_high - everybody.mean_low < spread


def test_tables_become_arrays_in_any_order_of_rows():
    import pandas as pd

    rows = [
        (who, day, trial, texture, model, 10.0 * day + trial)
        for who in ("b", "a")
        for day in (1, 2)
        for trial, (texture, model) in enumerate(
            [("t2", "full"), ("t1", "simplified"), ("t1", "full"), ("t2", "simplified")], start=1
        )
    ]
    columns = ["participant_id", "session", "trial", "texture", "model", "rating"]
    table = pd.DataFrame(rows, columns=columns)
    anchors = pd.DataFrame(
        [("a", 1, 9, "t1", "t2", 3.0), ("b", 1, 9, "t1", "t2", 4.0), ("b", 2, 9, "t1", "t2", 5.0)],
        columns=["participant_id", "session", "trial", "texture", "virtual_texture", "rating"],
    )
    models = ("full", "simplified")
    arranged = {"models": models, "people": ["a", "b"]}
    found = rating_studies(table, anchors, "rating", **arranged)
    assert found.values.shape == (1, 2, 2, 2, 2)
    # t1 full was trial 3 on both days, t2 simplified trial 4.
    assert found.values[0, 1, 0, 0].tolist() == [13.0, 23.0]
    assert found.values[0, 0, 1, 1].tolist() == [14.0, 24.0]
    assert found.trends[0, 0, 0, 1, 1].tolist() == [-0.5, 0.5]  # the day
    assert found.trends[1, 0, 0, 1, 1].tolist() == [0.5, 0.5]  # last of its session
    np.testing.assert_array_equal(found.anchors[0], [[3.0, np.nan], [4.0, 5.0]])
    shuffled = table.sample(frac=1.0, random_state=1)
    again = rating_studies(shuffled, anchors.iloc[::-1], "rating", **arranged)
    np.testing.assert_array_equal(again.values, found.values)
    np.testing.assert_array_equal(again.trends, found.trends)
    right = table.assign(correct=(table["trial"] == 1).astype(float))
    counted = choice_studies(right, anchors[:0], **arranged)
    assert counted.asked.tolist() == np.full((1, 2, 2, 2), 2.0).tolist()
    assert counted.right[0, 0].tolist() == [[0.0, 0.0], [2.0, 0.0]]
    assert counted.trends[0].tolist() == np.zeros((1, 2, 2, 2)).tolist()  # mean of both days
