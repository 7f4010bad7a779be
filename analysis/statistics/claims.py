"""Verdicts by the plan: for each claim the mean over textures, then every texture.

docs/method/statistics.md#verdicts
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field

import numpy as np
import pandas as pd

from tactileq.analysis.answers.plan import MODEL_RULE, TESTS_RULE, Claim
from tactileq.analysis.columns import TEXTURE, P
from tactileq.analysis.labels import ALL_TEXTURES, IDENTICAL, MEASURES
from tactileq.analysis.statistics.caveats import NOT_CONVERGED, Caveats
from tactileq.analysis.statistics.equivalence import (
    ALPHA,
    Bounds,
    bayes_factor_null,
    equivalence_test,
    verdict,
)
from tactileq.analysis.statistics.paired import (
    holm,
    ignoring_case,
    paired_test,
    participant_means,
)
from tactileq.analysis.statistics.participants.verdict import PeopleFound, PeopleJudged
from tactileq.analysis.statistics.people import people_test
from tactileq.modeling.arrays import Floats
from tactileq.modeling.files.columns import Column, chosen, names

CONTROL = "control"
NO_TEST = "no test"  # of answers that are incomplete

CLAIM_COLUMNS = (
    Column("claim", is_name=True),
    Column("measure", is_name=True),
    Column("planned"),
    TEXTURE,
    Column("verdict", is_name=True),
    Column("reference", is_name=True),
    Column("other", is_name=True),
    Column("n"),
    Column("mean_reference", "mean of reference"),
    Column("se_reference", "SE"),
    Column("mean_other", "mean of other"),
    Column("se_other", "SE"),
    Column("mean_difference", "difference"),
    Column("ci90_low", "90% CI from"),
    Column("ci90_high", "to"),
    Column("ci_low", "95% CI from"),
    Column("ci_high", "to"),
    Column("bound_low", "bounds from"),
    Column("bound_high", "to"),
    Column("t"),
    Column("df", format=".0f"),
    P,
    Column("p_holm", "p (Holm)", is_p_value=True),
    Column("p_equivalence", "p of TOST", is_p_value=True),
    Column("p_equivalence_holm", "p of TOST (Holm)", is_p_value=True),
    Column("d_z", "d_z"),
    Column("d_z_low", "CI from"),
    Column("d_z_high", "to"),
    Column("bf01", "BF₀₁"),
    Column("bf01_highest", "highest BF₀₁ at this n"),
    Column("shapiro_p", "Shapiro p", is_p_value=True),
    Column("wilcoxon_w", "Wilcoxon W"),
    Column("wilcoxon_p", "Wilcoxon p", is_p_value=True),
    Column("sign_flips_p", "sign flips p", is_p_value=True),
    Column("share_at_ends", "share at ends"),
    Column("doubt", "no equivalence because"),
    Column("excluded"),
    Column("rule", is_name=True),
    Column("tests_verdict", "verdict of the tests", is_name=True),
    Column("model_verdict", "verdict of the model", is_name=True),
    Column("model_mean", "mean effect by the model"),
    Column("model_low", "95% interval from"),
    Column("model_high", "to"),
    Column("p_of_model", "probability of a mean beyond a bound", is_p_value=True),
    Column("people_sd", "SD between people"),
    Column("people_sd_low", "95% interval from"),
    Column("people_sd_high", "to"),
    Column("people_f", "F of people"),
    Column("people_df", "df", format=".0f"),
    Column("people_df_rest", "and", format=".0f"),
    Column("people_p", "p of F", is_p_value=True),
    Column("note"),
)

VERDICT_COLUMNS = chosen(
    CLAIM_COLUMNS,
    *("claim", "texture", "verdict", "rule", "n", "model_mean", "model_low", "model_high"),
    *("p_of_model", "tests_verdict", "model_verdict", "mean_difference", "ci90_low", "ci90_high"),
    *("bound_low", "bound_high", "p_equivalence_holm", "p_holm", "share_at_ends", "doubt"),
)
# For a claim with incomplete data: amount and quality of the data, and no effect.
_INTERIM = ("texture", "verdict", "n", "share_at_ends", "excluded")


@dataclass(frozen=True, eq=False, kw_only=True)
class Values:
    """What a claim is about: a value of each participant and texture with either model.

    Parameters
    ----------
    table : DataFrame
        texture, participant_id, reference, other; NaN where a cell is not complete.
    share_at_ends : mapping of texture to float
        Share of single answers of both models that lie at an end of the scale; `ALL_TEXTURES` is
        that of all that are compared. Empty of a measure that has no ends.
    contrasts : DataFrame
        `crossover.day_contrasts`; without columns where models were not on different days.
    """

    table: pd.DataFrame
    share_at_ends: dict[str, float] = field(default_factory=dict)
    contrasts: pd.DataFrame = field(default_factory=pd.DataFrame)

    def contrasts_of(self, participants: pd.Series | pd.Index) -> Floats:
        """(n, c) days of these participants."""
        return np.asarray(self.contrasts.reindex(participants).to_numpy(dtype=float))


def claim_tests(
    claim: Claim, values: Values, *, caveats: Caveats, rng: np.random.Generator
) -> pd.DataFrame:
    """Every test of one claim: the mean over textures whose models differ, then each texture.

    Parameters
    ----------
    rng : Generator
        Draws sign flips.

    Returns
    -------
    DataFrame
        `CLAIM_COLUMNS`. The first row, of all textures, has complete participants only, each
        texture counting once, and is a family of its own. The textures are another, Holm for tests
        of difference and of equivalence separately; their verdicts rest on these. Identical
        textures come last, without tests; where all are, there is nothing else. Of an unfinished
        task there are numbers of participants and shares at the ends, and no effect.
    """
    compared = values.table[~values.table["texture"].isin(list(caveats.identical))]
    controls = _controls(values, claim, caveats, rng=rng)
    tests = _tests(compared, values, claim, caveats, rng=rng) if len(compared) else controls[:0]
    table = pd.concat([each for each in (tests, controls) if len(each)] or [controls])
    if caveats.unfinished:
        table = _without_effects(table)
    reference, other = claim.models
    low, high = claim.bounds or (np.nan, np.nan)
    return (
        table.reset_index(drop=True)
        .assign(
            claim=claim.name,
            measure=MEASURES[claim.measure],
            planned="yes" if claim.planned else "no",
            rule="" if caveats.unfinished else TESTS_RULE,
            tests_verdict="" if caveats.unfinished else table["verdict"].to_numpy(),
            model_verdict="",
            reference=reference,
            other=other,
            bound_low=low,
            bound_high=high,
        )
        .reindex(columns=names(CLAIM_COLUMNS))
    )


def _tests(
    compared: pd.DataFrame,
    values: Values,
    claim: Claim,
    caveats: Caveats,
    *,
    rng: np.random.Generator,
) -> pd.DataFrame:
    """The row over all textures, and a row for each."""
    overall = _row(_over_textures(compared), claim.bounds, values=values, rng=rng)
    overall |= {"texture": ALL_TEXTURES, "p_holm": overall["p"]}
    overall["p_equivalence_holm"] = overall["p_equivalence"]
    wide = differences_of(compared)
    apart = people_test(wide.to_numpy(dtype=float), values.contrasts_of(wide.index))
    overall |= {"people_f": apart.f, "people_p": apart.p}
    overall |= {"people_df": apart.df_people, "people_df_rest": apart.df_rest}
    textures = pd.DataFrame(
        {"texture": texture, **_row(rows, claim.bounds, values=values, rng=rng)}
        for texture, rows in compared.groupby("texture", sort=False)
    ).sort_values("texture", key=ignoring_case)
    textures["p_holm"] = holm(textures["p"])
    textures["p_equivalence_holm"] = holm(textures["p_equivalence"])
    table = pd.concat([pd.DataFrame([overall]), textures], ignore_index=True)
    shares = table["texture"].map(values.share_at_ends).astype(float)
    table["share_at_ends"] = shares
    table["doubt"] = [caveats.doubt(share) for share in shares]
    adjusted = zip(table["p_holm"], table["p_equivalence_holm"], shares, strict=True)
    table["verdict"] = [caveats.verdict(*p, share_at_ends=share) for *p, share in adjusted]
    return table


def with_people(
    tests: pd.DataFrame, found: PeopleFound, claim: Claim, *, caveats: Caveats, decides: bool
) -> pd.DataFrame:
    """The tests of a claim beside the model of the participants.

    Parameters
    ----------
    tests : DataFrame
        From `claim_tests`.
    claim : Claim
        With bounds.
    decides : bool
        Whether the model's verdict is that on the claim, or stands beside that of the tests.

    Returns
    -------
    DataFrame
        `CLAIM_COLUMNS`. Posterior probabilities of the single textures are corrected after Holm, as
        p values are.
    """
    assert claim.bounds is not None
    summary, table = found.summary, tests.copy()
    of_model = found.textures.set_index("texture").reindex(table["texture"]).reset_index(drop=True)
    overall = (table["texture"] == ALL_TEXTURES).to_numpy()
    judged = (~overall) & (table["verdict"] != CONTROL).to_numpy()
    words = words_of_people(
        found,
        claim.bounds,
        textures=list(table["texture"][judged]),
        shares=dict(zip(table["texture"], table["share_at_ends"].astype(float), strict=True)),
        caveats=caveats,
    )
    both = overall | judged
    table.loc[both, "model_verdict"] = table["texture"][both].map(words)
    if decides:
        table.loc[both, "verdict"] = table["model_verdict"][both]
        table["rule"] = np.where(both, MODEL_RULE, "")
    if not summary.converged:
        return table
    for column, name in (
        ("model_mean", "mean"),
        ("model_low", "ci_low"),
        ("model_high", "ci_high"),
    ):
        table[column] = of_model[name].to_numpy()
    table["p_of_model"] = of_model["p_equivalence"].to_numpy()
    row = {
        "model_mean": summary.mean,
        "model_low": summary.mean_low,
        "model_high": summary.mean_high,
        "people_sd": summary.sd,
        "people_sd_low": summary.sd_low,
        "people_sd_high": summary.sd_high,
    }
    for column, value in row.items():
        table.loc[overall, column] = value
    return table


def words_of_people(
    found: PeopleJudged,
    bounds: Bounds,
    *,
    textures: Sequence[str],
    shares: Mapping[str, float],
    caveats: Caveats,
) -> dict[str, str]:
    """The verdicts of the model of the participants: over all textures, then on each.

    Parameters
    ----------
    bounds : (float, float)
    textures : sequence of str
        Those that are compared. Their posterior probabilities are corrected after Holm.
    shares : mapping of texture to float
        As `Values.share_at_ends`.
    """
    if not found.summary.converged:
        return dict.fromkeys((ALL_TEXTURES, *textures), caveats.allowed(NOT_CONVERGED))
    words = {ALL_TEXTURES: found.summary.verdict(bounds)}
    known = found.textures.set_index("texture").reindex(list(textures))
    p = holm(known["p_difference"]), holm(known["p_equivalence"])
    for texture, differs, equals in zip(textures, *p, strict=True):
        words[texture] = verdict(float(differs), float(equals))
    return {
        texture: caveats.allowed(word, share_at_ends=shares.get(texture, np.nan))
        for texture, word in words.items()
    }


def _without_effects(table: pd.DataFrame) -> pd.DataFrame:
    """The rows of an unfinished task, without effects, to prevent optional stopping."""
    notes = table["note"].where(table["note"] == IDENTICAL, "")
    return table[list(_INTERIM)].assign(note=notes).reindex(columns=names(CLAIM_COLUMNS))


def all_equivalent(tests: pd.DataFrame) -> bool:
    """Whether every texture that is compared is equivalent: the largest unadjusted p of TOST.

    An intersection–union test (Berger 1982), which needs no correction. Where the model of the
    participants decides: the largest probability of a mean effect beyond a bound.
    docs/method/statistics.md#all-textures-equivalent

    Parameters
    ----------
    tests : DataFrame
        Of one claim, from `claim_tests`.
    """
    textures = tests[(tests["texture"] != ALL_TEXTURES) & (tests["verdict"] != CONTROL)]
    by_model = (textures["rule"] == MODEL_RULE).any()
    p = textures["p_of_model" if by_model else "p_equivalence"]
    return every_equivalent(p.to_numpy(float), doubts=textures["doubt"])


def every_equivalent(p_equivalence: Floats, *, doubts: Iterable[str]) -> bool:
    """Whether the unadjusted p of TOST of all textures, one at least, say so, and no doubt stands.

    Parameters
    ----------
    p_equivalence : (n,) ndarray
        NaN where there is none.
    doubts : iterable of str
        `Caveats.doubt` of each texture.
    """
    return bool(p_equivalence.size and (p_equivalence < ALPHA).all() and not any(doubts))


def _over_textures(compared: pd.DataFrame) -> pd.DataFrame:
    """Means over the textures of each participant; NaN if incomplete in any of them."""
    lacking = compared[["reference", "other"]].isna().any(axis=1)
    means = compared.groupby("participant_id")[["reference", "other"]].mean()
    means[means.index.isin(compared["participant_id"][lacking])] = np.nan
    return means.reset_index()


def differences_of(compared: pd.DataFrame) -> pd.DataFrame:
    """Other − reference: a row for each participant, a column for each texture."""
    return compared.assign(difference=compared["other"] - compared["reference"]).pivot(
        index="participant_id", columns="texture", values="difference"
    )


def _row(
    rows: pd.DataFrame, bounds: Bounds | None, *, values: Values, rng: np.random.Generator
) -> dict[str, object]:
    """Both tests over the participants of one texture, or of the means over all."""
    both = rows.dropna(subset=["reference", "other"])
    contrasts = values.contrasts_of(both["participant_id"])
    result = paired_test(both["reference"], both["other"], rng=rng, contrasts=contrasts)
    differences = (both["other"] - both["reference"]).to_numpy(float)
    # The bounds do not matter to the interval; without them there is no p.
    equal = equivalence_test(differences, bounds or (-1.0, 1.0), rng=rng, contrasts=contrasts)
    days = contrasts[:, 0] if contrasts.shape[1] == 1 else np.empty(0)
    groups = (int((days < 0).sum()), int((days > 0).sum()))
    two = groups if days.size and min(groups) else None
    no_factor = contrasts.shape[1] > 1  # of more than two days nobody has published one
    factors = [
        float("nan") if no_factor or result.df < 1 else bayes_factor_null(t, result.n, groups=two)
        for t in (result.t, 0.0)
    ]
    return {
        **asdict(result),
        "ci90_low": equal.ci_low,
        "ci90_high": equal.ci_high,
        "p_equivalence": equal.p if bounds else float("nan"),
        "bf01": factors[0],
        "bf01_highest": factors[1],
        "excluded": ", ".join(sorted(set(rows["participant_id"]) - set(both["participant_id"]))),
    }


def _controls(
    values: Values, claim: Claim, caveats: Caveats, *, rng: np.random.Generator
) -> pd.DataFrame:
    """Textures whose models are the same: described, without tests and verdict."""
    described = (
        *("n", "excluded", "mean_reference", "se_reference", "mean_other", "se_other"),
        *("mean_difference", "ci_low", "ci_high"),
    )
    rows = []
    for texture, of_texture in values.table.groupby("texture", sort=False):
        if texture in caveats.identical:
            found = _row(of_texture, claim.bounds, values=values, rng=rng)
            kept = {name: found[name] for name in described}
            rows.append({"texture": texture, "verdict": CONTROL, "note": IDENTICAL, **kept})
    table = pd.DataFrame(rows).reindex(columns=names(CLAIM_COLUMNS))
    return table.sort_values("texture", key=ignoring_case) if rows else table


def complete_means(
    table: pd.DataFrame, column: str, *, models: tuple[str, str], repeats: int
) -> pd.DataFrame:
    """Means of participants who answered every repeat of a texture with a model.

    An aborted session gives only the cells that it completed.

    Parameters
    ----------
    table : DataFrame
        participant_id, texture, model and `column`; one row per answer.
    models : (str, str)
        The reference, and the other one.
    repeats : int
        Answers that make a cell complete.

    Returns
    -------
    DataFrame
        texture, participant_id, reference, other; NaN where a cell is not complete.
    """
    of_pair = table[table["model"].isin(models)]
    means = participant_means(of_pair, column).rename(
        columns=dict(zip(models, ("reference", "other"), strict=True))
    )
    counts = of_pair.groupby(["texture", "participant_id", "model"])[column].count()
    for name, model in zip(("reference", "other"), models, strict=True):
        cells = pd.MultiIndex.from_arrays(
            [means["texture"], means["participant_id"], [model] * len(means)]
        )
        complete = counts.reindex(cells, fill_value=0).to_numpy() >= repeats
        means[name] = means[name].where(complete) if name in means else np.nan
    return means[["texture", "participant_id", "reference", "other"]]


def share_at_ends(
    table: pd.DataFrame, column: str, *, identical: Collection[str], ends: tuple[float, float]
) -> dict[str, float]:
    """Share of answers at an end of their scale, by texture and over all that are compared.

    Parameters
    ----------
    table : DataFrame
        texture and `column`; one row per answer.
    identical : collection of str
        Textures that are not compared.
    ends : (float, float)
    """
    answered = table[table[column].notna()]
    at_end = answered[column].isin(ends)
    by_texture = at_end.groupby(answered["texture"]).mean()
    compared = ~answered["texture"].isin(list(identical))
    shares = {str(texture): float(share) for texture, share in by_texture.items()}
    return {**shares, ALL_TEXTURES: float(at_end[compared].mean())}
