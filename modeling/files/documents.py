"""Whole TOML and JSON files."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from modeling.errors import InputError


def read_toml(path: Path, what: str) -> dict[str, Any]:
    """The contents of a TOML file; InputError naming `what` is expected where it is none."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(
            f"expected {what} at {path}, got {error.strerror}; give its path."
        ) from None
    except ValueError as error:
        raise InputError(
            f"expected TOML in {path}, got something else ({error}); correct that line."
        ) from None


def read_json_object(path: Path, *, advice: str) -> dict[str, Any]:
    """The object that a JSON file holds; InputError ending in `advice` where it holds none."""
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        values = None
    if not isinstance(values, dict):
        raise InputError(f"expected a JSON object in {path}, got something else; {advice}.")
    return values


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
