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
    items : tuple of Table, Picture or Fold
        In the order of the page.
    outcomes : tuple of Outcome
        Findings, computed from the numbers.
    done : tuple of str
        What was done.
    tiles : tuple of (str, str)
        Key figures: value, and what it is.
    answer, lead : str
        The sentence that answers the question of the whole report, and what its words mean.
    cautions : tuple of str
        What must not be concluded.
    deviations : tuple of str
        What was planned, who was left out, and how the study deviated from the plan.
    methods : str
        The statistical methods, worded for a paper.

    Without items it has no place of its own in the page; its sentences are shown at a glance.
    """

    anchor: str
    heading: str
    items: tuple[Item, ...]
    outcomes: tuple[Outcome, ...] = ()
    done: tuple[str, ...] = ()
    tiles: tuple[tuple[str, str], ...] = ()
    answer: str = ""
    lead: str = ""
    cautions: tuple[str, ...] = ()
    deviations: tuple[str, ...] = ()
    methods: str = ""


def of_task(section: Section, ending: str) -> Section:
    """The section of a task whose anchor and files have this ending; unchanged with an empty one.

    Parameters
    ----------
    ending : str
        Such as `_pair`.
    """
    if not ending:
        return section
    return replace(
        section,
        anchor=f"{section.anchor}{ending.replace('_', '-')}",
        items=tuple(_renamed(item, lambda name: f"{name}{ending}") for item in section.items),
    )


def _renamed(item: Item, name: Callable[[str], str], *, words: str = "") -> Item:
    """An item whose files have another name, and whose title these words behind it."""

    def renamed(single: Table | Picture) -> Table | Picture:
        return replace(single, name=name(single.name), title=f"{single.title}{words}")

    if isinstance(item, Fold):
        inner = tuple(renamed(each) for each in item.items)
        return replace(item, summary=f"{item.summary}{words}", items=inner)
    return renamed(item)


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
        items=tuple(_for_pair(item, pair) for pair, each in kept.items() for item in each.items),
        outcomes=tuple(dict.fromkeys(one for each in kept.values() for one in each.outcomes)),
    )


def _for_pair(item: Item, pair: tuple[str, str]) -> Item:
    reference, other = pair
    return _renamed(
        item,
        lambda name: file_stem(f"{name}_{other}_{reference}"),
        words=f": {other} compared with {reference} models",
    )
