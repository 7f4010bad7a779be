"""Values of declared types: what they are in words, and what msgspec does not check of them."""

from __future__ import annotations

from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import inspect


class NameOrFile(str):
    """The name of something that is shipped or, where it has a suffix, a file."""

    @property
    def file(self) -> Path | None:
        """The file, None for a name."""
        return Path(self) if Path(self).suffix else None


def words(kind: inspect.Type, *, unit: str = "") -> str:
    """What a value of a type is, in words: "a number from 0 to 20 Hz"."""
    match kind:
        case inspect.Metadata(type=inner, extra=extra):
            said = extra or {}
            return str(said.get("expected") or words(inner, unit=unit or said.get("unit", "")))
        case inspect.UnionType(types=types):
            either = [one for one in types if not isinstance(one, inspect.NoneType)]
            if any(isinstance(one, inspect.FloatType) for one in either):  # whole ones are numbers
                either = [one for one in either if not isinstance(one, inspect.IntType)]
            return " or ".join(words(one, unit=unit) for one in either)
        case inspect.IntType() | inspect.FloatType():
            number = "a whole number" if isinstance(kind, inspect.IntType) else "a number"
            of_unit = unit if _range(kind) or not unit else f"in {unit}"
            return " ".join(filter(None, (number, _range(kind), of_unit)))
        case inspect.LiteralType(values=values):
            return " or ".join(
                f'"{value}"' if isinstance(value, str) else str(value) for value in values
            )
        case inspect.VarTupleType(item_type=item, min_length=least):
            return f"a list{' of one or more' * bool(least)}, each {words(item, unit=unit)},"
        case inspect.TupleType(item_types=items):
            return f"[{', '.join(words(item, unit=unit) for item in items)}]"
        case inspect.DictType(key_type=name, value_type=value):
            return f"a table of {words(name)} = {words(value, unit=unit)}"
        case inspect.CustomType(cls=cls):
            return f"{'a name or ' * (cls is NameOrFile)}a path in quotes"
    return _PLAIN[type(kind)]


def _range(kind: inspect.IntType | inspect.FloatType) -> str:
    low = kind.ge if kind.gt is None else kind.gt
    if low is not None and kind.le is not None:
        return (
            f"above {_short(low)} and up to {_short(kind.le)}"
            if kind.gt is not None
            else (f"from {_short(low)} to {_short(kind.le)}")
        )
    if low is not None:
        return f"above {_short(low)}" if kind.gt is not None else f"of at least {_short(low)}"
    return "" if kind.le is None else f"of at most {_short(kind.le)}"


def within(kind: inspect.Type, values: Any) -> Any:
    """Which of an array's values are finite and within the limits of a type."""
    good = np.isfinite(values)
    if not isinstance(kind, inspect.FloatType):
        return good
    for limit, compared in (
        (kind.ge, np.greater_equal),
        (kind.gt, np.greater),
        (kind.le, np.less_equal),
    ):
        if limit is not None:
            good &= compared(values, limit)
    return good


def item_of(kind: inspect.Type) -> inspect.Type:
    """The type of the values of an array."""
    while isinstance(kind, inspect.VarTupleType):
        kind = kind.item_type
    return kind


def _short(limit: float) -> str:
    """A limit without an exponent where it is a whole number that one can read."""
    whole = float(limit).is_integer() and abs(limit) < 1e9
    return f"{limit:.0f}" if whole else f"{limit:g}".replace("e+", "e")


_PLAIN = {
    inspect.StrType: "text",
    inspect.BoolType: "true or false",
    inspect.DateType: "a date such as 2026-11-22, without quotes",
    inspect.AnyType: "a value",
}


_CLASSES: dict[type[inspect.Type], Any] = {
    inspect.StrType: str,
    inspect.FloatType: float,
    inspect.VarTupleType: tuple,
    inspect.TupleType: tuple,
    inspect.DictType: dict,
}


def is_valid(kind: inspect.Type, value: Any) -> bool:
    """What msgspec does not check: that numbers are finite, and the predicates of `key`.

    True of what is of another type, which another member of a union holds.
    """
    predicate = None
    if isinstance(kind, inspect.Metadata):
        predicate, kind = (kind.extra or {}).get("holds"), kind.type
    if value is None or not isinstance(value, _CLASSES.get(type(kind), object)):
        return True
    match kind:
        case inspect.UnionType(types=types):
            good = all(is_valid(one, value) for one in types)
        case inspect.FloatType():
            good = isfinite(value)
        case inspect.VarTupleType(item_type=item):
            good = all(is_valid(item, one) for one in value)
        case inspect.TupleType(item_types=items):
            good = all(map(is_valid, items, value))
        case inspect.DictType(key_type=name, value_type=each):
            good = all(is_valid(name, n) and is_valid(each, v) for n, v in value.items())
        case _:
            good = True
    return good and (predicate is None or predicate(value))


def without_numpy(value: Any) -> Any:
    """A value, or a list of them, with Python's own numbers."""
    if isinstance(value, list | tuple):
        return [without_numpy(one) for one in value]
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value
