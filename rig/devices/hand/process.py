"""The hand's process: reads the device, filters, writes readings.

`tactileq.rig.devices.hand.messages` go between it and `tactileq.rig.devices.hand.reader`. Where its
parent is gone, it ends (docs/method/hand.md#process).
"""

from __future__ import annotations

import gc
import threading
from contextlib import suppress

from tactileq.modeling.errors import InputError
from tactileq.rig.devices.hand.loop import HandLoop
from tactileq.rig.devices.hand.messages import HandFault, ReadHand, Ready, Unplug
from tactileq.rig.shared.live.clock import taking_part
from tactileq.rig.shared.live.driven import Parent
from tactileq.rig.shared.live.memory import Live
from tactileq.rig.shared.live.messages import Done


def main() -> None:
    """Read the device until the parent is gone."""
    with Parent() as parent:
        wanted = parent.settings(ReadHand)
        parent_gone = threading.Event()
        with Live.attach(wanted.live) as live:
            loop = HandLoop(live, wanted.settings, send=parent.send)
            threading.Thread(target=_listen, args=(parent, loop, parent_gone), daemon=True).start()
            _open(parent, loop, patient=wanted.patient)
            gc.collect()
            gc.freeze()  # what was made so far is not looked through in the middle of a stroke
            try:
                with taking_part():
                    while not parent_gone.is_set():
                        loop.step()
            finally:
                loop.close()


def _open(parent: Parent, loop: HandLoop, *, patient: bool) -> None:
    """Open the device; a patient loop waits for one that is not there."""
    try:
        parent.send(Ready(loop.open()))
    except InputError as error:
        if not patient:
            raise
        parent.send(HandFault(str(error)))


def _listen(parent: Parent, loop: HandLoop, parent_gone: threading.Event) -> None:
    """Follow requests until the parent is gone."""

    def unplug(wanted: Unplug) -> Done:
        loop.unplugged = wanted.unplugged
        return Done()

    with suppress(OSError):
        parent.serve(Unplug, unplug)
    parent_gone.set()


if __name__ == "__main__":
    main()
