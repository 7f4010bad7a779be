"""Tables and sidecars as BIDS knows them.

docs/method/protocols.md#bids
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from modeling.files.columns import Column, names
from modeling.files.tables import guarded

MISSING = "n/a"
# A table of BIDS has one line for a row, so neither a tab nor a line end can stand in a cell: they
# become the characters that picture them (U+2409 for a tab), as all control characters do.
_PICTURES = {number: 0x2400 + number for number in range(32)} | {127: 0x2421}


def cell(value: object) -> str:
    """A value as one cell: n/a for nothing and NaN, true or false, ten digits of a number.

    Text that holds a quote is put in quotes and its quotes are doubled, as in CSV; readers of CSV
    get it back as it was. Control characters become their pictures. What a spreadsheet would
    calculate has ' before it (`modeling.files.tables.guarded`).
    """
    if value is None or value == "":
        return MISSING
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return f"{value:.10g}" if math.isfinite(value) else MISSING
    text = value if isinstance(value, str) else _text(value)
    text = guarded(text).translate(_PICTURES).encode("utf-8", "backslashreplace").decode("utf-8")
    return '"' + text.replace('"', '""') + '"' if '"' in text else text


def _text(value: object) -> str:
    if isinstance(value, Mapping | list | tuple):
        return json.dumps(value, ensure_ascii=False, sort_keys=True)
    return str(value)


def table_bytes(columns: Sequence[Column], rows: Iterable[Mapping[str, object]]) -> bytes:
    """A table with a header; what a row does not have is n/a."""
    header = names(columns)
    lines = ["\t".join(header)]
    # Most rows have few of the columns, as those of events do.
    for row in rows:
        cells = {name: cell(value) for name, value in row.items()}
        lines.append("\t".join(cells.get(name, MISSING) for name in header))
    return ("\n".join(lines) + "\n").encode("utf-8")


def json_bytes(values: Mapping[str, Any]) -> bytes:
    """A sidecar."""
    return (json.dumps(values, indent=2, ensure_ascii=False) + "\n").encode(
        "utf-8", "backslashreplace"
    )
