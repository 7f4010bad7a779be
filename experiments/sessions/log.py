"""The log of a session: one JSON object in each line, only ever appended.

docs/method/protocols.md#storing
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from modeling import InputError
from modeling.errors import shown
from modeling.files.reading import read_bytes

Event = dict[str, Any]
OWN_FIELDS = ("n", "utc", "t_s", "run", "event")


@dataclass(frozen=True)
class Log:
    """What a log holds.

    Parameters
    ----------
    events : tuple of dict
        Of the whole lines, in order; event n stands in line n.
    cut : bytes
        What follows the last whole line: of a line that was being written when the process was
        killed or the power failed. Empty where nothing follows.
    """

    events: tuple[Event, ...]
    cut: bytes = b""


def read_log(path: str | Path) -> Log:
    """The events of a session's log.

    Raises
    ------
    InputError
        If the file cannot be read, or a whole line is not an event with the line's number.
    """
    log = read_lines(Path(path), "the log of a session")
    for number, event in enumerate(log.events, start=1):
        if event.get("n") != number or not _is_event(event):
            raise _malformed(Path(path), number, f"n = {shown(event.get('n'))}, or fields missing")
    return log


def _is_event(event: Event) -> bool:
    kinds = {"utc": str, "t_s": int | float, "run": int, "event": str}
    return all(isinstance(event.get(name), kind) for name, kind in kinds.items()) and is_time(
        event["utc"]
    )


def is_time(text: str) -> bool:
    """Whether a text is a time as `utc_text` writes it."""
    try:
        return datetime.fromisoformat(text).utcoffset() is not None
    except ValueError:
        return False


def read_lines(path: Path, what: str) -> Log:
    """The objects that stand in the whole lines of a file, and what follows them.

    Raises
    ------
    InputError
        If the file cannot be read, or a whole line holds no JSON object.
    """
    *lines, cut = read_bytes(path, what).split(b"\n")
    return Log(tuple(_object(line, path, n) for n, line in enumerate(lines, start=1)), cut)


def _object(line: bytes, path: Path, number: int) -> Event:
    try:
        value = json.loads(line.decode("utf-8"), parse_constant=_refuse)
    except (ValueError, RecursionError):
        value = None
    if not isinstance(value, dict):
        raise _malformed(path, number, shown(line.decode("utf-8", "replace")))
    return value


def _refuse(constant: str) -> None:
    raise ValueError(constant)


def _malformed(path: Path, number: int, got: str) -> InputError:
    return InputError(
        f"expected an event as one JSON object in line {number} of {path}, got {got}; restore the "
        "file from a copy."
    )


def line_of(values: Mapping[str, Any]) -> bytes:
    """Values as one line: UTF-8, numbers that read back equal, null for NaN and infinities."""
    try:
        text = json.dumps(values, ensure_ascii=False, allow_nan=False, default=plain)
    except (ValueError, TypeError):
        text = json.dumps(plain(values), ensure_ascii=False)
    # Half of a surrogate pair (of a file name, say) becomes the escape that JSON has for it.
    return text.encode("utf-8", "backslashreplace") + b"\n"


def plain(value: object) -> Any:
    """A value as JSON knows it: numpy's as Python's, null for NaN, text for what is neither."""
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [plain(item) for item in value]
    return str(value)


def now_utc() -> datetime:
    """Now, in UTC."""
    return datetime.now(UTC)


def utc_text(moment: datetime | None = None) -> str:
    """A moment (now, without one) as 2026-11-22T09:30:00.125Z."""
    utc = (moment or now_utc()).astimezone(UTC)
    return utc.isoformat(timespec="milliseconds").removesuffix("+00:00") + "Z"
