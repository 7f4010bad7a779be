"""The parts of a section of the report."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol, TypeVar

from tactileq.analysis.page.outcomes import Outcome
from tactileq.analysis.page.page import Fold, Item, Picture, Table
from tactileq.modeling.files.writing import file_stem

Progress = Callable[[float, str], None]
Wanted = TypeVar("Wanted")
Result = TypeVar("Result")


class Mapped(Protocol):
    """Results of a function of each item, in order: `map`, or one that uses several processes."""

    def __call__(
        self, work: Callable[[Wanted], Result], items: Sequence[Wanted], /
    ) -> Iterable[Result]: ...


@dataclass(frozen=True)
class Headline:
    """The answer to the question of a whole report, and what its words mean.

    Parameters
    ----------
    subject : str
        The answer; with points, what they are about.
    points : tuple of str
        One for each claim.
    lead : str
        What the words mean.
    """

    subject: str
    points: tuple[str, ...] = ()
    lead: str = ""


@dataclass(frozen=True, eq=False)
class Section:
    """A chapter of the report.

    Parameters
    ----------
    items : tuple of Table, Picture or Fold
        The first picture begins the chapter (without one, the first table); all others are its
        supplement.
    answer : str
        What the chapter says, in one sentence; by default its weightiest finding.
    outcomes : tuple of Outcome
        Findings, computed from the numbers.
    front : tuple of Picture
        Pictures for the first page.
    done : tuple of str
        What was done.
    tiles : tuple of (str, str)
        Key figures: value, and what it is.
    headline : Headline, optional
        The answer to the question of the whole report; the first one counts.
    reliability, verified : tuple of str
        For the first page: how reliable the answers are, and what was checked.
    cautions : tuple of str
        What must not be concluded.
    deviations : tuple of str
        What was planned, who was left out, and how the study deviated from the plan.
    methods : str
        The statistical methods, worded for a paper.

    Without items it is no chapter; its sentences are on the first page all the same.
    """

    anchor: str
    heading: str
    items: tuple[Item, ...]
    answer: str = ""
    outcomes: tuple[Outcome, ...] = ()
    front: tuple[Picture, ...] = ()
    done: tuple[str, ...] = ()
    tiles: tuple[tuple[str, str], ...] = ()
    headline: Headline | None = None
    reliability: tuple[str, ...] = ()
    verified: tuple[str, ...] = ()
    cautions: tuple[str, ...] = ()
    deviations: tuple[str, ...] = ()
    methods: str = ""

    @property
    def opening(self) -> Picture | Table | None:
        """What begins the chapter, below its answer: a picture, or a table that is all it says."""
        single = [item for item in self.items if not isinstance(item, Fold)]
        pictures = [item for item in single if isinstance(item, Picture)]
        return next(iter(pictures or ([] if self.findings else single)), None)

    @property
    def supplement(self) -> tuple[Item, ...]:
        """Everything but the opening."""
        opening = self.opening
        return tuple(item for item in self.items if item is not opening)

    @property
    def findings(self) -> tuple[str, ...]:
        """The answer, then the other findings, the weightiest first; none twice."""
        found = [outcome.sentence for outcome in sorted(self.outcomes, key=lambda o: o.weight)]
        return tuple(dict.fromkeys([self.answer] * bool(self.answer) + found))


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
