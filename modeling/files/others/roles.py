"""Which column of another program's table means what: `--map`, as words or as a TOML file."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.files.documents import read_toml


@dataclass(frozen=True)
class Roles:
    """What columns mean, and which rows count.

    Parameters
    ----------
    columns : dict of str to list of str
        Columns by role; several where a role may have several.
    where : dict of str to tuple of str
        Only rows with one of these values in a column count.
    right : str
        The code that means a right answer; empty where none is named.
    decimal : str
        The decimal sign of the numbers; empty where the tables show it.
    """

    columns: dict[str, list[str]] = field(default_factory=dict)
    where: dict[str, tuple[str, ...]] = field(default_factory=dict)
    right: str = ""
    decimal: str = ""


DECIMAL = {"point": ".", "comma": ","}


def parse_roles(
    texts: Sequence[str],
    *,
    roles: Sequence[str],
    several: Sequence[str] = (),
    where: Sequence[tuple[str, str]] = (),
    right: str = "",
    example: str,
) -> Roles:
    """Roles from `correct=hit,factor=model`, or from a file `roles.toml` with these keys.

    `decimal=comma` states the decimal sign. A column whose name holds a comma may be in quotes;
    what follows a comma and is no role with = belongs to the name before.

    Parameters
    ----------
    texts : sequence of str
        Each of them one or several roles, or the path of a TOML file, in which a key `where` is a
        table of columns and values, and `right` a value.
    several : sequence of str
        Roles that may have several columns.
    where, right
        As they were given beside the map; they add to the file.
    example : str
        How a map is written, for messages.

    Raises
    ------
    InputError
        For another role, one of them twice, or a column twice in one role.
    """
    roles = (*roles, "decimal")
    columns: dict[str, list[str]] = {}
    rows: dict[str, list[str]] = {}
    for text in texts:
        if not is_file_of_roles(text):
            pairs = _pairs(text, roles=roles, example=example)
        else:
            stated = _from_file(Path(text.strip()), roles=roles, several=several)
            pairs = [(role, name) for role, names in stated.columns.items() for name in names]
            for column, values in stated.where.items():
                rows.setdefault(column, []).extend(values)
            right = right or stated.right
        for role, name in pairs:
            if name in columns.get(role, ()) or (role in columns and role not in several):
                raise InputError(
                    f"expected each column once in the map, got {shown(f'{role}={name}')} again; "
                    f"write it like {example}."
                )
            columns.setdefault(role, []).append(name)
    for column, value in where:
        rows.setdefault(column, []).append(value)
    [sign] = columns.pop("decimal", [""])
    if sign and sign not in DECIMAL:
        raise InputError(f"expected decimal=point or decimal=comma, got {shown(sign)}; correct it.")
    values_of = {column: tuple(values) for column, values in rows.items()}
    return Roles(columns, values_of, right, DECIMAL.get(sign, ""))


def is_file_of_roles(text: str) -> bool:
    """Whether a map is the path of a TOML file."""
    return text.strip().casefold().endswith(".toml") and "=" not in text


def _pairs(text: str, *, roles: Sequence[str], example: str) -> list[tuple[str, str]]:
    """Role and column of each part of a text."""
    pairs: list[tuple[str, str]] = []
    for part in _parts(text):
        role, equals, name = (piece.strip() for piece in part.partition("="))
        if pairs and (not equals or not re.fullmatch(r"\w+", role)):
            pairs[-1] = (pairs[-1][0], f"{pairs[-1][1]},{part.rstrip()}")
            continue
        if role not in roles or not name:
            raise InputError(
                f"expected one of {', '.join(roles)}, = and a column in the map, got "
                f"{shown(part)}; write it like {example}."
            )
        pairs.append((role, name))
    return [(role, _unquoted(name)) for role, name in pairs]


def _parts(text: str) -> list[str]:
    """A text split at commas outside of quotes that open after =."""
    parts = re.findall(r'(?:[^,=]*=\s*"(?:[^"]|"")*"|[^,])+', text)
    return [part for part in parts if part.strip()]


def _unquoted(name: str) -> str:
    if len(name) > 1 and name[0] == name[-1] == '"':
        return name[1:-1].replace('""', '"')
    return name


def _from_file(path: Path, *, roles: Sequence[str], several: Sequence[str]) -> Roles:
    """The roles that a laboratory keeps in a file."""
    values = read_toml(path, "a map of columns")
    known = (*roles, "where", "right")
    for key in values:
        if key not in known:
            raise InputError(
                f"expected keys among {', '.join(known)} in {path}, got {shown(key)}; remove it."
            )
    where = values.pop("where", {})
    if not isinstance(where, dict):
        raise InputError(
            f"expected a table of columns and values as where in {path}, got {shown(where)}; write "
            '[where] and a line such as phase = "main".'
        )
    right = values.pop("right", "")
    return Roles(
        {key: _texts(value, key, path, one=key not in several) for key, value in values.items()},
        {key: tuple(_texts(value, key, path)) for key, value in where.items()},
        _texts(right, "right", path, one=True)[0] if right != "" else "",
    )


def _texts(value: Any, key: str, path: Path, *, one: bool = False) -> list[str]:
    """A value or a list of values as texts."""
    values = value if isinstance(value, list) else [value]
    sound = all(isinstance(each, str | int | float) for each in values)
    if not values or not sound or (one and len(values) > 1):
        wanted = "one name" if one else "a name or a list of names"
        raise InputError(f"expected {wanted} as {key} in {path}, got {shown(value)}; correct it.")
    return [str(each).lower() if isinstance(each, bool) else str(each) for each in values]
