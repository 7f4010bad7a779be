"""How the process of a servo begins and ends: driven by `rig.force.messages`."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress

from rig.force.control import Control
from rig.force.messages import RunServo
from rig.force.realtime import outlive_signals
from rig.force.states import Ask
from rig.live.driven import Parent
from rig.live.memory import Live
from rig.live.messages import Done


def serve_servo(run: Callable[[Parent, Live, RunServo, threading.Event], None]) -> None:
    """Run a servo until the parent is gone; then it is asked to stop.

    Parameters
    ----------
    run : callable
        Returns once the event is set and there is no force.
    """
    with Parent() as parent:
        outlive_signals()
        wanted = parent.settings(RunServo)
        with Live.attach(wanted.live) as live:
            gone = threading.Event()
            threading.Thread(target=_listen, args=(parent, live, gone), daemon=True).start()
            run(parent, live, wanted, gone)


def _listen(parent: Parent, live: Live, gone: threading.Event) -> None:
    """Have the servo stop once the parent is gone."""
    with suppress(OSError):
        parent.serve(Done, lambda done: done)
    gone.set()
    with suppress(TypeError):  # the memory is released already
        Control(live).ask(Ask.STOP, within_s=0)
