"""Checks of single values of a recipe, each with one sentence for what is wrong."""

from __future__ import annotations

from modeling import InputError


def check_name(what: str, name: object) -> None:
    """Refuse all but printable text in one line."""
    if not isinstance(name, str) or not name.strip() or not name.isprintable():
        raise InputError(f"expected printable text in one line as {what}, got {name!r}; rename it.")


def check_choice(what: str, value: object, choices: tuple[str, ...]) -> None:
    """Refuse all but one of the choices."""
    if value not in choices:
        either = " or ".join(f'"{choice}"' for choice in choices)
        raise InputError(f"expected {what} to be {either}, got {value!r}; choose one.")


def check_number(what: str, value: object, *, low: float = 0.0, high: float) -> None:
    """Refuse all but a number from `low` to `high`."""
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if not (number and low <= value <= high):  # type: ignore[operator]
        raise InputError(
            f"expected a number from {low:g} to {high:g} for {what}, got {value!r}; correct it."
        )


def check_whole(what: str, value: object, *, low: int, high: int) -> None:
    """Refuse all but a whole number from `low` to `high`."""
    if not (isinstance(value, int) and not isinstance(value, bool) and low <= value <= high):
        raise InputError(
            f"expected a whole number from {low} to {high} for {what}, got {value!r}; correct it."
        )
