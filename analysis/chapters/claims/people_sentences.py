"""What is said of people: whether they differ, how many, and where model and tests part.

docs/method/statistics.md#people
"""

from __future__ import annotations

import numpy as np

from tactileq.analysis.labels import SCALES, sentence_case, unit_of
from tactileq.analysis.statistics.caveats import NOT_CONVERGED
from tactileq.analysis.statistics.claims import NO_TEST
from tactileq.analysis.statistics.equivalence import ALPHA, WITHIN_BOUNDS
from tactileq.analysis.statistics.people import MOST_REPEATS
from tactileq.analysis.statistics.verdicts import ClaimFound, Row
from tactileq.modeling.errors import counted
from tactileq.modeling.files.answer_tables import ANSWER_TABLES
from tactileq.modeling.files.columns import p_value

WORTH_A_WORD = 0.05  # share of careless people, or of ratings at an end, that may part two verdicts
NEAR_NONE = 1.0  # points: below it the lower limit of an SD tells nothing from none


def do_people_differ(found: ClaimFound, row: Row) -> str:
    """The F test, the SD between people, and how many feel it, as far as the design can tell."""
    differ, many = _differ(found, row), how_many(found, doubt=row["doubt"])
    said = sentence_case("; ".join(part for part in (differ, many) if part))
    return f"{'Do people differ? ' * bool(differ)}{said}." if said else ""


def _differ(found: ClaimFound, row: Row) -> str:
    if found.claim.measure not in SCALES or np.isnan(row["people_p"]):
        return ""
    p = p_value(row["people_p"])
    test = f"F({row['people_df']:.0f}, {row['people_df_rest']:.0f}) = {row['people_f']:.2f}, p "
    test += p if p.startswith("<") else f"= {p}"
    spread = _spread(found)
    shown = "Shown" if row["people_p"] < ALPHA else "Not shown"
    return f"{shown} ({test})" + f": {spread}" * bool(spread)


def _spread(found: ClaimFound) -> str:
    """The SD between people with its interval; its upper limit alone where it may be none."""
    if found.people is None or np.isnan(found.people.summary.sd):
        return ""
    own = found.people.summary
    unit, factor = unit_of(found.claim.measure)
    what = "SD of people and days" if found.by_day else "SD of personal effects"
    if own.sd_low < NEAR_NONE:
        return f"{what} at most {factor * own.sd_high:.1f} {unit} (95% CI)"
    return (
        f"{what} {factor * own.sd:.1f} {unit} (95% CI {factor * own.sd_low:.1f} to "
        f"{factor * own.sd_high:.1f})"
    )


def how_many(found: ClaimFound, *, doubt: str = "") -> str:
    """How many participants differ by more than the bounds; or why nobody can say it.

    Parameters
    ----------
    doubt : str
        Why equality must not be concluded: then nothing is said of nobody.
    """
    counts = found.people_count
    if counts is None:
        return ""
    if counts.by_day:
        return "with the models on different days, people and days cannot be told apart"
    if counts.repeats < counts.needed:
        each = "" if ANSWER_TABLES[found.claim.task].both_models else " with each model"
        answers = f"{counted(counts.repeats, 'answer')} on each texture{each}"
        least = f"{counts.needed} are needed"
        if counts.needed >= MOST_REPEATS:
            least = "no number would, with these bounds"
        return f"{answers} cannot say how many feel it ({least})"
    if doubt and not counts.beyond:
        return ""
    return (
        f"{counts.beyond} of {counted(counts.people, 'participant')} "
        f"{'is' if counts.beyond == 1 else 'are'} shown to differ by more than the bounds (Holm)"
    )


def disagreement(found: ClaimFound, row: Row) -> str:
    """That the model and the tests say something else, and why; empty where they do not."""
    if found.people is None or not row["model_verdict"]:
        return ""
    of_model, tests = row["model_verdict"], row["tests_verdict"] or NO_TEST
    if of_model == tests or {of_model, tests} & {NOT_CONVERGED, NO_TEST}:
        return ""
    return (
        f"{sentence_case(found.claim.name)}: the model of the participants says “{of_model}”, the "
        f"paired tests “{tests}”; {', and '.join(_reasons(found, row))}."
    )


def _reasons(found: ClaimFound, row: Row) -> list[str]:
    assert found.people is not None
    reasons, careless = [], found.people.summary.careless
    if careless > WORTH_A_WORD:
        reasons.append(f"the tests count careless people (about {careless:.0%}) like the others")
    if row["share_at_ends"] > WORTH_A_WORD:
        reasons.append(
            f"{row['share_at_ends']:.0%} of the ratings lie at an end of the scale, where "
            "differences look smaller than they are"
        )
    if row["excluded"]:
        reasons.append(f"the tests leave out incomplete answers ({row['excluded']})")
    if not reasons and WITHIN_BOUNDS in (row["model_verdict"], row["tests_verdict"]):
        reasons.append("both lie inside the bounds, and the difference is close to none")
    return reasons or ["they make different assumptions about how people and textures differ"]
