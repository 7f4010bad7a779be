"""The tests of answers in the atlas: effects of ceilings, careless raters and few participants.

Simulated are ratings of a full and a simplified model, one of each per rater, and answers of the
forced choice; they are analysed by the functions of `tactileq.analysis.statistics` themselves. The
same raters are drawn along the whole axis, so that edges are clean.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, partial
from math import sqrt
from typing import Any

import numpy as np
from scipy import stats
from scipy.optimize import brentq

from tactileq.analysis.statistics.paired import (
    d_z_interval,
    t_tests,
    without_rounding_noise,
)
from tactileq.benches.atlas.case import Axis, Case
from tactileq.benches.raters import (
    HIGHEST,
    MISS_RATE,
    at_random,
    bootstrap_covers,
    covered,
    mean_at_the_end,
    paired_power,
)
from tactileq.modeling.arrays import Bools, Floats
from tactileq.modeling.seeds import generator

FAMILY = "answers"
SEED = 17
STUDIES = {False: 2000, True: 6000}
# The bootstrap takes milliseconds for each study.
INTERVALS = {False: 90, True: 1500}  # of 300 one in ten counts would miss by chance
BATCH = 30  # at once, for the memory
RATERS, JUDGES, REPEATS = 20, 24, 3  # the default study (experiments/study/study.toml)
MEAN, PERSON_SD, DIFFERENCE_SD = 60.0, 10.0, 10.0
# With these a paired t-test of 20 raters finds the difference in nine studies of ten.
EFFECT = 0.765 * DIFFERENCE_SD
CLEAR_EFFECT = 2.0 * DIFFERENCE_SD
USUAL_RATE = 0.6
NORMAL, WITH_CARELESS = 0.0, 0.1
Test = Callable[[Floats], Floats]


def ratings(studies: int, raters: int, *, mean: float, effect: float) -> tuple[Floats, Floats]:
    """Latent ratings (studies, raters) of the full and the simplified model, without a ceiling."""
    rng = generator([SEED, raters])
    person = mean + PERSON_SD * rng.standard_normal((studies, raters))
    noise = DIFFERENCE_SD / np.sqrt(2) * rng.standard_normal((2, studies, raters))
    return person + noise[0], person - effect + noise[1]


def careless(shape: tuple[int, ...], share: float) -> tuple[Bools, Floats]:
    """Who answers at random, (studies, raters), and their two answers, uniform on the scale."""
    rng = generator([SEED, 1, *shape])
    return rng.random(shape) < share, at_random(rng, (2, *shape))


def t_p(differences: Floats) -> Floats:
    """p of the paired t-test in each row; NaN where it is undefined."""
    p = np.full(len(differences), np.nan)
    varied = np.ptp(differences, axis=1) > 0
    p[varied] = t_tests(differences[varied])[1]
    return p


def wilcoxon_p(differences: Floats) -> Floats:
    """p of the signed-rank test in each row; NaN where all differences are 0."""
    p = np.full(len(differences), np.nan)
    zeros = (differences == 0).sum(axis=1)
    # SciPy takes one distribution for all rows, and another one where a difference is 0.
    for whole in (True, False):
        rows = ((zeros == 0) == whole) & (zeros < differences.shape[1])
        if rows.any():
            p[rows] = stats.wilcoxon(differences[rows], axis=1).pvalue
    return p


def _found(test: Test, full: Floats, simplified: Floats) -> float:
    """Share of the studies with a significant difference; an undefined test finds none."""
    return float((test(without_rounding_noise(simplified - full)) < MISS_RATE).mean())


def power_lost_at_the_end(share: float, column: float, *, full: bool, test: Test) -> float:
    """The loss of power due to the end of the scale."""
    latent = ratings(STUDIES[full], RATERS, mean=_mean_near_the_end(share), effect=EFFECT)
    seen = [np.minimum(one, HIGHEST) for one in latent]  # the lower end is far away
    return _found(test, *latent) - _found(test, *seen)


def understated_at_the_end(share: float, column: float, *, full: bool) -> float:
    """Share by which the difference of means is smaller than that of the latent ratings."""
    latent = ratings(STUDIES[full], RATERS, mean=_mean_near_the_end(share), effect=EFFECT)
    seen = [np.minimum(one, HIGHEST) for one in latent]  # the lower end is far away
    return float(1 - (seen[1] - seen[0]).mean() / (latent[1] - latent[0]).mean())


def power_lost_to_carelessness(share: float, column: float, *, full: bool, test: Test) -> float:
    """The loss of power due to careless raters."""
    latent = ratings(STUDIES[full], RATERS, mean=MEAN, effect=EFFECT)
    who, answers = careless(latent[0].shape, share)
    seen = [np.where(who, random, one) for random, one in zip(answers, latent, strict=True)]
    return _found(test, *latent) - _found(test, *seen)


def false_alarms(count: float, careless_share: float, *, full: bool, test: Test) -> float:
    """Share of studies that find a difference where none exists."""
    latent = ratings(STUDIES[full], round(count), mean=MEAN, effect=0.0)
    who, answers = careless(latent[0].shape, careless_share)
    seen = [np.where(who, random, one) for random, one in zip(answers, latent, strict=True)]
    return _found(test, *seen)


def clear_effects_missed(count: float, column: float, *, full: bool, test: Test) -> float:
    """Share of studies that miss a difference of twice its standard deviation."""
    latent = ratings(STUDIES[full], round(count), mean=MEAN, effect=CLEAR_EFFECT)
    return 1 - _found(test, *latent)


def effect_sizes_missed(count: float, column: float, *, full: bool) -> float:
    """Share of the intervals of d_z that do not contain the true value."""
    n = round(count)
    latent = ratings(STUDIES[full] // 4, n, mean=MEAN, effect=-EFFECT)
    limits = [d_z_interval(t, n) for t in t_tests(latent[1] - latent[0])[0].tolist()]
    low, high = np.array(limits).T
    truth = EFFECT / DIFFERENCE_SD
    return float((~covered(low, truth, high)).mean())


def rates_missed_with_few(count: float, column: float, *, full: bool) -> float:
    """Share of intervals that miss the correct rate or are missing: few participants."""
    return _rates_missed(USUAL_RATE, round(count), full=full)


def rates_missed_near_one(error_rate: float, column: float, *, full: bool) -> float:
    """The same where nearly all answers are right."""
    return _rates_missed(1 - error_rate, JUDGES, full=full)


def _rates_missed(rate: float, judges: int, *, full: bool) -> float:
    # From one uniform number each, so that no participant gets worse as the rate rises.
    uniform = generator([SEED, 2, judges]).random((INTERVALS[full], judges, REPEATS))
    rates = (uniform < rate).mean(axis=2)
    held = np.zeros(len(rates), dtype=np.bool_)
    varied = np.flatnonzero(np.ptp(rates, axis=1) > 0)
    for start in range(0, varied.size, BATCH):
        some = varied[start : start + BATCH]
        held[some] = bootstrap_covers(rates[some], rate, generator([SEED, 3]))
    return float(1 - held.mean())


def _latent_sd() -> float:
    return float(np.hypot(PERSON_SD, DIFFERENCE_SD / np.sqrt(2)))


def _mean_near_the_end(share: float) -> float:
    """Mean of the full model's latent ratings of which this share lies beyond the end."""
    return mean_at_the_end(share, sd=_latent_sd())


