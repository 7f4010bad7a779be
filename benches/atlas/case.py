"""A case of the atlas: a method, a difficulty, and the measure that shows failure.

How to read the results: docs/stability.md.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal, Protocol

import numpy as np

Verdict = Literal["holds", "degrades", "fails"]
HOLDS: Verdict = "holds"
DEGRADES: Verdict = "degrades"
FAILS: Verdict = "fails"
VERDICTS: tuple[Verdict, ...] = (HOLDS, DEGRADES, FAILS)
ALONE = {"": np.nan}


class Measure(Protocol):
    """A run of a case: the figure of merit; larger is worse, inf is the worst.

    `value` is on the case's axis, `column` one of its columns' numbers (NaN where there is only one
    column). `full`: with all repeats of the full atlas instead of the few of the reduced one.
    The same arguments give the same figure: random numbers are seeded within.
    """

    def __call__(self, value: float, column: float, *, full: bool) -> float: ...


@dataclass(frozen=True, kw_only=True)
class Axis:
    """What is varied, from where a case is easy (`mild`) to where it is hard (`severe`).

    Parameters
    ----------
    name, unit : str
        As on the axis of a picture: "speed of modulation", "Hz"; unit "" for a bare number.
    mild, severe : float
        Ends of the range, in either order; above 0 on a logarithmic axis.
    default : float, optional
        The default of the program or its typical use; None where there is no such value.
    """

    name: str
    unit: str
    mild: float
    severe: float
    default: float | None = None
    logarithmic: bool = True

    def at(self, share: float) -> float:
        """The value at this share (0–1) of the way from mild to severe."""
        if not self.logarithmic:
            return self.mild + share * (self.severe - self.mild)
        return float(self.mild * (self.severe / self.mild) ** share)

    def farther(self, factor: float) -> float:
        """The value that is by this factor more severe than the default, as `margin` says."""
        assert self.default is not None
        harder = 1 if self.severe > self.mild else -1
        if self.unit == "dB":
            return self.default + harder * 20 * math.log10(factor)
        return float(self.default * factor**harder)

    def margin(self, edge: float) -> float:
        """By which factor an edge is more severe than the default; NaN where there is no factor.

        In decibels: of the amplitude.
        """
        if self.default is None:
            return float("nan")
        if self.unit == "dB":
            farther_db = edge - self.default if self.severe > self.mild else self.default - edge
            return float(10 ** (farther_db / 20))
        if not (self.default > 0 and edge > 0):
            return float("nan")
        return edge / self.default if self.severe > self.mild else self.default / edge


@dataclass(frozen=True, kw_only=True)
class Case:
    """One method in one kind of difficulty.

    Parameters
    ----------
    family : str
        Cases that are drawn together: "filters", "peak finding", …
    method : str
        The method whose edge is sought: "direct form", "unit covariance", …
    ours : bool
        Whether it is what the program does by default.
    axis : Axis
        Along which the edges are sought.
    figure, unit : str
        What `measure` gives, in words, and its unit.
    holds, degrades : float
        The largest figure with which the method holds, and with which it has not failed yet.
    measure : Measure
        A function of a module (it is sent to other processes).
    across : str
        What the columns are, in words.
    columns : mapping of str to float
        Names and values of a second quantity, each with edges of its own.
    theory : callable, optional
        From a column's value to the edge (on the axis) from which the method should no longer
        hold; at or beyond the severe end where it should hold throughout, NaN where no formula
        says. `source` says which formula that is.
    exception : str
        Why the default may be within a factor of 2 of the nearest edge; "" where it may not.
    """

    family: str
    method: str
    ours: bool
    axis: Axis
    figure: str
    unit: str
    holds: float
    degrades: float
    measure: Measure
    across: str = ""
    columns: Mapping[str, float] = field(default_factory=lambda: dict(ALONE))
    theory: Callable[[float], float] | None = None
    source: str = ""
    exception: str = ""

    @property
    def key(self) -> tuple[str, str, str, str]:
        """Its identity: family, method, what is varied, and what is measured."""
        return self.family, self.method, self.axis.name, self.figure

    def verdict(self, figure: float) -> Verdict:
        """The verdict on a figure; one that is not a number counts as failed."""
        if figure <= self.holds:
            return HOLDS
        return DEGRADES if figure <= self.degrades else FAILS
