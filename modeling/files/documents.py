"""Whole TOML and JSON files."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from sys import float_info
from typing import Any

from tactileq.modeling.errors import InputError, shortened, shown
from tactileq.modeling.files.reading import read_text

_PLACE = re.compile(r"line (?P<line>\d+), column (?P<column>\d+)")  # said in a message alone
_COMMA = re.compile(r"=\s*(?P<number>[+-]?[\d_]+(?P<rest>,\d+(?:[eE][+-]?\d+)?))\s*")
_CORRECT = "correct it"
_TOO_DEEP = "values nested too deeply"
_TOO_LARGE = "a whole number too large for any calculation"


def read_toml(path: Path, what: str) -> dict[str, Any]:
    """The contents of a TOML file; InputError naming `what` is expected where it is none."""
    text, advice = read_text(path, what), _CORRECT
    try:
        values = tomllib.loads(text)
        _check_values(values)
    except tomllib.TOMLDecodeError as error:
        got, advice = _no_toml(text, str(error))
    except RecursionError:
        got = _TOO_DEEP
    except ValueError:
        got = _TOO_LARGE
    else:
        return values
    raise InputError(f"expected TOML in {path}, got {got}; {advice}.")


def _no_toml(text: str, said: str) -> tuple[str, str]:
    """What came in the place of TOML, by what tomllib said of it, and what to do.

    A comma that may stand where it is, as between numbers of a list, is no error.
    """
    at = _PLACE.search(said)
    if at is None:
        return f"something else ({shortened(said)})", _CORRECT
    line = text.replace("\r\n", "\n").split("\n")[int(at["line"]) - 1]
    for found in _COMMA.finditer(line):
        # By itself a value ends before the comma; in { … } a key begins behind it, and lacks its =.
        if found.start("rest") < int(at["column"]) <= found.end() + 1:
            got = f"a decimal comma in line {at['line']} ({shown(line.strip())})"
            return got, f"write a point, {found['number'].replace(',', '.')}"
    return f"something else in line {at['line']} ({shortened(said)})", _CORRECT


def read_json_object(path: Path, *, advice: str, what: str = "a JSON file") -> dict[str, Any]:
    """The object that a JSON file holds.

    Parameters
    ----------
    advice : str
        What to do about a file that holds none; the end of the message.
    what : str
        What is expected there, for files that cannot be read.

    Raises
    ------
    InputError
    """
    text = read_text(path, what)
    try:
        values = json.loads(text, object_pairs_hook=_without_doubles)
        _check_values(values)
    except json.JSONDecodeError as error:
        got = f"something else at line {error.lineno}"
    except RecursionError:
        got = _TOO_DEEP
    except _Double as error:
        got = f"{shown(str(error))} twice"
    except ValueError:
        got = "a whole number too large for any calculation, or text that is not Unicode"
    else:
        if isinstance(values, dict):
            return values
        got = "a value that is not an object"
    raise InputError(f"expected JSON in {path}, got {got}; {advice}.")


class _Double(ValueError):
    """A name that stands twice in one object."""


def _without_doubles(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    values = dict(pairs)
    if len(values) < len(pairs):
        names = [name for name, _ in pairs]
        raise _Double(next(name for name in names if names.count(name) > 1))
    return values


def _check_values(values: object) -> None:
    """Refuse whole numbers beyond floating-point ones, and text that cannot be written again.

    Raises
    ------
    ValueError
    """
    if isinstance(values, dict):
        for key, value in values.items():
            key.encode("utf-8")
            _check_values(value)
    elif isinstance(values, list):
        for value in values:
            _check_values(value)
    elif isinstance(values, str):
        values.encode("utf-8")  # JSON can write one half of a surrogate pair
    elif isinstance(values, int) and abs(values) > float_info.max:
        raise ValueError("a whole number beyond floating-point ones")


def dump_json(values: dict[str, Any]) -> str:
    """JSON with one line per field and, in nested arrays, one line per row of the grid.

    Likewise in lists of objects, one line per object.
    """
    lines = [f"  {json.dumps(key)}: {_rows(value)}" for key, value in values.items()]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _rows(value: Any) -> str:
    encode: Callable[[Any], str] = lambda v: json.dumps(v, allow_nan=False)  # noqa: E731
    if isinstance(value, list) and value and isinstance(value[0], list | dict):
        return "[\n    " + ",\n    ".join(map(encode, value)) + "\n  ]"
    return encode(value)


def check_version(values: Mapping[str, Any], version: int, *, what: str) -> None:
    """Refuse a TOML file whose version is not the one that is read; `what` names its kind."""
    stated = values.get("version")
    if type(stated) is not int or stated != version:
        raise InputError(
            f"expected version = {version} at the top of a {what}, got {shown(stated)}; write that "
            f"line, or update tactileq if the {what} is newer."
        )


def as_text(value: object, what: str) -> str:
    """A text; InputError for any other value."""
    if not isinstance(value, str):
        raise InputError(f"expected text for {what}, got {shown(value)}; put it in quotes.")
    return value
