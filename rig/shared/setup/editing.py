"""Changing single keys of a TOML text; everything else, comments and layout included, stays."""

from __future__ import annotations

from collections.abc import Mapping, MutableMapping
from typing import Any

import tomlkit

from tactileq.modeling.files.described import plain


def with_values(text: str, values: Mapping[str, object]) -> str:
    """The text of a TOML file with other values.

    Parameters
    ----------
    values : mapping
        From "section.key" to a Figure, a Curve, text, number, bool, date or list of texts. What is
        missing is added at the end of its section, a missing section at the end.
    """
    document = tomlkit.parse(text)
    for name, value in values.items():
        section, _, key = name.partition(".")
        if section not in document:
            document[section] = tomlkit.table()
        _put(document[section], key, plain(value))
    return document.as_string()


def _put(table: MutableMapping[str, Any], key: str, value: Any) -> None:
    if not isinstance(value, dict):
        table[key] = value
    elif key in table:
        for name, part in value.items():
            _put(table[key], name, part)
    else:
        pairs = (f"{name} = {tomlkit.item(part).as_string()}" for name, part in value.items())
        table[key] = tomlkit.value(f"{{ {', '.join(pairs)} }}")
