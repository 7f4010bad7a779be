"""Columns of more than one table of the report, and its tables as text."""

from __future__ import annotations

import pandas as pd

from tactileq.analysis.labels import ALL_LAYERS, ALL_TEXTURES
from tactileq.modeling.files.columns import Column
from tactileq.modeling.files.tables import guarded

TEXTURE = Column("texture", is_name=True, total=ALL_TEXTURES)
MODEL = Column("model", is_name=True)
ESTIMATOR = Column("estimator", is_name=True)
LAYER = Column("layer", is_name=True, total=ALL_LAYERS)
CONDITIONS = Column("conditions")
P = Column("p", is_p_value=True)
SIMULATED_COLUMN = Column("simulated")


def tsv_text(table: pd.DataFrame) -> str:
    """A table as the text of a TSV; what is missing is n/a, text as `files.tables.guarded`."""
    safe = table.map(lambda value: guarded(value) if isinstance(value, str) else value)
    return str(safe.to_csv(sep="\t", index=False, na_rep="n/a", lineterminator="\n"))


def table_bytes(table: pd.DataFrame) -> bytes:
    """A table as the text of a TSV file."""
    return tsv_text(table).encode()
