"""What a column's header says: the quantity or axis, and its unit.

docs/method/recordings.md#headers-and-units
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

from tactileq.modeling.files.others.table import same_name

# As `known_unit` compares them: in small letters, without blanks, dots and signs of powers; µ is u.
SPELLINGS: Mapping[str, Sequence[str]] = {
    "g": ("g", "gs", "g's", "gn", "g0", "gee", "g-force"),
    "mg": ("mg", "mgs", "mgn", "milli-g", "millig", "milli-gs", "milligs"),
    "m/s2": (
        *("m/s2", "m/(s2)", "(m/s2)", "ms-2", "ms2", "m/s-2", "m/s/s", "mps2"),
        *("m/sec2", "m/sec/sec", "meter/second2", "metre/second2", "meters/second2"),
        *("metres/second2", "meterspersecondsquared", "meterpersecondsquared"),
        *("metrespersecondsquared", "metrepersecondsquared", "meterspersecondpersecond"),
        "metrespersecondpersecond",
    ),
    "V": ("v", "volt", "volts"),
    "mV": ("mv", "mvolt", "mvolts", "millivolt", "millivolts"),
    "arbitrary": ("arbitrary",),
    "s": ("s", "sec", "secs", "second", "seconds"),
    "ms": ("ms", "msec", "msecs", "millis", "millisecond", "milliseconds"),
    "us": ("us", "usec", "usecs", "micros", "microsecond", "microseconds"),
    "ns": ("ns", "nsec", "nsecs", "nanos", "nanosecond", "nanoseconds"),
}
_UNITS = {spelling: unit for unit, spellings in SPELLINGS.items() for spelling in spellings}
_TIME_UNITS = ("s", "ms", "us", "ns")
TIME_NAMES = {"time", "t", "timestamp"}
_TIME_ENDS = ("_time", "_timestamp", "_seconds")  # s1_timestamp (ms)
_BRACKETS = re.compile(r"[\[({<]([^\[\]()]*(?:\([^()]*\))?[^\[\]()]*)[\])}>]")
_BETWEEN = re.compile(r"\s+in\s+|\s*[/,]\s*|[\s_]+")  # a name and its unit: z in g, t/s, x_g
_ACC = r"acc(?:el(?:eration|erometer)?)?"
# x, ax, accx, linear_acceleration_x, x_axis, x_acceleration; gx is a gyroscope's, accuracy no y
_AXIS_NAME = re.compile(rf"(?:(?:a|.*{_ACC}|.*acc.*_)_?)?(?P<axis>[xyz])(?:_axis)?(?:_{_ACC})?")
_ACCELERATION = re.compile(rf"a_?[xyz]|(?:.*_)?{_ACC}(?:_.*|[xyz])?")
_ACCELERATION_UNITS = ("g", "mg", "m/s2")
_MARKS = str.maketrans({**dict.fromkeys("−–‐‑", "-"), "’": "'", "μ": "u"})


def known_unit(text: str) -> str | None:
    """The unit that is spelled so, if it is known: `m s⁻²` is "m/s2"."""
    return _UNITS.get(re.sub(r"[\s^*·⋅∙._]", "", _plain(text)))


def _plain(text: str) -> str:
    """In small letters; full-width, raised and other forms of letters and signs as plain ones."""
    return same_name(text).translate(_MARKS)


def name_and_unit(header: str) -> tuple[str, str]:
    """`Acc X (m/s²)` → (acc_x, m/s2); `x_g` → (x, g); `seconds_elapsed` → (time, s).

    A unit in brackets that is not known is as the header has it, in small letters.
    """
    text = _plain(header)
    if (alone := known_unit(text)) in (*_ACCELERATION_UNITS, "V", "mV"):
        return text, alone or ""
    for name, unit in _ways_to_split(text):
        if found := known_unit(unit):
            return _time_or(_joined(name), found)
    brackets = [found for found in _BRACKETS.finditer(text) if found[1].strip() not in "xyz"]
    if brackets:
        return _joined(text[: brackets[0].start()]), brackets[0][1].strip()
    return _time_or(_joined(text), "")


def _ways_to_split(text: str) -> Iterator[tuple[str, str]]:
    """A header as a name and what may be its unit: in brackets, or behind a sign or a blank."""
    for found in _BRACKETS.finditer(text):
        yield text[: found.start()], found[1]
    for found in _BETWEEN.finditer(text):
        if found.start() > 0:
            yield text[: found.start()], text[found.end() :]


def _joined(name: str) -> str:
    """Words joined by one `_`."""
    return re.sub(r"[\s_.()\[\]/-]+", "_", name).strip("_")


def _time_or(name: str, unit: str) -> tuple[str, str]:
    """The same; but where only a unit is named, written out: Second is time, Volt in V."""
    *others, last = [word for word in name.split("_") if word != "elapsed"] or ["time"]
    if others:
        return name, unit
    written_out = known_unit(last) if len(last) > 2 else None
    if not unit and written_out in _TIME_UNITS:
        return "time", written_out
    return last, unit or written_out or ""


def role(header: str) -> str | None:
    """What a column is by its header alone: "time", an axis, or neither."""
    name, unit = name_and_unit(header)
    if name in TIME_NAMES or (unit in _TIME_UNITS and name.endswith(_TIME_ENDS)):
        return "time"
    if axis := _AXIS_NAME.fullmatch(name):
        return axis["axis"]
    # S1_X (g): a unit of acceleration says what the name alone does not.
    return name[-1] if re.fullmatch(r".*_[xyz]", name) and is_acceleration(header) else None


def is_acceleration(header: str) -> bool:
    """Whether a header tells an acceleration from other channels, by its unit or its name.

    G of a magnetometer is gauss.
    """
    name, unit = name_and_unit(header)
    by_unit = unit in _ACCELERATION_UNITS and "mag" not in name
    return by_unit or _ACCELERATION.fullmatch(name) is not None


# --- Cells ----------------------------------------------------------------------------------

# What SCPI instruments send for a value beyond their range.
OVERLOAD = 9.9e37
_OVERRANGE = {
    *("ol", "0l", "ovl", "ovld", "ovr", "ovrng", "over", "overrange", "overflow", "overload"),
    *("ofl", "oflow", "1#inf", "inf", "infinity", "∞"),
}


def overrange(cell: str) -> bool:
    """Whether a cell says that its value was beyond the range of the instrument: OL, 9.9E+37."""
    text = _plain(cell)
    try:
        return abs(float(text.replace(",", "."))) >= OVERLOAD
    except ValueError:
        return re.sub(r"[\s.,_+-]", "", text) in _OVERRANGE
