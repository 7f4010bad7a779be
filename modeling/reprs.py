"""What objects look like in a notebook: one line, however many numbers they hold."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import Field, fields, is_dataclass
from typing import Any

MOST_ITEMS = 4
LONGEST_TEXT = 40


def one_line(self: Any) -> str:
    """The `__repr__` of a dataclass: its fields but those that have their default.

    Arrays are shown as their shape, with their ends where they have one axis.
    """
    shown = ", ".join(f"{name}={_short(value)}" for name, value in _telling(self))
    return f"{type(self).__name__}({shown})"


def _telling(self: Any) -> Iterator[tuple[str, Any]]:
    """Fields with something to say: not those with their default, nor flags that are not set."""
    for field in fields(self):
        value = getattr(self, field.name)
        if field.repr and not _is_usual(value, field):
            yield field.name, value


def _is_usual(value: Any, field: Field[Any]) -> bool:
    if hasattr(value, "dtype"):
        return bool(value.dtype == bool and not value.any() and field.default is not True)
    if field.default_factory in (list, dict, tuple):
        return not len(value)
    return type(value) is type(field.default) and bool(value == field.default)


def _short(value: Any) -> str:
    if hasattr(value, "dtype"):
        return _array(value) if value.ndim else _short(value.item())
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, str):
        return repr(value if len(value) <= LONGEST_TEXT else f"{value[: LONGEST_TEXT - 1]}…")
    if isinstance(value, Mapping | tuple | list):
        if len(value) > MOST_ITEMS or any(map(is_dataclass, value)):
            return f"<{len(value)} items>"
        return f"<{', '.join(map(_short, value))}>"
    if callable(value):
        return f"<{getattr(value, '__name__', 'function')}>"
    if is_dataclass(value):
        name = getattr(value, "name", getattr(value, "texture", None))
        words = [type(value).__name__, *([_short(name)] if name else [])]
        words += ["(simulated)"] * bool(getattr(value, "simulated", False))
        return f"<{' '.join(words)}>"
    return repr(value)


def _array(values: Any) -> str:
    """Shape, and ends of one axis; all of them where they are few."""
    if values.ndim > 1 or not values.size:
        return f"<{' × '.join(map(str, values.shape))}>"
    if values.size <= MOST_ITEMS:
        return f"[{', '.join(map(_short, values.tolist()))}]"
    return f"<{values.size}: {_short(values[0])} … {_short(values[-1])}>"
