"""Which tests a run has: those of `make test`, or the long ones of `make test-long`.

A long test is marked `@pytest.mark.long("why")`. `make test-long` runs these, and once more all
that draw random examples, with others each time.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

_DEFINES_TESTS = re.compile(r"^(async )?def test_|^class Test", re.MULTILINE)


def uses_audio_server(item: pytest.Item) -> bool:
    """Whether a test starts JACK."""
    return "jack_server" in getattr(item, "fixturenames", ())


def is_chosen(item: pytest.Item, *, long: bool) -> bool:
    """Whether a test is one of this run.

    Raises
    ------
    pytest.UsageError
        For a long test without a reason.
    """
    marker = item.get_closest_marker("long")
    if marker is not None and not (len(marker.args) == 1 and isinstance(marker.args[0], str)):
        raise pytest.UsageError(f"{item.nodeid}: expected long(why), got {marker}.")
    draws = hasattr(getattr(item, "obj", None), "hypothesis")
    return marker is not None or draws if long else marker is None


def holds_tests(path: Path) -> bool:
    """Whether a file defines tests, whatever its name."""
    return _DEFINES_TESTS.search(path.read_text(encoding="utf-8")) is not None
