"""The section on where a report comes from."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd

from analysis.columns import Column, names
from analysis.report.page import Table

PROVENANCE_COLUMNS = (Column("what"), Column("value", is_hash=True))


def provenance_table(facts: Mapping[str, object]) -> Table:
    """What the report rests on, a row for each fact; what is nested is unfolded."""
    return Table(
        "provenance",
        "Where this report comes from",
        "Exact tables are in tables/*.tsv, pictures in figures/*.png beside this file. Of a "
        "SHA-256 hash the first digits are shown; point at it, or see the table's file, for all.",
        pd.DataFrame(unfolded(facts), columns=names(PROVENANCE_COLUMNS)),
        PROVENANCE_COLUMNS,
        simulated=False,
    )


def unfolded(facts: Mapping[str, object], *, within: str = "") -> list[tuple[str, str]]:
    """Nested settings as pairs of what they are (`settings › study › seed`) and their value."""
    rows: list[tuple[str, str]] = []
    for name, value in facts.items():
        what = f"{within} › {name}" if within else str(name)
        if isinstance(value, Mapping):
            rows += unfolded(value, within=what) or [(what, "none")]
        elif isinstance(value, list | tuple) and any(isinstance(v, Mapping) for v in value):
            rows += unfolded({str(n): v for n, v in enumerate(value, start=1)}, within=what)
        else:
            rows.append((what, _plain(value)))
    return rows


def _plain(value: object) -> str:
    if isinstance(value, list | tuple):
        return ", ".join(_plain(each) for each in value) or "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return "none" if value is None else str(value)
