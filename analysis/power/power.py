"""How often a study of n participants comes to each verdict, counted over simulated studies.

docs/method/power.md
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from tactileq.analysis.answers.plan import EQUIVALENCE, Claim
from tactileq.analysis.answers.responses import Responses
from tactileq.analysis.columns import TEXTURE
from tactileq.analysis.labels import ALL_TEXTURES
from tactileq.analysis.statistics.caveats import BOUNDS_WITHHELD, WITHHELD, Caveats
from tactileq.analysis.statistics.claims import (
    Values,
    differences_of,
    every_equivalent,
    words_of_people,
)
from tactileq.analysis.statistics.compared_answers import claim_shares, claim_values
from tactileq.analysis.statistics.crossover import mean_differences
from tactileq.analysis.statistics.draws import generators
from tactileq.analysis.statistics.equivalence import (
    DIFFERENT,
    EQUIVALENT,
    INCONCLUSIVE,
    WITHIN_BOUNDS,
    Bounds,
    equivalence_test,
)
from tactileq.analysis.statistics.paired import (
    holm,
    sign_flips_p,
    t_tests,
    why_undefined,
    without_rounding_noise,
)
from tactileq.analysis.statistics.participants.design import PeopleData
from tactileq.analysis.statistics.participants.posterior import Effort
from tactileq.analysis.statistics.participants.verdict import PeopleJudged, judged_by_size
from tactileq.analysis.statistics.rates import clopper_pearson
from tactileq.analysis.statistics.verdicts import claim_caveats, people_data
from tactileq.modeling.files.columns import Column, names

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


def verdicts_by_size(
    by_size: Mapping[int, Responses],
    *,
    rng: np.random.Generator,
    effort: Effort | None = None,
) -> list[Verdict]:
    """The verdicts on all claims of the plan, by its rule, at every number of participants.

    Parameters
    ----------
    by_size : mapping of int to Responses
        A finished study and its first people alone, from few to many.
    rng : Generator
        Draws sign flips where participants do not vary, and seeds the draws from posteriors.
    effort : Effort, optional
        Of the model of the participants, where it decides.
    """
    judged = judged_claims(by_size, rng=rng, effort=effort)
    found = []
    for n, responses in by_size.items():
        for claim in responses.plan.claims:
            caveats, key = claim_caveats(responses, claim, rng=rng), (claim.name, n)
            if key in judged:
                shares = claim_shares(responses, claim)
                found += people_verdicts(claim, judged[key], n=n, shares=shares, caveats=caveats)
            else:
                values = claim_values(responses, claim)
                found += verdicts(claim, values, n=n, caveats=caveats, rng=rng)
    return found


def judged_claims(
    by_size: Mapping[int, Responses],
    *,
    rng: np.random.Generator,
    effort: Effort | None = None,
) -> dict[tuple[str, int], PeopleJudged]:
    """What the model of the participants says of each claim by name and number of participants.

    Claims of one task with the same bounds and as many answers are sampled side by side.

    Parameters
    ----------
    by_size, rng, effort
        As for `verdicts_by_size`.

    Returns
    -------
    dict
        Without claims of which the tests decide.
    """
    sizes, groups = list(by_size), _sampled_together(by_size[max(by_size)])
    own = generators(rng) if groups else {}
    found: dict[tuple[str, int], PeopleJudged] = {}
    for claims in groups:
        first = claims[0][0]
        assert first.bounds is not None
        data = [one for _, one in claims]
        judged = judged_by_size(data, first.bounds, sizes=sizes, rng=own[first.task], effort=effort)
        for (claim, _), by_n in zip(claims, judged, strict=True):
            found |= {(claim.name, n): one for n, one in zip(sizes, by_n, strict=True)}
    return found


def _sampled_together(responses: Responses) -> list[list[tuple[Claim, PeopleData]]]:
    """Claims about ratings that the model of the participants decides, those alike in one list."""
    alike: dict[tuple[object, ...], list[tuple[Claim, PeopleData]]] = {}
    for claim in responses.plan.claims:
        data = people_data(responses, claim)
        if data is not None and data.decides:
            shapes = (one.shape for one in vars(data.studies).values())
            key = (claim.task, claim.bounds, *shapes)
            alike.setdefault(key, []).append((claim, data))
    return list(alike.values())


def people_verdicts(
    claim: Claim,
    judged: PeopleJudged,
    *,
    n: int,
    shares: Mapping[str, float],
    caveats: Caveats,
) -> list[Verdict]:
    """The verdicts of the model of the participants, as `claims.with_people` states them.

    docs/method/power.md#verdicts

    Parameters
    ----------
    claim : Claim
        With bounds.
    n : int
        Participants of the study, for the record.
    shares : mapping of texture to float
        As `Values.share_at_ends`.
    caveats : Caveats
        Of a finished study.

    Returns
    -------
    list of Verdict
        Over all textures, of each, and whether every single mean lies inside the bounds (as
        `claims.all_equivalent`).
    """
    assert claim.bounds is not None
    textures = list(judged.textures["texture"])
    words = words_of_people(judged, claim.bounds, textures=textures, shares=shares, caveats=caveats)
    doubts = [caveats.doubt(shares.get(texture, np.nan)) for texture in textures]
    every = every_equivalent(judged.textures["p_equivalence"].to_numpy(float), doubts=doubts)
    rows = {
        **{texture: word or NO_VERDICT for texture, word in words.items()},
        EVERY_TEXTURE: EQUIVALENT if every else INCONCLUSIVE,
    }
    return [Verdict(claim.name, texture, n, word) for texture, word in rows.items()]


def verdicts(
    claim: Claim, values: Values, *, n: int, caveats: Caveats, rng: np.random.Generator
) -> list[Verdict]:
    """The verdicts of `claims.claim_tests`, without the tests that no verdict rests on.

    docs/method/power.md#verdicts

    Parameters
    ----------
    n : int
        Participants of the study, for the record.
    caveats : Caveats
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
    compared = values.table[~values.table["texture"].isin(list(caveats.identical))]
    if compared.empty or claim.bounds is None:
        return []
    wide = differences_of(compared)
    overall = _p_values(wide.dropna().mean(axis=1), values, claim.bounds, rng=rng)
    own = (wide[texture].dropna() for texture in wide)
    each = np.array([_p_values(differences, values, claim.bounds, rng=rng) for differences in own])
    adjusted = np.column_stack([holm(each[:, 0]), holm(each[:, 1])])
    rows = {ALL_TEXTURES: overall, **dict(zip(map(str, wide), adjusted, strict=True))}
    shares = {texture: values.share_at_ends.get(texture, np.nan) for texture in rows}
    found = [
        Verdict(
            claim.name,
            texture,
            n,
            caveats.verdict(*p, share_at_ends=shares[texture]) or NO_VERDICT,
        )
        for texture, p in rows.items()
    ]
    doubts = [caveats.doubt(shares[str(texture)]) for texture in wide]
    every = every_equivalent(each[:, 1], doubts=doubts)
    return [*found, Verdict(claim.name, EVERY_TEXTURE, n, EQUIVALENT if every else INCONCLUSIVE)]


