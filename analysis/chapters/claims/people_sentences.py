"""What the model of the participants says of a claim, in sentences.

docs/method/participants.md#verdict
"""

from __future__ import annotations

from tactileq.analysis.labels import sentence_case, signed, unit_of
from tactileq.analysis.statistics.caveats import BOUNDS_WITHHELD, WITHHELD
from tactileq.analysis.statistics.equivalence import (
    ALL_BUT,
    AVERAGE_FELT,
    DIFFERENT,
    EQUIVALENT,
    FELT,
    INCONCLUSIVE,
    WITHIN_BOUNDS,
)
from tactileq.analysis.statistics.participants.verdict import LIKELY, PeopleFound
from tactileq.analysis.statistics.verdicts import ClaimFound, Row
from tactileq.modeling.errors import counted

HIGHEST_R_HAT = 1.05
WORTH_A_WORD = 0.05  # share of lapsed trials, or of ratings at an end, that may part two verdicts
MOST_NAMED = 6
FEEL_IT = (
    "“Feel it” means that a person's own difference between the two models, as the mean over the "
    "textures, lies outside the bounds of the claim; where each trial holds both models, it is "
    "the share of right answers minus chance. Smaller differences are not counted. Shares are of "
    "people like these participants, as far as they attend to the task."
)
_HEADLINES = {
    EQUIVALENT: "equivalent in {what}: at most {most} of people feel it (95%), {mean}",
    ALL_BUT: "equal for all but {range} of people in {what} (95%), {mean}",
    AVERAGE_FELT: "equal on average, but felt by some, in {what}: {share}, {mean}",
    FELT: "felt by some in {what}: {share}, {mean}",
    DIFFERENT: "different in {what}: {mean}, {share}",
    INCONCLUSIVE: "inconclusive in {what}: {unknown}, {mean}",
    WITHHELD: "not called equivalent in {what}, since {doubt}: {mean}",
}
# The tests find a difference as well, but none that matters: no contradiction.
_ALIKE = {(EQUIVALENT, WITHIN_BOUNDS), (WITHHELD, BOUNDS_WITHHELD)}


def headline(found: ClaimFound, row: Row, *, what: str) -> str:
    """A clause about a claim that the model decides, people first.

    Parameters
    ----------
    row : Row
        Over all textures.
    what : str
        The measure, in words.
    """
    summary = _people(found).summary
    return _HEADLINES[row["verdict"]].format(
        what=what,
        most=percent(summary.share_most),
        range=_range(summary.share_low, summary.share_high),
        mean=mean_effect(found),
        share=share_phrase(found, row),
        unknown=_unknown(found, row),
        doubt=row["doubt"],
    )


def mean_effect(found: ClaimFound) -> str:
    """The mean effect by the model: `mean −0.4 points of 100 (95% CI …, bounds …)`."""
    summary, bounds = _people(found).summary, found.claim.bounds
    assert bounds is not None
    unit, factor = unit_of(found.claim.measure)
    low, high = (signed(factor * bound, 1) for bound in bounds)
    values = (summary.mean, summary.mean_low, summary.mean_high)
    return f"mean {_interval(values, unit, factor)[:-1]}, bounds {low} to {high})"


def texture_effect(found: ClaimFound, row: Row) -> str:
    """The mean effect on one texture by the model, with its interval."""
    unit, factor = unit_of(found.claim.measure)
    return _interval((row["model_mean"], row["model_low"], row["model_high"]), unit, factor)


def share_phrase(found: ClaimFound, row: Row) -> str:
    """How many people feel it, with the interval; only at least how many where there is doubt."""
    summary = _people(found).summary
    if row["doubt"]:
        text = f"at least {percent(summary.share_low)} of people feel it"
        if row["verdict"] == DIFFERENT:
            return text
        return f"{text}, with no upper limit, since {row['doubt']}"
    return f"{about(summary.share)} (95%: {_range(summary.share_low, summary.share_high)})"


def about(share: float) -> str:
    """A share of people as one says it: `about 4 in 10 people feel it`."""
    if share >= 0.95:
        return "nearly everybody feels it"
    if share < 0.01:
        return "fewer than 1 in 100 people feel it"
    if share < 0.075:
        return f"about {100 * share:.0f} in 100 people feel it"
    return f"about {10 * share:.0f} in 10 people feel it"


def disagreement(found: ClaimFound, row: Row) -> str:
    """That the paired tests say something else, and why that may be; empty where they do not."""
    verdict, tests = row["verdict"], row["tests_verdict"]
    if tests in ("", verdict) or (verdict, tests) in _ALIKE:
        return ""
    name = sentence_case(found.claim.name)
    return (
        f"{name}: the model of the participants says “{verdict}”, the paired tests “{tests}”; "
        f"{_and(_reasons(found, row))}."
    )


