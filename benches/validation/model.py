"""The rule of verdicts on planted truth that was not made for it.

docs/method/validation.md#the-rule-of-verdicts
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import nan
from typing import Any

import numpy as np
import pandas as pd

from tactileq.analysis.labels import ALL_TEXTURES
from tactileq.analysis.statistics.caveats import DIFFERENCES, EQUALITY, SHOWN, Caveats
from tactileq.analysis.statistics.claims import words_of_people
from tactileq.analysis.statistics.crossover import mean_differences
from tactileq.analysis.statistics.equivalence import one_sided_tests, verdict
from tactileq.analysis.statistics.paired import holm, t_tests
from tactileq.analysis.statistics.participants.posterior import Draws, sufficient_draws
from tactileq.analysis.statistics.participants.verdict import (
    PeopleJudged,
    summary_of,
    texture_table,
)
from tactileq.analysis.statistics.rates import clopper_pearson
from tactileq.benches.validation.people.choices import CHOICE_WORLDS
from tactileq.benches.validation.people.drawn import N_TEXTURES, DrawnStudies, World
from tactileq.benches.validation.people.held_out import OTHER_WORLDS
from tactileq.benches.validation.people.ratings import RATER_WORLDS
from tactileq.modeling.arrays import Floats
from tactileq.modeling.checks import check_whole
from tactileq.modeling.files.columns import Column, names
from tactileq.modeling.participants.ratings import RatingStudies
from tactileq.modeling.seeds import generator, number_of

SIZES = (20, 36)
AT_ONCE = 50  # studies that are sampled side by side
SURE = 0.99  # of the interval that an aim has to lie in
TEXTURES = tuple(f"texture {place + 1}" for place in range(N_TEXTURES))
WORLDS: Mapping[str, World] = {**RATER_WORLDS, **OTHER_WORLDS, **CHOICE_WORLDS}

MODEL_COLUMNS = (
    Column("world", is_name=True),
    Column("n"),
    Column("simulations"),
    Column("rule", is_name=True),
    Column("planted", "planted mean effect", format=".3f"),
    Column("coverage", "mean covered by 95% interval", format=".3f"),
    Column("sd_coverage", "SD between people covered", format=".3f"),
    Column("equal", "mean equal", format=".3f"),
    Column("tests_equal", "by tests", format=".3f"),
    Column("different", "mean different", format=".3f"),
    Column("tests_different", "by tests", format=".3f"),
    Column("texture_different", "a texture without effect called different", format=".3f"),
    Column("tests_texture_different", "by tests", format=".3f"),
    Column("texture_equal", "a texture at a bound called equal", format=".3f"),
    Column("tests_texture_equal", "by tests", format=".3f"),
    Column("withheld", "sampler not converged", format=".3f"),
    Column("held_out", "written after the rule of", is_name=True),
    Column("missed", "aim missed", is_name=True),
)
Cell = tuple[str, int]  # world, participants


def model_cells(*, sizes: Iterable[int] = SIZES) -> list[Cell]:
    """The rows of the table, in order; groups of 13 and 7 of 20 people only."""
    return [(name, n) for name in WORLDS for n in sizes if n == 20 or "13 and 7" not in name]


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
    world, parts = WORLDS[name], []
    for start in range(0, simulations, AT_ONCE):
        rng = generator(seed, number_of(name), n, start)
        drawn = world(rng, (min(AT_ONCE, simulations - start), n))
        parts.append(_judged(world, drawn, rng=rng))
    found = pd.concat(parts, ignore_index=True)
    row = {
        "world": name,
        "n": n,
        "simulations": simulations,
        "rule": "hierarchical" if _by_model(world, drawn) else "tests",
        "planted": float(drawn.planted.mean()),
        "held_out": world.held_out,
        **{column: float(found[column].mean()) for column in found.columns},
    }
    return {**row, "missed": "; ".join(_missed(row))}


def _contrasts(drawn: DrawnStudies) -> Floats:
    """(n, 1) −1 where the other model came first, +1 where last; (n, 0) with a single session."""
    days = drawn.days[:, 0, :, 0]
    apart = (days[:, 0] - days[:, 1]).astype(float)[:, None]
    return apart if apart.any() else apart[:, :0]


def _by_model(world: World, drawn: DrawnStudies) -> bool:
    """Whether the model decides, as `verdicts.people_data` has it."""
    return world.rated and not _contrasts(drawn).sum()


def _judged(world: World, drawn: DrawnStudies, *, rng: np.random.Generator) -> pd.DataFrame:
    """What was said of each study: a row of shares or truth values for each."""
    told, tested = _words_of_tests(world, drawn)
    rows = [_said(words, world, drawn, by="tests_") for words in told]
    own: list[dict[str, float]] = [
        {"coverage": covered, "sd_coverage": nan, "withheld": 0.0} for covered in tested
    ]
    if _by_model(world, drawn):
        caveats, own = Caveats(sensitivity=SHOWN), []
        told = []
        for draws in sufficient_draws(_studies(drawn), rng=rng):
            summary = summary_of(draws)
            table = texture_table(draws, world.bounds, textures=TEXTURES)
            judged = PeopleJudged(summary=summary, textures=table)
            told.append(
                words_of_people(judged, world.bounds, textures=TEXTURES, shares={}, caveats=caveats)
            )
            own.append(_covered(draws, drawn))
    return pd.DataFrame(
        [
            {**of_tests, **_said(words, world, drawn), **one}
            for of_tests, words, one in zip(rows, told, own, strict=True)
        ]
    ).astype(float)


def _said(
    words: Mapping[str, str], world: World, drawn: DrawnStudies, *, by: str = ""
) -> dict[str, float]:
    planted = dict(zip(TEXTURES, drawn.planted, strict=True))
    at_bound = [name for name, one in planted.items() if np.isclose(abs(one), world.bounds[1])]
    none = [name for name, one in planted.items() if not one]
    shown = {
        "different": (DIFFERENCES, [ALL_TEXTURES]),
        "equal": (EQUALITY, [ALL_TEXTURES]),
        "texture_different": (DIFFERENCES, none),
        "texture_equal": (EQUALITY, at_bound if world.rated else []),
    }
    return {
        f"{by}{column}": float(any(words[each] in which for each in of)) if of else nan
        for column, (which, of) in shown.items()
    }


def _covered(draws: Draws, drawn: DrawnStudies) -> dict[str, float]:
    summary = summary_of(draws)
    if not summary.converged:
        return {"coverage": nan, "sd_coverage": nan, "withheld": 1.0}
    sd = drawn.people_sd
    known = not np.isnan(sd + summary.sd)
    return {
        "coverage": float(summary.mean_low <= drawn.planted.mean() <= summary.mean_high),
        "sd_coverage": float(summary.sd_low <= sd <= summary.sd_high) if known else nan,
        "withheld": 0.0,
    }


def _studies(drawn: DrawnStudies) -> RatingStudies:
    days = np.broadcast_to(drawn.days - drawn.days.mean(), drawn.values.shape)
    return RatingStudies(
        values=drawn.values,
        anchors=drawn.anchors,
        trends=np.stack([days, drawn.orders - 0.5]),
    )


def _words_of_tests(world: World, drawn: DrawnStudies) -> tuple[list[dict[str, str]], list[float]]:
    """The verdicts of paired t and TOST, apart from days, and whether the interval covers."""
    means = drawn.values.mean(axis=-1)
    differences = means[..., 1] - means[..., 0]  # (k, n, T)
    contrasts = _contrasts(drawn)
    columns = [differences.mean(axis=2), *np.moveaxis(differences, 2, 0)]
    p_difference, p_equivalence = [], []
    for each in columns:
        found = mean_differences(each, contrasts)
        p_difference.append(t_tests(found)[1])
        _, low, _, high = one_sided_tests(found, world.bounds)
        p_equivalence.append(np.maximum(low, high))
    *_, low, high = t_tests(mean_differences(columns[0], contrasts))
    truth = drawn.planted.mean()
    words = []
    p = np.transpose([p_difference, p_equivalence], (2, 0, 1))
    for differs, equals in p:
        own = [(differs[0], equals[0]), *zip(holm(differs[1:]), holm(equals[1:]), strict=True)]
        said = (verdict(float(a), float(b)) for a, b in own)
        words.append(dict(zip((ALL_TEXTURES, *TEXTURES), said, strict=True)))
    return words, ((low <= truth) & (truth <= high)).astype(float).tolist()


def _missed(row: Mapping[str, Any]) -> list[str]:
    """The aims that do not lie in the 99 % interval of the simulated count."""
    missed = []
    for quantity, lowest, highest in aims(row):
        share, count = float(row[quantity]), int(row["simulations"])
        low, high = clopper_pearson(round(share * count), count, confidence=SURE)
        if low > highest or high < lowest:
            missed.append(f"{quantity} {share:.3f}, aim {lowest:.2f} to {highest:.2f}")
    return missed


def aims(row: Mapping[str, Any]) -> list[tuple[str, float, float]]:
    """What is asked of a row: quantity, least and largest share of studies.

    docs/method/validation.md#aims
    """
    world, planted = WORLDS[str(row["world"])], abs(float(row["planted"]))
    bound = world.bounds[1]
    found = [("coverage", 0.93, 0.97), ("sd_coverage", 0.92, 1.0), ("withheld", 0.0, 0.02)]
    found += [("texture_different", 0.0, 0.06), ("texture_equal", 0.0, 0.06)]
    if np.isclose(planted, bound):
        found.append(("equal", 0.0, 0.06))
    if planted == 0:
        found += [("different", 0.0, 0.06), ("equal", 0.95 * float(row["tests_equal"]), 1.0)]
    if np.isclose(planted, 2 * bound):
        found.append(("different", 0.95 * float(row["tests_different"]), 1.0))
    return [one for one in found if not np.isnan(float(row[one[0]]))]


def model_table(rows: Iterable[dict[str, Any]]) -> pd.DataFrame:
    """The rows of `simulate_model_cell` as a table of `MODEL_COLUMNS`."""
    return pd.DataFrame(list(rows), columns=names(MODEL_COLUMNS))
