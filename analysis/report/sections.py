"""What a section of the report is made of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from analysis.report.outcomes import Outcome
from analysis.report.page import Item

Progress = Callable[[float, str], None]


@dataclass(frozen=True, eq=False)
class Section:
    """One part of the report.

    Parameters
    ----------
    anchor, heading : str
    items : tuple of Table, Picture or Fold
        In the order of the page.
    outcomes : tuple of Outcome
        What came out, computed from the numbers.
    done : tuple of str
        What was done.
    tiles : tuple of (str, str)
        Key figures: value, and what it is.
    """

    anchor: str
    heading: str
    items: tuple[Item, ...]
    outcomes: tuple[Outcome, ...] = ()
    done: tuple[str, ...] = ()
    tiles: tuple[tuple[str, str], ...] = ()