def doubled_priors(found: ClaimFound, row: Row) -> str:
    """What would change if the SDs of all priors were twice as large."""
    people = _people(found)
    verdict = verdict_of_doubled(found, share_at_ends=row["share_at_ends"])
    unit, factor = unit_of(found.claim.measure)
    means = [signed(factor * one.mean, 1) for one in (people.doubled, people.summary)]
    same = verdict == row["verdict"]
    text = f"the verdict stays “{verdict}”" if same else f"the verdict would be “{verdict}”"
    text += f"; the mean is {means[0]} instead of {means[1]} {unit}"
    if not row["doubt"]:
        most = [percent(one.share_most) for one in (people.doubled, people.summary)]
        text += f", and at most {most[0]} instead of {most[1]} of people feel it (95%)"
    return f"{sentence_case(found.claim.name)}, if the SDs of all priors are doubled: {text}."


def verdict_of_doubled(found: ClaimFound, *, share_at_ends: float) -> str:
    """The verdict on all textures with doubled priors, by the same rule and doubts."""
    assert found.claim.bounds is not None
    word = _people(found).doubled.verdict(found.claim.bounds, few=found.few)
    return found.caveats.allowed(word, share_at_ends=share_at_ends)


def chains_disagree(found: ClaimFound) -> str:
    """A warning where the chains of the sampler disagree; empty where they agree."""
    people = _people(found)
    worst = max(people.summary.r_hat, people.doubled.r_hat)
    if worst < HIGHEST_R_HAT:
        return ""
    return (
        f"{sentence_case(found.claim.name)}: the chains of the sampler do not agree (R̂ = "
        f"{worst:.2f}, expected below {HIGHEST_R_HAT:.2f}), so its verdict and intervals may "
        "change with other draws; analyse again with another seed."
    )


def careless_people(people: PeopleFound) -> list[str]:
    """Participants who probably did not attend."""
    table = people.people
    return [str(who) for who in table[table["careless"] > LIKELY]["participant_id"]]


def named(people: list[str]) -> str:
    """The first of some people by name, and how many more there are."""
    more = len(people) - MOST_NAMED
    return ", ".join(people[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")


def percent(share: float) -> str:
    """A share in whole per cent."""
    return "less than 1%" if 0 < share < 0.005 else f"{share:.0%}"


def _people(found: ClaimFound) -> PeopleFound:
    assert found.people is not None
    return found.people


def _interval(values: tuple[float, float, float], unit: str, factor: float) -> str:
    middle, low, high = (signed(factor * value, 1) for value in values)
    return f"{middle} {unit} (95% CI {low} to {high})"


def _range(low: float, high: float) -> str:
    return f"up to {percent(high)}" if low < 0.005 else f"{100 * low:.0f}–{100 * high:.0f}%"


def _unknown(found: ClaimFound, row: Row) -> str:
    """What an inconclusive verdict leaves open."""
    summary, bounds = _people(found).summary, found.claim.bounds
    assert bounds is not None
    if row["doubt"]:
        return f"nothing follows about the bounds, since {row['doubt']}"
    share = f"95%: {_range(summary.share_low, summary.share_high)}"
    if summary.inside(bounds):
        return (
            "the mean lies inside the bounds, but the people who feel it could not be counted "
            f"well enough ({share}; planned: less than {percent(found.few)})"
        )
    return (
        f"it is open whether the mean lies inside the bounds, and how many people feel it ({share})"
    )


def _reasons(found: ClaimFound, row: Row) -> list[str]:
    """Why a verdict on people and one on the mean of the answers may part."""
    people, bounds = _people(found), found.claim.bounds
    assert bounds is not None
    reasons = []
    by_people = row["verdict"] == INCONCLUSIVE and people.summary.inside(bounds)
    if by_people or row["verdict"] in (AVERAGE_FELT, ALL_BUT, FELT):
        reasons.append("the tests judge the mean alone, however people differ")
    careless = careless_people(people)
    if careless:
        who = f"{counted(len(careless), 'participant')} who probably did not attend"
        reasons.append(f"the tests count {who} ({named(careless)}) like the others")
    if row["share_at_ends"] > WORTH_A_WORD:
        reasons.append(
            f"{row['share_at_ends']:.0%} of the ratings lie at an end of the scale, where "
            "differences look smaller than they are"
        )
    if people.lapses > WORTH_A_WORD:
        reasons.append(f"about {people.lapses:.0%} of the trials lapsed, which hides differences")
    if row["excluded"]:
        reasons.append(f"the tests leave out incomplete answers ({row['excluded']})")
    return reasons or ["they make different assumptions about how people and textures differ"]


def _and(parts: list[str]) -> str:
    return ", and ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else parts)
