"""Types that keys of several files have: names, rates, numbers from 0."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

from tactileq.modeling.checks import HIGHEST_RATE_HZ, LONGEST_NAME, LOWEST_RATE_HZ, UNITS
from tactileq.modeling.files.described import key


def is_line(text: str) -> bool:
    """Whether this is printable text in one line, and not only spaces."""
    return bool(text.strip()) and text.isprintable()


def is_label(text: str) -> bool:
    """Whether a table of answers can hold this: printable, no spaces around it, not n/a."""
    return is_line(text) and text.strip() == text and text != "n/a"


def is_listed_label(text: str) -> bool:
    """Whether lists in a table of answers can hold this label, too."""
    return is_label(text) and not set(text) & set('|"\\')


def is_different(values: Sequence[object]) -> bool:
    """Whether no value stands twice in a list."""
    return all(value not in values[:place] for place, value in enumerate(values))


_LABEL = "printable text without tabs, line ends or spaces around it"
Name = Annotated[str, key(expected="printable text in one line", holds=is_line, advice="rename it")]
TextureName = Annotated[
    str,
    key(
        expected=f"printable text in one line of at most {LONGEST_NAME} characters",
        holds=is_line,
        advice="rename it",
        max_length=LONGEST_NAME,
    ),
]
TextureNames = Annotated[
    tuple[TextureName, ...],
    key(
        expected=f"a list of texture names, each once and of at most {LONGEST_NAME} characters",
        holds=is_different,
        advice='write ["…", "…"]',
    ),
]
Rate = Annotated[float, key(unit="Hz", ge=LOWEST_RATE_HZ, le=HIGHEST_RATE_HZ)]
Unit = Annotated[
    str,
    key(
        "of the accelerations",
        expected=" or ".join(f'"{unit}"' for unit in UNITS),
        pattern=f"^({'|'.join(UNITS)})$",
    ),
]
Simulated = Annotated[bool, key("whether what it was made from was simulated")]
Label = Annotated[str, key(expected=_LABEL, holds=is_label, advice="rename it")]
ListedLabel = Annotated[
    str,
    key(
        expected=f"{_LABEL}, nor bars, quotes and backslashes",
        holds=is_listed_label,
        advice="rename it",
    ),
]
