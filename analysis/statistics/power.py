"""How often a study of n participants comes to each verdict, counted over simulated studies.

docs/method/power.md
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from analysis.answers.plan import EQUIVALENCE, Claim
from analysis.columns import TEXTURE, Column, names
from analysis.labels import ALL_TEXTURES
from analysis.statistics.claims import (
    BOUNDS_WITHHELD,
    WITHHELD,
    Standing,
    Values,
    every_equivalent,
)
from analysis.statistics.equivalence import (
    DIFFERENT,
    EQUIVALENT,
    INCONCLUSIVE,
    WITHIN_BOUNDS,
    Bounds,
    equivalence_test,
)
from analysis.statistics.paired import (
    holm,
    sign_flips_p,
    t_test,
    why_undefined,
    without_rounding_noise,
)
from analysis.statistics.validation import clopper_pearson
from modeling.arrays import Floats

TARGET = 0.8  # usual power to plan for
EVERY_TEXTURE = "every texture"
NO_VERDICT = "no verdict"
VERDICTS = (
    *(EQUIVALENT, WITHIN_BOUNDS, DIFFERENT, INCONCLUSIVE),
    *(WITHHELD, BOUNDS_WITHHELD, NO_VERDICT),
)

POWER_COLUMNS = (
    Column("claim", is_name=True),
    TEXTURE,
    Column("n"),
    Column("verdict", is_name=True),
    Column("hits"),
    Column("simulations"),
    Column("chance", format=".3f"),
    Column("ci_low", "95% CI from", format=".3f"),
    Column("ci_high", "to", format=".3f"),
)


@dataclass(frozen=True)
class Verdict:
    """The verdict of one simulated study of n participants on one claim and texture."""

    claim: str
    texture: str
    n: int
    verdict: str


def verdicts(
    claim: Claim, values: Values, *, n: int, standing: Standing, rng: np.random.Generator
) -> list[Verdict]:
    """The verdicts of `claims.claim_tests`, without the tests that no verdict rests on.

    docs/method/power.md#verdicts

    Parameters
    ----------
    claim : Claim
    values : Values
    n : int
        Participants of the study, for the record.
    standing : Standing
        Of a finished study.
    rng : Generator
        Draws sign flips where participants do not vary.

    Returns
    -------
    list of Verdict
        Over all textures that are compared, of each, and whether every single one is equivalent
        (the largest unadjusted p of TOST, as `claims.all_equivalent`); empty where models are
        identical for all, or the claim has no bounds.
    """
    compared = values.table[~values.table["texture"].isin(list(standing.identical))]
    if compared.empty or claim.bounds is None:
        return []
    wide = compared.assign(difference=compared["other"] - compared["reference"]).pivot(
        index="participant_id", columns="texture", values="difference"
    )
    complete = wide.dropna().mean(axis=1).to_numpy(dtype=float)
    overall = _p_values(complete, claim.bounds, rng=rng)
    own = (wide[texture].dropna().to_numpy(float) for texture in wide)
    each = np.array([_p_values(differences, claim.bounds, rng=rng) for differences in own])
    adjusted = np.column_stack([holm(each[:, 0]), holm(each[:, 1])])
    rows = {ALL_TEXTURES: overall, **dict(zip(map(str, wide), adjusted, strict=True))}
    shares = {texture: values.share_at_ends.get(texture, np.nan) for texture in rows}
    found = [
        Verdict(
            claim.name,
            texture,
            n,
            standing.verdict(*p, share_at_ends=shares[texture]) or NO_VERDICT,
        )
        for texture, p in rows.items()
    ]
    doubts = [standing.doubt(shares[str(texture)]) for texture in wide]
    every = every_equivalent(each[:, 1], doubts=doubts)
    return [*found, Verdict(claim.name, EVERY_TEXTURE, n, EQUIVALENT if every else INCONCLUSIVE)]


def _p_values(
    differences: Floats, bounds: Bounds, *, rng: np.random.Generator
) -> tuple[float, float]:
    """p of a difference and of equivalence, over participants."""
    differences = without_rounding_noise(differences)
    undefined = why_undefined(differences)
    p = sign_flips_p(differences, rng=rng) if undefined else t_test(differences)[1]
    return p, equivalence_test(differences, bounds, rng=rng).p


def power_table(found: Iterable[Verdict], *, simulations: int) -> pd.DataFrame:
    """How often each verdict occurred, with its 95 % interval (Clopper–Pearson).

    Parameters
    ----------
    found : iterable of Verdict
        Of all simulations, in any order but with the same claims, textures and n in each.
    simulations : int

    Returns
    -------
    DataFrame
        `POWER_COLUMNS`: claims and textures as they first came, then by n; all verdicts that came
        at any n, in the order of `VERDICTS`; of `EVERY_TEXTURE` only how often all were equivalent.
    """
    counts = Counter(found)
    places = dict.fromkeys((one.claim, one.texture) for one in counts)
    rows = []
    for claim, texture in places:
        of_place = {
            (one.n, one.verdict): hits
            for one, hits in counts.items()
            if (one.claim, one.texture) == (claim, texture)
        }
        came = {verdict for _, verdict in of_place} | {EQUIVALENT, INCONCLUSIVE}
        shown = {EQUIVALENT} if texture == EVERY_TEXTURE else came
        for n in sorted({n for n, _ in of_place}):
            for verdict in (verdict for verdict in VERDICTS if verdict in shown):
                hits = of_place.get((n, verdict), 0)
                low, high = clopper_pearson(hits, simulations)
                rows.append(
                    (claim, texture, n, verdict, hits, simulations, hits / simulations, low, high)
                )
    return pd.DataFrame(rows, columns=names(POWER_COLUMNS))


def power_sentences(table: pd.DataFrame, *, claims: Sequence[Claim]) -> list[str]:
    """One line for each claim: the smallest n with sufficient power over all textures.

    Where no n suffices, the line is for the largest n and states so.

    Parameters
    ----------
    table : DataFrame
        From `power_table`.
    claims : sequence of Claim
        In the order of the lines.
    """
    overall = table[table["texture"] == ALL_TEXTURES]
    lines = []
    for claim in claims:
        own = overall[overall["claim"] == claim.name]
        if own.empty:
            lines.append(f"{claim.name}: identical models, nothing to compare")
            continue
        wanted = EQUIVALENT if claim.test == EQUIVALENCE else DIFFERENT
        enough = own[(own["verdict"] == wanted) & (own["chance"] >= TARGET)]["n"]
        n = enough.min() if len(enough) else own["n"].max()
        chances = ", ".join(
            f"{row['verdict']} {row['chance']:.2f} ({row['ci_low']:.2f}–{row['ci_high']:.2f})"
            for row in own[own["n"] == n].to_dict("records")
        )
        short = "" if len(enough) else f"; {wanted} with {TARGET:.0%} is not reached"
        lines.append(f"{claim.name}: simulated: {n} participants: {chances}{short}")
    return lines
