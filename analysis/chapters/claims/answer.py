"""The answer to the report's question, claim by claim, computed from the verdicts."""

from __future__ import annotations

from collections.abc import Sequence

from tactileq.analysis.answers.responses import Responses
from tactileq.analysis.chapters.claims.sentences import claim_in_short
from tactileq.analysis.labels import ALL_TEXTURES, MEASURES, TASK_TITLES, sentence_case
from tactileq.analysis.page.sections import Headline
from tactileq.analysis.statistics.claims import CONTROL
from tactileq.analysis.statistics.verdicts import ClaimFound, overall_row

NOTHING_TO_CLAIM = "No models are compared: no task asked for ratings or right answers."
NOTHING_ANSWERED = (
    "Nothing to compare: there are no answers to the tasks that the claims are about."
)
IDENTICAL = "Nothing to compare: the models of all textures are identical."


def answer(found: Sequence[ClaimFound], responses: Responses) -> Headline | None:
    """Can anybody feel the difference? A point for each claim; None without answers.

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
    rows = [(one, row) for one in asked if (row := overall_row(one)) is not None]
    if not rows:
        identical = all(one.caveats.identical for one in asked)
        return Headline(IDENTICAL if identical else NOTHING_ANSWERED)
    over = {one.claim.name: textures_in_words(one) for one, _ in rows}
    everywhere = set(over.values())
    subject = f"{_circumstances(responses)}{_subject(asked)}"
    alike = len(everywhere) == 1
    if alike:
        subject += f", over {everywhere.pop()}"
    points = [
        claim_in_short(
            one,
            row,
            what=_what(one, asked),
            where="" if alike else f" (over {over[one.claim.name]})",
        )
        for one, row in rows
    ]
    return Headline(f"{sentence_case(subject)}:", tuple(points))


def textures_in_words(found: ClaimFound) -> str:
    """The textures that a claim is about, by name, and how many are identical."""
    tests = found.tests[found.tests["texture"] != ALL_TEXTURES]
    names = list(map(str, tests["texture"][tests["verdict"] != CONTROL]))
    listed = " and ".join(filter(None, [", ".join(names[:-1]), *names[-1:]]))
    same = int((tests["verdict"] == CONTROL).sum())
    if same:
        listed += f" ({same} more {'has' if same == 1 else 'have'} identical models)"
    return listed


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
    return f"{names}{kind}"


def _what(one: ClaimFound, found: Sequence[ClaimFound]) -> str:
    """The measure, with the claim's name where several claims share the measure."""
    shared = sum(each.claim.measure == one.claim.measure for each in found) > 1
    return f"{MEASURES[one.claim.measure]}{f' (“{one.claim.name}”)' * shared}"
