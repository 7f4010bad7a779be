"""What the model of the participants says of people, claim by claim: pictures and tables.

docs/method/participants.md#verdict
"""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from tactileq.analysis.chapters.claims.people_figure import figure_people
from tactileq.analysis.chapters.claims.predictive_figure import figure_predictive
from tactileq.analysis.page.page import Fold, Item, Picture, Table
from tactileq.analysis.statistics.participants.verdict import PEOPLE_COLUMNS
from tactileq.analysis.statistics.verdicts import ClaimFound, overall_row, word_of
from tactileq.modeling.files.columns import Column, names
from tactileq.modeling.files.writing import file_stem

PRIORS_COLUMNS = (
    Column("claim", is_name=True),
    Column("priors", is_name=True),
    Column("verdict", is_name=True),
    Column("mean", "mean effect"),
    Column("mean_low", "95% CI from"),
    Column("mean_high", "to"),
    Column("sd", "SD between people"),
    Column("sd_low", "95% CI from"),
    Column("sd_high", "to"),
    Column("careless", "share of careless people", format=".2f"),
    Column("careless_low", "95% CI from", format=".2f"),
    Column("careless_high", "to", format=".2f"),
    Column("lapses", "lapsed trials", format=".2f"),
)
OWN, DOUBLED = "as planned", "SDs doubled"


def people_items(found: Sequence[ClaimFound], *, simulated: bool) -> tuple[Item, ...]:
    """Pictures and tables of the claims that the model was asked about; none without such claims.

    Parameters
    ----------
    found : sequence of ClaimFound
        Of finished tasks.
    """
    own = [one for one in found if one.people is not None]
    if not own:
        return ()
    priors = Table(
        "people_priors",
        "The model of the participants, and what other priors would change",
        "Below each claim: the same with the standard deviations of all priors doubled. Effects "
        "are in points of the scale. Empty: not sampled well enough to be told (R̂ above 1.05, or "
        "fewer than 400 effective draws).",
        priors_table(own),
        PRIORS_COLUMNS,
        simulated,
    )
    pictures = [
        picture
        for one in own
        for picture in (_picture(one, simulated=simulated), _predictive(one, simulated=simulated))
    ]
    return (Fold("People, one by one, by the model", (*pictures, _table(own, simulated))), priors)


def priors_table(found: Sequence[ClaimFound]) -> pd.DataFrame:
    """Each claim with its priors, then with doubled ones: `PRIORS_COLUMNS`."""
    rows = []
    for one in found:
        row, people = overall_row(one), one.people
        assert row is not None
        assert people is not None
        for priors, summary in ((OWN, people.summary), (DOUBLED, people.doubled)):
            word = word_of(one, summary, row)
            names_of = {"claim": one.claim.name, "priors": priors, "verdict": word}
            rows.append({**vars(summary), **names_of})
    return pd.DataFrame(rows, columns=names(PRIORS_COLUMNS))


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
        "Own effect: median and 95% interval, as the mean over textures, in points of the scale; "
        "it draws on the other participants as well, so that a single one's deviates less than the "
        "mean of their answers. Careless participants are not left out by hand: the model weighs "
        "everybody by the probability that they attend. The signs of carelessness in the section "
        "on reliability are others, and are not used here.",
        people_table(found),
        PEOPLE_COLUMNS,
        simulated,
    )


def _picture(found: ClaimFound, *, simulated: bool) -> Picture:
    days = " People and days are one, as the models were on different days." * found.by_day
    return Picture(
        file_stem(f"people_{found.claim.name}"),
        f"People, one by one: {found.claim.name}",
        "Each participant's own effect over all textures with its 95% interval, by the model of "
        f"the participants; grey: the bounds.{days} Hollow squares: participants who probably did "
        "not attend; the effect that they would have is hardly known. How many lie outside the "
        "bounds must not be read from it: few ratings of each texture cannot tell.",
        figure_people(found, simulated=simulated),
        simulated,
    )


def _predictive(found: ClaimFound, *, simulated: bool) -> Picture:
    return Picture(
        file_stem(f"predictive_{found.claim.name}"),
        f"Does the model describe the ratings? {found.claim.name}",
        "Posterior predictive check: what these people rated (black) among what the model says "
        "that they could have rated (blue). Left: share of ratings at either end of the scale. "
        "Beside it: SD of each person's ratings, in rising order, with 95% of what is predicted; "
        "and where surfaces were rated several times, the SD of repeated ratings. Where black lies "
        "outside, the model misses something that may matter.",
        figure_predictive(found, simulated=simulated),
        simulated,
    )
