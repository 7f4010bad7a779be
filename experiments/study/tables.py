"""What the tables of a study file share: labels, lists, needed keys."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from modeling import InputError
from modeling.errors import shown


def require_label(name: str, value: object, *, forbidden: str = "") -> None:
    """Refuse what a table of answers could not hold: anything but plain printable text."""
    if (
        not isinstance(value, str)
        or value.strip() != value
        or value in ("", "n/a")
        or not value.isprintable()
        or any(character in value for character in forbidden)
    ):
        listed = f" and none of {' '.join(forbidden)}" if forbidden else ""
        raise InputError(
            f"expected printable text for {name}, without tabs, line ends or spaces around it"
            f"{listed}, got {shown(value)}; rename it."
        )


def require_keys(values: Mapping[str, Any], needed: Collection[str], *, where: str) -> None:
    """Refuse a table that lacks a key."""
    missing = sorted(set(needed) - set(values))
    if missing:
        raise InputError(
            f"expected {', '.join(sorted(needed))} in {where}, got no {', '.join(missing)}; "
            "add what is missing."
        )


def require_bool(name: str, value: object) -> None:
    """Refuse everything but true and false."""
    if not isinstance(value, bool):
        raise InputError(f"expected true or false for {name}, got {shown(value)}; correct it.")


def as_table(values: object, *, where: str, example: str) -> dict[str, Any]:
    """A copy of a table; InputError for any other value."""
    if not isinstance(values, Mapping):
        raise InputError(f"expected a table {where}, got {shown(values)}; write {example}.")
    return dict(values)


def as_list(values: object, *, where: str, example: str) -> tuple[Any, ...]:
    """The items of a list; InputError for any other value."""
    if not isinstance(values, list | tuple):
        raise InputError(f"expected a list of {where}, got {shown(values)}; write {example}.")
    return tuple(values)


def require_different(what: str, names: Collection[str]) -> None:
    """Refuse a list that names something twice."""
    if len(set(names)) != len(names):
        raise InputError(
            f"expected different {what}, got {', '.join(names)}; name each of them once."
        )
