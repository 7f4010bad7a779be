"""The other end of a `rig.live.child.Child`: a process that is driven by lines of JSON."""

from __future__ import annotations

import json
import signal
import sys
from collections.abc import Mapping
from typing import Any


def settings_from_parent() -> dict[str, Any]:
    """What the parent said when it started this process; the parent handles Ctrl-C and Ctrl-Z."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if sys.platform != "win32":
        # A stopped process cannot fade; a card may repeat indefinitely what it got last.
        signal.signal(signal.SIGTSTP, signal.SIG_IGN)
    settings: dict[str, Any] = json.loads(sys.argv[1])
    return settings


def tell(line: Mapping[str, Any]) -> None:
    """Send a line to the parent."""
    sys.stdout.write(json.dumps(line) + "\n")
    sys.stdout.flush()
