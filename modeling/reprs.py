"""What objects look like in a notebook: one line, however many numbers they hold."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import MISSING, fields, is_dataclass
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
    """Fields with something to say."""
    for field in fields(self):
        value = getattr(self, field.name)
        if not field.repr or value is None:
            continue
        if hasattr(value, "dtype"):
            if value.dtype != bool or value.any():
                yield field.name, value
        elif field.default_factory is not MISSING:
            if value != field.default_factory():
                yield field.name, value
        elif field.default is MISSING or value != field.default:
            yield field.name, value


def _short(value: Any) -> str:
    if hasattr(value, "dtype") and value.ndim:
        return _array(value)
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, str):
        return repr(value if len(value) <= LONGEST_TEXT else f"{value[: LONGEST_TEXT - 1]}…")
    if isinstance(value, Mapping | tuple | list):
        if len(value) > MOST_ITEMS:
            return f"<{len(value)}>"
        return f"<{', '.join(map(str if isinstance(value, Mapping) else _short, value))}>"
    if is_dataclass(value):
        name = getattr(value, "name", getattr(value, "texture", None))
        words = (type(value).__name__, name, getattr(value, "simulated", False) and "(simulated)")
        return f"<{' '.join(str(word) for word in words if word)}>"
    return repr(value)


def _array(values: Any) -> str:
    """Shape, and ends of one axis; all of them where they are few."""
    if values.ndim > 1 or not values.size:
        return f"<{' × '.join(map(str, values.shape))}>"
    if values.size <= MOST_ITEMS:
        return f"[{', '.join(map(_short, values.tolist()))}]"
    first, last = _short(values[0].item()), _short(values[-1].item())
    return f"<{values.size}: {first} … {last}>"
