"""Tables and sidecars as BIDS knows them.

docs/method/protocols.md#bids
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from typing import Any

from tactileq.modeling.files.columns import Column, names

MISSING = "n/a"
# A table of BIDS has one line for a row, so neither a tab nor a line end can stand in a cell: they
# become the characters that picture them (U+2409 for a tab), as all control characters do.
_PICTURES = {number: 0x2400 + number for number in range(32)} | {127: 0x2421}


def cell(value: object) -> str:
    """A value as one cell: n/a for nothing and NaN, true or false, ten digits of a number.

    Text that holds a quote is put in quotes and its quotes are doubled, as in CSV; readers of CSV
    get it back as it was. Control characters become their pictures. Nothing is put before what a
    spreadsheet would calculate: programs compare cells with the levels in the sidecar.
    """
    if isinstance(value, str):
        return _text_cell(value)
    if value is None:
        return MISSING
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return f"{value:.10g}" if math.isfinite(value) else MISSING
    if isinstance(value, Mapping | list | tuple):
        return _text_cell(json.dumps(value, ensure_ascii=False, sort_keys=True))
    return _text_cell(str(value))


@lru_cache(maxsize=4096)  # most cells are one of a few words, or 0
def _text_cell(text: str) -> str:
    if not text:
        return MISSING
    text = text.translate(_PICTURES).encode("utf-8", "backslashreplace").decode("utf-8")
    return '"' + text.replace('"', '""') + '"' if '"' in text else text


def table_bytes(columns: Sequence[Column], rows: Iterable[Mapping[str, object]]) -> bytes:
    """A table with a header; what a row does not have is n/a."""
    header = names(columns)
    lines = ["\t".join(header)]
    for row in rows:
        # Most rows have few of the columns, as those of events do.
        cells = [cell(row[name]) if name in row else MISSING for name in header]
        lines.append("\t".join(cells))
    return ("\n".join(lines) + "\n").encode("utf-8")


def json_bytes(values: Mapping[str, Any]) -> bytes:
    """A sidecar."""
    return (json.dumps(values, indent=2, ensure_ascii=False) + "\n").encode(
        "utf-8", "backslashreplace"
    )
