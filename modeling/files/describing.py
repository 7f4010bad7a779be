"""What follows from a declared file for readers and editors: its JSON Schema and tables of keys."""

from __future__ import annotations

import json
from typing import Any

import msgspec

from tactileq.modeling.files.described import (
    NOT_FINITE,
    DescribedFile,
    FileSection,
    Key,
    keys_of,
    plain,
)
from tactileq.modeling.files.described_json import DescribedJson

BAR = r"\|"  # in a cell of Markdown


def schema(file: type[FileSection]) -> dict[str, Any]:
    """The JSON Schema (2020-12) of a file, for editors that complete and check what one types."""
    properties, required = _properties(keys_of(file))
    if issubclass(file, DescribedFile):
        head = file.WHERE.strip("[]")
        if head:  # the plain keys stand in a section of their own
            tables = {name: properties.pop(name) for name in file.tables()}
            needed = [name for name in required if name in properties]
            section = _object(file, properties, needed)
            properties = {head: section, **tables}
            required = [head] * bool(needed) + [name for name in required if name in tables]
        if file.VERSION:
            properties = {"version": {"const": file.VERSION}, **properties}
            required = ["version", *required]
    about = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    return {**about, **_object(file, properties, required)}


def schema_text(file: type[FileSection]) -> str:
    """The text of the schema's file."""
    return json.dumps(schema(file), indent=2, ensure_ascii=False) + "\n"


def key_tables(file: type[FileSection]) -> str:
    """The keys of a file in Markdown, a table for each of its sections."""
    keys = keys_of(file)
    parts = [] if all(one.is_table for one in keys) else [_key_table(file)]
    parts += [
        key_tables(one.section)
        for one in keys
        if one.section is not None and one.is_table and not issubclass(one.section, DescribedJson)
    ]
    return "\n\n".join(parts)


def _key_table(section: type[FileSection]) -> str:
    lines = [
        f"### `{section.WHERE}`" if section.WHERE else "### At the top",
        "",
        _summary(section),
        "",
        "| Key | Holds | Default | Meaning |",
        "| --- | --- | --- | --- |",
    ]
    for one in keys_of(section):
        if not one.is_table or issubclass(section, DescribedJson):  # whose keys name their tables
            cells = (f"`{one.name}`", _holds(one), _default(one), one.description)
            lines.append(f"| {' | '.join(cell.replace('|', BAR) for cell in cells)} |")
    return "\n".join(lines)


def _holds(one: Key) -> str:
    if not one.is_table:
        return one.words.removesuffix(",")
    below = "a list of tables, below" if one.several else "a table, below"
    return str(getattr(one.section, "WHAT", below))


def _summary(section: type[FileSection]) -> str:
    """The first paragraph of its docstring."""
    return " ".join((section.__doc__ or "").split("\n\n")[0].split())


def _default(one: Key) -> str:
    if one.required:
        return "required"
    if one.quantity is not None and one.default is not None:
        return f"`{one.default}`"
    value = plain(one.default)
    return "" if value in (None, [], {}, "") else f"`{json.dumps(value, ensure_ascii=False)}`"


def _properties(keys: tuple[Key, ...]) -> tuple[dict[str, Any], list[str]]:
    properties = {name: _key_schema(one) for one in keys for name in one.names}
    return properties, [one.name for one in keys if one.required]


def _object(
    section: type[FileSection], properties: dict[str, Any], required: list[str]
) -> dict[str, Any]:
    if issubclass(section, DescribedJson):
        head = {"format": {"const": section.FORMAT}, "version": {"const": section.VERSION}}
        properties, required = {**head, **properties}, [*head, *required]
    return {
        "type": "object",
        "description": _summary(section),
        "properties": properties,
        "required": required,
        "additionalProperties": False,
    }


def _key_schema(one: Key) -> dict[str, Any]:
    about = {"description": f"{one.description} ({one.words})".strip()}
    if not one.required and (value := plain(one.default)) not in (None, (), {}):
        about["default"] = value
    if one.section is not None:
        table = _object(one.section, *_properties(one.keys))
        if one.quantity is not None:
            return table | about
        return about | ({"type": "array", "items": table} if one.several else table)
    either = [_value(one.annotation, null=one.always)]
    either += [] if one.also is None else [_value(one.also)]
    either += [{"enum": list(NOT_FINITE)}] if one.any_number and not one.shape else []
    return {**(either[0] if len(either) == 1 else {"anyOf": either}), **about}


def _value(annotation: Any, *, null: bool = False) -> dict[str, Any]:
    """The schema of a value. TOML has no null, a key is left out."""
    found: dict[str, Any] = msgspec.json.schema(
        annotation, schema_hook=lambda kind: {"type": "string"}
    )
    if "anyOf" in found and not null:
        found["anyOf"] = [one for one in found["anyOf"] if one != {"type": "null"}]
    return found
