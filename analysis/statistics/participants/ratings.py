"""The posterior of what people rate, by Gibbs sampling; many studies, or chains, at once.

docs/method/participants.md#sampler
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import gammaln, ndtr, ndtri

from tactileq.analysis.statistics.participants.population import GridSd, NormalPopulation
from tactileq.modeling.arrays import Bools, Floats
from tactileq.modeling.participants.ratings import (
    AT_END,
    HIGHEST,
    LOWEST,
    WITHIN,
    RatingPriors,
    RatingStudies,
    censored,
    lapsed_ratings,
)

_NORMAL = 1 / np.sqrt(2 * np.pi)
_HALVES = np.array([-0.5, 0.5])[:, None]
_TINY = 1e-300
_LEAST = 1e-4  # variance


def _summed(values: Floats, *, keep: int) -> Floats:
    """Sums over all axes but the first few; a product is much faster than short sums."""
    flat = values.reshape(*values.shape[:keep], -1)
    found: Floats = flat @ np.ones(flat.shape[-1])
    return found


def _other_less_reference(left: Floats) -> Floats:
    """(B, n, T) half of the sum over the other model's repeats less that of the reference's."""
    sums = _summed(left, keep=4)
    found: Floats = 0.5 * (sums[..., 1] - sums[..., 0])
    return found


class RatingSampler:
    """The state of the chains of B studies; `step` draws everything once.

    Parameters
    ----------
    studies : RatingStudies
        Missing people have missing answers alone.
    """

    def __init__(
        self, studies: RatingStudies, priors: RatingPriors, *, rng: np.random.Generator
    ) -> None:
        self._priors, self._rng = priors, rng
        self._main = _Answers(studies.values)
        self._anchors = _Answers(studies.anchors)
        self._trends = studies.trends
        self._varying = [c for c, one in enumerate(studies.trends) if np.ptp(one) > 0]
        b, n, t, _, _ = studies.values.shape
        # Who is there at all; the others follow the priors and change nothing.
        self.people: Bools = self._main.of_people + self._anchors.of_people > 0
        self.population = NormalPopulation(priors.mean_sd, priors.people_sd, b, rng=rng)
        self._interaction = GridSd(priors.interaction_sd, b, rng=rng)
        self._given_count = _summed(self._main.counts, keep=3)
        self._given = self._main.of_people + self._anchors.of_people
        # Of a single rating nothing tells it from the scatter of a person's ratings.
        twice = self._main.counts.sum(axis=-1) > 1
        self._interaction.hold(~twice.any(axis=(1, 2, 3)))
        self._level = np.full(b, priors.level[0])
        self._person = self._main.means(self._level)
        self._person_variance = np.full(b, priors.person_sd**2)
        self._cell, self._cell_variance = np.zeros((b, n, t)), np.full(b, priors.cell_sd**2)
        self._texture, self.texture_effects = np.zeros((b, t)), np.zeros((b, t))
        self.effects, self._deviations = np.zeros((b, n)), np.zeros((b, n, t))
        self._slopes = np.zeros((len(studies.trends), b))
        self._rest = np.zeros_like(studies.values)
        anchors = studies.anchors.shape[2]
        self._anchor, self._own_anchor = (
            np.full((b, anchors), priors.anchor[0]),
            np.zeros((b, n, anchors)),
        )
        self._anchor_variance = np.full(b, priors.anchor_sd**2)
        self._variance = np.full((b, n), priors.rating_sd**2)
        self._typical = np.full(b, priors.rating_sd**2)
        self.attends = np.ones((b, n), dtype=bool)
        self.lapses = np.full(b, 0.05)
        self.careless = np.full(b, 0.05)

    @property
    def interaction_sd(self) -> Floats:
        """(B,) SD of the deviations of people's effects on single textures."""
        return self._interaction.now

    @property
    def typical_sd(self) -> Floats:
        """(B,) typical SD of a person's ratings."""
        return np.asarray(np.sqrt(self._typical))

    def replicated(self) -> Floats:
        """(B, n, T, 2, R) ratings as the same people could give them; NaN where none was given."""
        expected = self._own() + self.attends[..., None, None, None] * self._felt()
        sd = np.sqrt(self._variance)[..., None, None, None]
        shape, lapses = self._rest.shape, self.lapses[:, None, None, None, None]
        rated = censored(expected + sd * self._rng.standard_normal(shape))
        lapsed = self._rng.random(shape) < lapses
        rated = np.where(lapsed, lapsed_ratings(self._rng, shape), rated)
        return np.where(self._main.answered, rated, np.nan)

    def step(self, *, all_attend: bool = False) -> None:
        """Draw every unknown once, given all others; at first with everybody attending.

        Chains begin far from the answers, where nobody seems to attend, and where nobody does
        nothing tells the effects any more: some would never come back.
        """
        self._draw_classes(all_attend=all_attend)
        self._draw_anchors()
        self._draw_effects()
        self._draw_levels()
        self._draw_cells()
        self._draw_textures()
        self._draw_trends()
        self._draw_variances()
        self._draw_shares()

    # What the state predicts; all (B, n, T, 2, R) or broadcast to it.

    def _trend(self) -> Floats | float:
        if not self._varying:
            return 0.0
        found: Floats = np.einsum(
            "cb,cb...->b...", self._slopes[self._varying], self._trends[self._varying]
        )
        return found

    def _own(self) -> Floats:
        """(B, n, T, 2, R): what people rate whether they attend or not."""
        found: Floats = (self._person[..., None] + self._cell)[..., None, None] + self._trend()
        return found

    def _on_textures(self) -> Floats:
        """(B, n, T): effect of each person on each texture."""
        found: Floats = self.effects[..., None] + self.texture_effects[:, None] + self._deviations
        return found

    def _felt(self) -> Floats:
        """(B, n, T, 2, 1): what people who attend add to their own levels."""
        effects = self._on_textures()
        felt: Floats = self._texture[:, None, :, None, None] + _HALVES * effects[..., None, None]
        return felt

    def _draw_classes(self, *, all_attend: bool) -> None:
        """Who attends, which trials lapsed, and the latent judgements beyond the ends.

        What a person rates a texture at stays as it is, whether the texture or their own deviation
        takes them there: deviations that made up for a texture would keep them attending.
        """
        texture = self._texture[:, None]
        self._cell = self._cell + self.attends[..., None] * texture
        own = self._own()
        of_attending, of_careless, log = self._propose_variances(own)
        log -= self._propose_effects(own, of_attending)
        effects = _HALVES * self._on_textures()[..., None, None]
        each = (..., None, None, None)
        attending = self._main.likelihoods(own + effects, np.sqrt(of_attending)[each])
        careless = self._main.likelihoods(own, np.sqrt(of_careless)[each])
        sd_anchor = np.sqrt(of_attending + self._anchor_variance[:, None])[..., None]
        level = self._person[..., None]
        expected = level + self._anchor[:, None]
        anchors = (
            self._anchors.likelihoods(expected, sd_anchor),
            self._anchors.likelihoods(level, np.sqrt(of_careless)[..., None]),
        )
        lapses = self.lapses[:, None, None]
        log += (np.log1p(-self.careless) - np.log(self.careless))[:, None]
        log += self._main.log_ratio(attending, careless, self.lapses)
        log += self._anchors.log_ratio(*anchors, self.lapses)
        made_up = self._cell**2 - (self._cell - texture) ** 2
        log += 0.5 * made_up.sum(axis=2) / self._cell_variance[:, None]
        share = 1.0 if all_attend else 1 / (1 + np.exp(-np.clip(log, -500, 500)))
        self.attends = self._rng.random(log.shape) < share
        self._variance = np.where(self.attends, of_attending, of_careless)
        sd = np.sqrt(self._variance)[each]
        sd_own = np.sqrt(of_careless)[..., None]
        chosen = np.where(self.attends[each], attending, careless)
        self._main.draw_lapses(chosen, lapses[..., None, None], self._rng)
        shown = self.attends[..., None]
        self._anchors.draw_lapses(np.where(shown, *anchors), lapses, self._rng)
        self._cell = self._cell - self.attends[..., None] * texture
        middle = own + self.attends[..., None, None, None] * effects
        self._main.draw_latent(middle, sd, self._rng)
        # From here on what is left of the latent judgements is kept up to date by every step.
        self._rest = self._main.latent - middle
        middle = np.where(shown, expected, level)
        self._anchors.draw_latent(middle, np.where(shown, sd_anchor, sd_own), self._rng)

    def _propose_variances(self, own: Floats) -> tuple[Floats, Floats, Floats]:
        """(B, n) variances of each person's ratings if they attend, and if they do not.

        One of them is the present one. The other is drawn from what the ratings say if none lapsed,
        or, of who would attend, as often from its prior: all that is unlike may have lapsed. Third,
        the log densities of both draws to their priors, that of who attends subtracted.
        """
        squares = _summed(self._main.answered * (self._main.given - own) ** 2, keep=2)
        away = self._anchors.given - self._person[..., None]
        squares += (self._anchors.answered * away**2).sum(axis=2)
        half, count = self._priors.rating_df / 2, self._given / 2
        prior = _InverseGamma(np.full(count.shape, half), half * self._typical[:, None])
        told = _InverseGamma(prior.shape + count, prior.rate + squares / 2)
        from_prior = self._rng.random(count.shape) < 0.5
        drawn = np.where(from_prior, prior.draw(self._rng), told.draw(self._rng))
        of_attending = np.where(self.attends, self._variance, drawn)
        log = -np.logaddexp(0.0, told.log(of_attending) - prior.log(of_attending)) + np.log(2)
        alike = np.ones(count.shape)
        prior = _InverseGamma(alike, self._priors.careless_scale * alike)
        told = _InverseGamma(prior.shape + count, prior.rate + squares / 2)
        of_careless = np.where(self.attends, told.draw(self._rng), self._variance)
        log += told.log(of_careless) - prior.log(of_careless)
        return of_attending, of_careless, log

    def _propose_effects(self, own: Floats, variances: Floats) -> Floats:
        """What careless people's effects would be, did they attend; (B, n) log density to prior.

        Pseudo-priors of Carlin and Chib (1995): effects of people who do not attend are in no
        likelihood, and drawn from the prior they would hardly ever fit the answers, so that whoever
        is careless in one step stayed so. They are drawn as if these people attended and no trial
        lapsed, or as often from the prior: where many trials lapsed, answers mislead, and whoever
        attended stayed so. The ratio of that density to the prior's is taken back where classes
        are drawn.
        """
        precision = 0.25 * self._given_count / variances[..., None]
        left = self._main.answered * (self._main.given - own)
        total = _other_less_reference(left) / variances[..., None]
        variance, textures = (
            self._interaction.now[:, None, None] ** 2,
            self.texture_effects[:, None],
        )
        grown = 1 + precision * variance
        prior, mean = self.population.sd[:, None] ** -2, self.population.mean[:, None]
        known = (precision / grown).sum(axis=2) + prior
        middle = ((total - precision * textures) / grown).sum(axis=2) + mean * prior
        middle /= known
        unlike = self._rng.random(known.shape) < 0.5
        drawn = self._normal(np.where(unlike, mean, middle), np.where(unlike, prior, known))
        self.effects = np.where(self.attends, self.effects, drawn)
        rest = total - precision * (self.effects[..., None] + textures)
        middles = variance * rest / grown
        told = ~unlike[..., None]
        drawn = self._normal(told * middles, np.where(told, grown, 1.0) / variance)
        own_deviations = self._deviations = np.where(
            self.attends[..., None], self._deviations, drawn
        )
        away = own_deviations**2 - grown * (own_deviations - middles) ** 2
        log = (away / variance + np.log(grown)).sum(axis=2) + np.log(known / prior)
        log += prior * (self.effects - mean) ** 2 - known * (self.effects - middle) ** 2
        found: Floats = np.logaddexp(0.5 * log, 0.0) - np.log(2)
        return found

    def _draw_effects(self) -> None:
        """Effects of people, of textures and of people on textures, with the SDs of the people.

        The deviations are integrated out of everything but themselves.
        """
        share = (self.attends / self._variance)[..., None]
        precision = 0.25 * _summed(self._main.counts, keep=3) * share
        old = self._on_textures()
        total = _other_less_reference(self._main.counts * self._rest) * share + precision * old
        variance = self._interaction.window()[:, None, None] ** 2
        rest = (total - precision * (old - self._deviations))[..., None]
        grown = 1 + precision[..., None] * variance
        log = rest**2 * variance / grown - np.log(grown)
        self._interaction.choose(0.5 * log.sum(axis=(1, 2)))
        variance = self._interaction.now[:, None, None] ** 2
        grown = 1 + precision * variance
        weights, sums = precision / grown, total / grown
        of_people = sums - weights * self.texture_effects[:, None]
        self.effects = self.population.draw(of_people.sum(axis=2), weights.sum(axis=2))
        of_textures = sums - weights * self.effects[..., None]
        self.texture_effects = self._without_mean(
            of_textures.sum(axis=1), weights.sum(axis=1), self._priors.texture_effect_sd
        )
        means = self.effects[..., None] + self.texture_effects[:, None]
        rest = total - precision * means
        self._deviations = self._normal(variance * rest / grown, grown / variance)
        self._apart(self.attends[..., None] * (self._on_textures() - old))

    def _apart(self, change: Floats) -> None:
        """Take changed effects (B, n, T) of the other model from what is left."""
        change = 0.5 * change[..., None]
        self._rest[:, :, :, 0] += change
        self._rest[:, :, :, 1] -= change

    def _draw_levels(self) -> None:
        counts, old = self._main.counts, self._person
        own = self.attends[..., None] * (self._anchor[:, None] + self._own_anchor)
        answers = self._main.of_people
        count = answers + self._anchors.of_people
        total = _summed(counts * self._rest, keep=2) + answers * old
        total += (self._anchors.counts * (self._anchors.latent - own)).sum(axis=2)
        prior = 1 / self._person_variance[:, None]
        precision = count / self._variance + prior
        middle = (total / self._variance + self._level[:, None] * prior) / precision
        self._person = self._normal(middle, precision)
        self._rest -= (self._person - old)[..., None, None, None]
        people = self.people.sum(axis=1)
        mean, sd = self._priors.level
        precision = people / self._person_variance + 1 / sd**2
        total = (self._person * self.people).sum(axis=1) / self._person_variance + mean / sd**2
        self._level = self._normal(total / precision, precision)
        squares = ((self._person - self._level[:, None]) ** 2 * self.people).sum(axis=1)
        self._person_variance = self._inverse_gamma(self._priors.person_sd, people, squares)

    def _draw_cells(self) -> None:
        counts, old = self._main.counts, self._cell
        prior = 1 / self._cell_variance[:, None, None]
        known = _summed(counts, keep=3) / self._variance[..., None]
        precision = known + prior
        total = _summed(counts * self._rest, keep=3) / self._variance[..., None] + known * old
        self._cell = self._normal(total / precision, precision)
        self._rest -= (self._cell - old)[..., None, None]
        held = self.people[..., None]
        squares = (self._cell**2 * held).sum(axis=(1, 2))
        count = self.people.sum(axis=1) * self._cell.shape[2]
        self._cell_variance = self._inverse_gamma(self._priors.cell_sd, count, squares)

    def _draw_textures(self) -> None:
        """Levels of the textures, without a mean over them."""
        share = (self.attends / self._variance)[..., None]
        precision = (_summed(self._main.counts, keep=3) * share).sum(axis=1)
        total = (_summed(self._main.counts * self._rest, keep=3) * share).sum(axis=1)
        old = self._texture
        total += precision * old
        self._texture = self._without_mean(total, precision, self._priors.texture_sd)
        change = (self._texture - old)[:, None]
        self._rest -= (self.attends[..., None] * change)[..., None, None]

    def _without_mean(self, total: Floats, precision: Floats, sd: float) -> Floats:
        """Normal draws (B, T) under the condition that their sum is 0.

        The prior is that of `sd` times independent normal values without their mean.
        """
        precision = precision + 1 / sd**2
        free = self._normal(total / precision, precision)
        share = (1 / precision) / (1 / precision).sum(axis=1, keepdims=True)
        found: Floats = free - share * free.sum(axis=1, keepdims=True)
        return found

    def _draw_trends(self) -> None:
        for c in self._varying:
            trend, old = self._trends[c], self._slopes[c]
            weighted = self._main.counts / self._variance[..., None, None, None] * trend
            known = _summed(weighted * trend, keep=1)
            total = _summed(weighted * self._rest, keep=1) + known * old
            precision = known + self._priors.trend_sd**-2
            new = self._normal(total / precision, precision)
            self._slopes[c] = new
            self._rest -= (new - old)[:, None, None, None, None] * trend

    def _draw_anchors(self) -> None:
        if not self._anchor.size:
            return
        shown = self._anchors.counts * self.attends[..., None] / self._variance[..., None]
        above = self._anchors.latent - self._person[..., None]
        # The mean of an anchor, then each person's deviation.
        mean, sd = self._priors.anchor
        spread = self._anchor_variance[:, None, None]
        own = np.where(shown > 0, 1 / (1 / np.maximum(shown, _TINY) + spread), 0.0)
        precision = own.sum(axis=1) + sd**-2
        self._anchor = self._normal(
            ((own * above).sum(axis=1) + mean * sd**-2) / precision, precision
        )
        precision = shown + 1 / spread
        middle = shown * (above - self._anchor[:, None]) / precision
        self._own_anchor = self._normal(middle, precision)
        held = self.people[..., None]
        count = self.people.sum(axis=1) * self._anchor.shape[1]
        squares = (self._own_anchor**2 * held).sum(axis=(1, 2))
        self._anchor_variance = self._inverse_gamma(self._priors.anchor_sd, count, squares)

    def _draw_variances(self) -> None:
        squares = _summed(self._main.counts * self._rest**2, keep=2)
        own = self.attends[..., None] * (self._anchor[:, None] + self._own_anchor)
        rest = self._anchors.latent - self._person[..., None] - own
        squares += (self._anchors.counts * rest**2).sum(axis=2)
        count = self._main.of_people + self._anchors.of_people
        half = self._priors.rating_df / 2
        shape = np.where(self.attends, half, 1.0) + count / 2
        scale = np.where(self.attends, half * self._typical[:, None], self._priors.careless_scale)
        self._variance = _InverseGamma(shape, scale + squares / 2).draw(self._rng)
        who = self.attends & self.people
        shape = 2.0 + half * who.sum(axis=1)
        rate = 2.0 / self._priors.rating_sd**2 + half * np.where(who, 1 / self._variance, 0.0).sum(
            axis=1
        )
        self._typical = self._rng.standard_gamma(shape) / rate

    def _draw_shares(self) -> None:
        lapsed = self._main.lapsed() + self._anchors.lapsed()
        kept = _summed(self._main.counts, keep=1) + self._anchors.counts.sum(axis=(1, 2))
        self.lapses = np.clip(self._beta(self._priors.lapses, lapsed, kept), 1e-6, 0.999)
        careless = (self.people & ~self.attends).sum(axis=1)
        attending = (self.people & self.attends).sum(axis=1)
        shares = self._beta(self._priors.careless, careless, attending)
        self.careless = np.clip(shares, 1e-9, 1 - 1e-9)

    def _normal(self, middle: Floats, precision: Floats) -> Floats:
        found: Floats = middle + self._rng.standard_normal(middle.shape) / np.sqrt(precision)
        return found

    def _inverse_gamma(self, typical: float, count: Floats, squares: Floats) -> Floats:
        """Variances whose prior is inverse gamma of shape 2 and mean typical²."""
        return _InverseGamma(2.0 + count / 2, typical**2 + squares / 2).draw(self._rng)

    def _beta(self, prior: tuple[float, float], yes: Floats, no: Floats) -> Floats:
        found: Floats = self._rng.beta(prior[0] + yes, prior[1] + no)
        return found


