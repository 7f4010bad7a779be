"""A quantity in a rig file: its value with unit, and whether it was measured."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, ClassVar

from tactileq.modeling.errors import counted
from tactileq.modeling.files.described import FileSection, key

Points = tuple[tuple[float, float], ...]
Unit = Annotated[str, key("that of the quantity", advice="convert the value and write that unit")]
Assumed = Annotated[
    bool,
    key(
        "false only for what was measured at this very rig",
        advice="write false only for what was measured at this rig",
    ),
]
Source = Annotated[
    str, key("who measured it how, a data sheet, a guess", advice="put it in quotes")
]


@dataclass(frozen=True)
class Figure(FileSection):
    """A physical quantity of a rig."""

    QUANTITY: ClassVar[str] = "value"
    value: Annotated[float, key("in its unit")]
    unit: Unit
    assumed: Assumed
    source: Source

    def __str__(self) -> str:
        return f"{self.value:g} {self.unit}" + (" (assumed)" if self.assumed else "")


def _rises(points: Points) -> bool:
    return all(b[0] > a[0] and b[1] >= a[1] for a, b in pairwise(points))


@dataclass(frozen=True)
class Curve(FileSection):
    """A quantity that follows another one: points of both, straight lines between them."""

    QUANTITY: ClassVar[str] = "points"
    points: Annotated[
        Points,
        key(
            "the second numbers in its unit",
            expected="two or more points, the first numbers rising, the second never falling",
            advice="write points = [[0, 0], [1, 4]], sorted, or measure again",
            holds=_rises,
            min_length=2,
        ),
    ]
    unit: Unit
    assumed: Assumed
    source: Source

    def __str__(self) -> str:
        ends = f"{self.points[0][1]:g} to {self.points[-1][1]:g} {self.unit}"
        return f"{ends}, {counted(len(self.points), 'point')}" + (
            " (assumed)" if self.assumed else ""
        )
