"""Everything that can be wrong with one key of a declared file, made from its declaration.

A `Kind` is a file that is read, with an example in which every key stands. `mutations` spoils one
key after another; what refuses it must name the file, the section and the key.
"""

from __future__ import annotations

import copy
import datetime
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import inf, nan
from pathlib import Path
from typing import Any

from msgspec import inspect

from tactileq.modeling.files.described import DescribedFile, FileSection, Key, keys_of

Values = dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class Kind:
    """A kind of file.

    Parameters
    ----------
    name : str
        Of the file, with its suffix.
    section : type of FileSection
        Its declaration.
    examples : tuple of dict
        Plain values of good files, in which together every key stands.
    load : callable
        Reads a file of this kind.
    write : callable
        The text of such values.
    beside : dict of name to text
        The files that the examples name.
    again : callable, optional
        The plain values or the text of what was loaded, to be loaded again.
    """

    name: str
    section: type[FileSection]
    examples: tuple[Values, ...]
    load: Callable[[Path], Any]
    write: Callable[[Values], str]
    beside: dict[str, str]
    again: Callable[[Any], Values | str] | None = None


@dataclass(frozen=True)
class Place:
    """A key of an example: the tables on the way to it, how messages and its class call the last
    one, and its declaration."""

    example: int
    way: tuple[str | int, ...]
    where: str
    key: Key
    declared: str

    def __str__(self) -> str:
        return f"{self.declared} {self.key.name}"

    def table(self, values: Values) -> Values:
        """The table of the key."""
        found: Any = values
        for step in self.way:
            found = found[step]
        return found


def places(kind: Kind) -> Iterator[Place]:
    """Every key that stands in an example, once."""
    seen = set()
    for number, example in enumerate(kind.examples):
        for place in _places(kind.section, example, number):
            if str(place) not in seen:
                seen.add(str(place))
                yield place


def declared(section: type[FileSection]) -> Iterator[str]:
    """Every key that is declared, as `Place` names it."""
    yield from _declared(section.WHERE, keys_of(section))


def _declared(where: str, keys: tuple[Key, ...]) -> Iterator[str]:
    for key in keys:
        if not key.is_table:
            yield f"{where} {key.name}"
        yield from _declared(key.within(where), key.keys)


def _places(section: type[FileSection], values: Values, number: int) -> Iterator[Place]:
    head = section.WHERE.strip("[]") if issubclass(section, DescribedFile) else ""
    for key in keys_of(section):
        way = (head,) if head and not key.is_table else ()
        place = Place(number, way, section.WHERE, key, section.WHERE)
        yield from _within(place, values)


def _within(place: Place, values: Values) -> Iterator[Place]:
    """A key that stands in an example, and those of the sections that it holds."""
    key, table = place.key, place.table(values)
    for name in (name for name in key.names if name in table):
        if not key.is_table:
            yield place
        step = (name, 0) if key.several and table[name] else (name,)
        called = key.within(place.declared)
        where = f"[{name}]" if key.tables else key.within(place.where)
        for below in key.keys:
            yield from _within(
                Place(place.example, (*place.way, *step), where, below, called), values
            )


def mutations(place: Place, values: Values) -> Iterator[tuple[str, Values]]:
    """What is wrong, and the values of the file with it; `values` stay as they are."""
    name = place.key.name

    def changed(value: Any) -> Values:
        other = copy.deepcopy(values)
        place.table(other)[name] = value
        return other

    other = copy.deepcopy(values)
    table = place.table(other)
    table[f"{name}_misspelt"] = table.pop(name)
    yield "misspelt", other
    if place.key.required:
        other = copy.deepcopy(values)
        del place.table(other)[name]
        yield "missing", other
    good = place.table(values)[name]
    if place.key.always and not _may_be_none(place.key.kind):
        yield "null", changed(None)
    for wrong in _of_another_type(good, place.key):
        yield f"of another type: {wrong!r}", changed(wrong)
    for wrong in _no_items(good, place.key) if place.key.shape else []:
        yield f"with {wrong!r}", changed(_with_first(good, wrong))
    for beyond in _beyond(place.key.kind):
        value = beyond if place.key.also is not None else _with_first(good, beyond)
        yield f"out of range: {beyond!r}", changed(value)


def _with_first(good: Any, value: Any) -> Any:
    """A list or a table of values, or lists of them, with another first one."""
    if isinstance(good, list):
        return [_with_first(good[0], value), *good[1:]]
    if isinstance(good, dict):
        name = next(iter(good))
        return {**good, name: _with_first(good[name], value)}
    return value


def _of_another_type(good: Any, key: Key) -> list[Any]:
    if isinstance(good, bool):
        return [1, "true", []]
    if isinstance(good, int | float):
        return ["much", True, {}, nan, inf]
    if isinstance(good, str):
        text: list[Any] = [True, {}, [[]]]
        return [*text, "no such choice"] if _is_choice(key.kind) else text
    if isinstance(good, datetime.date):
        return [good.isoformat(), 5]
    if isinstance(good, list):
        return [{}, "text", [{}]] if key.also is not None else [5, {}, "text", [[{}]]]
    return [5, "text", []]


def _may_be_none(kind: inspect.Type) -> bool:
    kind = kind.type if isinstance(kind, inspect.Metadata) else kind
    return isinstance(kind, inspect.UnionType) and kind.includes_none


def _no_items(good: Any, key: Key) -> list[Any]:
    """What cannot be in an array."""
    while isinstance(good, list):
        good = good[0]
    if isinstance(good, bool):
        return [1, "true", None]
    return ["1", None, [], *([] if key.any_number else [nan, inf])]


def _is_choice(kind: inspect.Type) -> bool:
    match kind:
        case inspect.Metadata(type=inner):
            return _is_choice(inner)
        case inspect.UnionType(types=types):
            return any(_is_choice(one) for one in types)
    return isinstance(kind, inspect.LiteralType)


def _beyond(kind: inspect.Type) -> Iterator[float]:
    """Numbers below and above the limits of a type or of its items."""
    match kind:
        case inspect.Metadata(type=inner):
            yield from _beyond(inner)
        case inspect.UnionType(types=types):
            for one in types:
                yield from _beyond(one)
        case inspect.VarTupleType(item_type=item):
            yield from _beyond(item)
        case inspect.TupleType(item_types=items):
            yield from _beyond(items[0])
        case inspect.DictType(value_type=value):
            yield from _beyond(value)
        case inspect.IntType() | inspect.FloatType():
            if kind.gt is not None:
                yield kind.gt
            if kind.ge is not None:
                yield kind.ge - max(1e-9, abs(kind.ge) / 2) if kind.ge % 1 else kind.ge - 1
            if kind.le is not None:
                yield kind.le + max(1, kind.le // 100)


def toml_of(values: Values) -> str:
    """Values as TOML, a key a line: for thousands of files, each of which takes tomlkit 10 ms."""
    return "".join(f"{json.dumps(key)} = {_inline(value)}\n" for key, value in values.items())


def _inline(value: object) -> str:
    match value:
        case dict():
            return (
                "{" + ", ".join(f"{json.dumps(k)} = {_inline(v)}" for k, v in value.items()) + "}"
            )
        case list() | tuple():
            return "[" + ", ".join(map(_inline, value)) + "]"
        case bool() | str():
            return json.dumps(value, ensure_ascii=False)
        case int() | float():
            return repr(value)
    return str(value)  # a date
