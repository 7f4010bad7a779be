"""The appendix on the procedures themselves: their performance where the truth is planted."""

from __future__ import annotations

import pandas as pd

from tactileq.analysis.page.page import Fold, Table
from tactileq.analysis.page.sections import Section
from tactileq.benches.validation.model import MODEL_COLUMNS
from tactileq.benches.validation.procedures import VALIDATION_COLUMNS
from tactileq.benches.validation.ranks import RANK_COLUMNS

NOTE = (
    "Each row: simulated studies with n participants in which the truth is planted; how often the "
    "procedure covered it (coverage) or rejected (type I error, power), with a 95% interval "
    "(Clopper–Pearson), and the nominal value for normal differences without careless answers or "
    "dropout. The planted value is the latent difference in points, or the rate, of attentive "
    "participants. About one row in twenty says no by chance alone."
)


MODEL_NOTE = (
    "Each row: studies drawn by generators that share no code with the model of the participants "
    "and were not made for it; those that were held out were first run after the rule had been "
    "committed. Shares of studies: the mean effect among people who attend covered by its 95% "
    "interval; the share of people outside the bounds below its 95% limit; the mean said to be "
    "inside the bounds, by the model and by TOST; verdicts as the report says them, without words "
    "of equality where sensitivity was not shown (the share of ratings at the ends is not looked "
    "at). Last column: what the row was to reach and missed by more than two standard errors."
)
RANK_NOTE = (
    "Studies whose parameters were drawn from the priors: how many of the drawn values lay in each "
    "tenth of the ranks among draws from the posterior (Talts et al. 2018). Where the sampler is "
    "right the ranks are uniform; about one p in twenty is below .05 by chance alone."
)


def validation_section(table: pd.DataFrame, of_model: pd.DataFrame, ranks: pd.DataFrame) -> Section:
    """What `tactileq analyze --validate` appends.

    docs/method/validation.md

    Parameters
    ----------
    table : DataFrame
        From `tactileq.benches.validation.procedures.validation_table`.
    of_model : DataFrame
        From `validation_model.model_table`.
    ranks : DataFrame
        From `validation_ranks.rank_table`.
    """
    apart = table[table["within"] == "no"]
    short = (
        apart.groupby(["procedure", "quantity", "situation", "meaning"], sort=False)["n"]
        .agg(lambda sizes: ", ".join(map(str, sizes)))
        .reset_index()
    )
    columns = tuple(column for column in VALIDATION_COLUMNS if column.name in short)
    summary = Table(
        "validation_apart",
        "Where a procedure misses its nominal value",
        "Rows of the table below whose interval does not contain the nominal value, by number of "
        "participants.",
        short,
        columns,
        True,
    )
    whole = Table(
        "validation", "Procedures on planted truth", NOTE, table, VALIDATION_COLUMNS, True
    )
    model = Table(
        "validation_model",
        "Verdicts of the model of the participants on planted truth",
        MODEL_NOTE,
        of_model,
        MODEL_COLUMNS,
        True,
    )
    calibration = Table(
        "validation_ranks",
        "Calibration of the samplers: ranks of drawn values",
        RANK_NOTE,
        ranks,
        RANK_COLUMNS,
        True,
    )
    held = len(table) - len(apart)
    missed = int((of_model["missed"] != "").sum())
    most = int(table["simulations"].max())
    return Section(
        "validation",
        "Appendix: the procedures on planted truth",
        (summary, Fold("All procedures in all situations", (whole,)), model, calibration),
        done=(
            f"Procedures were tested on planted truth ({most} simulations per row): {held} of "
            f"{len(table)} rows contain their nominal value; verdicts of the model of the "
            f"participants miss an aim in {missed} of {len(of_model)} rows (appendix).",
        ),
    )
