"""A quantity in a rig file: its value with unit, and whether it was measured."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from math import isfinite
from typing import Any

from modeling import InputError
from modeling.checks import check_keys, is_number
from modeling.errors import counted, shown
from modeling.files.documents import as_text

_FIGURE = ("value", "unit", "assumed", "source")
_CURVE = ("points", "unit", "assumed", "source")


@dataclass(frozen=True)
class Figure:
    """A physical quantity of a rig.

    Parameters
    ----------
    value : float
        Finite.
    unit : str
    assumed : bool
        False only where it was measured at this very rig.
    source : str
        Where it comes from: who measured it how, a data sheet, a guess.
    """

    value: float
    unit: str
    assumed: bool
    source: str

    def __str__(self) -> str:
        return f"{self.value:g} {self.unit}" + (" (assumed)" if self.assumed else "")

    def to_dict(self) -> dict[str, Any]:
        """Plain values, those of a rig file."""
        return {name: getattr(self, name) for name in _FIGURE}


@dataclass(frozen=True)
class Curve:
    """A quantity that follows another one: points of both, straight lines between them.

    Parameters
    ----------
    points : tuple of (float, float)
        At least two, the first numbers rising; the second ones are in `unit` and do not fall.
    unit, assumed, source
        As in `Figure`.
    """

    points: tuple[tuple[float, float], ...]
    unit: str
    assumed: bool
    source: str

    def __str__(self) -> str:
        ends = f"{self.points[0][1]:g} to {self.points[-1][1]:g} {self.unit}"
        return f"{ends}, {counted(len(self.points), 'point')}" + (
            " (assumed)" if self.assumed else ""
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain values, those of a rig file."""
        values = {name: getattr(self, name) for name in _CURVE}
        return values | {"points": [list(point) for point in self.points]}


def figure_from(values: object, what: str, *, unit: str, low: float, high: float) -> Figure:
    """A figure from plain values.

    Parameters
    ----------
    values : object
        { value, unit, assumed, source }, or a Figure.
    what : str
        Its name, for messages.
    unit : str
        The only one that is accepted.
    low, high : float
        Its range.

    Raises
    ------
    InputError
        Naming the key and its unit.
    """
    table = _table(values, what, _FIGURE, unit=unit, example="value = 1.0")
    value = table["value"]
    if not (is_number(value) and low <= value <= high):
        raise InputError(
            f"expected a value from {low:g} to {high:g} {unit} for {what}, got {shown(value)}; "
            "correct it."
        )
    return Figure(float(value), unit, table["assumed"], table["source"])


def curve_from(values: object, what: str, *, unit: str) -> Curve:
    """A curve from { points, unit, assumed, source }; refused as `figure_from` does."""
    table = _table(values, what, _CURVE, unit=unit, example="points = [[0, 0], [1, 4]]")
    points = table["points"]
    if not isinstance(points, list | tuple) or len(points) < 2 or not all(map(_is_point, points)):
        raise InputError(
            f"expected at least two points [pressure, {unit}] for {what}, got {shown(points)}; "
            "write points = [[0, 0], [1, 4]]."
        )
    pairs = tuple((float(x), float(y)) for x, y in points)
    steps = [(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(pairs)]
    if any(across <= 0 or up < 0 for across, up in steps):
        raise InputError(
            f"expected points of rising pressure and never falling {unit} for {what}, got "
            f"{shown(points)}; sort them, or measure again."
        )
    return Curve(pairs, unit, table["assumed"], table["source"])


def _table(
    values: object, what: str, keys: tuple[str, ...], *, unit: str, example: str
) -> dict[str, Any]:
    """The keys of a figure or a curve, each there and of its kind."""
    if isinstance(values, Figure | Curve):
        values = values.to_dict()
    if not isinstance(values, Mapping) or any(key not in values for key in keys):
        raise InputError(
            f"expected {', '.join(keys)} for {what}, got {shown(values)}; write {{ {example}, "
            f'unit = "{unit}", assumed = true, source = "…" }}.'
        )
    check_keys(values, keys, where=what)
    if values["unit"] != unit:
        raise InputError(
            f'expected the unit "{unit}" for {what}, got {shown(values["unit"])}; convert the '
            "value and write that unit."
        )
    if not isinstance(values["assumed"], bool):
        raise InputError(
            f"expected assumed = true or assumed = false for {what}, got "
            f"{shown(values['assumed'])}; write false only for what was measured at this rig."
        )
    as_text(values["source"], f"source of {what}")
    return dict(values)


def _is_point(point: object) -> bool:
    if not isinstance(point, list | tuple) or len(point) != 2:
        return False
    return all(is_number(number) and isfinite(number) for number in point)
