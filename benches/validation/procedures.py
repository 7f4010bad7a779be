"""The procedures on planted truth: coverage, type I error and power in several situations.

docs/method/validation.md
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from math import sqrt
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import integrate, stats

from tactileq.analysis.chapters.confusions.information import (
    information_bits,
    transferred_information,
)
from tactileq.analysis.chapters.single_answers.gee import fit_gee
from tactileq.analysis.statistics.equivalence import ALPHA, Bounds, one_sided_tests
from tactileq.analysis.statistics.mixed import fit_mixed, t_of
from tactileq.analysis.statistics.paired import (
    CONFIDENCE,
    d_z_interval,
    holm,
    sign_flips_p,
    t_tests,
)
from tactileq.analysis.statistics.rates import clopper_pearson
from tactileq.benches.raters import (
    HIGHEST,
    LOWEST,
    bootstrap_covers,
    covered,
    paired_power,
)
from tactileq.benches.validation.worlds import (
    DIFFERENCE_SD,
    LATENT,
    N_TEXTURES,
    RATE_WORLDS,
    RATING_WORLDS,
    Draw,
    confusions,
    equal_slopes,
    rates_of_people,
    single_choices,
    single_ratings,
)
from tactileq.modeling.arrays import Floats
from tactileq.modeling.checks import check_whole
from tactileq.modeling.files.columns import Column, names
from tactileq.modeling.seeds import generator, number_of

SIZES = (8, 20, 36)  # participants
BOUNDS: Bounds = (-7.5, 7.5)
HIGHEST_SHARE_AT_ENDS = 0.2
COVERAGE, TYPE_I, POWER = "coverage", "type I error", "power"
AT_ONCE = 100  # simulations: keeps what the bootstrap holds below 200 MB

VALIDATION_COLUMNS = (
    Column("procedure", is_name=True),
    Column("quantity", is_name=True),
    Column("situation", is_name=True),
    Column("n"),
    Column("planted"),
    Column("simulations"),
    Column("estimate", format=".3f"),
    Column("ci_low", "95% CI from", format=".3f"),
    Column("ci_high", "to", format=".3f"),
    Column("nominal", format=".3f"),
    Column("within", "nominal within", is_name=True),
    Column("meaning"),
)
# What a nominal value below the interval means, and one above it.
MEANINGS = {
    COVERAGE: ("covers more often than nominal", "covers too rarely"),
    TYPE_I: ("errs too often", "errs less often than allowed"),
    POWER: ("finds it more often", "finds it less often"),
}

Hits = NDArray[np.bool_]


def _each_size(values: Floats) -> Iterator[tuple[NDArray[np.intp], Floats]]:
    """Simulations with equally many complete participants: which ones, and their values.

    Those with fewer than two are left out: nothing can be computed of them.
    """
    complete = np.isfinite(values)
    counts = complete.sum(axis=1)
    for count in np.unique(counts[counts > 1]):
        which = np.flatnonzero(counts == count)
        yield which, values[which][complete[which]].reshape(which.size, count)


def _hits_of_rows(values: Floats, judge: Callable[[Floats], Hits]) -> Hits:
    """The result of a procedure for each row of (k, n) values; no where it has none."""
    hits = np.zeros(len(values), dtype=bool)
    for which, complete in _each_size(values):
        hits[which] = judge(complete)
    return hits


def _differences(ratings: Floats) -> Floats:
    return np.asarray(ratings[..., 1] - ratings[..., 0])


def _t_covers(ratings: Floats, truth: float, rng: np.random.Generator) -> Hits:
    def judge(differences: Floats) -> Hits:
        *_, low, high = t_tests(differences)
        return covered(low, truth, high)

    return _hits_of_rows(_differences(ratings), judge)


def _t_rejects(ratings: Floats, truth: float, rng: np.random.Generator) -> Hits:
    return _hits_of_rows(_differences(ratings), lambda each: t_tests(each)[1] < ALPHA)


def _family_rejects(ratings: Floats, truth: float, rng: np.random.Generator) -> Hits:
    """Whether anything in a family of seven textures is called different; (7k, n, 2) → (k,)."""
    p = np.full(len(ratings), np.nan)
    for which, differences in _each_size(_differences(ratings)):
        p[which] = t_tests(differences)[1]
    families = p.reshape(-1, N_TEXTURES)
    return np.array([bool((holm(family) < ALPHA).any()) for family in families])


def _equivalent(ratings: Floats, truth: float, rng: np.random.Generator) -> Hits:
    def judge(differences: Floats) -> Hits:
        _, p_low, _, p_high = one_sided_tests(differences, BOUNDS)
        equal: Hits = np.maximum(p_low, p_high) < ALPHA
        return equal

    return _hits_of_rows(_differences(ratings), judge)


def _equivalent_by_guard(ratings: Floats, truth: float, rng: np.random.Generator) -> Hits:
    """Equivalent, and few enough ratings at an end of the scale."""
    at_end = (ratings <= LOWEST) | (ratings >= HIGHEST)
    answered = np.isfinite(ratings).sum(axis=(1, 2))
    few = at_end.sum(axis=(1, 2)) <= HIGHEST_SHARE_AT_ENDS * answered
    found: Hits = _equivalent(ratings, truth, rng) & few
    return found


def _d_z_covers(ratings: Floats, truth: float, rng: np.random.Generator) -> Hits:
    def judge(differences: Floats) -> Hits:
        n = differences.shape[1]
        limits = np.array([d_z_interval(float(t), n) for t in t_tests(differences)[0]])
        return covered(limits[:, 0], truth / DIFFERENCE_SD, limits[:, 1])

    return _hits_of_rows(_differences(ratings), judge)


def _flips_reject(ratings: Floats, truth: float, rng: np.random.Generator) -> Hits:
    return _hits_of_rows(
        _differences(ratings),
        lambda each: np.array([sign_flips_p(one, rng=rng) < ALPHA for one in each]),
    )


def _bootstrap_covers(rates: Floats, truth: float, rng: np.random.Generator) -> Hits:
    return _hits_of_rows(rates, lambda complete: bootstrap_covers(complete, truth, rng))


def _information_covers(counts: Floats, truth: float, rng: np.random.Generator) -> Hits:
    pooled = truth * np.eye(N_TEXTURES) + (1 - truth) * (1 - np.eye(N_TEXTURES)) / (N_TEXTURES - 1)
    bits = float(information_bits(pooled))
    found = [transferred_information(each) for each in counts]
    return covered([one.ci_low for one in found], bits, [one.ci_high for one in found])


def _columns_of(answers: Floats) -> tuple[NDArray[np.intp], Floats]:
    """Who gave each of the (n, 2, r) answers, and the columns of the model and of a constant."""
    n, _, repeats = answers.shape
    model = np.tile(np.repeat([-0.5, 0.5], repeats), n)
    return np.repeat(np.arange(n), 2 * repeats), np.column_stack([model, np.ones_like(model)])


def _mixed_covers(answers: Floats, truth: float, rng: np.random.Generator) -> Hits:
    """By the paired t-test where the fit does not converge, as in the report."""
    people, columns = _columns_of(answers[0])
    hits = _t_covers(answers.mean(axis=-1), truth, rng)
    for place, each in enumerate(answers):
        fit = fit_mixed(each.ravel(), columns, slope=columns[:, 0], people=people)
        if fit is not None:
            found = t_of(float(fit.estimates[0]), float(fit.errors[0]), n=len(each))
            hits[place] = found["ci_low"] <= truth <= found["ci_high"]
    return hits


def _gee_rejects(answers: Floats, truth: float, rng: np.random.Generator) -> Hits:
    """By sign flips where nothing can be fitted, as in the report."""
    people, columns = _columns_of(answers[0])
    hits = np.zeros(len(answers), dtype=bool)
    for place, each in enumerate(answers):
        separated = np.isin(each.mean(axis=(0, 2)), (0.0, 1.0)).any()
        fit = None if separated else fit_gee(each.ravel(), columns, people=people)
        if fit is None:
            p = sign_flips_p(np.diff(each.mean(axis=-1), axis=1).ravel(), rng=rng)
        else:
            p = t_of(float(fit[0][0]), float(fit[1][0]), n=len(each))["p"]
        hits[place] = p < ALPHA
    return hits


def t_test_power(n: int, truth: float) -> float:
    """Power of the two-sided paired t-test at α = .05 where differences are normal (noncentral t).

    docs/method/validation.md#nominal-values

    Parameters
    ----------
    n : int
        Participants, ≥ 2.
    truth : float
        True mean difference, in points, where the SD of differences is `DIFFERENCE_SD`.
    """
    return paired_power(truth / DIFFERENCE_SD, n)


def equivalence_power(
    n: int, truth: float, *, bounds: Bounds = BOUNDS, sd: float = DIFFERENCE_SD
) -> float:
    """Chance that both one-sided tests reject at α = .05 where differences are normal.

    docs/method/validation.md#nominal-values

    Parameters
    ----------
    n : int
        Participants, ≥ 2.
    truth : float
        True mean difference, in the unit of the bounds.
    bounds : (float, float)
    sd : float
        Of the differences, > 0.

    Notes
    -----
    Phillips (1990): given the sampled SD, the mean must lie as far within the bounds as t
    requires; integrated over the distribution of the SD.
    """
    root, error = sqrt(n - 1), sd / sqrt(n)
    inward = float(stats.t.ppf(1 - ALPHA, n - 1))

    def at(ratio: float) -> float:
        margin = inward * ratio
        low, high = (bounds[0] - truth) / error + margin, (bounds[1] - truth) / error - margin
        within = stats.norm.cdf(high) - stats.norm.cdf(low)
        return float(within * stats.chi.pdf(ratio * root, n - 1))

    widest = (bounds[1] - bounds[0]) / (2 * inward * error)
    # A sampled SD of more than four times the true one does not happen, and hides what does.
    area, _ = integrate.quad(at, 0.0, min(widest, 4.0), limit=200)
    return float(area * root)


def _level_of_flips(n: int, truth: float) -> float:
    """Sign flips have only so many p values: the share of those below .05."""
    half = 2.0 ** (n - 1)
    return float(np.floor(ALPHA * half) / half)


def _always(value: float) -> Callable[[int, float], float]:
    return lambda n, truth: value


@dataclass(frozen=True, kw_only=True)
class Check:
    """A procedure, what is asked of it, and what it should answer.

    Parameters
    ----------
    hits : callable
        Of drawn values (k, n, …), the truth and a generator: (k,) whether it covered, or rejected.
    nominal : callable
        Of n and the truth: the share of hits that theory promises where differences are normal.
    truth : float
        Planted: points, or a share.
    situations : mapping of name to callable
    per_simulation : int
        Rows of values that one simulation takes.
    """

    procedure: str
    quantity: str
    hits: Callable[[Floats, float, np.random.Generator], Hits]
    nominal: Callable[[int, float], float]
    truth: float
    situations: Mapping[str, Draw]
    per_simulation: int = 1


_GUARDED = {name: RATING_WORLDS[name] for name in ("normal", "ceiling")}
_CHECKS = (
    Check(
        procedure="paired t, 95 % interval",
        quantity=COVERAGE,
        hits=_t_covers,
        nominal=_always(CONFIDENCE),
        truth=BOUNDS[1],
        situations=RATING_WORLDS,
    ),
    Check(
        procedure="paired t",
        quantity=TYPE_I,
        hits=_t_rejects,
        nominal=_always(ALPHA),
        truth=0.0,
        situations=RATING_WORLDS,
    ),
    Check(
        procedure="paired t",
        quantity=POWER,
        hits=_t_rejects,
        nominal=t_test_power,
        truth=BOUNDS[1],
        situations=RATING_WORLDS,
    ),
    Check(
        procedure="Holm over seven textures",
        quantity=TYPE_I,
        hits=_family_rejects,
        nominal=_always(1 - (1 - ALPHA / N_TEXTURES) ** N_TEXTURES),
        truth=0.0,
        situations=RATING_WORLDS,
        per_simulation=N_TEXTURES,
    ),
    Check(
        procedure="TOST",
        quantity=TYPE_I,
        hits=_equivalent,
        nominal=equivalence_power,
        truth=BOUNDS[0],
        situations=RATING_WORLDS,
    ),
    Check(
        procedure="TOST",
        quantity=POWER,
        hits=_equivalent,
        nominal=equivalence_power,
        truth=0.0,
        situations=RATING_WORLDS,
    ),
    Check(
        procedure="TOST, no guard on ends",
        quantity=TYPE_I,
        hits=_equivalent,
        nominal=equivalence_power,
        truth=LATENT,
        situations=_GUARDED,
    ),
    Check(
        procedure="TOST, guard on ends",
        quantity=TYPE_I,
        hits=_equivalent_by_guard,
        nominal=equivalence_power,
        truth=LATENT,
        situations=_GUARDED,
    ),
    Check(
        procedure="TOST, guard on ends",
        quantity=POWER,
        hits=_equivalent_by_guard,
        nominal=equivalence_power,
        truth=0.0,
        situations=_GUARDED,
    ),
    Check(
        procedure="d_z interval",
        quantity=COVERAGE,
        hits=_d_z_covers,
        nominal=_always(CONFIDENCE),
        truth=BOUNDS[1],
        situations=RATING_WORLDS,
    ),
    Check(
        procedure="sign flips",
        quantity=TYPE_I,
        hits=_flips_reject,
        nominal=_level_of_flips,
        truth=0.0,
        situations=RATING_WORLDS,
    ),
    Check(
        procedure="BCa interval of a correct rate",
        quantity=COVERAGE,
        hits=_bootstrap_covers,
        nominal=_always(CONFIDENCE),
        truth=0.4,
        situations=RATE_WORLDS,
    ),
    Check(
        procedure="BCa interval of a correct rate",
        quantity=COVERAGE,
        hits=_bootstrap_covers,
        nominal=_always(CONFIDENCE),
        truth=0.95,
        situations={"ceiling": rates_of_people},
    ),
    Check(
        procedure="interval of transferred information",
        quantity=COVERAGE,
        hits=_information_covers,
        nominal=_always(CONFIDENCE),
        truth=0.5,
        situations={"normal": confusions},
    ),
    Check(
        procedure="interval of transferred information",
        quantity=COVERAGE,
        hits=_information_covers,
        nominal=_always(CONFIDENCE),
        truth=0.85,
        situations={"ceiling": confusions},
    ),
    Check(
        procedure="mixed model, 95 % interval",
        quantity=COVERAGE,
        hits=_mixed_covers,
        nominal=_always(CONFIDENCE),
        truth=BOUNDS[1],
        situations={"normal": single_ratings, "equal slopes": equal_slopes},
    ),
    Check(
        procedure="GEE",
        quantity=TYPE_I,
        hits=_gee_rejects,
        nominal=_always(ALPHA),
        truth=0.5,
        situations={"normal": single_choices},
    ),
    Check(
        procedure="GEE",
        quantity=TYPE_I,
        hits=_gee_rejects,
        nominal=_always(ALPHA),
        truth=0.95,
        situations={"ceiling": single_choices},
    ),
)
Cell = tuple[int, str, int]  # number of a check, situation, participants


def cells(procedures: Iterable[str] = (), *, sizes: Iterable[int] = SIZES) -> list[Cell]:
    """The rows of the table, in order: of these procedures, or of all."""
    wanted = set(procedures)
    return [
        (number, situation, n)
        for number, check in enumerate(_CHECKS)
        if not wanted or check.procedure in wanted
        for situation in check.situations
        for n in sizes
    ]


def simulate_cell(cell: Cell, *, simulations: int, seed: int) -> dict[str, Any]:
    """One row of the table, the same wherever and in whatever order it is computed.

    docs/method/validation.md#seeds

    Parameters
    ----------
    cell : Cell
        One of `cells()`.
    simulations : int
        1 … 1 000 000.
    seed : int
        ≥ 0.

    Returns
    -------
    dict
        As `VALIDATION_COLUMNS`.
    """
    check_whole("simulations", simulations, low=1, high=1_000_000)
    number, situation, n = cell
    check = _CHECKS[number]
    what = " ".join((check.procedure, check.quantity, situation, f"{check.truth:g}"))
    hits = 0
    for start in range(0, simulations, AT_ONCE):
        rng = generator(seed, number_of(what), n, start)
        rows = min(AT_ONCE, simulations - start) * check.per_simulation
        drawn = check.situations[situation](rng, (rows, n), check.truth)
        hits += int(check.hits(drawn, check.truth, rng).sum())
    return {
        "procedure": check.procedure,
        "quantity": check.quantity,
        "situation": situation,
        "n": n,
        "planted": check.truth,
        **_judged(hits, simulations, check.nominal(n, check.truth), quantity=check.quantity),
    }


def _judged(hits: int, simulations: int, nominal: float, *, quantity: str) -> dict[str, Any]:
    low, high = clopper_pearson(hits, simulations)
    above, below = MEANINGS[quantity]
    meaning = above if nominal < low else below if nominal > high else ""
    return {
        "simulations": simulations,
        "estimate": hits / simulations,
        "ci_low": low,
        "ci_high": high,
        "nominal": nominal,
        "within": "no" if meaning else "yes",
        "meaning": meaning,
    }


def validation_table(rows: Iterable[dict[str, Any]]) -> pd.DataFrame:
    """The rows of `simulate_cell` as a table of `VALIDATION_COLUMNS`."""
    return pd.DataFrame(list(rows), columns=names(VALIDATION_COLUMNS))
