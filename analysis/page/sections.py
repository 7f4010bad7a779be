"""The parts of a section of the report."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from analysis.page.outcomes import Outcome
from analysis.page.page import Fold, Item, Picture, Table
from modeling.files.writing import file_stem

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
        Findings, computed from the numbers.
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


def of_pairs(sections: Mapping[tuple[str, str], Section | None]) -> Section | None:
    """One section from those about pairs of models; its items state which pair.

    Parameters
    ----------
    sections : mapping of (reference, other) to Section or None
        A single section is returned unchanged.
    """
    kept = {pair: section for pair, section in sections.items() if section is not None}
    first = next(iter(kept.values()), None)
    if first is None or len(kept) == 1:
        return first
    return replace(
        first,
        items=tuple(_of_pair(item, pair) for pair, each in kept.items() for item in each.items),
        outcomes=tuple(dict.fromkeys(one for each in kept.values() for one in each.outcomes)),
    )


def _of_pair(item: Item, pair: tuple[str, str]) -> Item:
    reference, other = pair
    compared = f": {other} compared with {reference} models"

    def named(single: Table | Picture) -> Table | Picture:
        name = file_stem(f"{single.name}_{other}_{reference}")
        return replace(single, name=name, title=single.title + compared)

    if isinstance(item, Fold):
        inner = tuple(named(each) for each in item.items)
        return replace(item, summary=item.summary + compared, items=inner)
    return named(item)
