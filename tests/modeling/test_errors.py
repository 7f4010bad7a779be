"""How messages write counts: a number agrees with its noun."""

from __future__ import annotations

import pytest

from tactileq.modeling.errors import counted


@pytest.mark.parametrize(
    ("number", "noun", "plural", "written"),
    [
        (0, "layer", None, "0 layers"),
        (1, "layer", None, "1 layer"),
        (2, "layer", None, "2 layers"),
        (1, "person", "people", "1 person"),
        (3, "person", "people", "3 people"),
    ],
)
def test_a_number_agrees_with_its_noun(
    number: int, noun: str, plural: str | None, written: str
) -> None:
    assert counted(number, noun, plural) == written
