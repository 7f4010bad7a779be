"""Logs of sessions sealed again after a test has changed them."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from tactileq.experiments.sessions.kept.log import sealed_line


def sealed(events: Iterable[dict[str, Any]]) -> tuple[bytes, str]:
    """A log of these events, numbered again, and the seal of its last line."""
    before = ""
    made = []
    for number, event in enumerate(events, start=1):
        values = {name: value for name, value in event.items() if name != "seal"}
        line, before = sealed_line({**values, "n": number}, before)
        made.append(line)
    return b"".join(made), before


def change_text(log: Path, change: Callable[[str], str]) -> None:
    """Change the text of a log, and seal it again."""
    lines = change(log.read_text()).splitlines()
    log.write_bytes(sealed(json.loads(line) for line in lines)[0])
