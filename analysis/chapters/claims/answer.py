"""The answer to the report's question, claim by claim, computed from the verdicts."""

from __future__ import annotations

from collections.abc import Sequence

from tactileq.analysis.answers.responses import Responses
from tactileq.analysis.chapters.claims.people_sentences import headline
from tactileq.analysis.chapters.claims.sentences import (
    by_verdict,
    difference,
)
from tactileq.analysis.labels import MEASURES, TASK_TITLES, sentence_case
from tactileq.analysis.page.sections import Headline
from tactileq.analysis.statistics.caveats import (
    BOUNDS_WITHHELD,
    DIFFERENCES,
    INTERIM,
    WITHHELD,
    WITHOUT_EQUALITY,
)
from tactileq.analysis.statistics.claims import NO_TEST
from tactileq.analysis.statistics.equivalence import (
    DIFFERENT,
    EQUIVALENT,
    INCONCLUSIVE,
    WITHIN_BOUNDS,
)
from tactileq.analysis.statistics.verdicts import ClaimFound, overall_row

WORDS = {
    EQUIVALENT: "equivalent in",
    WITHIN_BOUNDS: "different, but within the bounds, in",
    DIFFERENT: "different in",
    INCONCLUSIVE: "inconclusive in",
    WITHHELD: "not called equivalent in",
    BOUNDS_WITHHELD: "different, with no conclusion about the bounds, in",
    INTERIM: "no verdict before the study is complete on",
    NO_TEST: "not tested, because answers are incomplete, in",
}
NOTHING_TO_CLAIM = "No models are compared: no task asked for ratings or right answers."
NOTHING_ANSWERED = (
    "Nothing to compare: there are no answers to the tasks that the claims are about."
)
IDENTICAL = "Nothing to compare: the models of all textures are identical."
NO_BOUNDS = "no difference was shown, and without bounds equivalence cannot be tested, in"


def answer(found: Sequence[ClaimFound], responses: Responses) -> Headline | None:
    """Can anybody feel the difference? A point with intervals for each claim; None without answers.

    Planned claims alone, where there are some.

    Parameters
    ----------
    responses : Responses
        Who answered, and where.
    """
    if all(table.empty for table in responses.answers.values()):
        return None
    if not found:
        return Headline(NOTHING_TO_CLAIM)
    asked = [one for one in found if one.claim.planned] or list(found)
    parts = _parts(asked)
    if not parts:
        identical = all(one.caveats.identical for one in asked)
        return Headline(IDENTICAL if identical else NOTHING_ANSWERED)
    points = [*parts, *_differing_textures(asked)]
    subject = f"{_circumstances(responses)}{_subject(asked)}:"
    return Headline(sentence_case(subject), tuple(f"{sentence_case(point)}." for point in points))


def unfinished_tasks(responses: Responses) -> list[str]:
    """How much of each task that is not complete has been done."""
    lines = []
    for task in responses.unfinished:
        done, planned = responses.done(task), responses.planned[task]
        under_way = ", ".join(sorted(responses.under_way.get(task, ())))
        lines.append(
            f"{TASK_TITLES[task]}: {done.participants} of {planned.participants} planned "
            f"participants, {done.sessions} of {planned.sessions} planned sessions"
            + (f"; answers are missing in sessions of {under_way}" if under_way else "")
        )
    return lines


def _circumstances(responses: Responses) -> str:
    """State that a study is simulated or unfinished, so that nobody overlooks it."""
    if responses.simulated_participants:
        where = "in a simulation without people, "
    elif responses.simulated_rig:
        where = "at a simulated rig, where nobody felt a real surface, "
    else:
        where = ""
    return where + ("so far, " if responses.unfinished else "")


def _subject(found: Sequence[ClaimFound]) -> str:
    pairs = list(dict.fromkeys(one.claim.models for one in found))
    names = " and ".join(f"{other} compared with {reference} models" for reference, other in pairs)
    kind = "" if any(one.claim.planned for one in found) else " (exploratory: nothing was planned)"
    return f"{names}, over all textures{kind}"


def _parts(found: Sequence[ClaimFound]) -> list[str]:
    """What is said of the claims; those of one verdict of the tests together."""
    by_model: list[str] = []
    groups: dict[str, list[str]] = {}
    for one in found:
        row = overall_row(one)
        if row is None:
            continue
        if one.people is not None:
            by_model.append(headline(one, row, what=_what(one, found)))
            continue
        verdict = row["verdict"] or NO_TEST
        words = WORDS[verdict]
        if verdict == INCONCLUSIVE and one.claim.bounds is None:
            words = NO_BOUNDS
        part = _what(one, found)
        if verdict != INTERIM:
            shown = "90%" if one.claim.bounds is not None else "95%"
            part += f" {difference(one, row, confidence=shown)}"
        if verdict in WITHOUT_EQUALITY:
            part += f", since {row['doubt']}"
        groups.setdefault(words, []).append(part)
    return by_model + [f"{words} {' and '.join(parts)}" for words, parts in groups.items()]


def _what(one: ClaimFound, found: Sequence[ClaimFound]) -> str:
    """The measure, with its task or pair of models where several claims share the measure."""
    claim, what = one.claim, MEASURES[one.claim.measure]
    others = [each.claim for each in found if each.claim.measure == claim.measure]
    if len({each.task for each in others}) > 1:
        what += f" of the {TASK_TITLES[claim.task]}"
    if len({each.models for each in others}) > 1:
        what += f" ({claim.models[1]})"
    return f"the {what}" if claim.measure == "correct" else what


def _differing_textures(found: Sequence[ClaimFound]) -> list[str]:
    """Single textures whose models differ, whatever the mean over textures."""
    named = {}
    for one in found:
        groups = by_verdict(one)
        rows = [row for verdict in DIFFERENCES for row in groups.get(verdict, [])]
        if rows:
            named[_what(one, found)] = ", ".join(sorted(str(row["texture"]) for row in rows))
    shown = "; ".join(f"{textures} ({what})" for what, textures in named.items())
    return [f"single textures that differ: {shown}"] * bool(named)
