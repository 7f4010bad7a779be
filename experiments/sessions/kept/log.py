"""The log of a session: one JSON object in each line, only ever appended, each with its seal.

docs/method/protocols.md#storing and docs/method/verification.md#seals
"""

from __future__ import annotations

import hashlib
import json
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from tactileq.modeling import InputError
from tactileq.modeling.checks import is_number, is_whole
from tactileq.modeling.errors import shown
from tactileq.modeling.files.reading import read_bytes

Event = dict[str, Any]
OWN_FIELDS = ("n", "utc", "t_s", "run", "event", "seal")
SESSION_ENDS = ("complete", "aborted", "crashed")
SEAL_WRITTEN = 8  # last characters of a seal, which an experimenter writes down
_LONGEST_S = 1e9  # of a run: 30 years
_SEAL = b', "seal": "%s"}'
_LINE_AND_MORE = re.compile(rb', "seal": "[0-9a-f]{16}"}.', re.DOTALL)
YEARS = range(2000, 2200)  # in which every time zone has a date for a moment


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

    @property
    def seal(self) -> str:
        """That of its last line; empty where there is none, or an earlier version began it."""
        return str(self.events[-1].get("seal", "")) if self.events else ""


def read_log(path: str | Path) -> Log:
    """The events of a session's log.

    Raises
    ------
    InputError
        If the file cannot be read, or a whole line is not an event with the line's number, of a
        start of the session that an "opened" began, with fields as sessions write them; or, in a
        log whose first line has a seal, without the one over it and all lines before.
    """
    *lines, cut = read_bytes(Path(path), "the log of a session").split(b"\n")
    events: list[Event] = []
    runs, seal = 0, ""
    if _LINE_AND_MORE.search(cut):  # a damaged end of a line: what was cut short has no such end
        raise _malformed(Path(path), len(lines) + 1, shown(cut.decode("utf-8", "replace")))
    for number, line in enumerate(lines, start=1):
        try:
            event = object_of(line)
        except ValueError:
            got = shown(line.decode("utf-8", "replace"))
            raise _malformed(Path(path), number, got) from None
        runs += event.get("event") == "opened"
        if got := _wrong_in(event, {"n": number, "run": runs}):
            raise _malformed(Path(path), number, got)
        if "seal" in (events[0] if events else event):
            seal = seal_after(seal, line.removesuffix(_SEAL % str(event.get("seal")).encode()))
        if event.get("seal", "") != seal:
            raise InputError(
                f"expected the seal {seal or 'of a first line'} over line {number} of {path} and "
                f"all before it, got {shown(event.get('seal', 'none'))}: one of these lines was "
                "changed; restore the file from a copy."
            )
        events.append(event)
    return Log(tuple(events), cut)


def check_event(event: Mapping[str, Any]) -> None:
    """Refuse to write what `read_log` would refuse to read.

    Raises
    ------
    ValueError
        Naming the field.
    """
    read_back = object_of(line_of({"n": 1, **event}))
    if got := _wrong_in(read_back, {}):
        raise ValueError(f"expected an event that can be read again, got {got}")


def _wrong_in(event: Event, wanted: Mapping[str, int]) -> str:
    """The first invalid field of an event; empty where there is none."""
    for name, holds in (_FIELDS | _FIELDS_OF.get(str(event.get("event")), {})).items():
        value = event.get(name)
        if not holds(value) or value != wanted.get(name, value):
            return f"{name} = {shown(value)}" if name in event else f"no {name}"
    return ""


def is_time(value: object) -> bool:
    """Whether this is a time as `utc_text` writes it."""
    try:
        moment = datetime.fromisoformat(value) if isinstance(value, str) else None
    except ValueError:
        return False
    return moment is not None and moment.utcoffset() is not None and moment.year in YEARS


def _or_none(holds: Callable[[object], bool]) -> Callable[[object], bool]:
    return lambda value: value is None or holds(value)


def _is(kind: type) -> Callable[[object], bool]:
    return lambda value: isinstance(value, kind)


def _is_seconds(value: object) -> bool:
    return is_number(value) and 0.0 <= value <= _LONGEST_S


def _are_objects(value: object) -> bool:
    return isinstance(value, list) and all(isinstance(one, dict) for one in value)


# What may stand in the fields of every event, and of some; those that nothing is made of are free.
_FIELDS: dict[str, Callable[[object], bool]] = {
    "n": is_whole,
    "event": _is(str),
    "utc": is_time,
    "t_s": _is_seconds,
    "run": is_whole,
    "trial": _or_none(is_whole),
    "index": _or_none(is_whole),
    "start_s": _or_none(is_number),
}
_FIELDS_OF: dict[str, dict[str, Callable[[object], bool]]] = {
    "opened": {"manifest_sha256": _is(str), "overrides": _or_none(_are_objects)},
    "welcome": {"consent": _or_none(_is(str)), "answers": _or_none(_is(dict))},
    "answer": {"row": _is(dict)},
    "ended": {"status": lambda value: value in SESSION_ENDS},
}


def object_of(line: bytes) -> Event:
    """The JSON object of a line, its numbers finite; ValueError where it holds none."""
    try:
        value = _DECODER.decode(line.decode("utf-8"))
    except RecursionError:
        value = None
    if not isinstance(value, dict):
        raise ValueError(line)
    return value


def _refuse(constant: str) -> None:
    raise ValueError(constant)


def _finite(text: str) -> float:
    """A number; ValueError beyond floating-point ones."""
    if math.isinf(value := float(text)):
        raise ValueError(text)
    return value


def _whole(text: str) -> int:
    _finite(text)
    return int(text)


_DECODER = json.JSONDecoder(parse_constant=_refuse, parse_float=_finite, parse_int=_whole)


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


def sealed_line(values: Mapping[str, Any], before: str) -> tuple[bytes, str]:
    """Values as a line with its seal at the end, and that seal; `before` is the one of the line
    before, empty for the first.
    """
    line = line_of(values).removesuffix(b"}\n")
    seal = seal_after(before, line)
    return line + _SEAL % seal.encode() + b"\n", seal


def seal_after(before: str, line: bytes) -> str:
    """The seal of a line: 16 hexadecimal digits over the one before and the line's own bytes."""
    return hashlib.sha256(before.encode() + line).hexdigest()[:16]


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