# Where theory predicts failure.


def end_of_the_scale(column: float) -> float:
    """Where E min(x, end) of two normal ratings differs too little, in closed form."""

    def beyond(mean: float) -> float:
        sd, over = _latent_sd(), (mean - HIGHEST) / _latent_sd()
        return float(sd * (over * stats.norm.cdf(over) + stats.norm.pdf(over)))

    def understated(log_share: float) -> float:
        mean = _mean_near_the_end(np.exp(log_share))
        return (beyond(mean) - beyond(mean - EFFECT)) / EFFECT - UNDERSTATED

    return float(np.exp(brentq(understated, np.log(1e-4), np.log(0.99))))


@lru_cache(maxsize=1)
def careless_share(column: float) -> float:
    """Where the power of a t-test has dropped, careless answers modelled as variance."""
    random = HIGHEST**2 / 6  # of the difference of two answers anywhere

    def lost(share: float) -> float:
        k = np.arange(RATERS + 1)
        among = k / RATERS
        means = (1 - among) * EFFECT
        attended = (1 - among) * (DIFFERENCE_SD**2 + EFFECT**2)
        variances = (attended + among * random - means**2) * RATERS / (RATERS - 1)
        variances[0] = DIFFERENCE_SD**2
        powers = [paired_power(m / sqrt(v), RATERS) for m, v in zip(means, variances, strict=True)]
        expected = float(stats.binom.pmf(k, RATERS, share) @ powers)
        return powers[0] - expected - POWER_LOST

    return float(brentq(lost, 1e-4, 0.9))


def fewest_for_t(column: float) -> float:
    """Number of raters at which a t-test still has the required power."""

    def surplus(count: float) -> float:
        return paired_power(CLEAR_EFFECT / DIFFERENCE_SD, count) - (1 - POWER_LOST)

    return float(brentq(surplus, 2.5, 20.0))


def fewest_for_ranks(column: float) -> float:
    """With n signs all alike p is 2/2ⁿ, never below 5 % for five or fewer."""
    return float(np.log2(2 / MISS_RATE))


def fewest_for_the_bootstrap(column: float) -> float:
    """Resampled means have √((n−1)/n) of the standard error, and normal tails instead of t's."""
    normal = stats.norm.isf(MISS_RATE / 2)

    def surplus(count: float) -> float:
        limit = normal * np.sqrt((count - 1) / count)
        return float(2 * stats.t.sf(limit, count - 1) - MISSED)

    return float(brentq(surplus, 2.1, 50.0))


def rate_of_no_interval(column: float) -> float:
    """Error rate at which intervals are missing too often because all answers are right."""
    return float(1 - MISSED ** (1 / (JUDGES * REPEATS)))


