"""Changing single keys of a TOML text; everything else, comments included, stays as it is."""

from __future__ import annotations

import json
import re
import tomllib
from datetime import date
from typing import Any

from modeling import InputError
from rig.setup.figures import Curve, Figure


def with_value(text: str, section: str, key: str, *, value: object) -> str:
    """The text of a TOML file with another value of one key, which stands in one line.

    Parameters
    ----------
    text : str
    section, key : str
        A table without dots, and a key in it; each is added where it is missing.
    value : object
        A Figure, a Curve, text, number, bool, date or a list of texts.

    Raises
    ------
    InputError
        If the key's value spreads over several lines.
    """
    lines = text.splitlines()
    line = f"{key} = {as_toml(value)}"
    first, end = _span(lines, section)
    if first is None:
        return "\n".join([*lines, "", f"[{section}]", line]) + "\n"
    for index in range(first, end):
        if re.match(rf"\s*{re.escape(key)}\s*=", lines[index]):
            lines[index] = line + _comment(lines[index], f"{section}.{key}")
            break
    else:
        while end > first and not lines[end - 1].strip():
            end -= 1  # above the empty lines before the next section
        lines.insert(end, line)
    return "\n".join(lines) + "\n"


def as_toml(value: object) -> str:
    """A value as TOML, in one line."""
    if isinstance(value, Figure | Curve):
        pairs = (f"{name} = {as_toml(part)}" for name, part in value.to_dict().items())
        return "{ " + ", ".join(pairs) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(as_toml, value)) + "]"
    if isinstance(value, date):
        return value.isoformat()
    if isinstance(value, float):
        return repr(float(value))
    # Texts, whole numbers and bools are written as in JSON (\u escapes included).
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _span(lines: list[str], section: str) -> tuple[int | None, int]:
    """Where the lines of a section begin and end; None where it is missing."""
    headers = [number for number, line in enumerate(lines) if re.match(r"\s*\[", line)]
    for number in headers:
        if re.match(rf"\s*\[\s*{re.escape(section)}\s*\]\s*(#.*)?$", lines[number]):
            end = next((later for later in headers if later > number), len(lines))
            return number + 1, end
    return None, len(lines)


def _comment(line: str, what: str) -> str:
    """The comment behind a key's value, with two spaces before it."""
    starts = [number for number, character in enumerate(line) if character == "#"]
    for start in (*starts, len(line)):
        if _is_whole(line[:start]):
            return f"  {line[start:]}" if line[start:] else ""
    raise InputError(
        f"expected the value of {what} in one line, which then can be replaced, got several; "
        "write it in one line."
    )


def _is_whole(line: str) -> bool:
    try:
        parsed: dict[str, Any] = tomllib.loads(line)
    except tomllib.TOMLDecodeError:
        return False
    return bool(parsed)
