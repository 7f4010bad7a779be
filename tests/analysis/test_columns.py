"""Columns: what people read of a name, a unit and a number."""

from __future__ import annotations

import numpy as np
import pytest

from tactileq.analysis.columns import LAYER, TEXTURE
from tactileq.analysis.labels import ALL_LAYERS, ALL_TEXTURES
from tactileq.modeling.files.columns import Column, chosen, names, p_value, without
from tests.refusals import refused

PLAIN, P, EXACT = Column("x"), Column("p", is_p_value=True), Column("gfc", format=".4f")
COLUMNS = (PLAIN, P, EXACT)


@pytest.mark.parametrize(
    ("column", "value", "text"),
    [
        (P, 0.0004, "< .001"),
        (P, 0.04, ".040"),
        (P, 1.0, "1.000"),
        (P, np.nan, "n/a"),
        (PLAIN, -3.14159, "−3.14"),
        (PLAIN, 56.44, "56.4"),
        (PLAIN, 1234.5, "1234"),
        (PLAIN, 0.00012, "1.2e−04"),
        (PLAIN, 1e-16, "0.000"),
        (PLAIN, -1e-16, "0.000"),
        (EXACT, -0.00001, "0.0000"),
        (PLAIN, np.float64(0.5), "0.500"),
        (PLAIN, np.nan, "n/a"),
        (PLAIN, np.inf, "∞"),
        (EXACT, -np.inf, "−∞"),
        (PLAIN, 19, "19"),
        (PLAIN, "wall paper", "wall paper"),
        (EXACT, 0.98765, "0.9877"),
        (EXACT, np.nan, "n/a"),
        (EXACT, -0.98765, "−0.9877"),
        (Column("hash", is_hash=True), "0a" * 32, "0a0a0a0a0a0a…"),
        (Column("hash", is_hash=True), "tactileq-demo", "tactileq-demo"),
        (PLAIN, "wall-paper", "wall-paper"),
        (Column("speed", format="g"), 350.0, "350"),
    ],
)
def test_cells_are_readable(column: Column, value: object, text: str) -> None:
    assert column.text(value) == text


@pytest.mark.parametrize(
    ("p", "text"), [(0.0, "< .001"), (0.00099, "< .001"), (0.001, ".001"), (0.9996, "1.000")]
)
def test_p_values_have_three_decimals(p: float, text: str) -> None:
    assert p_value(p) == text


def test_headings_have_units() -> None:
    speed = Column("worst_speed_mm_s", "worst speed", "mm/s")
    assert speed.heading == "worst speed (mm/s)"
    assert Column("distance_db", "distance", "dB").heading == "distance (dB)"
    assert Column("p_holm", "p (Holm)").heading == "p (Holm)"
    assert Column("row_share").heading == "row share"


def test_totals_are_told_from_other_rows() -> None:
    assert TEXTURE.is_total(ALL_TEXTURES)
    assert LAYER.is_total(ALL_LAYERS)
    assert not TEXTURE.is_total("canvas")
    assert not LAYER.is_total(1)
    assert not PLAIN.is_total("")


def test_columns_are_chosen_and_left_out_by_name() -> None:
    assert names(COLUMNS) == ["x", "p", "gfc"]
    assert chosen(COLUMNS, "gfc", "x") == (EXACT, PLAIN)
    assert without(COLUMNS, "p") == (PLAIN, EXACT)


@pytest.mark.parametrize("select", [chosen, without])
def test_what_is_not_declared_is_not_selected(select) -> None:
    with refused(KeyError, names="'q'"):
        select(COLUMNS, "x", "q")
