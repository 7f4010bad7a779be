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
    "Each row: studies drawn by generators that share no code with the model of the participants; "
    "for those with a commit the rule was fixed before they were written. Shares of studies: the "
    "mean effect among people who attend, and the SD between people, covered by their 95% "
    "intervals; the mean called equal or different; a texture without effect called different, "
    "or one at a bound equal; each beside paired t-test and TOST, apart from days. Verdicts "
    "of a sampler that did not converge are withheld. Last column: aims that do not lie in the 99% "
    "interval of the row."
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
        From `tactileq.benches.validation.model.model_table`.
    ranks : DataFrame
        From `tactileq.benches.validation.ranks.rank_table`.
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
        "The rule of verdicts on planted truth",
        MODEL_NOTE,
        of_model,
        MODEL_COLUMNS,
        True,
    )
    calibration = Table(
        "validation_ranks",
        "Calibration of the sampler: ranks of drawn values",
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
            f"{len(table)} rows contain their nominal value; the rule of verdicts misses an aim in "
            f"{missed} of {len(of_model)} rows (appendix).",
        ),
    )