def never(column: float) -> float:
    """Exact at any size: there is no edge."""
    return float("nan")


# Bradley's (1978) liberal criterion of robustness: a nominal 5 % may be 2.5 to 7.5 %. Twice the
# nominal level counts as wrong.
ALARMS, ALARMS_AT_MOST = 0.075, 0.1
# Intervals of 95 %: one miss in ten is twice the nominal rate, one in five four times.
MISSED, MISSED_AT_MOST = 0.1, 0.2
# Planned power is 90 %; 80 % is the usual minimum, 50 % is a coin toss.
POWER_LOST, POWER_LOST_AT_MOST = 0.1, 0.4
# An underestimate of a tenth is within the usual standard error, one of a third is not.
UNDERSTATED, UNDERSTATED_AT_MOST = 0.1, 0.33

T, RANKS, BOOTSTRAP, D_Z = "paired t-test", "Wilcoxon", "bootstrap (BCa)", "interval of d_z"
TESTS: dict[str, Test] = {T: t_p, RANKS: wilcoxon_p}
ENDS = Axis(name="ratings at the end of the scale", unit="", mild=0.005, severe=0.95, default=0.05)
CARELESS = Axis(name="careless raters", unit="", mild=0.002, severe=0.8, default=0.05)
FEW = Axis(name="raters", unit="", mild=30.0, severe=3.0, default=float(RATERS))
FEW_JUDGES = Axis(name="participants", unit="", mild=30.0, severe=3.0, default=float(JUDGES))
# In the paper two of seven textures were recognised in about 60 % of the trials, one nearly always.
ERRORS = Axis(name="wrong answers", unit="", mild=0.4, severe=0.002, default=0.4)
A_CARELESS_ONE = (
    "a single rater in twenty who answers at random adds more variance than all others together: "
    "exclude such raters by a rule that was fixed beforehand, or consult the rank test reported "
    "beside it"
)


def _case(method: str, axis: Axis, **rest: Any) -> Case:
    return Case(family=FAMILY, method=method, ours=method != RANKS, axis=axis, **rest)


def _powers(words: str) -> dict[str, Any]:
    return {"figure": words, "unit": "", "holds": POWER_LOST, "degrades": POWER_LOST_AT_MOST}


CASES: tuple[Case, ...] = (
    *(
        _case(
            method,
            ENDS,
            measure=partial(power_lost_at_the_end, test=test),
            **_powers("power lost"),
        )
        for method, test in TESTS.items()
    ),
    _case(
        "difference of means",
        ENDS,
        measure=understated_at_the_end,
        figure="share of the difference that is missed",
        unit="",
        holds=UNDERSTATED,
        degrades=UNDERSTATED_AT_MOST,
        theory=end_of_the_scale,
        source="expected value of censored normal ratings",
    ),
    _case(
        T,
        CARELESS,
        measure=partial(power_lost_to_carelessness, test=t_p),
        theory=careless_share,
        source="noncentral t with the variance of so many careless raters",
        exception=A_CARELESS_ONE,
        **_powers("power lost"),
    ),
    _case(
        RANKS,
        CARELESS,
        measure=partial(power_lost_to_carelessness, test=wilcoxon_p),
        **_powers("power lost"),
    ),
    *(
        _case(
            method,
            FEW,
            measure=partial(false_alarms, test=test),
            figure="differences found where none exists",
            unit="",
            holds=ALARMS,
            degrades=ALARMS_AT_MOST,
            across="raters who answer at random",
            columns={"none": NORMAL, "one in ten": WITH_CARELESS},
            theory=never,
            source="exact for symmetric differences"
            if method == RANKS
            else "exact for normal ones",
        )
        for method, test in TESTS.items()
    ),
    _case(
        T,
        FEW,
        measure=partial(clear_effects_missed, test=t_p),
        theory=fewest_for_t,
        source="noncentral t",
        **_powers("clear differences (d_z = 2) missed"),
    ),
    _case(
        RANKS,
        FEW,
        measure=partial(clear_effects_missed, test=wilcoxon_p),
        theory=fewest_for_ranks,
        source="p of n signs alike is 2/2ⁿ",
        **_powers("clear differences (d_z = 2) missed"),
    ),
    *(
        _case(
            method,
            axis,
            measure=measure,
            figure="intervals that miss the truth",
            unit="",
            holds=MISSED,
            degrades=MISSED_AT_MOST,
            theory=theory,
            source=source,
        )
        for method, axis, measure, theory, source in (
            (D_Z, FEW, effect_sizes_missed, never, "exact for normal differences"),
            (
                BOOTSTRAP,
                FEW_JUDGES,
                rates_missed_with_few,
                fewest_for_the_bootstrap,
                "normal tails and √((n−1)/n) of the standard error",
            ),
            (
                BOOTSTRAP,
                ERRORS,
                rates_missed_near_one,
                rate_of_no_interval,
                "no errors, hence no interval",
            ),
        )
    ),
)
