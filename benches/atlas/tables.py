"""The results of the atlas as three tables: all runs, the edges, the margins of our defaults."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import groupby

import numpy as np
import pandas as pd

from tactileq.analysis.columns import SIMULATED_COLUMN
from tactileq.benches.atlas.case import HOLDS, Axis
from tactileq.benches.atlas.edges import Examined
from tactileq.modeling.files.columns import Column

LEAST_MARGIN = 2.0

_FAMILY = Column("family", is_name=True)
_METHOD = Column("method", is_name=True)
_OURS = Column("ours", "our default")
_AXIS = Column("axis", "varied", is_name=True)
_UNIT = Column("unit")
_COLUMN = Column("column", "at", is_name=True)
_MEASURED = Column("measured", "measured", is_name=True)

CELL_COLUMNS = (
    _FAMILY,
    _METHOD,
    _OURS,
    _AXIS,
    _UNIT,
    _COLUMN,
    Column("value", format=".4g"),
    Column("is_default", "at the default"),
    _MEASURED,
    Column("figure", format=".3g"),
    Column("figure_unit", "its unit"),
    Column("verdict"),
    SIMULATED_COLUMN,
)
EDGE_COLUMNS = (
    _FAMILY,
    _METHOD,
    _OURS,
    _AXIS,
    _UNIT,
    _COLUMN,
    _MEASURED,
    Column("holds_to", format=".4g"),
    Column("holds_throughout"),
    Column("fails_from", format=".4g"),
    Column("theory", "holds to, by theory", format=".4g"),
    Column("disagreement", "measured over theory", format=".3g"),
    Column("returns", "holds again beyond"),
    Column("runs"),
    Column("source", "theory from"),
    SIMULATED_COLUMN,
)
MARGIN_COLUMNS = (
    _FAMILY,
    _METHOD,
    _AXIS,
    _UNIT,
    _MEASURED,
    Column("default", format=".5g"),
    Column("verdict", "at the default"),
    Column("nearest_edge", format=".4g"),
    _COLUMN,
    Column("margin", "distance (factor)", format=".3g"),
    Column("at_least", "no edge found"),
    Column("enough", f"{LEAST_MARGIN:g} or more"),
    Column("exception", "why it is less"),
    SIMULATED_COLUMN,
)


def cell_table(examined: Sequence[Examined]) -> pd.DataFrame:
    """Every cell and every run at a default, one row each: `CELL_COLUMNS`."""
    rows = []
    for one in examined:
        case = one.case
        runs = [(cell, False) for cell in one.cells]
        if one.at_default is not None:
            runs.append((one.at_default, True))
        for cell, is_default in runs:
            found = {
                "value": cell.value,
                "is_default": is_default,
                "figure": cell.figure,
                "figure_unit": case.unit,
                "verdict": cell.verdict,
            }
            rows.append(_names(one) | found | {"simulated": True})
    return _table(rows, CELL_COLUMNS)


def edge_table(examined: Sequence[Examined]) -> pd.DataFrame:
    """Measured and expected edges, one row per column of a case: `EDGE_COLUMNS`."""
    rows = []
    for one in examined:
        theory = theory_of(one)
        edges = {
            "holds_to": one.holds_to,
            "holds_throughout": one.holds_throughout,
            "fails_from": one.fails_from,
            "theory": theory,
            "disagreement": disagreement(one.case.axis, one.holds_to, theory),
            "returns": one.returns,
            "runs": one.runs,
            "source": one.case.source if not math.isnan(theory) else "",
        }
        rows.append(_names(one) | edges | {"simulated": True})
    return _table(rows, EDGE_COLUMNS)


def margin_table(examined: Iterable[Examined]) -> pd.DataFrame:
    """How far our defaults are from the nearest edge: `MARGIN_COLUMNS`, one row per case.

    `margin` is the factor by which the nearest edge, over all columns, is more severe than the
    default: 1 or less where the default itself does not hold. With `at_least` there is no edge
    within the axis, and the factor is that to its end.
    """
    ours = [one for one in examined if one.case.ours and one.at_default is not None]
    rows = [_margin_row(list(columns)) for _, columns in groupby(ours, lambda one: one.case.key)]
    return _table(rows, MARGIN_COLUMNS)


def _margin_row(columns: Sequence[Examined]) -> dict[str, object]:
    case = columns[0].case
    margins = [_margin(one) for one in columns]
    nearest = columns[int(np.argmin(margins))]
    margin = min(margins)
    assert nearest.at_default is not None
    return {
        "family": case.family,
        "method": case.method,
        "axis": case.axis.name,
        "unit": case.axis.unit,
        "measured": case.figure,
        "default": case.axis.default,
        "verdict": nearest.at_default.verdict,
        "nearest_edge": nearest.holds_to,
        "column": nearest.column,
        "margin": margin,
        "at_least": nearest.holds_throughout,
        "enough": margin >= LEAST_MARGIN,
        "exception": case.exception,
        "simulated": True,
    }


def _margin(one: Examined) -> float:
    """0 where it holds nowhere; at most 1 where the default itself does not hold."""
    margin = one.case.axis.margin(one.holds_to)
    margin = 0.0 if math.isnan(margin) else margin
    holds = one.at_default is not None and one.at_default.verdict == HOLDS
    return margin if holds else min(margin, 1.0)


def theory_of(one: Examined) -> float:
    """Up to where a method should hold, within the axis; NaN without a formula."""
    case = one.case
    if case.theory is None:
        return math.nan
    edge = float(case.theory(case.columns[one.column]))
    if math.isnan(edge):
        return edge
    low, high = sorted((case.axis.mild, case.axis.severe))
    return min(max(edge, low), high)


def disagreement(axis: Axis, holds_to: float, theory: float) -> float:
    """Measured over expected edge: a factor, or on a linear axis a difference in its unit.

    A method that does not hold even at the mild end counts as holding up to there.
    """
    measured = axis.mild if math.isnan(holds_to) else holds_to
    return measured / theory if axis.logarithmic else measured - theory


def _names(one: Examined) -> dict[str, object]:
    case = one.case
    return {
        "family": case.family,
        "method": case.method,
        "ours": case.ours,
        "axis": case.axis.name,
        "unit": case.axis.unit,
        "column": one.column,
        "measured": case.figure,
    }


def _table(rows: Sequence[dict[str, object]], columns: Sequence[Column]) -> pd.DataFrame:
    return pd.DataFrame(list(rows), columns=[column.name for column in columns])
