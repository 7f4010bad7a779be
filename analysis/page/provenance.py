"""The section on the provenance of a report."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd

from tactileq.analysis.page.page import Table
from tactileq.modeling.files.columns import Column, names

PROVENANCE_COLUMNS = (Column("what"), Column("value", is_hash=True))


def provenance_table(facts: Mapping[str, object]) -> Table:
    """What the report is based on, a row for each fact; nested values are flattened."""
    return Table(
        "provenance",
        "Provenance of this report",
        "Exact tables are in tables/*.tsv and pictures in figures/*.png beside this file. Only the "
        "first digits of SHA-256 hashes are shown; hover over them, or see the file of the table, "
        "for all digits.",
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
