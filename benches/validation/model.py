"""The model of the participants on planted truth that was not made for it.

docs/method/validation.md#the-model-of-the-participants
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import sqrt
from typing import Any

import numpy as np
import pandas as pd
from scipy import stats

from tactileq.analysis.statistics.caveats import EQUALITY, SHOWN, Caveats
from tactileq.analysis.statistics.equivalence import (
    ALL_BUT,
    ALPHA,
    AVERAGE_FELT,
    DIFFERENT,
    EQUIVALENT,
    FELT,
    INCONCLUSIVE,
    one_sided_tests,
)
from tactileq.analysis.statistics.participants.posterior import (
    Draws,
    Effort,
    choice_draws,
    rating_draws,
)
from tactileq.analysis.statistics.participants.verdict import PeopleSummary, summary_of
from tactileq.benches.validation.people.held_out import HELD_OUT
from tactileq.benches.validation.people.situations import (
    CHOICE_KIND,
    ODDITY_KIND,
    RATING_KIND,
    SITUATIONS,
    DrawnStudies,
    Situation,
)
from tactileq.modeling.arrays import Bools, Floats
from tactileq.modeling.checks import check_whole
from tactileq.modeling.files.columns import Column, names
from tactileq.modeling.participants.choices import ODDITY, ChoiceStudies, forced_choice
from tactileq.modeling.participants.ratings import RatingStudies
from tactileq.modeling.seeds import generator, number_of

SIZES = (20, 36)
FEW = 0.15
AT_ONCE = 100  # studies that are sampled side by side
EFFORT = Effort(chains=1, warm_up=200, steps=450, every=3)
FELT_WORDS = (AVERAGE_FELT, ALL_BUT, FELT)

MODEL_COLUMNS = (
    Column("situation", is_name=True),
    Column("n"),
    Column("simulations"),
    Column("planted", "planted mean effect", format=".3f"),
    Column("outside", "planted share of people outside", format=".3f"),
    Column("coverage", "mean covered by 95% interval", format=".3f"),
    Column("share_covered", "share below its 95% limit", format=".3f"),
    Column("inside", "mean said to be inside", format=".3f"),
    Column("tests_inside", "by TOST", format=".3f"),
    Column("equality", "a word of equality", format=".3f"),
    Column("equivalent", format=".3f"),
    Column("felt", "felt by some, or all but a few", format=".3f"),
    Column("different", format=".3f"),
    Column("inconclusive", format=".3f"),
    Column("careless", "people held to be careless", format=".3f"),
    Column("held_out", "held out", is_name=True),
    Column("missed", "aim missed", is_name=True),
)
Cell = tuple[str, int]  # situation, participants


def all_situations() -> dict[str, Situation]:
    """Those that the model was developed with, then those that were held out."""
    return {**SITUATIONS, **HELD_OUT}


def model_cells(*, sizes: Iterable[int] = SIZES) -> list[Cell]:
    """The rows of the table, in order."""
    return [(name, n) for name in all_situations() for n in sizes]


def simulate_model_cell(cell: Cell, *, simulations: int, seed: int) -> dict[str, Any]:
    """One row of the table, the same wherever and in whatever order it is computed.

    Parameters
    ----------
    cell : Cell
        One of `model_cells()`.
    simulations : int
        1 … 1 000 000.
    seed : int
        ≥ 0.

    Returns
    -------
    dict
        As `MODEL_COLUMNS`.
    """
    check_whole("simulations", simulations, low=1, high=1_000_000)
    name, n = cell
    situation = all_situations()[name]
    parts = []
    for start in range(0, simulations, AT_ONCE):
        rng = generator(seed, number_of(name), n, start)
        drawn = situation(rng, (min(AT_ONCE, simulations - start), n))
        parts.append(_judged(situation, drawn, rng=rng))
    found = pd.concat(parts, ignore_index=True)
    shares = {column: float(found[column].mean()) for column in found.columns}
    row = {
        "situation": name,
        "n": n,
        "simulations": simulations,
        "planted": drawn.mean,
        "outside": drawn.outside,
        "held_out": "yes" if name in HELD_OUT else "no",
        **shares,
    }
    return {**row, "missed": "; ".join(_missed(row))}


def _judged(situation: Situation, drawn: DrawnStudies, *, rng: np.random.Generator) -> pd.DataFrame:
    """What was said of each study: a row of shares or truth values for each."""
    draws = posterior_of(situation, drawn, rng=rng)
    differences = _differences(drawn)
    sensitive = _sensitive(situation, drawn)
    _, low, _, high = one_sided_tests(differences, situation.bounds)
    rows = []
    for one, shown, p in zip(draws, sensitive, np.maximum(low, high), strict=True):
        summary = summary_of(one)
        word = said(summary, situation, sensitive=bool(shown))
        rows.append(
            {
                "coverage": _holds(summary.mean_low, drawn.mean, summary.mean_high),
                "share_covered": _holds(0.0, drawn.outside, summary.share_most),
                "inside": summary.inside(situation.bounds),
                "tests_inside": p < ALPHA,
                "equality": word in EQUALITY,
                "equivalent": word == EQUIVALENT,
                "felt": word in FELT_WORDS,
                "different": word == DIFFERENT,
                "inconclusive": word == INCONCLUSIVE,
                "careless": 1 - one.attends.mean(),
            }
        )
    return pd.DataFrame(rows).astype(float)


def _holds(low: float, truth: float, high: float) -> float:
    """Whether the truth lies between; NaN where nothing is planted."""
    return float("nan") if np.isnan(truth) else float(low <= truth <= high)


def said(summary: PeopleSummary, situation: Situation, *, sensitive: bool) -> str:
    """The verdict as the report says it: without equality where sensitivity was not shown."""
    caveats = Caveats(sensitivity=SHOWN if sensitive else "not shown")
    return caveats.allowed(summary.verdict(situation.bounds, few=FEW))


def posterior_of(
    situation: Situation, drawn: DrawnStudies, *, rng: np.random.Generator
) -> list[Draws]:
    """The posterior of each study of a batch."""
    trends = _trends(drawn)
    if situation.kind == RATING_KIND:
        ratings = RatingStudies(values=drawn.values, anchors=drawn.checks, trends=trends)
        return rating_draws(ratings, situation.bounds, rng=rng, effort=EFFORT)
    choices = ChoiceStudies(
        right=np.nansum(drawn.values, axis=-1),
        asked=np.isfinite(drawn.values).sum(axis=-1).astype(float),
        catch_right=np.nansum(drawn.checks, axis=-1),
        catch_asked=np.isfinite(drawn.checks).sum(axis=-1).astype(float),
        trends=trends.mean(axis=-1),
    )
    model = ODDITY if situation.kind == ODDITY_KIND else forced_choice(drawn.values.shape[2])
    return choice_draws(choices, model, situation.bounds, rng=rng, effort=EFFORT)


def _trends(drawn: DrawnStudies) -> Floats:
    axes = tuple(range(1, drawn.days.ndim))
    days = drawn.days - drawn.days.mean(axis=axes, keepdims=True)
    return np.stack([days, drawn.orders - 0.5])


def _differences(drawn: DrawnStudies) -> Floats:
    """(k, n) differences, as the paired tests take them."""
    means = np.nanmean(drawn.values, axis=(2, 4))
    reference = means[..., 0] if means.shape[-1] == 2 else ODDITY.chance
    found: Floats = means[..., -1] - reference
    return found


def _sensitive(situation: Situation, drawn: DrawnStudies) -> Bools:
    """(k,) whether different surfaces were told apart, as `verdicts` demands it."""
    if situation.kind == CHOICE_KIND:
        above = np.nanmean(drawn.values[:, :, :, 0], axis=(2, 3)) - 1 / drawn.values.shape[2]
    elif not drawn.checks.shape[-1]:
        return np.zeros(len(drawn.values), dtype=bool)
    elif situation.kind == RATING_KIND:
        above = np.nanmean(drawn.values, axis=(2, 3, 4)) - np.nanmean(drawn.checks, axis=-1)
    else:
        above = np.nanmean(drawn.checks, axis=-1) - ODDITY.chance
    alike = np.ptp(above, axis=1) < 1e-12
    p = np.where(above[:, 0] > 0, 0.5 ** above.shape[1], 1.0)  # of sign flips, where all are alike
    vary = stats.ttest_1samp(above[~alike], 0.0, axis=1, alternative="greater").pvalue
    p[~alike] = vary
    found: Bools = p < ALPHA
    return found


def _missed(row: Mapping[str, Any]) -> list[str]:
    """The aims that a row misses by more than two standard errors of the simulation."""
    missed = []
    for quantity, low, high in aims(str(row["situation"]), int(row["n"]), row=row):
        share = float(row[quantity])
        nearest = low if share < low else high if share > high else share
        error = sqrt(max(nearest * (1 - nearest), 0.0) / row["simulations"])
        if abs(share - nearest) > 2 * error + 1e-12:
            missed.append(f"{quantity} {share:.3f}, aim {low:.2f} to {high:.2f}")
    return missed


def aims(name: str, n: int, *, row: Mapping[str, Any]) -> list[tuple[str, float, float]]:
    """What is asked of a situation: quantity, least and largest share of studies.

    docs/method/validation.md#aims
    """
    which = name.partition(": ")[2]
    bound = all_situations()[name].bounds[1]
    found = []
    if np.isclose(abs(float(row["planted"])), bound):
        found += [("equality", 0.0, 0.06)]
        found += [("coverage", 0.93, 0.97), ("inside", 0.0, 0.06)]
    if which in ("split ± 10", "split", "1 person in 4"):
        found += [("equivalent", 0.0, 0.05)]
    if which == "1 person in 10" and n >= 36:
        found += [("felt", 0.85, 1.0)]
    if which in ("nobody", "nobody feels it", "nothing planted, SD 2"):
        found += [("felt", 0.0, 0.05)]
    if which == "nothing planted, SD 2" and n >= 36:
        found += [("equivalent", 0.9, 1.0)]
    if which.startswith("nothing planted, SD"):
        found += [("inside", min(0.95 * float(row["tests_inside"]), 1.0), 1.0)]
    if which.startswith("everybody at"):
        found += [("equality", 0.0, 0.05)]
    return found


def model_table(rows: Iterable[dict[str, Any]]) -> pd.DataFrame:
    """The rows of `simulate_model_cell` as a table of `MODEL_COLUMNS`."""
    return pd.DataFrame(list(rows), columns=names(MODEL_COLUMNS))
