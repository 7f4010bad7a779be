"""The appendix on the procedures themselves: their performance where the truth is planted."""

from __future__ import annotations

import pandas as pd

from analysis.report.page import Fold, Table
from analysis.report.sections import Section
from analysis.statistics.validation import VALIDATION_COLUMNS

NOTE = (
    "Each row: simulated studies with n participants in which the truth is planted; how often the "
    "procedure covered it (coverage) or rejected (type I error, power), with a 95% interval "
    "(Clopper–Pearson), and the nominal value for normal differences without careless answers or "
    "dropout. The planted value is the latent difference in points, or the rate, of attentive "
    "participants. About one row in twenty says no by chance alone."
)


def validation_section(table: pd.DataFrame) -> Section:
    """What `tactileq analyze --validate` appends.

    docs/method/validation.md

    Parameters
    ----------
    table : DataFrame
        From `analysis.statistics.validation.validation_table`.
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
    held = len(table) - len(apart)
    most = int(table["simulations"].max())
    return Section(
        "validation",
        "Appendix: the procedures on planted truth",
        (summary, Fold("All procedures in all situations", (whole,))),
        done=(
            f"Procedures were tested on planted truth ({most} simulations per row): {held} of "
            f"{len(table)} rows contain their nominal value (appendix).",
        ),
    )
