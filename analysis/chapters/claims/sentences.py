"""What the tests of claims say, in sentences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from tactileq.analysis.chapters.claims.people_sentences import (
    chains_disagree,
    disagreement,
    doubled_priors,
    texture_effect,
)
from tactileq.analysis.labels import (
    ALL_TEXTURES,
    IDENTICAL,
    MEASURES,
    sentence_case,
    signed,
    unit_of,
)
from tactileq.analysis.page.outcomes import Outcome, Weight
from tactileq.analysis.statistics.caveats import DIFFERENCES, INTERIM, WITHOUT_EQUALITY
from tactileq.analysis.statistics.claims import CONTROL, NO_TEST, all_equivalent
from tactileq.analysis.statistics.verdicts import ClaimFound, Row, overall_row
from tactileq.modeling.files.answer_tables import ANSWER_TABLES
from tactileq.modeling.files.columns import p_value

_JOINTLY = "all textures jointly equivalent (largest p of TOST below .05)"
_JOINTLY_BY_MODEL = (
    "all textures jointly equal on average (largest probability of a mean beyond a bound below .05)"
)


def claim_outcomes(found: Sequence[ClaimFound]) -> list[Outcome]:
    """For each claim a sentence on all textures together, and one on each of them.

    An unfinished task gets a single sentence, without an effect. Where the model of the
    participants decides, there are more: that the tests say something else, that its chains
    disagree, and what other priors would change.
    """
    outcomes = []
    for one in found:
        row = overall_row(one)
        if row is not None:
            outcomes.append(Outcome(Weight.OVERALL, _overall(one, row)))
            outcomes += _beside(one, row)
        if one.caveats.unfinished:
            continue
        textures = by_verdict(one)
        differ = set(DIFFERENCES) & textures.keys()
        weight = Weight.TEXTURES if differ else Weight.SECONDARY
        outcomes.append(Outcome(weight, _textures(one, textures)))
    return outcomes


def _beside(found: ClaimFound, row: Row) -> list[Outcome]:
    """What is said of a verdict of the model besides itself."""
    if found.people is None:
        return []
    said = [
        (Weight.OVERALL, chains_disagree(found)),
        (Weight.OVERALL, disagreement(found, row)),
        (Weight.SECONDARY, doubled_priors(found, row)),
    ]
    return [Outcome(weight, sentence) for weight, sentence in said if sentence]


def by_verdict(found: ClaimFound) -> dict[str, list[Row]]:
    """The rows of single textures, controls left out, by their verdicts."""
    groups: dict[str, list[Row]] = {}
    for row in found.tests.to_dict("records"):
        if row["texture"] != ALL_TEXTURES and row["verdict"] != CONTROL:
            groups.setdefault(row["verdict"] or NO_TEST, []).append(row)
    return groups


def difference(found: ClaimFound, row: Row, *, confidence: str = "95%") -> str:
    """The mean difference with its interval: `−1.7 points of 100 (95% CI −2.9 to −0.5)`."""
    unit, factor = unit_of(found.claim.measure)
    ends = ("ci90_low", "ci90_high") if confidence == "90%" else ("ci_low", "ci_high")
    middle, low, high = (factor * row[name] for name in ("mean_difference", *ends))
    if np.isnan(middle):
        return "(no participant answered completely)"
    interval = f"{confidence} CI {signed(low, 1)} to {signed(high, 1)}"
    if np.isnan(low):
        interval = "no interval"
    bounds = found.claim.bounds
    if bounds is not None and confidence == "90%":
        low, high = (signed(factor * bound, 1) for bound in bounds)
        interval += f", bounds {low} to {high}"
    return f"{signed(middle, 1)} {unit} ({interval})"


def comparison(found: ClaimFound) -> str:
    """What is subtracted from what."""
    reference, other = found.claim.models
    if ANSWER_TABLES[found.claim.task].both_models:
        return f"right answers for {other} among {reference} and vice versa, minus chance"
    return f"{other} − {reference}"


def _overall(found: ClaimFound, row: Row) -> str:
    verdict = row["verdict"] or NO_TEST
    text = f"{found.claim.name} ({MEASURES[found.claim.measure]}, {comparison(found)}): {verdict}"
    if verdict in WITHOUT_EQUALITY:
        text += f", since {row['doubt']}"
    if verdict != INTERIM:
        tests = f"{difference(found, row, confidence='90%')}{_tests(row)}"
        if found.people is not None:
            shown = row["tests_verdict"] or NO_TEST
            tests = f"paired tests: {shown}, {tests}"
        text += f"; {tests}"
    return f"{sentence_case(text)} (participants: {row['n']})."


def _tests(row: Row) -> str:
    """The tests of a row; those in favour of equivalence only where nothing casts doubt on it."""
    text = ""
    if np.isfinite(row["t"]):
        text += f", t({row['df']:.0f}) = {signed(row['t'], 2)}"
    if np.isfinite(row["p"]):
        text += f", {_p(row['p'])}"
    if np.isfinite(row["p_equivalence"]) and not row["doubt"]:
        text += f", TOST {_p(row['p_equivalence'])}"
    if np.isfinite(row["d_z"]):
        text += f", d_z = {signed(row['d_z'], 2)}"
        if not row["doubt"]:
            text += f", BF₀₁ = {row['bf01']:.2g} (maximum at this n: {row['bf01_highest']:.2g})"
    return text


def _textures(found: ClaimFound, groups: Mapping[str, Sequence[Row]]) -> str:
    parts = []
    for verdict, rows in groups.items():
        shown = [str(row["texture"]) for row in rows]
        if verdict in DIFFERENCES:
            shown = [f"{row['texture']} {_texture_difference(found, row)}" for row in rows]
        if verdict in WITHOUT_EQUALITY:
            shown = [f"{text} ({row['doubt']})" for text, row in zip(shown, rows, strict=True)]
        apart = "; " if verdict in (*DIFFERENCES, *WITHOUT_EQUALITY) else ", "
        parts.append(f"{verdict}: {apart.join(shown)}")
    if found.claim.bounds is not None and all_equivalent(found.tests):
        parts.append(_JOINTLY if found.people is None else _JOINTLY_BY_MODEL)
    same = found.tests[found.tests["note"] == IDENTICAL]["texture"]
    if len(same):
        parts.append(f"{IDENTICAL}: {', '.join(same)}")
    text = f"{found.claim.name}, texture by texture: {'; '.join(parts) or 'nothing to compare'}."
    return sentence_case(text)


def _texture_difference(found: ClaimFound, row: Row) -> str:
    """How a texture differs, by what decides about it."""
    if found.people is not None:
        return texture_effect(found, row)
    return f"{difference(found, row)}, Holm {_p(row['p_holm'])}"


def _p(p: float) -> str:
    shown = p_value(p)
    return f"p {shown}" if shown.startswith("<") else f"p = {shown}"
