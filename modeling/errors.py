"""The errors that users see, and how values and counts are written in them."""

from __future__ import annotations

import reprlib

LONGEST_QUOTE = 60


class InputError(ValueError):
    """Input that cannot be used; the message is one sentence: expected, got, what to do."""


class GridError(InputError):
    """Recordings that are good one by one, but do not span a grid of speeds and forces."""


class _Quotes(reprlib.Repr):
    """Short representations, those of numpy's numbers and arrays as Python's own."""

    def __init__(self) -> None:
        super().__init__()
        self.maxstring = self.maxlong = self.maxother = LONGEST_QUOTE

    def repr1(self, x: object, level: int) -> str:
        if type(x).__module__ == "numpy" and hasattr(x, "tolist"):
            x = x.tolist()
        return super().repr1(x, level)


_QUOTES = _Quotes()


def shown(value: object) -> str:
    """A value as a message quotes it: at most 60 characters in one line, numbers plain."""
    return shortened(_QUOTES.repr(value))


def counted(number: int, noun: str, plural: str | None = None) -> str:
    """A number with its noun: "1 layer", "2 layers"; `plural` where it does not end in s."""
    return f"{number} {noun if number == 1 else plural or f'{noun}s'}"


def shortened(text: str, *, longest: int = LONGEST_QUOTE) -> str:
    """A text in one line, of which no more than the first `longest` characters are left."""
    line = " ".join(text[: 2 * longest].split())
    return line if len(line) <= longest and len(text) <= 2 * longest else line[: longest - 1] + "…"