def _p_values(
    differences: pd.Series, values: Values, bounds: Bounds, *, rng: np.random.Generator
) -> tuple[float, float]:
    """p of a difference and of equivalence, over participants."""
    contrasts = values.contrasts_of(differences.index)
    own = without_rounding_noise(differences.to_numpy(dtype=float))
    found = mean_differences(own[None, :], contrasts)
    undefined = why_undefined(found)
    p = sign_flips_p(found.told[0], rng=rng) if undefined else float(t_tests(found)[1][0])
    return p, equivalence_test(own, bounds, rng=rng, contrasts=contrasts).p


def power_table(found: Iterable[Verdict], *, simulations: int) -> pd.DataFrame:
    """How often each verdict occurred, with its 95 % interval (Clopper–Pearson).

    Parameters
    ----------
    found : iterable of Verdict
        Of all simulations, in any order but with the same claims, textures and n in each.

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
        shown = _shown(texture, of_place)
        for n in sorted({n for n, _ in of_place}):
            for verdict in (verdict for verdict in VERDICTS if verdict in shown):
                hits = of_place.get((n, verdict), 0)
                low, high = clopper_pearson(hits, simulations)
                rows.append(
                    (claim, texture, n, verdict, hits, simulations, hits / simulations, low, high)
                )
    return pd.DataFrame(rows, columns=names(POWER_COLUMNS))


def _shown(texture: str, hits: Iterable[tuple[int, str]]) -> set[str]:
    """The verdicts of one place of the table: those that came, and those that are always listed."""
    if texture == EVERY_TEXTURE:
        return {EQUIVALENT}
    return {verdict for _, verdict in hits} | {EQUIVALENT, INCONCLUSIVE}


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
        at_n = table[(table["claim"] == claim.name) & (table["n"] == n)]
        parts = [_chances(at_n[at_n["texture"] == ALL_TEXTURES])]
        if not len(enough):
            parts.append(f"{wanted} with {TARGET:.0%} is not reached")
        lines.append(f"{claim.name}: simulated: {n} participants: {'; '.join(parts)}")
    return lines


def _chances(rows: pd.DataFrame) -> str:
    return ", ".join(f"{row['verdict']} {_chance(row)}" for _, row in rows.iterrows())


def _chance(row: pd.Series) -> str:
    return f"{row['chance']:.2f} ({row['ci_low']:.2f}–{row['ci_high']:.2f})"
