"""Checks of single values, each with one sentence for what is wrong."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from math import inf
from numbers import Integral, Real
from typing import TypeGuard

from tactileq.modeling.errors import InputError, shortened, shown

UNITS = ("g", "arbitrary")
LOWEST_RATE_HZ = 1.0
HIGHEST_RATE_HZ = 1e7  # above any accelerometer's; a second then holds 80 MB
LARGEST_VALUE = 1e100  # of samples, so that powers of them stay finite
HIGHEST_SPEED_MM_S = 1e5  # beyond any hand's, as the force
HIGHEST_FORCE_N = 1e4
MOST_SAMPLES = 10_000_000  # of one simulated record: 80 MB, and a set may have dozens
_CLOSE = 0.7  # of difflib's ratio: one letter of four exchanged, or a word that lacks its end
_MOST_MEANT = 3
LONGEST_NAME = 100  # of a texture: it is part of file names


def is_number(value: object) -> TypeGuard[float]:
    """Whether this is a number, and not a bool, which Python counts among them."""
    return isinstance(value, Real) and not isinstance(value, bool)


def is_whole(value: object) -> TypeGuard[int]:
    """Whether this is a whole number, and not a bool."""
    return isinstance(value, Integral) and not isinstance(value, bool)


def check_texture_name(name: object) -> None:
    """Refuse what cannot be a texture's name in a table: anything but printable text."""
    if not isinstance(name, str) or not name.strip() or not name.isprintable():
        raise InputError(
            f"expected a texture name of printable text in one line, got {shown(name)}; name it."
        )
    if len(name) > LONGEST_NAME:
        raise InputError(
            f"expected a texture name of at most {LONGEST_NAME} characters, got {len(name)} in "
            f"{shown(name)}; shorten it."
        )


def is_positive(value: object) -> TypeGuard[float]:
    """Whether this is a finite number above 0."""
    try:
        return is_number(value) and 0 < float(value) < inf
    except OverflowError:  # a whole number larger than any floating-point one
        return False


def check_rate(rate_hz: object) -> None:
    """Refuse what cannot be a sampling rate: anything but a number from 1 Hz to 10 MHz."""
    if not (is_number(rate_hz) and LOWEST_RATE_HZ <= rate_hz <= HIGHEST_RATE_HZ):
        raise InputError(
            f"expected a rate from {LOWEST_RATE_HZ:.0f} to {HIGHEST_RATE_HZ:.0f} Hz, got "
            f"{shown(rate_hz)}; give the rate in Hz."
        )


def check_duration(duration_s: float, rate_hz: float) -> None:
    """Refuse a rate, and a duration above 0 s of more samples than one record may have."""
    check_rate(rate_hz)
    if not is_positive(duration_s):
        raise InputError(
            f"expected a duration above 0 s, got {shown(duration_s)}; give a longer one."
        )
    if duration_s * rate_hz > MOST_SAMPLES:
        raise InputError(
            f"expected a duration of at most {MOST_SAMPLES / rate_hz:g} s at {rate_hz:g} Hz "
            f"({MOST_SAMPLES} samples), got {duration_s:g} s; give a shorter one, or a lower rate."
        )


def check_name(what: str, name: object) -> None:
    """Refuse all but printable text in one line."""
    if not isinstance(name, str) or not name.strip() or not name.isprintable():
        raise InputError(
            f"expected printable text in one line as {what}, got {shown(name)}; rename it."
        )


def check_choice(what: str, value: object, choices: tuple[str, ...]) -> None:
    """Refuse all but one of the choices."""
    if value not in choices:
        either = " or ".join(f'"{choice}"' for choice in choices)
        raise InputError(f"expected {what} to be {either}, got {shown(value)}; choose one.")


def check_number(what: str, value: object, *, low: float = 0.0, high: float) -> None:
    """Refuse all but a number from `low` to `high`."""
    if not (is_number(value) and low <= value <= high):
        raise InputError(
            f"expected a number from {low:g} to {high:g} for {what}, got {shown(value)}; correct "
            "it."
        )


def check_whole(what: str, value: object, *, low: int, high: int) -> None:
    """Refuse all but a whole number from `low` to `high`."""
    if not (is_whole(value) and low <= value <= high):
        raise InputError(
            f"expected a whole number from {low} to {high} for {what}, got {shown(value)}; correct "
            "it."
        )


def check_keys(values: Iterable[str], known: Sequence[str], *, where: str) -> None:
    """Refuse keys that are not among the known ones, and name those that may be meant."""
    unknown = sorted(set(values) - set(known))
    if unknown:
        meant = _meant(unknown[:_MOST_MEANT], known)
        raise InputError(
            f"expected only {', '.join(known)} in {where}, got {shortened(', '.join(unknown))}"
            f"{meant and f' (did you mean {meant}?)'}; correct the spelling or remove it."
        )


def _meant(unknown: Sequence[str], known: Sequence[str]) -> str:
    """The names that unknown ones are close to."""
    close = [get_close_matches(name, known, n=1, cutoff=_CLOSE) for name in unknown]
    return ", ".join(dict.fromkeys(name for names in close for name in names))
