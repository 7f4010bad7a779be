"""The hand's process: reads the device, filters, writes readings.

Started by `rig.hand.reader` with its settings as JSON; its reports go to standard output,
one JSON object a line. The end of standard input means that its parent is gone: it ends
(docs/method/hand.md#process).
"""

from __future__ import annotations

import gc
import json
import os
import sys
import threading
from contextlib import suppress

from modeling.errors import InputError
from rig.hand.loop import HandLoop
from rig.hand.settings import HandSettings
from rig.live.driven import settings_from_parent, tell
from rig.live.memory import Live


def main() -> int:
    """Read the device until standard input ends."""
    wanted = settings_from_parent()
    parent_gone = threading.Event()
    try:
        with Live.attach(wanted["live"]) as live:
            loop = HandLoop(live, HandSettings.from_dict(wanted["settings"]), tell=tell)
            threading.Thread(target=_listen, args=(loop, parent_gone), daemon=True).start()
            _run(loop, parent_gone, patient=wanted["patient"])
    except InputError as error:
        tell({"error": str(error)})
        return 1
    except OSError as error:  # nobody listens any more
        return 0 if isinstance(error, BrokenPipeError) else _failed(error)
    except Exception as error:
        return _failed(error)
    return 0


def _run(loop: HandLoop, parent_gone: threading.Event, *, patient: bool) -> None:
    """Step until the parent is gone; a patient loop waits for a device that is not there."""
    try:
        tell({"ready": loop.open()})
    except InputError as error:
        if not patient:
            raise
        tell({"fault": str(error)})
    gc.collect()
    gc.freeze()  # what was made so far is not looked through in the middle of a stroke
    try:
        while not parent_gone.is_set():
            loop.step()
    finally:
        loop.close()


def _listen(loop: HandLoop, parent_gone: threading.Event) -> None:
    """Follow requests until the input ends."""
    rest = b""
    # Not sys.stdin, whose lock a thread would still hold when the interpreter ends.
    while piece := os.read(0, 4096):
        *lines, rest = (rest + piece).split(b"\n")
        for line in lines:
            loop.unplugged = json.loads(line)["unplugged"]
    parent_gone.set()


def _failed(error: Exception) -> int:
    with suppress(OSError):
        tell({"fault": f"the hand's process failed ({type(error).__name__}: {error})."})
    return 1


if __name__ == "__main__":
    sys.exit(main())
