"""What the paper found (PAPER IV, V, VIII), and what our results say of each finding.

docs/paper.md
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import nan
from typing import Literal

import numpy as np
import pandas as pd
from scipy import stats

from tactileq.analysis.labels import MODELS, unit_of
from tactileq.analysis.statistics.compared_answers import chance_of
from tactileq.analysis.statistics.equivalence import EQUIVALENT
from tactileq.analysis.statistics.paired import mean, t_interval
from tactileq.analysis.statistics.verdicts import ClaimFound
from tactileq.modeling.arrays import Floats
from tactileq.modeling.files.answer_tables import ANSWER_TABLES
from tactileq.modeling.files.columns import Column

Outcome = Literal["replicated", "contradicted", "open", "not comparable"]
REPLICATED: Outcome = "replicated"
CONTRADICTED: Outcome = "contradicted"
OPEN: Outcome = "open"
NOT_COMPARABLE: Outcome = "not comparable"  # identical models here

# --- What the paper says --------------------------------------------------------------------

PAPER_TEXTURES = ("aluminum", "canvas", "leather", "MDF", "polyester", "PVC", "wall paper")
# Textures whose two models differ, with the sign of simplified − full; 0 where none is stated.
DIFFER: Mapping[str, Mapping[str, int]] = {
    "magnitude_similarity": {"PVC": -1, "leather": -1},
    "frequency_similarity": {"PVC": -1, "canvas": 0},
    "correct": {"MDF": 1},
}
FIGURES = {"magnitude_similarity": "9a", "frequency_similarity": "9b", "correct": "11"}
PARTICIPANTS = {"magnitude_similarity": 20, "frequency_similarity": 20, "correct": 24}
NOT_ABOVE_HALF = "aluminum"  # whose full model is not rated above 50
WITHOUT_ERROR = "wall paper"
WELL_RECOGNISED = ("canvas", "wall paper")  # the full models of all others: below 40 %
BELOW_CHANCE = (("aluminum", "full"), ("leather", "simplified"))
CONFUSED = ("canvas", "polyester")
CORRELATION = 0.6  # of centroid and amplitude

ALPHA, POWER = 0.05, 0.8
FINDING_COLUMNS = (
    Column("where", "in the paper", is_name=True),
    Column("texture", is_name=True),
    Column("said", "finding of the paper", is_name=True),
    Column("unit"),
    Column("ours", format=".3g"),
    Column("low", "95% CI from", format=".3g"),
    Column("high", "to", format=".3g"),
    Column("outcome"),
    Column("left_open", "left open by the paper's test", format=".2g"),
)


@dataclass(frozen=True, kw_only=True)
class PaperFinding:
    """A finding of the paper beside ours.

    Parameters
    ----------
    where : str
        Figure or table.
    kind : str
        A few words, the same for all textures.
    said : str
        What the paper says of the texture.
    ours, low, high : float
        Our value with its 95 % interval, in `unit`; NaN where there is none.
    left_open : float
        The smallest difference that a paired t-test with as many participants as the paper had
        finds with a probability of 80 %, given the spread of our participants; else NaN.
    """

    where: str
    kind: str
    texture: str
    said: str
    unit: str
    ours: float
    low: float
    high: float
    outcome: Outcome
    left_open: float = nan


def of_answers(
    found: Sequence[ClaimFound], answers: Mapping[str, pd.DataFrame]
) -> list[PaperFinding]:
    """Findings on ratings, right answers and confusions (figures 9 to 11).

    Parameters
    ----------
    found : sequence of ClaimFound
        With a verdict. Of each measure the first claim on full and simplified models counts, and
        of right answers the first on a task that asks for a texture.
    answers : mapping of task to DataFrame
        `Responses.answers`.
    """
    findings: list[PaperFinding] = []
    compared: dict[str, ClaimFound] = {}
    for one in found:
        asked = ANSWER_TABLES[one.claim.task]
        if one.claim.models == MODELS and (asked.scales or asked.is_identification):
            compared.setdefault(one.claim.measure, one)
    for one in (compared[measure] for measure in DIFFER if measure in compared):
        findings += _differences(one)
        if one.claim.measure == "magnitude_similarity":
            findings += _ratings(one.values)
        if one.claim.measure == "correct":
            table = answers[one.claim.task]
            findings += _rates(one.values, chance=chance_of(one.claim.task, table))
            findings += _confusions(table)
    return findings


def of_models(centroids: pd.DataFrame, gfc: pd.DataFrame) -> list[PaperFinding]:
    """Findings on models (figure 5, the text of IV, table 3).

    Parameters
    ----------
    centroids : DataFrame
        `tactileq.analysis.textures.regressions.centroid_table`.
    gfc : DataFrame
        `tactileq.analysis.textures.likeness.gfc_table`.
    """
    findings: list[PaperFinding] = []
    for row in centroids.to_dict("records"):
        if row["texture"] not in PAPER_TEXTURES:
            continue
        slope, p = row["slope_speed_alone"], row["p_speed_alone"]
        rises = OPEN if not p < ALPHA else REPLICATED if slope > 0 else CONTRADICTED
        findings += [
            PaperFinding(
                texture=str(row["texture"]),
                low=nan,
                high=nan,
                where="figure 5",
                kind="centroid rises with speed",
                said="rises with speed",
                unit="Hz per mm/s",
                ours=slope,
                outcome=rises,
            ),
            _correlated(str(row["texture"]), row["amplitude_r"], int(row["conditions"])),
        ]
    full, simple = (gfc[gfc["model"] == model].set_index("texture") for model in MODELS)
    for texture in full.index.intersection(list(PAPER_TEXTURES)):
        dropped = full.loc[texture, "layers"] - simple.loc[texture, "layers"]
        change = simple.loc[texture, "gfc30_mean"] - full.loc[texture, "gfc30_mean"]
        few = dropped == 1
        findings.append(
            PaperFinding(
                where="table 3",
                kind="GFC after dropping one layer",
                texture=str(texture),
                said="changes by less than 0.01",
                unit="GFC30",
                ours=change,
                low=nan,
                high=nan,
                outcome=(REPLICATED if abs(change) < 0.01 else CONTRADICTED)
                if few
                else NOT_COMPARABLE,
            )
        )
    return findings


def _differences(found: ClaimFound) -> Iterator[PaperFinding]:
    """Which textures' models differ, by unadjusted intervals as the paper's tests were."""
    claim = found.claim
    unit, factor = unit_of(claim.measure)
    named = DIFFER[claim.measure]
    for row in found.tests.to_dict("records"):
        texture = str(row["texture"])
        if texture not in PAPER_TEXTURES:
            continue
        low, high = factor * row["ci_low"], factor * row["ci_high"]
        equal = EQUIVALENT in (row["verdict"], row["tests_verdict"]) and not row["doubt"]
        outcome = _outcome(low, high, at=0.0, sign=named.get(texture), equal=equal)
        if texture in found.caveats.identical:
            outcome = NOT_COMPARABLE
        own = found.values[found.values["texture"] == texture]
        spread = factor * float((own["other"] - own["reference"]).std(ddof=1))
        yield PaperFinding(
            where=f"figure {FIGURES[claim.measure]}",
            kind={
                "magnitude_similarity": "magnitude changes",
                "frequency_similarity": "frequency changes",
                "correct": "correct rate changes",
            }[claim.measure],
            texture=texture,
            said="differs" if texture in named else "no significant difference",
            unit=unit,
            ours=factor * row["mean_difference"],
            low=low,
            high=high,
            outcome=outcome,
            left_open=detectable(PARTICIPANTS[claim.measure]) * spread,
        )


def _outcome(
    low: float, high: float, *, at: float, sign: int | None, equal: bool = False
) -> Outcome:
    """What an interval says of a finding that something differs from a value, or does not.

    Parameters
    ----------
    sign : int, optional
        1 above, -1 below, 0 on either side; None where the paper found no difference.
    equal : bool
        Whether equality was shown.
    """
    found = 1 if low > at else -1 if high < at else 0
    if sign is None:
        return CONTRADICTED if found else REPLICATED if equal else OPEN
    if not found:
        return CONTRADICTED if equal else OPEN
    return REPLICATED if sign in (0, found) else CONTRADICTED


def detectable(participants: int) -> float:
    """The d_z that a two-sided paired t-test finds with a probability of 80 %."""
    from statsmodels.stats.power import TTestPower  # late: slow to load

    effect: float = TTestPower().solve_power(nobs=participants, alpha=ALPHA, power=POWER)
    return effect


def _ratings(values: pd.DataFrame) -> Iterator[PaperFinding]:
    """Whether full models are rated above 50."""
    for texture, own in _of_paper(values):
        ratings = own["reference"].to_numpy(dtype=float)
        low, high = t_interval(ratings)
        sign = -1 if texture == NOT_ABOVE_HALF else 1
        yield PaperFinding(
            where="figure 9a",
            kind="full model above 50",
            texture=texture,
            said="not above 50" if sign < 0 else "above 50",
            unit="points of 100",
            ours=mean(ratings),
            low=low,
            high=high,
            outcome=_outcome(low, high, at=50.0, sign=sign),
        )


def _rates(values: pd.DataFrame, *, chance: float) -> Iterator[PaperFinding]:
    """Who is recognised, and how often."""
    for texture, own in _of_paper(values):
        shares = {
            model: own[column].to_numpy(dtype=float)
            for model, column in zip(MODELS, ("reference", "other"), strict=True)
        }
        often, right = "how often recognised", "right answers"
        said: list[tuple[str, str, str, Floats, float, int]] = []
        if texture == WITHOUT_ERROR:
            errors = (shares["full"] == 1.0).astype(np.float64)
            said.append((often, "most without an error", "participants", errors, 0.5, 1))
        elif texture not in WELL_RECOGNISED:
            said.append((often, "full model below 40 %", right, shares["full"], 0.4, -1))
        if texture == "MDF":
            rates = shares["simplified"]
            said.append(("if simplified", "simplified model above 60 %", right, rates, 0.6, 1))
        said += [
            ("below chance", f"{model} model below chance", right, shares[model], chance, -1)
            for name, model in BELOW_CHANCE
            if name == texture
        ]
        for kind, words, of, rates, at, sign in said:
            low, high = t_interval(rates)
            yield PaperFinding(
                where="figure 11",
                kind=kind,
                texture=texture,
                said=words,
                unit=f"% of {of}",
                ours=100 * mean(rates),
                low=100 * low,
                high=100 * high,
                outcome=_outcome(low, high, at=at, sign=sign),
            )


def _confusions(answers: pd.DataFrame) -> Iterator[PaperFinding]:
    """Whether canvas and polyester are taken for each other."""
    for texture, other in (CONFUSED, CONFUSED[::-1]):
        own = answers[(answers["texture"] == texture) & answers["answer"].notna()]
        if own.empty:
            continue
        taken = (own["answer"] == other).astype(float).groupby(own["participant_id"]).mean()
        shares = np.array(taken, dtype=np.float64)
        low, high = t_interval(shares)
        yield PaperFinding(
            where="figure 10",
            kind="confused",
            texture=texture,
            said=f"taken for {other} above chance",
            unit="% of answers",
            ours=100 * mean(shares),
            low=100 * low,
            high=100 * high,
            outcome=_outcome(low, high, at=1 / len(PAPER_TEXTURES), sign=1),
        )


def _correlated(texture: str, r: float, conditions: int) -> PaperFinding:
    """Whether centroid and amplitude are correlated by more than 0.6 (Fisher's z)."""
    low = high = nan
    if conditions > 3 and abs(r) < 1:
        half = stats.norm.ppf(1 - ALPHA / 2) / np.sqrt(conditions - 3)
        low, high = (float(np.tanh(np.arctanh(r) + side * half)) for side in (-1, 1))
    return PaperFinding(
        where="text of IV",
        kind="centroid and amplitude",
        texture=texture,
        said="correlated above 0.6",
        unit="Pearson's r",
        ours=r,
        low=low,
        high=high,
        outcome=_outcome(low, high, at=CORRELATION, sign=1),
    )


def _of_paper(values: pd.DataFrame) -> Iterator[tuple[str, pd.DataFrame]]:
    complete = values[values["texture"].isin(PAPER_TEXTURES)].dropna(subset=["reference", "other"])
    for texture, own in complete.groupby("texture", sort=False):
        yield str(texture), own


def finding_table(findings: Sequence[PaperFinding]) -> pd.DataFrame:
    """`FINDING_COLUMNS`, a row for each finding."""
    rows = [{name.name: getattr(one, name.name) for name in FINDING_COLUMNS} for one in findings]
    return pd.DataFrame(rows, columns=[column.name for column in FINDING_COLUMNS])


def in_words(findings: Sequence[PaperFinding], *, simulated: bool) -> str:
    """How many findings came out in which way."""
    counts = {
        o: sum(one.outcome == o for one in findings) for o in (REPLICATED, CONTRADICTED, OPEN)
    }
    compared = sum(counts.values())
    text = (
        f"Of {compared} findings of the paper {counts[REPLICATED]} are replicated, "
        f"{counts[CONTRADICTED]} contradicted, and {counts[OPEN]} are open"
    )
    if simulated:
        return f"{text} in this simulation, which is evidence neither for the paper nor against it."
    return f"{text}."
