"""What the model of the participants says of people, claim by claim: pictures and tables.

docs/method/participants.md#verdict
"""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from tactileq.analysis.chapters.claims.people_figure import figure_people
from tactileq.analysis.chapters.claims.people_sentences import verdict_of_doubled
from tactileq.analysis.page.page import Fold, Item, Picture, Table
from tactileq.analysis.statistics.participants.verdict import PEOPLE_COLUMNS, PeopleSummary
from tactileq.analysis.statistics.verdicts import ClaimFound, overall_row
from tactileq.modeling.files.columns import Column, names
from tactileq.modeling.files.writing import file_stem

PRIORS_COLUMNS = (
    Column("claim", is_name=True),
    Column("priors", is_name=True),
    Column("verdict", is_name=True),
    Column("mean", "mean effect"),
    Column("mean_low", "95% CI from"),
    Column("mean_high", "to"),
    Column("share", "share of people outside the bounds", format=".2f"),
    Column("share_low", "95% CI from", format=".2f"),
    Column("share_high", "to", format=".2f"),
    Column("share_most", "at most (95%)", format=".2f"),
    Column("somebody", "somebody is (probability)", format=".2f"),
    Column("lapses", "lapsed trials", format=".2f"),
    Column("r_hat", "R̂", format=".3f"),
)
OWN, DOUBLED = "as planned", "SDs doubled"


def people_items(found: Sequence[ClaimFound], *, simulated: bool) -> tuple[Item, ...]:
    """A picture for each claim that the model decides, then its tables; none without such claims.

    Parameters
    ----------
    found : sequence of ClaimFound
        Of finished tasks.
    """
    own = [one for one in found if one.people is not None]
    if not own:
        return ()
    pictures = [_picture(one, simulated=simulated) for one in own]
    priors = Table(
        "people_priors",
        "People outside the bounds, and what other priors would change",
        "Share: of people whose own effect lies outside the bounds (who “feel it” in the words of "
        "the answer). Below each claim: the same with the standard deviations of all priors "
        "doubled. Effects are in points of the scale, or shares of right answers. "
        "Where equivalence is withheld, a small share is no evidence for it.",
        priors_table(own),
        PRIORS_COLUMNS,
        simulated,
    )
    return (*pictures, priors, Fold("Participants one by one", (_table(own, simulated),)))


def priors_table(found: Sequence[ClaimFound]) -> pd.DataFrame:
    """Each claim with its priors, then with doubled ones: `PRIORS_COLUMNS`."""
    rows = []
    for one in found:
        row = overall_row(one)
        assert row is not None
        assert one.people is not None
        doubled = verdict_of_doubled(one, share_at_ends=row["share_at_ends"])
        own = {"claim": one.claim.name, "lapses": one.people.lapses}
        rows.append({**own, **_row(one.people.summary, OWN, verdict=row["verdict"])})
        own["lapses"] = float("nan")
        rows.append({**own, **_row(one.people.doubled, DOUBLED, verdict=doubled)})
    return pd.DataFrame(rows, columns=names(PRIORS_COLUMNS))


def _row(summary: PeopleSummary, priors: str, *, verdict: str) -> dict[str, object]:
    return {**vars(summary), "priors": priors, "verdict": verdict}


def people_table(found: Sequence[ClaimFound]) -> pd.DataFrame:
    """Every participant by every claim: `PEOPLE_COLUMNS`."""
    tables = [
        one.people.people.assign(claim=one.claim.name) for one in found if one.people is not None
    ]
    return pd.concat(tables, ignore_index=True)[names(PEOPLE_COLUMNS)]


def _table(found: Sequence[ClaimFound], simulated: bool) -> Table:
    return Table(
        "people",
        "Participants by the model",
        "Own effect: median and 95% interval, as the mean over textures, in points of the scale or "
        "shares of right answers; it draws on the other participants as well, so that a single "
        "one's deviates less than the mean of their answers. Careless participants are not left "
        "out by hand: the model weighs everybody by the probability that they attend. The signs of "
        "carelessness in the section on reliability are others, and are not used here.",
        people_table(found),
        PEOPLE_COLUMNS,
        simulated,
    )


def _picture(found: ClaimFound, *, simulated: bool) -> Picture:
    return Picture(
        file_stem(f"people_{found.claim.name}"),
        f"People, one by one: {found.claim.name}",
        "Each participant's own effect over all textures with its 95% interval, by the model of "
        "the participants; grey: the bounds. Diamonds: effects that lie outside with a probability "
        "above 0.5. Hollow squares: participants who probably did not attend; the effect that they "
        "would have is hardly known, and they count neither in the mean nor in the share.",
        figure_people(found, simulated=simulated),
        simulated,
    )
