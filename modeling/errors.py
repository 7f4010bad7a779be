"""The errors that users see, and the checks that all kinds of data share."""

from math import isfinite
from numbers import Real


class InputError(ValueError):
    """Input that cannot be used; the message is one sentence: expected, got, what to do."""


class GridError(InputError):
    """Recordings that are good one by one, but do not span a grid of speeds and forces."""


def check_texture_name(name: object) -> None:
    """Refuse what cannot be a texture's name in a table: anything but one line of text."""
    if not isinstance(name, str) or not name.strip() or any(c in name for c in "\t\r\n"):
        raise InputError(
            f"expected a texture name of one line without tabs, got {name!r}; name it."
        )


def check_rate(rate_hz: object) -> None:
    """Refuse what cannot be a sampling rate: anything but a finite number above 0."""
    number = isinstance(rate_hz, Real) and not isinstance(rate_hz, bool)
    if not (number and isfinite(float(rate_hz)) and float(rate_hz) > 0):  # type: ignore[arg-type]
        got = str(rate_hz) if number else repr(rate_hz)
        raise InputError(f"expected a rate above 0 Hz, got {got}; give the rate.")
