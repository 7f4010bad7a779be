"""What a verdict says in sentences: the one for the first page, and the tests behind it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from tactileq.analysis.chapters.claims.people_sentences import disagreement, do_people_differ
from tactileq.analysis.labels import (
    ALL_TEXTURES,
    IDENTICAL,
    MEASURES,
    sentence_case,
    signed,
    unit_of,
)
from tactileq.analysis.statistics.caveats import (
    BOUNDS_WITHHELD,
    DIFFERENCES,
    INTERIM,
    NOT_CONVERGED,
    WITHHELD,
    WITHOUT_EQUALITY,
)
from tactileq.analysis.statistics.claims import CONTROL, NO_TEST, all_equivalent
from tactileq.analysis.statistics.crossover import CONFOUNDED
from tactileq.analysis.statistics.equivalence import (
    DIFFERENT,
    EQUIVALENT,
    INCONCLUSIVE,
    WITHIN_BOUNDS,
)
from tactileq.analysis.statistics.verdicts import ClaimFound, Row, overall_row, word_of
from tactileq.modeling.files.answer_tables import ANSWER_TABLES
from tactileq.modeling.files.columns import p_value

MOST_NAMED = 3  # textures that show no difference, beyond which they are counted
SAID = {
    EQUIVALENT: "equivalent",
    WITHIN_BOUNDS: "different, but by no more than allowed",
    DIFFERENT: "a difference is shown; whether it is too large is open",
    INCONCLUSIVE: "inconclusive: neither a difference nor equivalence is shown",
    WITHHELD: "not called equivalent, since {doubt}",
    BOUNDS_WITHHELD: "a difference is shown; nothing is concluded about the bounds, since {doubt}",
    INTERIM: "no verdict before the study is complete",
    NO_TEST: "not tested{because}",
    NOT_CONVERGED: "no verdict, since the sampler did not converge; analyse again with other draws "
    "(--seed)",
}
TOO_LARGE = "a difference is shown, larger than allowed"
NOT_DIFFERENT = "no difference is shown, and without bounds equivalence cannot be tested"
_JOINTLY = "all textures jointly within the bounds (largest p of equivalence below .05)"
_BY_90 = (EQUIVALENT, WITHHELD, WITHIN_BOUNDS, BOUNDS_WITHHELD)


def claim_in_short(found: ClaimFound, row: Row, *, what: str, where: str = "") -> str:
    """What the first page says of a claim: difference, verdict, textures, people, priors.

    Parameters
    ----------
    row : Row
        Over all textures.
    what : str
        The measure, in words.
    where : str
        Over which textures, if claims differ in it.
    """
    verdict = row["verdict"] or NO_TEST
    said = SAID[verdict]
    if verdict == DIFFERENT and _beyond(found, row):
        said = TOO_LARGE
    elif found.claim.bounds is None and verdict in (DIFFERENT, INCONCLUSIVE):
        said = NOT_DIFFERENT if verdict == INCONCLUSIVE else "a difference is shown"
    confounded = row["note"] == CONFOUNDED
    because = f": {CONFOUNDED}" if confounded else ", because answers are incomplete"
    said = said.format(doubt=row["doubt"], because=because)
    if verdict in (INTERIM, NO_TEST, NOT_CONVERGED):
        return f"{sentence_case(what)}{where}: {said}."
    parts = [f"{sentence_case(what)}{where}: {_difference(found, row)}: {said}."]
    parts += [_which_textures(found, row), do_people_differ(found, row)]
    parts += [_if_doubled(found, row), _model_beside(found, row)]
    return " ".join(part for part in parts if part)


def _beyond(found: ClaimFound, row: Row) -> bool:
    """Whether the whole 95 % interval lies beyond a bound; the mean where nobody varies."""
    if found.claim.bounds is None:
        return False
    mean, *limits = decided_interval(found, row, level="95%")
    low, high = (mean if np.isnan(limit) else limit for limit in limits)
    return bool(low > found.claim.bounds[1] or high < found.claim.bounds[0])


def decided_interval(found: ClaimFound, row: Row, *, level: str) -> tuple[float, float, float]:
    """The mean difference and its interval, `95%` or `90%`, by what decides."""
    if found.by_model and found.people is not None:
        own = found.people.summary
        if level == "90%":
            return own.mean, own.mean90_low, own.mean90_high
        return own.mean, own.mean_low, own.mean_high
    low, high = ("ci90_low", "ci90_high") if level == "90%" else ("ci_low", "ci_high")
    return row["mean_difference"], row[low], row[high]


def _difference(found: ClaimFound, row: Row) -> str:
    """`5.8 points of 100 lower with simplified models (95% CI −9.4 to −2.5; allowed ±7.5)`.

    The interval is the one that the verdict rests on: 90 % where it says or withholds equivalence,
    both of a difference within the bounds.
    """
    unit, factor = unit_of(found.claim.measure)
    intervals, mean = [], float("nan")
    levels = ["95%"] * (row["verdict"] not in (EQUIVALENT, WITHHELD))
    for level in levels + ["90%"] * (row["verdict"] in _BY_90):
        mean, low, high = (factor * value for value in decided_interval(found, row, level=level))
        if np.isfinite(low):
            intervals.append(f"{level} CI {signed(low, 1)} to {signed(high, 1)}")
    inside = ", ".join(intervals) or f"no interval, {row['note'] or 'since people do not vary'}"
    if found.claim.bounds is not None:
        inside += f"; allowed {_allowed(found.claim.bounds, factor)}"
    reference, other = found.claim.models
    size = f"{abs(mean):.1f} {unit}"
    if ANSWER_TABLES[found.claim.task].both_models:
        side = "above" if mean >= 0 else "below"
        return f"{size} {side} chance, {other} among {reference} models ({inside})"
    direction = "higher" if mean > 0 else "lower"
    return f"{size} {direction} with {other} than with {reference} models ({inside})"


def _allowed(bounds: tuple[float, float], factor: float) -> str:
    low, high = bounds
    if np.isclose(-low, high):
        return f"±{factor * high:.3g}"
    return f"{signed(factor * low, 1)} to {signed(factor * high, 1)}"


def _which_textures(found: ClaimFound, row: Row) -> str:
    """Which single textures a difference comes from, and what the others show."""
    groups = {name: rows for name, rows in by_verdict(found).items() if name != NO_TEST}
    differ = differing(found)
    if sum(map(len, groups.values())) < 2:
        return ""
    if not differ:
        return "No single texture shows it (Holm)." * (row["verdict"] in DIFFERENCES)
    others = [
        str(one["texture"])
        for verdict, rows in groups.items()
        for one in rows
        if verdict not in DIFFERENCES
    ]
    _, factor = unit_of(found.claim.measure)
    shown = ", ".join(
        f"{one['texture']} ({signed(factor * _mean_of(found, one), 1)})" for one in differ
    )
    verb = "It comes from" if row["verdict"] in DIFFERENCES else "Single textures that differ:"
    if not others:
        return f"{verb} {shown}."
    rest = ", ".join(others) if len(others) <= MOST_NAMED else f"the other {len(others)}"
    return f"{verb} {shown}; {rest} {'shows' if len(others) == 1 else 'show'} none (Holm)."


def _mean_of(found: ClaimFound, row: Row) -> float:
    return float(row["model_mean"] if found.by_model else row["mean_difference"])


def _if_doubled(found: ClaimFound, row: Row) -> str:
    """That wider priors would turn the verdict; empty where they would not."""
    if not found.by_model or found.people is None:
        return ""
    word = word_of(found, found.people.doubled, row)
    if word in (row["verdict"], NOT_CONVERGED):
        return ""
    return f"With priors twice as wide the verdict would be “{word}”."


def _model_beside(found: ClaimFound, row: Row) -> str:
    """That the model, where it does not decide, says something else."""
    if found.by_model or row["model_verdict"] in ("", NOT_CONVERGED, row["verdict"]):
        return ""
    return f"The hierarchical model beside the tests says “{row['model_verdict']}”."


def claim_sentences(found: ClaimFound) -> list[str]:
    """For a paper: a sentence on all textures together, and one on each of them.

    An unfinished task gets a single sentence, without an effect. Where the model of the
    participants says something else than the tests, there is a third.
    """
    row = overall_row(found)
    sentences = [_overall(found, row)] if row is not None else []
    if found.caveats.unfinished:
        return sentences
    sentences.append(_textures(found, by_verdict(found)))
    apart = disagreement(found, row) if row is not None else ""
    return sentences + [apart] * bool(apart)


def by_verdict(found: ClaimFound) -> dict[str, list[Row]]:
    """The rows of single textures, controls left out, by their verdicts."""
    groups: dict[str, list[Row]] = {}
    for row in found.tests.to_dict("records"):
        if row["texture"] != ALL_TEXTURES and row["verdict"] != CONTROL:
            groups.setdefault(row["verdict"] or NO_TEST, []).append(row)
    return groups


def differing(found: ClaimFound) -> list[Row]:
    """The rows of single textures that differ."""
    groups = by_verdict(found)
    return [row for verdict in DIFFERENCES for row in groups.get(verdict, [])]


def difference(found: ClaimFound, row: Row, *, confidence: str = "95%") -> str:
    """The mean difference by the tests: `−1.7 points of 100 (95% CI −2.9 to −0.5)`."""
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
        days = ", apart from days" * found.by_day
        tests = f"{difference(found, row, confidence='90%')}{days}{_tests(row)}"
        if found.by_model:
            shown = row["tests_verdict"] or NO_TEST
            tests = f"paired tests: {shown}, {tests}"
        text += f"; {tests}"
    people = f"participants: {row['n']}"
    if found.by_model and found.people is not None:
        people = f"participants: {len(found.people.people)}, in the tests {row['n']}"
    return f"{sentence_case(text)} ({people})."


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
        if not row["doubt"] and np.isfinite(row["bf01"]):
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
        parts.append(_JOINTLY)
    same = found.tests[found.tests["note"] == IDENTICAL]["texture"]
    if len(same):
        parts.append(f"{IDENTICAL}: {', '.join(same)}")
    text = f"{found.claim.name}, texture by texture: {'; '.join(parts) or 'nothing to compare'}."
    return sentence_case(text)


def _texture_difference(found: ClaimFound, row: Row) -> str:
    """How a texture differs, by what decides about it."""
    if found.by_model:
        unit, factor = unit_of(found.claim.measure)
        values = (factor * row[name] for name in ("model_mean", "model_low", "model_high"))
        middle, low, high = (signed(value, 1) for value in values)
        return f"{middle} {unit} (95% CI {low} to {high})"
    return f"{difference(found, row)}, Holm {_p(row['p_holm'])}"


def _p(p: float) -> str:
    shown = p_value(p)
    return f"p {shown}" if shown.startswith("<") else f"p = {shown}"
