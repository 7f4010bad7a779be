"""The sampler of the model of the participants, where the answer is known."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from tactileq.analysis.statistics.participants import posterior as posterior_module
from tactileq.analysis.statistics.participants.design import (
    first_people,
    rating_studies,
    side_by_side,
)
from tactileq.analysis.statistics.participants.population import GridSd, NormalPopulation
from tactileq.analysis.statistics.participants.posterior import (
    FEWEST_EFFECTIVE,
    Draws,
    Effort,
    described,
    effective_draws,
    r_hat,
    rating_draws,
    sufficient_draws,
    well_sampled,
)
from tactileq.analysis.statistics.participants.ratings import RatingSampler
from tactileq.analysis.statistics.participants.verdict import PeopleSummary, summary_of
from tactileq.benches.validation.people.held_out import OTHER_WORLDS
from tactileq.modeling.arrays import Floats
from tactileq.modeling.participants.ratings import HIGHEST, LOWEST, RatingPriors, RatingStudies
from tactileq.modeling.seeds import generator, number_of

BOUNDS = (-7.5, 7.5)
SHORT = Effort(chains=4, warm_up=150, steps=240, every=3)


def ratings(
    rng: np.random.Generator,
    effects: np.ndarray,
    *,
    sd: float = 8.0,
    base: float = 60.0,
    repeats: int = 1,
    deviation_sd: float = 0.0,
) -> RatingStudies:
    """One study of people with these effects: seven textures, two anchors rated 30 points lower."""
    n = effects.size
    person = base + rng.normal(0, 6, n)
    on_textures = effects[:, None] + rng.normal(0, deviation_sd, (n, 7))
    middle = person[:, None, None] + np.array([0.0, 1.0]) * on_textures[..., None]
    values = np.clip(middle[..., None] + rng.normal(0, sd, (n, 7, 2, repeats)), 0, 100)
    anchors = np.clip(person[:, None] - 30 + rng.normal(0, sd, (n, 2)), 0, 100)
    return RatingStudies(
        values=values[None], anchors=anchors[None], trends=np.zeros((2, 1, *values.shape))
    )


def told_by(draws: Draws) -> PeopleSummary:
    """A posterior in short, though it has too few draws to be printed."""
    return summary_of(draws, converged=True)


def posterior(studies: RatingStudies, seed: int = 1) -> Draws:
    (found,) = rating_draws(studies, rng=np.random.default_rng(seed), effort=SHORT)
    return found


# --- A normal population, and an SD on a grid -------------------------------------------------


def sd_posterior(grid: Floats, likelihood: Floats, scale: float) -> Floats:
    """Probabilities of the places of a grid whose root is even; half-normal prior."""
    log = likelihood - 0.5 * (grid / scale) ** 2 + 0.5 * np.log(grid)
    share = np.exp(log - log.max())
    return np.asarray(share / share.sum())


@pytest.mark.parametrize("power", [0.0, -6.0, 9.0, 30.0], ids=["prior", "least", "most", "amid"])
def test_an_sd_has_the_posterior_of_its_grid_wherever_it_lies(power: float):
    """Windows laid at random favour no place: neither amid the grid nor at its ends."""

    def likelihood(sd: Floats) -> Floats:
        return np.asarray(-power * np.abs(sd - 2.0) if power == 30.0 else power * sd)

    studies, scale = 5000, 1.5
    one = GridSd(scale, studies, rng=np.random.default_rng(2))
    seen = set()
    for _ in range(200):
        window = one.window()
        seen |= set(window[:100].ravel().tolist())
        one.choose(likelihood(window))
    grid = np.array(sorted(seen))
    expected = studies * sd_posterior(grid, likelihood(grid), scale)
    counts = np.array([(one.now == place).sum() for place in grid])
    assert counts.sum() == studies
    usual = expected > 10  # the rare places together
    counted, known = (np.append(of[usual], of[~usual].sum() + 10) for of in (counts, expected))
    assert stats.chisquare(counted, known).pvalue > 1e-3


def test_an_sd_that_is_held_stays_none():
    one = GridSd(10.0, 40, rng=np.random.default_rng(2))
    held = np.arange(40) % 2 == 0
    one.hold(held)
    for _ in range(30):
        one.choose(np.log(one.window()) * 20)
        assert (one.now[held] < 0.01).all()
        assert np.ptp(one.now[held]) == 0
    assert (one.now[~held] > 5).all()


@pytest.mark.parametrize("known", [True, False], ids=["effects known", "as ratings tell them"])
def test_a_population_has_the_posterior_that_integration_gives(known: bool):
    """Moments of mean, SD and of single effects; somebody of whom nothing is known is like all."""
    rng = np.random.default_rng(3)
    n, studies = 10, 2000
    estimates = rng.normal(4.0, 5.0, n)
    precision = np.full(n, 1e8) if known else rng.uniform(0.02, 0.5, n)
    precision[-1] = 0.0
    population = NormalPopulation(6.0, 8.0, studies, rng=rng)
    total = np.tile(estimates * precision, (studies, 1))
    for _ in range(80):
        effects = population.draw(total, np.tile(precision, (studies, 1)))
    # The density at a mean and an SD, of people of whom something is known.
    mean, sd = np.meshgrid(np.linspace(-20, 25, 300), np.linspace(1e-3, 32, 400), indexing="ij")
    log = stats.norm.logpdf(mean, 0, 6.0) + stats.halfnorm.logpdf(sd, scale=8.0)
    for one, own in zip(estimates[:-1], precision[:-1], strict=True):
        log += stats.norm.logpdf(one, mean, np.sqrt(sd**2 + 1 / own))
    density = np.exp(log - log.max())
    density /= density.sum()
    pairs = [(mean, population.mean), (sd, population.sd)]
    for place in (0, 1, n - 1):
        middle = (mean + sd**2 * precision[place] * estimates[place]) / (
            1 + sd**2 * precision[place]
        )
        pairs.append((middle, effects[:, place]))
    for exact, drawn in pairs:
        expected = (density * exact).sum()
        assert drawn.mean() == pytest.approx(expected, abs=4 * drawn.std() / np.sqrt(studies))
    for exact, drawn in pairs[:2]:
        expected = np.sqrt((density * exact**2).sum() - (density * exact).sum() ** 2)
        assert drawn.std() == pytest.approx(expected, rel=0.06)
    spread = np.sqrt((density * (mean**2 + sd**2)).sum() - (density * mean).sum() ** 2)
    assert effects[:, -1].std() == pytest.approx(spread, rel=0.06)


# --- Studies ----------------------------------------------------------------------------------


def test_clean_ratings_give_the_interval_of_the_paired_t_test():
    rng = np.random.default_rng(5)
    study = ratings(rng, rng.normal(3.0, 6.0, 30))
    found = told_by(posterior(study))
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
    found = told_by(draws)
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
    found = told_by(posterior(study))
    assert seen < 6.0  # the scale shows much less than 9
    assert found.mean_low < 9.0 < found.mean_high
    assert not found.inside(BOUNDS)


@pytest.mark.parametrize("repeats", [1, 3])
def test_no_effect_on_a_texture_is_known_better_than_by_t(repeats: int):
    """People's effects deviate on single textures by an SD of 10, be it told from scatter or not.

    Were it not, SDs would be 0.6 of the standard errors of t with three repeats.
    """
    rng = np.random.default_rng(13)
    both = [
        ratings(rng, rng.normal(0.0, 3.0, 20), repeats=repeats, deviation_sd=10.0) for _ in range(4)
    ]
    found = rating_draws(side_by_side(both), rng=rng, effort=SHORT)
    own = np.concatenate([draws.textures.reshape(-1, 7) for draws in found], axis=1)
    means = np.concatenate([one.values[0].mean(axis=-1) for one in both], axis=1)
    errors = stats.sem(means[..., 1] - means[..., 0], axis=0)
    ratio = np.sqrt((own.std(axis=0) ** 2).mean() / (errors**2).mean())
    assert 0.9 < ratio < 1.2
    # Nothing is planted on any texture.
    z = own.mean(axis=0) / own.std(axis=0)
    assert z.std() < 1.3


def test_missing_people_change_nothing_but_the_random_numbers():
    rng = np.random.default_rng(12)
    whole = ratings(rng, rng.normal(0, 3, 24))
    parts = first_people(whole, [12, 24])
    assert np.isnan(parts.values[0, 12:]).all()
    padded, everybody = (
        told_by(one) for one in rating_draws(parts, rng=np.random.default_rng(1), effort=SHORT)
    )
    alone = told_by(
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


# --- Ratings as the same people could give them -----------------------------------------------


def test_what_is_compared_by_loops_over_ragged_ratings():
    rng = np.random.default_rng(14)
    values = np.round(np.clip(rng.normal(60, 40, (3, 4, 3, 2, 3)), 0, 100), 0)
    values[rng.random(values.shape) < 0.3] = np.nan
    values[1, ..., 1:] = np.nan  # no repeats
    values[2, 0] = np.nan
    values[2, 0, 0, 0, 0] = 50.0  # a single rating
    found = described(values)
    for b, study in enumerate(values):
        given = study[~np.isnan(study)]
        assert found.at_ends[b] == pytest.approx(np.isin(given, (LOWEST, HIGHEST)).mean())
        for one, spread in zip(study, found.spread[b], strict=True):
            rated = one[~np.isnan(one)]
            known = rated.std(ddof=1) if rated.size > 1 else np.nan
            assert spread == pytest.approx(known, nan_ok=True)
        cells = [cell[~np.isnan(cell)] for cell in study.reshape(-1, 3)]
        squares = sum(cell.var() * cell.size for cell in cells if cell.size)
        freedom = sum(cell.size - 1 for cell in cells if cell.size)
        known = np.sqrt(squares / freedom) if freedom else np.nan
        assert found.repeated[b] == pytest.approx(known, nan_ok=True)
    assert np.isnan(found.repeated).tolist() == [False, True, False]
    assert np.isnan(found.spread[2, 0])


def test_replicated_ratings_are_on_the_scale_where_something_was_rated():
    rng = np.random.default_rng(15)
    study = ratings(rng, np.full(12, 5.0), base=90.0, repeats=2)
    study.values[rng.random(study.values.shape) < 0.2] = np.nan
    study.values[0, 3] = np.nan
    sampler = RatingSampler(study, RatingPriors(), rng=rng)
    for _ in range(20):
        sampler.step()
        again = sampler.replicated()
        np.testing.assert_array_equal(np.isnan(again), np.isnan(study.values))
        rated = again[~np.isnan(again)]
        assert ((rated >= LOWEST) & (rated <= HIGHEST)).all()
        assert (rated == HIGHEST).any()


def test_lapsed_trials_are_replicated_anywhere_on_the_scale():
    rng = np.random.default_rng(18)
    sampler = RatingSampler(ratings(rng, np.zeros(40)), RatingPriors(), rng=rng)
    sampler.lapses = np.ones(1)
    again = sampler.replicated()
    inside = again[(again > LOWEST) & (again < HIGHEST)]
    assert stats.kstest(inside, stats.uniform(LOWEST, HIGHEST - LOWEST).cdf).pvalue > 1e-3


def test_ratings_that_follow_the_model_look_like_their_replications():
    rng = np.random.default_rng(16)
    study = ratings(rng, rng.normal(3.0, 4.0, 24), base=88.0, repeats=3)
    draws, given = posterior(study), described(study.values)
    assert 0.05 < given.at_ends[0] < 0.5
    for name in ("at_ends", "repeated"):
        low, high = np.quantile(getattr(draws, name), [0.005, 0.995])
        assert low < getattr(given, name)[0] < high
    places = (draws.spread < given.spread[0]).mean(axis=(0, 1))
    assert ((places > 0.005) & (places < 0.995)).all()
    assert draws.repeated.mean() == pytest.approx(given.repeated[0], rel=0.1)


# --- Whether draws suffice --------------------------------------------------------------------


def autoregressive(correlation: float, shape: tuple[int, ...], *, seed: int = 1) -> Floats:
    """Chains (chains, S, …) of variance 1 whose neighbours are correlated."""
    drawn = np.random.default_rng(seed).standard_normal(shape)
    for step in range(1, shape[1]):
        fresh = np.sqrt(1 - correlation**2) * drawn[:, step]
        drawn[:, step] = correlation * drawn[:, step - 1] + fresh
    return np.asarray(drawn)


@pytest.mark.parametrize("correlation", [-0.3, 0.0, 0.5, 0.9])
def test_chains_of_known_correlation_have_known_effective_draws(correlation: float):
    draws = autoregressive(correlation, (8, 4000, 3))
    known = 8 * 4000 * (1 - correlation) / (1 + correlation)
    np.testing.assert_allclose(effective_draws(draws), np.full(3, known), rtol=0.15)
    assert r_hat(draws) == pytest.approx(np.ones(3), abs=0.01)


def test_r_hat_of_chains_that_do_not_agree():
    # Two pairs of chains 2 SD apart: between-chain variance 8/7 of eight halves, over within 1.
    draws = np.random.default_rng(1).normal(size=(4, 2000))
    apart = draws + np.array([-1, -1, 1, 1])[:, None]
    assert r_hat(apart) == pytest.approx(np.sqrt(1 + 8 / 7), rel=0.02)
    assert effective_draws(apart) < 40
    # A drift makes halves of a single chain disagree.
    drifting = draws[:1] + np.linspace(-2, 2, 2000)
    assert r_hat(drifting) > 1.3


def test_draws_that_do_not_vary_are_all_there_is():
    constant = np.full((4, 100, 2), 3.0)
    np.testing.assert_array_equal(r_hat(constant), 1.0)
    np.testing.assert_array_equal(effective_draws(constant), 400.0)
    stuck = np.arange(4.0)[:, None] * np.ones(100)
    assert r_hat(stuck) == np.inf
    assert effective_draws(stuck) < 10
    assert not well_sampled(stuck)


def test_only_what_is_sampled_well_may_be_printed():
    shape = (4, 1000)
    many, few = 1.5 * FEWEST_EFFECTIVE, 0.6 * FEWEST_EFFECTIVE
    columns = [
        autoregressive((4000 - count) / (4000 + count), shape, seed=3) for count in (many, few)
    ]
    apart = autoregressive(0.0, shape) + np.array([0.0, 0.0, 0.0, 1.5])[:, None]
    both = np.stack([*columns, apart, np.ones(shape)], axis=-1)
    assert well_sampled(both).tolist() == [True, False, False, True]
    assert well_sampled(autoregressive(0.0, shape) > 0).item()


def fields(**given: Floats) -> Draws:
    """Draws of three people, two textures; all good but what is given."""
    good = {
        name: autoregressive(0.0, (4, 400, *own), seed=seed)
        for seed, (name, own) in enumerate(
            [
                *(("mean", ()), ("textures", (2,)), ("people_sd", ()), ("effects", (3,))),
                *(("attends", (3,)), ("careless", ()), ("lapses", ()), ("at_ends", ())),
                *(("spread", (3,)), ("repeated", ())),
            ]
        )
    }
    good["attends"] = good["attends"] > 0
    return Draws(**{**good, **given})


def test_one_quantity_that_is_not_sampled_well_spoils_those_it_belongs_to():
    assert fields().suffices("mean", "textures", "effects", "attends", "careless")
    bad = autoregressive(0.0, (4, 400, 2))
    bad[:2, :, 1] += 3
    draws = fields(textures=bad)
    assert draws.suffices("mean", "effects")
    assert not draws.suffices("textures")
    assert not draws.suffices("mean", "textures")


def test_longer_is_sampled_only_what_did_not_suffice(monkeypatch: pytest.MonkeyPatch):
    rng = np.random.default_rng(17)
    studies = side_by_side([ratings(rng, np.full(8, one)) for one in (0.0, 25.0, 2.0)])
    small, longer, longest = (Effort(chains=2, warm_up=30, steps=steps) for steps in (8, 12, 16))
    monkeypatch.setattr(posterior_module, "Effort", lambda: small)
    monkeypatch.setattr(posterior_module, "LONGER", longer)
    monkeypatch.setattr(posterior_module, "LONGEST", longest)
    printed_at = posterior_module.PRINTED
    for limits, kept in (
        ((10.0, 1e9), [4, 6, 4]),  # all that is printed, and what verdicts rest on, below a mean
        ((10.0, 10.0), [4, 8, 4]),
        ((1e9, 1e9), [4, 4, 4]),
        ((-1e9, -1e9), [8, 8, 8]),
    ):
        monkeypatch.setattr(
            Draws,
            "suffices",
            lambda self, *names, at=limits: self.mean.mean() < at[names != printed_at],
        )
        found = sufficient_draws(studies, rng=rng)
        assert [draws.mean.shape for draws in found] == [(2, count) for count in kept]
        assert [draws.mean.mean() > 10 for draws in found] == [False, True, False]


def test_no_chain_begins_where_nobody_seems_to_attend() -> None:
    """Five repeats of eight people who all attend, as priors twice as wide have it."""
    rng = np.random.default_rng(21)
    once = ratings(rng, rng.normal(-3.0, 3.0, 8))
    values = np.clip(np.repeat(once.values, 5, axis=-1) + rng.normal(0, 8, (1, 8, 7, 2, 5)), 0, 100)
    many = RatingStudies(
        values=values, anchors=np.empty((1, 8, 0)), trends=np.zeros((2, *values.shape))
    )
    wide = RatingPriors().doubled()
    (draws,) = rating_draws(many, rng=np.random.default_rng(3), priors=wide, effort=SHORT)
    assert (draws.attends.mean(axis=(1, 2)) > 0.7).all()


def test_whoever_seems_to_attend_can_be_found_careless() -> None:
    """Somebody nudges the slider: half of the chains thought of lapses, and never changed."""
    rng = generator(5, number_of("stopped short"), 20, 50)
    drawn = OTHER_WORLDS["stopped short"](rng, (50, 20))
    orders = drawn.orders[10:11] - 0.5
    one = RatingStudies(
        values=drawn.values[10:11],
        anchors=drawn.anchors[10:11],
        trends=np.stack([np.zeros_like(orders), orders]),
    )
    effort = Effort(chains=8, warm_up=100, steps=600)
    (draws,) = rating_draws(one, rng=np.random.default_rng(1), effort=effort)
    stayed = draws.attends[:, :, 7].mean(axis=1) > 0.95
    assert stayed.sum() <= 1


def test_chains_that_disagree_on_who_attends_did_not_converge() -> None:
    rng = np.random.default_rng(22)
    wide = rng.normal(0.0, 1.0, (8, 400))
    told = {name: np.zeros((8, 400)) for name in vars(posterior(ratings(rng, np.zeros(8))))}
    told |= {"mean": wide, "textures": rng.normal(0.0, 1.0, (8, 400, 4))}
    attends = np.ones((8, 400, 10), dtype=bool)
    assert Draws(**{**told, "attends": attends}).converged
    attends = attends.copy()
    attends[0] = False
    assert not Draws(**{**told, "attends": attends}).converged