@dataclass(frozen=True, eq=False)
class _InverseGamma:
    """Distributions of variances."""

    shape: Floats
    rate: Floats

    def draw(self, rng: np.random.Generator) -> Floats:
        """One of each."""
        gammas = np.maximum(rng.standard_gamma(self.shape), _TINY)
        return np.maximum(self.rate / gammas, _LEAST)

    def log(self, variance: Floats) -> Floats:
        """Log density of each."""
        log: Floats = self.shape * np.log(self.rate) - gammaln(self.shape) - self.rate / variance
        return log - (self.shape + 1) * np.log(variance)


class _Answers:
    """Ratings with the latent judgements behind them, and which of them lapsed.

    `counts` is 1 where a judgement counts, 0 where the trial lapsed or was not answered;
    `of_people` is how many of each person's count.
    """

    def __init__(self, values: Floats) -> None:
        self.answered: Bools = np.isfinite(values)
        self.latent = np.where(self.answered, values, 0.0)
        self.counts = self.answered.astype(float)
        self.of_people = _summed(self.counts, keep=2)
        self.given = self.latent.copy()
        self._known = self.counts.copy()
        low = self.answered & (values <= LOWEST)
        high = self.answered & (values >= HIGHEST)
        self._low, self._high = np.nonzero(low), np.nonzero(high)
        self._lapse = np.where(low | high, AT_END, WITHIN)

    def means(self, otherwise: Floats) -> Floats:
        """Each person's mean; of people without answers `otherwise`."""
        axes = tuple(range(2, self.latent.ndim))
        count = self.counts.sum(axis=axes)
        means = self.latent.sum(axis=axes) / np.maximum(count, 1)
        return np.where(count > 0, means, otherwise[:, None])

    def likelihoods(self, middle: Floats, sd: Floats) -> Floats:
        """Density of each rating by a normal judgement, probability of one at an end."""
        scaled = (self.given - middle) / sd
        found: Floats = np.exp(-0.5 * scaled * scaled) * (_NORMAL / sd)
        for places, low in ((self._low, True), (self._high, False)):
            if places[0].size:
                z = scaled[places]
                found[places] = ndtr(z) if low else ndtr(-z)
        return found

    def log_ratio(self, first: Floats, second: Floats, lapses: Floats) -> Floats:
        """(B, n) log ratio of two likelihoods of all answers of a person, lapses considered."""
        rate = lapses.reshape(-1, *(1,) * (first.ndim - 1))
        blind = rate * self._lapse
        ratio = ((1 - rate) * first + blind) / ((1 - rate) * second + blind)
        return _summed(np.log(ratio) * self._known, keep=2)

    def draw_lapses(self, likelihood: Floats, rate: Floats, rng: np.random.Generator) -> None:
        """Which trials lapsed, given the likelihood of each answer if it did not."""
        blind = rate * self._lapse
        kept = rng.random(likelihood.shape) * ((1 - rate) * likelihood + blind) >= blind
        self.counts = kept * self._known
        self.of_people = _summed(self.counts, keep=2)

    def draw_latent(self, middle: Floats, sd: Floats, rng: np.random.Generator) -> None:
        """Judgements beyond an end of the scale, where a rating lies at it."""
        shape = self.given.shape
        for places, end in ((self._low, LOWEST), (self._high, HIGHEST)):
            if places[0].size:
                sign = 1.0 if end == LOWEST else -1.0
                at = np.broadcast_to(middle, shape)[places]
                scale = np.broadcast_to(sd, shape)[places]
                limit = sign * (end - at) / scale
                share = np.maximum(ndtr(limit) * rng.random(limit.shape), _TINY)
                self.latent[places] = at + sign * scale * np.minimum(ndtri(share), limit)

    def lapsed(self) -> Floats:
        """(B,) number of lapsed trials."""
        return _summed(self._known - self.counts, keep=1)
